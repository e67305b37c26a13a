/// The table of agreement leaves nothing out, and its page says what it says.
#include "tests/tools/agreement/table.h"

#include <algorithm>
#include <set>

#include <gtest/gtest.h>

#include "render/knobs.h"
#include "tests/support.h"
#include "tests/tools/agreement/document.h"
#include "world/base/file.h"
#include "world/luminaires/luminaire.h"
#include "world/media/medium.h"
#include "world/scenes/scene.h"

namespace tools {
namespace {

TEST(AgreementTable, HasEveryShippedSceneAtAllOfItsCameras) {
  for (const std::string& scene : world::scene_names())
    EXPECT_TRUE(std::any_of(agreement_rows().begin(), agreement_rows().end(), [&](const AgreementRow& row) {
      return row.world == scene && row.effect == scene && *row.cameras == 0 && row.ticks == 0;
    })) << scene;
}

TEST(AgreementTable, HasEveryKindOfLuminaireAndMedium) {
  std::set<std::string> effects;
  for (const AgreementRow& row : agreement_rows()) effects.insert(row.effect);
  for (const std::string& kind : world::luminaire_kinds()) EXPECT_TRUE(effects.contains(kind)) << kind;
  for (const std::string& kind : world::medium_kinds()) EXPECT_TRUE(effects.contains(kind)) << kind;
}

TEST(AgreementTable, HasEveryKnobWithEachOfItsChoicesOrSaysWhoAloneHasThem) {
  std::set<std::string> compared, alone;
  for (const AgreementRow& row : agreement_rows())
    for (const char* settings : {row.settings, row.of_rays, kSettingsOfAllRows})
      for (const std::string& setting : split(settings, " ")) compared.insert(setting);
  for (const Alone& one : agreement_alone())
    for (const std::string& setting : split(one.settings, " ")) alone.insert(setting);
  for (const auto& row : render::render_knobs().rows()) {
    if (alone.contains(row.name)) continue;
    for (const std::string& choice : row.choices) {
      const std::string setting = row.name + "=" + choice;
      EXPECT_TRUE(choice == row.usual || compared.contains(setting) || alone.contains(setting)) << setting;
      EXPECT_FALSE(compared.contains(setting) && alone.contains(setting)) << setting;
    }
    const auto set = compared.lower_bound(row.name + "=");
    EXPECT_TRUE(!row.choices.empty() || (set != compared.end() && set->starts_with(row.name + "="))) << row.name;
  }
}

TEST(AgreementTable, IsThatOfItsPageWhoseNumbersAreWithinTheBounds) {
  const auto file = world::read_file(std::filesystem::path(world::kSourceFolder) / "tools/gallery/agreement.md");
  ASSERT_TRUE(file.ok()) << file.error().message;
  const std::vector<std::string> lines = split(std::string(file->begin(), file->end()), "\n"),
                                 expected = split(agreement_document({}, ""), "\n");
  ASSERT_EQ(lines.size(), expected.size());
  size_t row = 0;
  for (size_t i = 0; i < lines.size(); ++i) {
    const std::string fixed = without_measured(lines[i]);
    EXPECT_EQ(fixed, without_measured(expected[i]));
    if (fixed == lines[i] || i < 2 || !without_measured(lines[i - 1]).starts_with("|")) continue;
    if (fixed.starts_with("|---") || fixed.starts_with("| effect |")) continue;
    const std::vector<std::string> measured = split(lines[i].substr(fixed.size()), "|");
    ASSERT_EQ(measured.size(), 3u) << lines[i];
    const AgreementBound& bound = agreement_rows()[row++].bound;
    EXPECT_GE(std::stod(measured[0]), 100 * bound.share) << lines[i];
    EXPECT_LT(std::stod(measured[1]), bound.flip) << lines[i];
    EXPECT_LE(std::stod(measured[2]), 100 * bound.elsewhere + 0.0005) << lines[i];
  }
  EXPECT_EQ(row, agreement_rows().size());
}

}  // namespace
}  // namespace tools
