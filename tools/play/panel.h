/// The panel of knobs (F9): every setting with the time that it costs here and now, and how far its picture is from the
/// reference, both measured while the panel is open.
#pragma once

#include <map>

#include "tools/play/settings_plan.h"
#include "tools/play/hud.h"

namespace tools {

class KnobPanel {
 public:
  /// True where it was closed.
  bool draw(Game& game, const HudNumbers& numbers, PlaySettings& settings, float scale);
  /// The settings whose picture is to be measured beside the next; none while all is known for what is seen.
  std::optional<PictureSettings> next_to_measure(const PictureRequest& request);
  void took(const Picture& picture);

 private:
  struct Known {
    double ms = 0;
    double error = 0;  // FLIP against the reference
    bool measured = false;
  };
  struct Cell {
    std::string knob, value;
  };
  std::vector<Cell> cells(const render::RenderKnobs& now) const;
  std::vector<MeasuredKnob> measured(const render::RenderKnobs& now) const;

  std::map<std::pair<std::string, std::string>, Known> known_;
  std::optional<Cell> asked_;
  size_t next_ = 0;
  uint64_t rounds_ = 0;
  double now_ms_ = 0, now_error_ = 0;
  std::string backend_, fitted_;
};

}  // namespace tools
