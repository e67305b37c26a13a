#include "tools/budget.h"

#include <gtest/gtest.h>

namespace tools {

namespace {

/// A renderer whose time and error are known: each metre-free setting adds to both.
world::Result<DrawnPicture> draw(const render::RenderKnobs& knobs) {
  DrawnPicture drawn{render::Image(16, 16), 10};
  float level = 40;
  if (knobs.sun_shadow == render::SunShadow::ray) drawn.ms += 20;
  if (knobs.sun_shadow != render::SunShadow::ray) level += 60;  // a large error for a large saving
  const bool linear = knobs.light_interpolation == render::LightInterpolation::linear;
  if (linear) drawn.ms += 15;
  if (!linear) level += 2;               // a small one
  if (knobs.merge_faces) drawn.ms -= 5;  // for nothing
  for (render::Rgb& pixel : drawn.image.pixels) pixel = {level, level, level};
  return drawn;
}

render::RenderKnobs best() { return render::render_knobs().preset(world::Accuracy::exact); }

bool took(const BudgetFit& fit, const std::string& knob) {
  return std::any_of(fit.taken.begin(), fit.taken.end(), [&](const MeasuredRung& r) { return r.knob == knob; });
}

}  // namespace

TEST(Budget, WhatFitsAtItsBestIsLeftAlone) {
  const auto fit = fit_to_budget(best(), 100, {}, draw);
  ASSERT_TRUE(fit.ok());
  EXPECT_TRUE(fit->fits);
  EXPECT_TRUE(fit->taken.empty());
  EXPECT_EQ(fit->ms, 45);
  EXPECT_EQ(fit->error, 0);
}

TEST(Budget, WhatSavesMostForItsErrorGoesFirstAndNoMoreThanIsNeeded) {
  const auto fit = fit_to_budget(best(), 41, {}, draw);
  ASSERT_TRUE(fit.ok());
  EXPECT_TRUE(fit->fits);
  EXPECT_TRUE(took(*fit, "merge_faces"));  // saves for nothing
  EXPECT_EQ(fit->taken.size(), 1u);
  const auto tighter = fit_to_budget(best(), 30, {}, draw);
  EXPECT_TRUE(took(*tighter, "light_interpolation"));
  EXPECT_FALSE(took(*tighter, "sun_shadow"));
  EXPECT_EQ(tighter->ms, 25);
  EXPECT_GT(tighter->error, 0);
  const auto tightest = fit_to_budget(best(), 6, {}, draw);
  EXPECT_TRUE(took(*tightest, "sun_shadow"));
  EXPECT_TRUE(tightest->fits);
  EXPECT_GT(tightest->error, tighter->error);
}

TEST(Budget, WhatCannotFitSaysSoAndFixedKnobsStay) {
  const auto fit = fit_to_budget(best(), 1, {"sun_shadow"}, draw);
  ASSERT_TRUE(fit.ok());
  EXPECT_FALSE(fit->fits);
  EXPECT_EQ(fit->knobs.sun_shadow, best().sun_shadow);
  EXPECT_NE(budget_text(*fit).find("nothing cheaper"), std::string::npos);
}

TEST(Budget, ReadsMillisecondsAndRefusesTheRest) {
  EXPECT_EQ(*parse_budget("16ms"), 16);
  EXPECT_EQ(*parse_budget("33.5"), 33.5);
  for (const char* bad : {"", "ms", "-4", "0", "16s", "nan", "inf", "16 ms x"})
    EXPECT_FALSE(parse_budget(bad).ok()) << bad;
}

}  // namespace tools
