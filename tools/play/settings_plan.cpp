#include "tools/play/settings_plan.h"

#include <algorithm>

namespace tools {

namespace {

struct Chosen {
  const MeasuredKnob* knob;
  double now_ms, now_error;
  const MeasuredSetting* setting;
};

}  // namespace

SettingsPlan plan_settings(const std::vector<MeasuredKnob>& knobs, double now_ms, double budget_ms) {
  std::vector<Chosen> all;
  for (const MeasuredKnob& knob : knobs) {
    const auto now = std::find_if(knob.settings.begin(), knob.settings.end(),
                                  [&](const MeasuredSetting& s) { return s.value == knob.now; });
    if (now == knob.settings.end()) continue;
    const auto best = std::min_element(knob.settings.begin(), knob.settings.end(),
                                       [](const MeasuredSetting& a, const MeasuredSetting& b) {
                                         return a.error != b.error ? a.error < b.error : a.ms < b.ms;
                                       });
    all.push_back({&knob, now->ms, now->error, &*best});
  }
  const auto expected = [&] {
    double ms = now_ms;
    for (const Chosen& c : all) ms += c.setting->ms - c.now_ms;
    return std::max(ms, 0.0);
  };
  while (expected() > budget_ms) {
    Chosen* best = nullptr;
    const MeasuredSetting* to = nullptr;
    double best_rate = 0;
    for (Chosen& c : all)
      for (const MeasuredSetting& s : c.knob->settings) {
        const double won = c.setting->ms - s.ms;
        if (won <= 0) continue;
        const double rate = won / (std::max(s.error - c.setting->error, 0.0) + 1e-6);
        if (rate > best_rate) best_rate = rate, best = &c, to = &s;
      }
    if (!best) break;
    best->setting = to;
  }
  SettingsPlan fit;
  fit.ms = expected();
  fit.fits = fit.ms <= budget_ms;
  for (const Chosen& c : all)
    if (c.setting->value != c.knob->now) fit.changes.emplace_back(c.knob->name, c.setting->value);
  return fit;
}

}  // namespace tools
