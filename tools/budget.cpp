#include "tools/budget.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "render/image/display.h"
#include "render/image/flip.h"

namespace tools {

namespace {

/// What is less than this part of the best picture's time is the clock's noise.
constexpr double kLeastSaving = 0.03;
/// Errors below this are none; it keeps what saves time for nothing first.
constexpr double kLeastError = 1e-5;

double error_of(const render::Image& picture, const render::Image8& best) {
  return render::flip_map(render::display_image(picture, 0), best).mean;
}

/// The other rungs of a row that are not the value it has, each once, from dear to cheap.
std::vector<std::string> rungs_below(const world::KnobRow<render::RenderKnobs>& row, const std::string& value) {
  std::vector<std::string> rungs;
  for (const std::string& rung : {row.exact, row.usual, row.fast})
    if (rung != value && std::find(rungs.begin(), rungs.end(), rung) == rungs.end()) rungs.push_back(rung);
  return rungs;
}

double worth(const MeasuredRung& rung) { return rung.saved_ms / std::max(rung.error, kLeastError); }

}  // namespace

world::Result<double> parse_budget(const std::string& text) {
  double ms = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, ms);
  const std::string unit(rest, end);
  if (error != std::errc() || !(ms > 0) || !std::isfinite(ms) || !(unit.empty() || unit == "ms"))
    return world::usage_error("--budget takes milliseconds above 0, for instance 16ms, not \"" + text + "\"");
  return ms;
}

world::Result<BudgetFit> fit_to_budget(
    const render::RenderKnobs& best, double budget_ms, const std::vector<std::string>& fixed,
    const std::function<world::Result<DrawnPicture>(const render::RenderKnobs&)>& draw) {
  BudgetFit fit;
  fit.knobs = best, fit.budget_ms = budget_ms;
  TRY(const DrawnPicture reference, draw(best));
  const render::Image8 shown = render::display_image(reference.image, 0);
  fit.best_ms = fit.ms = reference.ms;
  fit.fits = fit.ms <= budget_ms;
  if (fit.fits) return fit;

  // Measure each rung alone.
  const auto& rows = render::render_knobs().rows();
  for (const auto& row : rows) {
    if (std::find(fixed.begin(), fixed.end(), row.name) != fixed.end()) continue;
    for (const std::string& rung : rungs_below(row, row.get(best))) {
      render::RenderKnobs tried = best;
      TRY_STATUS(row.set(tried, rung));
      TRY(const DrawnPicture drawn, draw(tried));
      const MeasuredRung measured{row.name, rung, reference.ms - drawn.ms, error_of(drawn.image, shown)};
      if (std::abs(measured.saved_ms) > kLeastSaving * reference.ms || measured.error > kLeastError)
        fit.measured.push_back(measured);
    }
  }

  // Take down what saves most for its error, until it fits.
  std::vector<MeasuredRung> open = fit.measured;
  std::erase_if(open, [&](const MeasuredRung& r) { return r.saved_ms <= kLeastSaving * reference.ms; });
  std::sort(open.begin(), open.end(), [](const auto& a, const auto& b) { return worth(a) > worth(b); });
  std::map<std::string, double> saved;  // by knob, of the rung it is at
  for (const MeasuredRung& rung : open) {
    if (fit.fits) break;
    if (rung.saved_ms <= saved[rung.knob]) continue;  // it is at a rung that saves as much
    render::RenderKnobs tried = fit.knobs;
    TRY_STATUS(render::render_knobs().set(tried, rung.knob, rung.value));
    TRY(const DrawnPicture drawn, draw(tried));
    if (drawn.ms >= fit.ms) continue;  // with the others taken down it saves nothing
    saved[rung.knob] = rung.saved_ms;
    std::erase_if(fit.taken, [&](const MeasuredRung& r) { return r.knob == rung.knob; });
    fit.taken.push_back(rung);
    fit.knobs = tried, fit.ms = drawn.ms, fit.error = error_of(drawn.image, shown);
    fit.fits = fit.ms <= budget_ms;
  }
  return fit;
}

std::string budget_text(const BudgetFit& fit) {
  std::string text = fmt::format("budget {:g} ms: {:.1f} ms with every knob at its best", fit.budget_ms, fit.best_ms);
  if (fit.best_ms <= fit.budget_ms) return text + "\n";
  text += fmt::format("; chosen: {:.1f} ms, error {:.4f} (mean FLIP){}\n", fit.ms, fit.error,
                      fit.fits ? "" : "; nothing cheaper is left");
  for (const MeasuredRung& r : fit.taken)
    text += fmt::format("  {}={}: saves {:.1f} ms alone, error {:.4f}\n", r.knob, r.value, r.saved_ms, r.error);
  return text;
}

nlohmann::json budget_json(const BudgetFit& fit) {
  const auto rungs = [](const std::vector<MeasuredRung>& all) {
    nlohmann::json list = nlohmann::json::array();
    for (const MeasuredRung& r : all)
      list.push_back({{"knob", r.knob}, {"value", r.value}, {"saved_ms", r.saved_ms}, {"error", r.error}});
    return list;
  };
  return {{"budget_ms", fit.budget_ms},
          {"best_ms", fit.best_ms},
          {"ms", fit.ms},
          {"error", fit.error},
          {"fits", fit.fits},
          {"taken", rungs(fit.taken)},
          {"measured", rungs(fit.measured)}};
}

}  // namespace tools
