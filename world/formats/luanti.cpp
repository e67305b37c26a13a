// Luanti's (Minetest's) worlds: map.sqlite, or the folder of a world -> world.
//
// Luanti's z runs north and its axes are left-handed; ours are right-handed with z south. So a node at (x, y, z)
// becomes the voxel (x, y, -z - 1), and nothing is mirrored to the eye. Nodes become blocks by
// world/formats/translation/luanti.toml; "air" and "ignore" (not generated yet) are air. A block that is damaged is
// named in a warning, and the rest is read. Stored light can be read by luanti::read_map_light.
#include <atomic>

#include <fmt/format.h>

#include "world/base/jobs.h"
#include "world/formats/format.h"
#include "world/formats/luanti/map_block.h"
#include "world/formats/translation/translation.h"

namespace world {
namespace {

constexpr int kMostWorkers = 12;
constexpr size_t kMostWarnings = 20;
constexpr size_t kBatch = 512;  // blocks that a worker takes at a time

std::filesystem::path map_of(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::is_directory(path, error) ? path / "map.sqlite" : path;
}

Result<World> read_luanti(const std::filesystem::path& given, const ImportOptions& options, ImportReport& report) {
  const std::filesystem::path path = map_of(given);
  const std::string name = path.string();
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  if (error) return input_error(fmt::format("{}: cannot open: {}", name, error.message()));
  MemoryBudget budget(size);
  TRY(std::vector<luanti::StoredBlock> rows, luanti::read_rows(path, budget));
  if (!rows.empty() && rows.back().pos[0] == INT32_MAX) {
    rows.pop_back();
    report.warnings.push_back(name + ": the database is damaged; further blocks could not be read");
  }

  StateTable states(budget);
  const size_t batches = (rows.size() + kBatch - 1) / kBatch;
  std::vector<std::vector<Cube>> by_batch(batches);
  std::vector<std::string> problems(rows.size());
  std::vector<uint8_t> versions(rows.size());
  std::atomic<size_t> next{0};
  parallel_for(static_cast<size_t>(std::min(thread_count(), kMostWorkers)), [&](size_t) {
    luanti::BlockReader reader(states, budget);
    for (size_t b; (b = next++) < batches;)
      for (size_t i = b * kBatch; i < std::min(rows.size(), (b + 1) * kBatch); ++i) {
        problems[i] = reader.read(rows[i].bytes, rows[i].pos, by_batch[b]);
        versions[i] = static_cast<uint8_t>(reader.version());
        budget.give_back(rows[i].bytes.size());
        rows[i].bytes = {};
      }
  });
  size_t broken = 0;
  std::map<int, size_t> version_counts;
  std::string first_problem;
  for (size_t i = 0; i < rows.size(); ++i) {
    ++version_counts[versions[i]];
    if (problems[i].empty()) continue;
    const auto [x, y, z] = rows[i].pos;
    const std::string sentence = fmt::format("{}: block ({}, {}, {}): {}", name, x, y, z, problems[i]);
    if (broken++ == 0) first_problem = sentence;
    if (broken <= kMostWarnings) report.warnings.push_back(sentence);
  }
  if (broken > kMostWarnings)
    report.warnings.push_back(fmt::format("and {} more blocks are damaged", broken - kMostWarnings));
  if (broken && broken == rows.size()) return input_error(first_problem);

  World world(standard_blocks());
  Translator translator(translation_table("luanti"), *world.palette);
  std::vector<Cube> cubes = join_cubes(std::move(by_batch));
  if (options.count_states) {
    const std::vector<uint64_t> counts = count_states(cubes, states.texts().size());
    for (StateNumber i = 0; i < counts.size(); ++i)
      if (counts[i]) report.states[states.texts()[i]] += counts[i];
  }
  if (!fill_from_cubes(std::move(cubes), translator.blocks(states), budget, world.store))
    return input_error(name + ": its blocks take more memory than a file of this size ever needs");

  report.fact("map blocks", std::to_string(rows.size()));
  if (broken) report.fact("broken blocks", std::to_string(broken));
  std::string text;
  for (const auto& [version, n] : version_counts)
    text += (text.empty() ? "" : ", ") + fmt::format("{} of version {}", n, version);
  report.fact("versions", text);
  report.fact("node names", std::to_string(states.texts().size()));
  TRY_STATUS(translator.finish(world, "luanti", given, options, report));
  return world;
}

}  // namespace

const Format& luanti_format() {
  static const Format format = {
      .name = "luanti",
      .extensions = {".sqlite"},
      .what = "Luanti (Minetest) maps, map.sqlite; or the folder of a world",
      .recognizes = nullptr,
      .read = read_luanti,
      .write = nullptr,
      .recognizes_folder =
          [](const std::filesystem::path& folder) {
            std::error_code error;
            return std::filesystem::exists(folder / "map.sqlite", error);
          },
  };
  return format;
}

}  // namespace world
