/// The settings of knobs that keep a picture nearest to what it is at its best, within a time: measured on the scene
/// itself, where it is drawn. So an effect that the scene doesn't call for costs no knob anything, and none is touched.
///
/// Each knob alone is set to its cheaper rungs, the others at their best, and the picture is drawn: that says what the
/// rung saves and what it gets wrong (FLIP, against the best picture by the same backend). Then rungs are taken down
/// one by one, the one that saves most for its error first, each time drawn again, until the picture fits.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "render/backend.h"

namespace tools {

struct DrawnPicture {
  render::Image image;
  double ms = 0;
};

/// A knob at one of its rungs, all others at their best.
struct MeasuredRung {
  std::string knob, value;
  double saved_ms = 0;  // below 0: it takes longer
  double error = 0;     // mean FLIP, 0 to 1
};

struct BudgetFit {
  render::RenderKnobs knobs;
  double budget_ms = 0, best_ms = 0, ms = 0, error = 0;  // best: where every knob is at its best
  bool fits = false;
  std::vector<MeasuredRung> measured;  // those that move time or picture
  std::vector<MeasuredRung> taken;     // what was given up, in this order
};

/// "16ms" or "16": a number of ms above 0.
world::Result<double> parse_budget(const std::string& text);

/// `best` is where the search begins; knobs of the names `fixed` stay as they are. draw() draws twice or more for a
/// time that means something. Fails where draw() does.
world::Result<BudgetFit> fit_to_budget(
    const render::RenderKnobs& best, double budget_ms, const std::vector<std::string>& fixed,
    const std::function<world::Result<DrawnPicture>(const render::RenderKnobs&)>& draw);

std::string budget_text(const BudgetFit& fit);
nlohmann::json budget_json(const BudgetFit& fit);

}  // namespace tools
