/// Which settings fit a time: from what each setting of each knob was measured to cost and to be off. Unlike
/// tools/budget.h it draws nothing: the window can't stand still for that.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace tools {

struct MeasuredSetting {
  std::string value;
  double ms = 0;     // of a picture with this setting, all others as they are
  double error = 0;  // of that picture against the reference
};

struct MeasuredKnob {
  std::string name;
  std::string now;
  std::vector<MeasuredSetting> settings;
};

struct SettingsPlan {
  std::vector<std::pair<std::string, std::string>> changes;  // knob, value; those that differ from now
  double ms = 0;                                             // that the picture is expected to take
  bool fits = false;
};

/// Costs add up, as far as one knob's doesn't depend on another's: from the settings of least error on, the change that
/// wins most time for the error that it adds, until all fits. `now_ms`: of a picture as all is set now.
SettingsPlan plan_settings(const std::vector<MeasuredKnob>& knobs, double now_ms, double budget_ms);

}  // namespace tools
