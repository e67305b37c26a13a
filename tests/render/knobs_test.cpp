#include "render/knobs.h"

#include <set>

#include <gtest/gtest.h>

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

TEST(RenderKnobs, AnUnknownKnobNamesTheNearest) {
  RenderKnobs knobs;
  const auto status = render_knobs().set(knobs, "view_distanse", "10");
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.error().message.find("did you mean \"view_distance\"?"), std::string::npos)
      << status.error().message;
}

}  // namespace
}  // namespace render
