// Minecraft Java's regions (.mca) -> world: one file, or a folder of them.
//
// Minecraft's axes are ours: x east, y up, z south, a block is a metre; so blocks keep their coordinates.
// Names become Loam's blocks by world/formats/translation/minecraft.toml, numeric ids of old versions too.
// A chunk that is damaged is named in a warning, and the rest is read. Entities, block entities (what a chest holds)
// and biomes stay behind. Stored light can be read by mca::read_mca_light.
#include <atomic>
#include <set>

#include <fmt/format.h>

#include "world/base/jobs.h"
#include "world/formats/format.h"
#include "world/formats/mca/anvil.h"
#include "world/formats/translation/numeric_ids.h"
#include "world/formats/translation/translation.h"

namespace world {
namespace {

constexpr int kMostWorkers = 12;  // each may hold an inflated chunk
constexpr size_t kMostWarnings = 20;

struct Totals {
  size_t files = 0, chunks = 0, sections = 0, sections_with_blocks = 0, entities = 0, block_entities = 0, broken = 0;
  int min_version = INT32_MAX, max_version = 0;
  std::map<std::string, size_t> statuses;
  std::string first_problem;
};

void count(const mca::ChunkInfo& info, const std::string& file, Totals& totals, ImportReport& report) {
  ++totals.chunks;
  totals.sections += static_cast<size_t>(info.sections);
  totals.sections_with_blocks += static_cast<size_t>(info.sections_with_blocks);
  totals.entities += static_cast<size_t>(info.entities);
  totals.block_entities += static_cast<size_t>(info.block_entities);
  if (info.problem.empty() || info.sections > 0) {
    totals.min_version = std::min(totals.min_version, info.data_version);
    totals.max_version = std::max(totals.max_version, info.data_version);
    if (!info.status.empty() && totals.statuses.size() < 64) ++totals.statuses[info.status];
  }
  if (info.problem.empty()) return;
  const std::string sentence = fmt::format("{}: chunk ({}, {}): {}", file, info.x, info.z, info.problem);
  if (totals.broken++ == 0) totals.first_problem = sentence;
  if (totals.broken <= kMostWarnings) report.warnings.push_back(sentence);
}

/// Reads the chunks of one region file by several workers; cubes come in the order of the file.
std::vector<Cube> read_chunks(const mca::RegionFile& region, StateTable& states, MemoryBudget& budget,
                              std::vector<mca::ChunkInfo>& infos) {
  const std::string file = region.path.string();
  infos.resize(region.chunks.size());
  std::vector<std::vector<Cube>> by_chunk(region.chunks.size());
  std::atomic<size_t> next{0};
  parallel_for(static_cast<size_t>(std::min(thread_count(), kMostWorkers)), [&](size_t) {
    mca::ChunkReader reader(states, budget);
    for (size_t i; (i = next++) < region.chunks.size();) infos[i] = reader.read(region.chunks[i], file, by_chunk[i]);
  });
  return join_cubes(std::move(by_chunk));
}

void add_facts(const Totals& totals, const StateTable& states, ImportReport& report) {
  std::set<std::string_view> names;
  for (const std::string& text : states.texts())
    names.insert(std::string_view(text).substr(0, text.find(parse_numeric(text) ? ':' : '[')));
  if (totals.files > 1) report.fact("region files", std::to_string(totals.files));
  report.fact("data version", totals.min_version >= totals.max_version
                                  ? std::to_string(totals.max_version)
                                  : fmt::format("{} to {}", totals.min_version, totals.max_version));
  report.fact("chunks", std::to_string(totals.chunks));
  if (totals.broken) report.fact("broken chunks", std::to_string(totals.broken));
  std::string statuses;
  for (const auto& [status, n] : totals.statuses)
    statuses += (statuses.empty() ? "" : ", ") + fmt::format("{} {}", plain_name(status), n);
  if (!statuses.empty()) report.fact("chunk states", statuses);
  report.fact("sections", fmt::format("{} ({} with blocks)", totals.sections, totals.sections_with_blocks));
  report.fact("block names", std::to_string(names.size()));
  report.fact("block states", std::to_string(states.texts().size()));
  if (totals.broken > kMostWarnings)
    report.warnings.push_back(fmt::format("and {} more chunks are damaged", totals.broken - kMostWarnings));
}

Result<World> read_mca(const std::filesystem::path& path, const ImportOptions& options, ImportReport& report) {
  std::error_code error;
  const bool folder = std::filesystem::is_directory(path, error);
  const std::vector<std::filesystem::path> files =
      folder ? mca::region_files(path) : std::vector<std::filesystem::path>{path};
  if (files.empty()) return input_error(fmt::format("{}: holds no region files (r.X.Z.mca)", path.string()));
  uint64_t bytes = 0;
  for (const auto& file : files) bytes += std::filesystem::file_size(file, error);
  MemoryBudget budget(error ? 0 : bytes);

  World world(standard_blocks());
  StateTable states(budget);
  Translator translator(translation_table("minecraft"), *world.palette);
  Totals totals;
  totals.files = files.size();
  for (const auto& file : files) {
    TRY(const mca::RegionFile region, mca::open_region(file));
    std::vector<mca::ChunkInfo> infos;
    std::vector<Cube> cubes = read_chunks(region, states, budget, infos);
    for (const mca::ChunkInfo& info : infos) count(info, file.string(), totals, report);
    const std::vector<BlockId> blocks = translator.blocks(states);
    if (options.count_states) {
      const std::vector<uint64_t> counts = count_states(cubes, blocks.size());
      for (StateNumber i = 0; i < counts.size(); ++i)
        if (counts[i]) report.states[states.texts()[i]] += counts[i];
    }
    if (!fill_from_cubes(std::move(cubes), blocks, budget, world.store))
      return input_error(
          fmt::format("{}: its blocks take more memory than a file of this size ever needs", file.string()));
  }
  if (totals.broken && totals.sections_with_blocks == 0) return input_error(totals.first_problem);
  add_facts(totals, states, report);
  TRY_STATUS(
      translator.finish(world, "mca", path, options, report, LeftBehind{totals.entities, totals.block_entities}));
  world.metadata["mca.data_version"] = std::to_string(totals.max_version);
  return world;
}

}  // namespace

const Format& mca_format() {
  static const Format format = {
      .name = "mca",
      .extensions = {".mca"},
      .what = "Minecraft Java regions, 1.8 on; or a folder of them",
      .recognizes = nullptr,
      .read = read_mca,
      .write = nullptr,
      .recognizes_folder = [](const std::filesystem::path& folder) { return !mca::region_files(folder).empty(); },
  };
  return format;
}

}  // namespace world
