// Every number that ../shared/data/facts.json holds for files of block games, against what the importers find.
#include <set>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/world/formats/formats_support.h"
#include "world/formats/luanti/map_block.h"
#include "world/formats/mca/anvil.h"
#include "world/formats/translation/translation.h"

namespace world {
namespace {

using nlohmann::json;

/// "17:4" -> "17", "minecraft:oak_log[axis=y]" -> "minecraft:oak_log".
std::string name_of(const std::string& state) {
  if (state[0] >= '0' && state[0] <= '9') return state.substr(0, state.find(':'));
  return state.substr(0, state.find('['));
}

bool is_air(const std::string& name) {
  static const std::set<std::string> airs = {
      "0", "air", "ignore", "minecraft:air", "minecraft:cave_air", "minecraft:void_air"};
  return airs.contains(name);
}

/// Names and states, voxel for voxel, and that the world holds one voxel for each block that is not air.
void expect_blocks(const json& facts, const World& world, const ImportReport& report) {
  std::map<std::string, uint64_t> names;
  uint64_t not_air = 0, all = 0;
  for (const auto& [state, count] : report.states) {
    names[name_of(state)] += count;
    all += count;
    not_air += is_air(name_of(state)) ? 0 : count;
  }
  EXPECT_EQ(json(names), facts["hist"]);
  if (facts.contains("states")) {
    EXPECT_EQ(json(report.states), facts["states"]);
    EXPECT_EQ(report.states.size(), facts["distinct_states"]);
    EXPECT_EQ(names.size(), facts["distinct_names"]);
  }
  if (facts.contains("volume")) {
    EXPECT_EQ(all, facts["volume"]);
  }
  EXPECT_EQ(not_air, facts["nonair"]);
  EXPECT_EQ(world.store.voxel_count(), facts["nonair"]);
}

/// A file of ../shared/data that was read, and what facts.json says of it.
struct Imported {
  std::filesystem::path path;
  const json& facts;
  World world;
  ImportReport report;
  std::string fact(const std::string& name) const { return world::fact(report, name); }
};

/// Reads each file whose name begins and ends so, and checks what holds for files of every game: its blocks voxel for
/// voxel, and that all of them are known, but for those named; then what the caller checks.
void for_each_file(const std::string& prefix, const std::string& suffix, int files,
                   const std::function<void(const Imported&)>& check,
                   const std::map<std::string, json>& unmapped_of = {}) {
  int found = 0;
  for (const auto& [name, facts] : shared_facts().items()) {
    if (!name.starts_with(prefix) || !name.ends_with(suffix)) continue;
    SCOPED_TRACE(name);
    const auto path = shared_data(name);
    ASSERT_TRUE(path);
    ImportReport report;
    auto world = read_world(*path, {.count_states = true}, report);
    ASSERT_TRUE(world) << world.error().message;
    const Imported file{*path, facts, std::move(*world), std::move(report)};
    if (facts.contains("hist")) expect_blocks(facts, file.world, file.report);
    const auto unmapped = unmapped_of.find(name);
    EXPECT_EQ(json(file.report.unmapped), unmapped == unmapped_of.end() ? json::object() : unmapped->second);
    EXPECT_EQ(file.world.metadata.at("source"), path->filename().string());
    check(file);
    ++found;
  }
  EXPECT_EQ(found, files);
}

// ---- Minecraft regions -----------------------------------------------------------------------------------------

/// What a chunk's tree says beside its blocks.
struct ChunkTree {
  int data_version = 0, min_section = 0;
  std::map<std::string, std::vector<uint64_t>> heightmaps;  // words; of the old HeightMap nothing
  std::set<std::string> biomes;
};

void read_tree(nbt::Reader& in, ChunkTree& out) {
  for (nbt::Entry e; in.next(e);) {
    if (e.name == "DataVersion") {
      out.data_version = static_cast<int>(in.integer(e));
    } else if (e.name == "Level") {
      read_tree(in, out);
    } else if (e.name == "yPos") {
      out.min_section = static_cast<int>(in.integer(e));
    } else if (e.name == "HeightMap") {
      out.heightmaps["HeightMap"] = {};
      in.skip(e);
    } else if (e.name == "Heightmaps") {
      for (nbt::Entry h; in.next(h);) {
        const auto words = in.array(h, nbt::Type::long_array);
        auto& map = out.heightmaps[std::string(h.name)];
        for (size_t i = 0; i + 8 <= words.size(); i += 8) map.push_back(nbt::big_endian<uint64_t>(words.data() + i));
      }
    } else if (e.name == "sections") {
      for (uint32_t n = in.list(e, nbt::Type::compound); n > 0; --n)
        for (nbt::Entry s; in.next(s);) {
          if (s.name != "biomes") {
            in.skip(s);
            continue;
          }
          for (nbt::Entry b; in.next(b);) {
            if (b.name != "palette") {
              in.skip(b);
              continue;
            }
            for (uint32_t k = in.list(b, nbt::Type::text); k > 0; --k) out.biomes.insert(std::string(in.text()));
          }
        }
    } else {
      in.skip(e);
    }
  }
}

/// Columns of a full chunk whose highest block agrees with the height that the game stored.
int columns_at_stored_height(const ChunkTree& tree, int chunk_x, int chunk_z, const World& world) {
  const auto found = tree.heightmaps.find("WORLD_SURFACE");
  if (found == tree.heightmaps.end()) return 0;
  const bool spanning = tree.data_version < 2529;
  int agree = 0;
  for (int z = 0; z < 16; ++z)
    for (int x = 0; x < 16; ++x) {
      const size_t i = static_cast<size_t>(z * 16 + x), bit = spanning ? i * 9 : i / 7 * 64 + i % 7 * 9;
      uint64_t value = found->second[bit / 64] >> bit % 64;
      if (bit % 64 > 55) value |= found->second[bit / 64 + 1] << (64 - bit % 64);
      const int stored = static_cast<int>(value & 511) + tree.min_section * 16;
      int y = 320;
      while (y > -65 && world.store.get({chunk_x * 16 + x, y - 1, chunk_z * 16 + z}) == kAir) --y;
      agree += stored == (y == -65 ? tree.min_section * 16 : y);
    }
  return agree;
}

void expect_region(const Imported& file) {
  const auto& [path, facts, world, report] = file;
  EXPECT_TRUE(report.warnings.empty());
  const VoxelBox box = world.store.bounds();
  EXPECT_EQ(box.min.y, facts["ymin"]);
  EXPECT_EQ(box.max.y, facts["ymax"]);

  const auto region = mca::open_region(path);
  ASSERT_TRUE(region) << region.error().message;
  EXPECT_EQ(region->bytes.size(), facts["bytes"]);
  EXPECT_EQ(static_cast<double>(region->bytes.size()) / 4096, facts["sectors"]);
  EXPECT_EQ(region->chunks.size(), facts["chunks"]);
  MemoryBudget budget(region->bytes.size());
  StateTable states(budget);
  mca::ChunkReader reader(states, budget);
  std::map<std::string, int> versions, statuses, compressions, bits, heightmaps;
  std::set<std::string> biomes;
  std::vector<Cube> cubes;
  VoxelBox chunks;
  int sections = 0, with_blocks = 0, entities = 0, block_entities = 0, low = 100, high = -100, external = 0;
  std::array<int, 3> surface{};
  for (const mca::PackedChunk& chunk : region->chunks) {
    const mca::ChunkInfo info = reader.read(chunk, "chunk", cubes);
    EXPECT_EQ(info.problem, "");
    ++versions[std::to_string(info.data_version)];
    if (!info.status.empty()) ++statuses[info.status];
    ++compressions[std::to_string(chunk.compression)];
    external += !chunk.external.empty();
    chunks.include(VoxelPos{info.x, 0, info.z});
    sections += info.sections;
    with_blocks += info.sections_with_blocks;
    entities += info.entities;
    block_entities += info.block_entities;
    if (info.sections) low = std::min(low, info.min_section_y), high = std::max(high, info.max_section_y);
    ChunkTree tree;
    nbt::Reader in(*reader.inflate(chunk), "chunk");
    in.root();
    read_tree(in, tree);
    for (const auto& [kind, words] : tree.heightmaps) ++heightmaps[kind];
    biomes.insert(tree.biomes.begin(), tree.biomes.end());
    if (info.status.ends_with("full") || info.status == "fullchunk") {
      ++surface[0];
      surface[1] += 256;
      surface[2] += columns_at_stored_height(tree, info.x, info.z, world);
    }
  }
  for (const Cube& cube : cubes) {
    if (facts["bits"].empty()) continue;
    int width = 4;
    while ((size_t{1} << width) < cube.states.size()) ++width;
    ++bits[cube.narrow || cube.wide ? std::to_string(width) : "single"];
  }
  EXPECT_EQ(json(versions), facts["dataversions"]);
  EXPECT_EQ(json(statuses), facts["status"]);
  EXPECT_EQ(json(compressions), facts["compression"]);
  EXPECT_EQ(json(bits), facts["bits"].is_null() ? json::object() : facts["bits"]);
  EXPECT_EQ(json(heightmaps), facts["heightmaps"]);
  EXPECT_EQ(json(biomes), facts["biome_palette"]);
  EXPECT_EQ(external, facts["external"]);
  EXPECT_EQ(json({chunks.min.x, chunks.max.x}), facts["chunk_x"]);
  EXPECT_EQ(json({chunks.min.z, chunks.max.z}), facts["chunk_z"]);
  EXPECT_EQ(sections, facts["sections"]);
  EXPECT_EQ(with_blocks, facts["sections_with_blocks"]);
  EXPECT_EQ(json({low, high}), facts["section_Y"]);
  EXPECT_EQ(entities, facts["entities"]);
  EXPECT_EQ(block_entities, facts["tile_entities"]);
  // FACTS.md, column "surface": full chunks, their columns, and those that agree. An upside-down or shifted world
  // fails.
  static const std::map<std::string, std::array<int, 3>> kSurface = {{"1.13.2", {29, 7424, 7283}},
                                                                     {"1.16", {253, 64768, 64768}},
                                                                     {"1.17.1", {144, 36864, 36864}},
                                                                     {"1.18.2", {27, 6912, 6912}},
                                                                     {"1.21.1", {16, 4096, 4096}}};
  if (const auto known = kSurface.find(path.parent_path().filename().string()); known != kSurface.end()) {
    EXPECT_EQ(surface, known->second);
  }

  std::array<uint64_t, 16> sky{}, block{};
  int sky_sections = 0, block_sections = 0;
  const auto problems = mca::read_mca_light(path, [&](const mca::SectionLight& light) {
    sky_sections += !light.sky.empty();
    block_sections += !light.block.empty();
    for (const uint8_t two : light.sky) ++sky[two & 15], ++sky[two >> 4];
    for (const uint8_t two : light.block) ++block[two & 15], ++block[two >> 4];
  });
  ASSERT_TRUE(problems && problems->empty());
  EXPECT_EQ(json(sky), facts["sky_hist"]);
  EXPECT_EQ(json(block), facts["block_hist"]);
  EXPECT_EQ(sky_sections, facts["sky_sections"]);
  EXPECT_EQ(block_sections, facts["block_sections"]);
}

TEST(Mca, FactsOfRealFilesHold) {
  if (shared_facts().is_null()) GTEST_SKIP();
  for_each_file("mca/", ".mca", 7, expect_region);
}

TEST(Mca, AFolderOfRegionsIsOneWorld) {
  const auto a = shared_data("mca/1.17.1/r.0.0.mca"), b = shared_data("mca/1.13.2/r.-1.-1.mca");
  if (!a || !b) GTEST_SKIP();
  TemporaryFolder folder;
  std::filesystem::create_directory(folder / "region");
  for (const auto& file : {*a, *b}) std::filesystem::copy_file(file, folder / "region" / file.filename().string());
  ImportReport report;
  const auto world = read_world(folder / "", {}, report);
  ASSERT_TRUE(world) << world.error().message;
  EXPECT_EQ(world->store.voxel_count(), 145u + 3137732u);
  EXPECT_EQ(fact(report, "region files"), "2");
}

// ---- schematics ------------------------------------------------------------------------------------------------

std::string sides(const json& size) {
  return fmt::format("{} x {} x {}", size[0].get<int>(), size[1].get<int>(), size[2].get<int>());
}
std::string left_behind(const json& entities, const json& block_entities) {
  return fmt::format("{} entities, {} block entities", entities.get<int>(), block_entities.get<int>());
}

TEST(Schem, FactsOfRealFilesHold) {
  if (shared_facts().is_null()) GTEST_SKIP();
  for_each_file("schem/", ".schem", 5, [](const Imported& file) {
    const json& facts = file.facts;
    EXPECT_EQ(file.fact("version"), facts["version"].is_null() ? "1" : facts["version"].dump());
    EXPECT_EQ(file.fact("data version"), facts["dataversion"].is_null() ? "none" : facts["dataversion"].dump());
    EXPECT_EQ(file.fact("size"), sides(facts["size_WHL"]));
    EXPECT_EQ(file.fact("palette"), facts["palette"].dump());
    EXPECT_EQ(file.fact("left behind"), left_behind(facts["entities"], facts["block_entities"]));
    EXPECT_EQ(file.fact("offset"), fmt::format("{} {} {}", facts["offset"][0].get<int>(), facts["offset"][1].get<int>(),
                                               facts["offset"][2].get<int>()));
  });
}

TEST(Schematic, FactsOfRealFilesHold) {
  if (shared_facts().is_null()) GTEST_SKIP();
  for_each_file("schem/", ".schematic", 2, [](const Imported& file) {
    const json& facts = file.facts;
    EXPECT_EQ(file.fact("size"), sides(facts["size_WHL"]));
    EXPECT_EQ(file.fact("left behind"), left_behind(facts["entities"], facts["block_entities"]));
    if (!facts["schematica_mapping"].is_null()) {
      EXPECT_EQ(file.fact("named ids"), facts["schematica_mapping"].dump());
    }
  });
}

TEST(Litematic, FactsOfRealFilesHold) {
  if (shared_facts().is_null()) GTEST_SKIP();
  for_each_file("schem/", ".litematic", 4, [](const Imported& file) {
    const json& facts = file.facts;
    EXPECT_EQ(file.fact("version"), facts["version"].dump());
    EXPECT_EQ(file.fact("data version"), facts["dataversion"].dump());
    EXPECT_EQ(file.fact("total blocks"), facts["meta_total_blocks"].dump());
    EXPECT_EQ(file.fact("regions"), std::to_string(facts["regions"].size()));
    int entities = 0, block_entities = 0;
    for (const auto& [name, region] : facts["regions"].items()) {
      const auto at = [&](const char* key, int a) { return region[key][static_cast<size_t>(a)].get<int>(); };
      EXPECT_EQ(file.fact("region " + plain_name(name)),
                fmt::format("{} x {} x {} at {} {} {}, palette {}", at("size", 0), at("size", 1), at("size", 2),
                            at("pos", 0), at("pos", 1), at("pos", 2), region["palette"].get<int>()));
      entities += region["entities"].get<int>();
      block_entities += region["tile_entities"].get<int>();
      // Where a negative size reaches: no voxel lies outside.
      const VoxelBox box = file.world.store.bounds();
      for (int a = 0; a < 3; ++a) {
        const int low = at("pos", a) + std::min(at("size", a) + 1, 0);
        EXPECT_GE(box.min[a], low);
        EXPECT_LT(box.max[a], low + std::abs(at("size", a)));
      }
    }
    EXPECT_EQ(file.fact("left behind"), left_behind(entities, block_entities));
  });
}

// ---- Luanti and Qubicle ----------------------------------------------------------------------------------------

TEST(Mts, FactsOfRealFilesHold) {
  if (shared_facts().is_null()) GTEST_SKIP();
  for_each_file("luanti/", ".mts", 6, [](const Imported& file) {
    const json& facts = file.facts;
    EXPECT_EQ(file.fact("version"), facts["version"].dump());
    EXPECT_EQ(file.fact("size"), sides(facts["size_XYZ"]));
    EXPECT_EQ(file.fact("node names"), std::to_string(facts["names"].size()));
    EXPECT_EQ(file.fact("never placed"), facts["prob_zero"].dump());
    EXPECT_EQ(file.fact("placed by chance"),
              std::to_string(facts["prob_lt_always"].get<int>() - facts["prob_zero"].get<int>()));
  });
}

TEST(Luanti, FactsOfRealFilesHold) {
  if (shared_facts().is_null()) GTEST_SKIP();
  for_each_file("luanti/", ".sqlite", 2,
                [](const Imported& file) {
                  const std::filesystem::path& path = file.path;
                  const json& facts = file.facts;
                  EXPECT_EQ(file.fact("map blocks"), facts["blocks"].dump());
                  MemoryBudget budget(std::filesystem::file_size(path));
                  const auto rows = luanti::read_rows(path, budget);
                  ASSERT_TRUE(rows) << rows.error().message;
                  uint64_t bytes = 0;
                  VoxelBox blocks;
                  std::map<std::string, int> versions;
                  for (const luanti::StoredBlock& row : *rows) {
                    bytes += row.bytes.size();
                    ++versions[std::to_string(row.bytes[0])];
                    blocks.include(VoxelPos{row.pos[0], row.pos[1], row.pos[2]});
                  }
                  EXPECT_EQ(bytes, facts["data_bytes"]);
                  EXPECT_EQ(json(versions), facts["versions"]);
                  EXPECT_EQ(json({blocks.min.x, blocks.min.y, blocks.min.z}), facts["pos_min"]);
                  EXPECT_EQ(json({blocks.max.x, blocks.max.y, blocks.max.z}), facts["pos_max"]);
                  std::array<uint64_t, 16> day{}, night{};
                  const Status read =
                      luanti::read_map_light(path, [&](std::array<int, 3>, std::span<const uint8_t> light) {
                        for (const uint8_t both : light) ++day[both & 15], ++night[both >> 4];
                      });
                  ASSERT_TRUE(read) << read.error().message;
                  EXPECT_EQ(json(day), facts["day_hist"]);
                  EXPECT_EQ(json(night), facts["night_hist"]);
                },
                // Of 46 nodes two belong to mods of that server.
                {{"luanti/map2.sqlite", {{"protector:protect", 1}, {"travelnet:travelnet", 1}}}});
}

TEST(Qb, FactsOfRealFilesHold) {
  if (shared_facts().is_null()) GTEST_SKIP();
  for_each_file("qb/", ".qb", 2, [](const Imported& file) {
    const json& facts = file.facts;
    EXPECT_EQ(file.fact("version"), facts["version"]);
    EXPECT_EQ(file.fact("axes"), facts["zOrient"] == 1 ? "right-handed" : "left-handed");
    EXPECT_EQ(file.fact("compressed"), facts["compressed"] == 1 ? "yes" : "no");
    EXPECT_EQ(file.fact("visibility masks"), facts["visMask"] == 1 ? "yes" : "no");
    EXPECT_EQ(file.fact("matrices"), std::to_string(facts["matrices"].size()));
    uint64_t voxels = 0;
    VoxelBox box;
    for (const json& m : facts["matrices"]) {
      voxels += m["voxels"].get<uint64_t>();
      const auto at = [&](const char* key, int a) { return m[key][static_cast<size_t>(a)].get<int>(); };
      EXPECT_EQ(file.fact("matrix " + plain_name(m["name"].get<std::string>())),
                fmt::format("{} x {} x {} at {} {} {}, {} voxels", at("size", 0), at("size", 1), at("size", 2),
                            at("pos", 0), at("pos", 1), at("pos", 2), m["voxels"].get<int>()));
      box.include(VoxelPos{at("pos", 0), at("pos", 1), at("pos", 2)});
      box.include(VoxelPos{at("pos", 0) + at("size", 0) - 1, at("pos", 1) + at("size", 1) - 1,
                           at("pos", 2) + at("size", 2) - 1});
    }
    EXPECT_EQ(file.fact("voxels in matrices"), std::to_string(voxels));
    EXPECT_LE(file.world.store.voxel_count(), voxels);
    EXPECT_TRUE(box.contains(file.world.store.bounds().min) && box.contains(file.world.store.bounds().max));
  });
}

}  // namespace
}  // namespace world
