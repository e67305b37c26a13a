#include "render/knobs.h"

#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "render/effects/effect.shared.h"
#include "render/knob_ranges.h"
#include "render/light/sun_cascades.shared.h"

namespace render {
namespace {

TEST(RenderKnobs, TheUsualPresetIsWhatANewRecordHolds) {
  const RenderKnobs fresh, usual = render_knobs().preset(world::Accuracy::usual);
  for (const auto& row : render_knobs().rows()) EXPECT_EQ(row.get(fresh), row.get(usual)) << row.name;
}

TEST(RenderKnobs, EveryRowIsReadableBackAndSaysWhatItBuys) {
  std::set<std::string> names;
  for (const auto& row : render_knobs().rows()) {
    EXPECT_TRUE(names.insert(row.name).second) << row.name << " is declared twice";
    EXPECT_FALSE(row.what.empty()) << row.name;
    for (const std::string& text : {row.fast, row.usual, row.exact}) {
      RenderKnobs knobs;
      ASSERT_TRUE(render_knobs().set(knobs, row.name, text).ok()) << row.name;
      EXPECT_EQ(row.get(knobs), text) << row.name;
    }
    for (const std::string& choice : row.choices) {
      RenderKnobs knobs;
      EXPECT_TRUE(render_knobs().set(knobs, row.name, choice).ok()) << row.name << ' ' << choice;
    }
  }
  EXPECT_GE(names.size(), 5u);
}

/// Empty where the text is taken.
std::string refusal(std::string_view name, const std::string& text) {
  RenderKnobs knobs;
  const world::Status set = render_knobs().set(knobs, name, text);
  if (set.ok()) return "";
  EXPECT_EQ(set.error().kind, world::ErrorKind::usage);
  return set.error().message;
}

TEST(RenderKnobs, EveryNumberRefusesWhatNobodyCanDraw) {
  for (const auto& row : render_knobs().rows()) {
    if (!row.choices.empty()) continue;
    for (const char* absurd : {"nan", "inf", "-inf", "1e30", "-1e30", "2147483647", "-2147483648"})
      EXPECT_EQ(refusal(row.name, absurd).rfind("knob " + row.name + ": ", 0), 0u) << row.name << "=" << absurd;
    EXPECT_TRUE(row.what.find(" to ") != std::string::npos || row.what.find("at least ") != std::string::npos)
        << row.name << " doesn't say its range: " << row.what;
  }
}

TEST(RenderKnobs, RangesEndWhereWhatReadsThemDoes) {
  EXPECT_EQ(refusal("spp", "0"), "knob spp: 0 is outside [1, 16777216]");
  EXPECT_EQ(refusal("view_distance", "-5"), "knob view_distance: -5 is outside [0, 1e+09]");
  EXPECT_EQ(refusal("lod_error_px", "-1"), "knob lod_error_px: -1 is outside [0, 1e+09]");
  EXPECT_EQ(refusal("fog_steps", "0"), "knob fog_steps: 0 is outside [1, 65536]");
  EXPECT_EQ(refusal("fog_steps", "1e9"), "knob fog_steps: 1e9 is outside [1, 65536]");
  EXPECT_EQ(refusal("texture_anisotropy", "0"), "knob texture_anisotropy: 0 is outside [1, 64]");
  EXPECT_EQ(refusal("chromatic_aberration", "0.2"), "knob chromatic_aberration: 0.2 is outside [0, 0.1]");
  for (const auto& [name, most] :
       {std::pair{"sun_map_cascades", shared::kMostSunCascades}, std::pair{"lens_flare_blades", shared::kMostBlades}}) {
    EXPECT_EQ(refusal(name, std::to_string(most)), "");
    EXPECT_NE(refusal(name, std::to_string(most + 1)), "");
  }
}

TEST(RenderKnobs, ARecordIsHeldToTheSameRanges) {
  EXPECT_TRUE(check_ranges({}).ok());
  for (const world::Accuracy accuracy : {world::Accuracy::fast, world::Accuracy::usual, world::Accuracy::exact})
    EXPECT_TRUE(check_ranges(render_knobs().preset(accuracy)).ok());
  RenderKnobs knobs;
  knobs.photon_radius = std::nanf("");
  const world::Status no_number = check_ranges(knobs);
  ASSERT_FALSE(no_number.ok());
  EXPECT_EQ(no_number.error().message, "knob photon_radius: \"nan\" is not a finite number");
  knobs.photon_radius = 1, knobs.light_samples = 0;
  const world::Status none = check_ranges(knobs);
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().message, refusal("light_samples", "0"));
}

TEST(RenderKnobs, AnUnknownKnobNamesTheNearest) {
  RenderKnobs knobs;
  const auto status = render_knobs().set(knobs, "view_distanse", "10");
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.error().message.find("did you mean \"view_distance\"?"), std::string::npos)
      << status.error().message;
}

}  // namespace
}  // namespace render
