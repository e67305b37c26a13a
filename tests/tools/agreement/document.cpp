#include "tests/tools/agreement/document.h"

#include <algorithm>

#include <fmt/format.h>

#include "tests/tools/agreement/table.h"

namespace tools {

namespace {

constexpr const char* kHead =
    "# Where the rasterizer and the ray caster agree\n"
    "\n"
    "Written from `tests/tools/agreement/rows.cpp`, whose rows `loam_tools_tests` holds to their bounds, by\n"
    "`LOAM_AGREEMENT=tools/gallery/agreement.md build/release/loam_tools_tests --gtest_filter='*Agreement*'`.\n"
    "The aim is 99.9 % of the pixels within 2/255 and a mean of FLIP below 0.01. A row is a scene, or an effect in "
    "the\n"
    "smallest world that shows it; numbers are those of the worst of its cameras, at {}x{} where nothing else is "
    "said,\n"
    "with `{}` beside the row's settings. A pixel that differs lies on an edge (between faces, of a\n"
    "shadow, between texels) where the ray caster has the rasterizer's colour within 1/{:.0f} of a pixel of its "
    "middle, or\n"
    "colours to both sides of it; there the two fall on different sides. The last column is the share that lies on "
    "none.\n"
    "\n"
    "| effect | world: cameras | settings | bound | what differs beside edges | within | FLIP | on no edge |\n"
    "|---|---|---|---|---|---|---|---|\n";

std::string percent(double share, int digits) { return fmt::format("{:.{}f} %", 100 * share, digits); }

std::string code(const std::string& text) { return text.empty() ? "" : "`" + text + "`"; }

std::string fixed_cells(const AgreementRow& row) {
  const AgreementRow usual{.effect = "", .world = ""};
  std::string place = row.world;
  if (row.ticks > 0) place += fmt::format(" after {} ticks", row.ticks);
  if (*row.cameras != 0) place += fmt::format(": {}", row.cameras);
  if (row.width != usual.width) place += fmt::format(", {}x{}", row.width, row.height);
  std::string settings = code(row.settings);
  if (*row.of_rays != 0) settings += (settings.empty() ? "" : "; ") + fmt::format("rays: {}", code(row.of_rays));
  std::string bound =
      fmt::format("{} within {}, FLIP {}", percent(row.bound.share, 2), row.bound.levels, row.bound.flip);
  if (row.bound.elsewhere != AgreementBound{}.elsewhere)
    bound += fmt::format(", {} on no edge", percent(row.bound.elsewhere, 2));
  return fmt::format("| {} | {} | {} | {} | {} |", row.effect, place, settings, bound, row.rest);
}

constexpr int kMeasuredCells = 3;

}  // namespace

std::string agreement_document(const std::map<size_t, Measured>& measured, const std::string& page) {
  std::map<std::string, std::string> known;  // line by its fixed cells
  for (const std::string& line : split(page, "\n")) known[without_measured(line)] = line;
  const AgreementRow usual{.effect = "", .world = ""};
  std::string text = fmt::format(kHead, usual.width, usual.height, kSettingsOfAllRows, 1 / kBesidePixels);
  for (size_t i = 0; i < agreement_rows().size(); ++i) {
    const std::string fixed = fixed_cells(agreement_rows()[i]);
    if (const auto m = measured.find(i); m != measured.end())
      text += fixed + fmt::format(" {} | {:.5f} | {} |\n", percent(m->second.share, 3), m->second.flip,
                                  percent(m->second.elsewhere, 3));
    else if (const auto line = known.find(without_measured(fixed + "  |  |  |")); line != known.end())
      text += line->second + "\n";
    else
      text += fixed + "  |  |  |\n";
  }
  text += "\n## What the rows can't compare\n\n| who has it | what | knobs |\n|---|---|---|\n";
  for (const Alone& alone : agreement_alone())
    text += fmt::format("| {} | {} | {} |\n", alone.who, alone.what, code(alone.settings));
  return text;
}

std::vector<std::string> split(const std::string& text, const std::string& between) {
  std::vector<std::string> parts;
  for (size_t at = 0; at < text.size();) {
    const size_t end = std::min(text.find(between, at), text.size());
    if (end > at) parts.push_back(text.substr(at, end - at));
    at = end + between.size();
  }
  return parts;
}

std::string without_measured(const std::string& line) {
  constexpr int kBars = 9;  // of a row
  if (std::count(line.begin(), line.end(), '|') != kBars) return line;
  size_t end = line.size();
  for (int i = 0; i <= kMeasuredCells; ++i) end = line.rfind('|', end - 1);
  return line.substr(0, end);
}

}  // namespace tools
