/// The store: reading, editing, counting, hashing, saving, generating; and how many bytes a cubic metre costs.
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "tools/bench/benchmark.h"
#include "tools/bench/leaf_rows.h"
#include "tools/bench/rivals/openvdb_rival.h"
#include "tools/bench/rivals/sqlite_rival.h"
#include "tools/bench/save_rows.h"
#include "tools/bench/world_copy.h"
#include "world/base/jobs.h"
#include "world/base/random.h"
#include "world/formats/format.h"
#include "world/gen/generator.h"
#include "world/scenes/scene.h"

namespace tools {

namespace {

using world::BlockId;
using world::LeafPos;
using world::VoxelBox;
using world::VoxelPos;
using world::World;

/// The simplest rival: a byte a voxel, x slowest, z fastest. The bytes number the blocks that the world holds.
struct DenseArray {
  VoxelBox box;
  size_t size_y = 0, size_z = 0;
  std::vector<uint8_t> bytes;
  std::vector<BlockId> blocks;  // by byte
  size_t index(VoxelPos v) const {
    return (static_cast<size_t>(v.x - box.min.x) * size_y + static_cast<size_t>(v.y - box.min.y)) * size_z +
           static_cast<size_t>(v.z - box.min.z);
  }
};

std::shared_ptr<DenseArray> dense_array(BenchContext& context, const World& world) {
  return context.shared<DenseArray>("store/dense", [&] {
    auto dense = std::make_shared<DenseArray>();
    dense->blocks = {world::kAir};
    std::vector<uint8_t> byte(world.palette->size());
    for (const auto& [block, count] : world.store.census()) {
      byte[block] = static_cast<uint8_t>(dense->blocks.size());
      dense->blocks.push_back(block);
    }
    CHECK(dense->blocks.size() <= 256);
    dense->box = region_box(world.store);
    dense->size_y = static_cast<size_t>(dense->box.max.y - dense->box.min.y) + 1;
    dense->size_z = static_cast<size_t>(dense->box.max.z - dense->box.min.z) + 1;
    dense->bytes.resize(dense->box.volume());
    for (const world::RegionPos& r : world.store.regions())
      for (int i = 0; i < world::kLeavesPerRegion; ++i) {
        const LeafPos l = world::leaf_from_region(r) + world::leaf_offset_in_region(i);
        const world::LeafBlocks leaf = world.store.leaf(l);
        if (!leaf.values && leaf.uniform == world::kAir) continue;
        for (int n = 0; n < world::kLeafVoxels; ++n)
          dense->bytes[dense->index(world::voxel_from_leaf(l) + world::offset_in_leaf(n))] = byte[leaf[n]];
      }
    return dense;
  });
}

std::shared_ptr<OpenVdbRival> openvdb_rival(BenchContext& context, const World& world) {
  return context.shared<OpenVdbRival>("store/openvdb", [&] { return std::make_shared<OpenVdbRival>(world.store); });
}

std::vector<VoxelPos> random_positions(const VoxelBox& box, size_t count, uint64_t seed) {
  std::vector<VoxelPos> positions(count);
  for (size_t i = 0; i < count; ++i)
    for (int a = 0; a < 3; ++a) {
      const double u = world::uniform01_double(world::random_bits(seed, static_cast<int64_t>(i), a, 0));
      positions[i][a] = box.min[a] + static_cast<int32_t>(u * (double(box.max[a]) - box.min[a] + 1));
    }
  return positions;
}

/// A slab of columns through the middle of the box, in scanning order.
std::vector<VoxelPos> scan_positions(const VoxelBox& box) {
  std::vector<VoxelPos> positions;
  const int x = box.min.x + (box.max.x - box.min.x) / 2;
  for (int dx = 0; dx < 2; ++dx)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z) positions.push_back({x + dx, y, z});
  return positions;
}

Status equal(uint64_t ours, uint64_t rival, const char* what) {
  if (ours == rival) return {};
  return world::input_error(fmt::format("{} differs: ours {}, the rival's {}", what, ours, rival));
}

Result<Prepared> prepare_reads(BenchContext& context, bool scanning) {
  TRY(const World* valley, context.world("valley"));
  const auto dense = dense_array(context, *valley);
  const auto openvdb = openvdb_rival(context, *valley);
  const auto positions = std::make_shared<const std::vector<VoxelPos>>(
      scanning ? scan_positions(dense->box) : random_positions(dense->box, size_t{1} << 19, context.seed()));
  const auto ours = [=] {
    world::StoreReader reader(valley->store);
    uint64_t sum = 0;
    for (const VoxelPos& v : *positions) sum += reader.get(v);
    return sum;
  };
  const auto plain = [=] {
    uint64_t sum = 0;
    for (const VoxelPos& v : *positions) sum += valley->store.get(v);
    return sum;
  };
  const auto theirs = [=] {
    uint64_t sum = 0;
    for (const VoxelPos& v : *positions) sum += dense->blocks[dense->bytes[dense->index(v)]];
    return sum;
  };
  const double count = static_cast<double>(positions->size());
  const auto timed = [count](auto work) {
    return [=] {
      const uint64_t sum = work();
      keep(sum);
      return count;
    };
  };
  return Prepared{.ours = {"StoreReader", timed(ours)},
                  .rivals = {{"OpenVDB accessor", timed([=] { return openvdb->sum(*positions); })},
                             {"Store::get", timed(plain)},
                             {"dense byte array", timed(theirs)}},
                  .counters =
                      [=] {
                        return std::map<std::string, double>{{"voxels_read", count}};
                      },
                  .check = [=]() -> Status {
                    TRY_STATUS(equal(ours(), theirs(), "the sum of ids of the dense array"));
                    TRY_STATUS(equal(ours(), plain(), "the sum of ids by Store::get"));
                    return equal(ours(), openvdb->sum(*positions), "the sum of ids by OpenVDB");
                  }};
}

Result<Prepared> prepare_leaf_reads(BenchContext& context) {
  TRY(const World* valley, context.world("valley"));
  const auto openvdb = openvdb_rival(context, *valley);
  const auto dense = dense_array(context, *valley);
  const auto leaves = std::make_shared<const std::vector<LeafPos>>(valley->store.mixed_leaves());
  const auto ours = [=] {
    world::StoreReader reader(valley->store);
    uint64_t sum = 0;
    for (const LeafPos& l : *leaves) {
      const world::LeafBlocks leaf = reader.leaf(l);
      for (int n = 0; n < world::kLeafVoxels; ++n) sum += leaf.values[n];
    }
    return sum;
  };
  const double count = static_cast<double>(leaves->size()) * world::kLeafVoxels;
  return Prepared{.ours = {"StoreReader::leaf",
                           [=] {
                             const uint64_t sum = ours();
                             keep(sum);
                             return count;
                           }},
                  .rivals = {{"OpenVDB leaf manager",
                              [=] {
                                const uint64_t sum = openvdb->sum_of_leaves();
                                keep(sum);
                                return count;
                              }},
                             {"dense byte array",
                              [=] {
                                uint64_t sum = 0;
                                for (uint8_t b : dense->bytes) sum += dense->blocks[b];
                                keep(sum);
                                return static_cast<double>(dense->bytes.size());
                              }}},
                  .counters =
                      [=] {
                        return std::map<std::string, double>{{"leaves", static_cast<double>(leaves->size())}};
                      },
                  .check = [=] { return equal(ours(), openvdb->sum_of_leaves(), "the sum of ids"); }};
}

/// A piece of a world that rows may write to.
std::shared_ptr<World> copy_of(const World& world, const VoxelBox& box) {
  auto copy = std::make_shared<World>(*world.palette);
  for (const world::RegionPos& r : world.store.regions()) {
    const VoxelPos corner = world::voxel_from_region(r);
    if (!box.contains(corner)) continue;
    world::RegionBuilder region(r);
    for (int i = 0; i < world::kLeavesPerRegion; ++i) {
      const world::LeafBlocks leaf = world.store.leaf(world::leaf_from_region(r) + world::leaf_offset_in_region(i));
      if (leaf.values)
        region.set_leaf(i, std::span<const BlockId, world::kLeafVoxels>(leaf.values, world::kLeafVoxels));
      else if (leaf.uniform != world::kAir)
        region.set_uniform(i, leaf.uniform);
    }
    copy->store.adopt(std::move(region));
  }
  return copy;
}

/// A part of the valley of 256 x 256 x 256 voxels, whole regions.
VoxelBox part_box(const World& world) {
  const VoxelBox box = region_box(world.store);
  const VoxelPos low{box.min.x + 256, box.min.y, box.min.z + 256};
  return {low, low + VoxelPos{255, 255, 255}};
}

/// Edits that switch between two blocks, so that each call changes every voxel again.
Result<Prepared> prepare_edits(BenchContext& context, bool boxes) {
  TRY(const World* valley, context.world("valley"));
  const VoxelBox box = part_box(*valley);
  const auto copy = copy_of(*valley, box);
  const auto openvdb = std::make_shared<OpenVdbRival>(copy->store);
  const auto dense = dense_array(context, *valley);
  const auto rival = std::make_shared<DenseArray>(*dense);

  std::vector<VoxelBox> targets;
  if (boxes) {
    for (const VoxelPos& v : random_positions({box.min, box.max - VoxelPos{31, 31, 31}}, 64, context.seed()))
      targets.push_back({v, v + VoxelPos{31, 31, 31}});
  } else {
    for (const VoxelPos& v : random_positions(box, 100'000, context.seed())) targets.push_back({v, v});
  }
  double count = 0;
  for (const VoxelBox& target : targets) count += static_cast<double>(target.volume());
  std::vector<VoxelPos> positions;
  for (const VoxelBox& target : targets) positions.push_back(target.min);

  const auto batches = std::make_shared<std::vector<world::EditBatch>>(2);
  for (size_t b = 0; b < 2; ++b)
    for (const VoxelBox& target : targets) (*batches)[b].fill(target, static_cast<BlockId>(b + 1));
  const auto turn = std::make_shared<size_t>(0);
  const auto their_turn = std::make_shared<BlockId>(BlockId{1});
  const auto ours = [=] {
    const auto report = copy->store.apply((*batches)[(*turn)++ % 2]);
    return report.ok() ? count : std::nan("");
  };
  const auto by_openvdb = [=, positions = std::move(positions)] {
    *their_turn = static_cast<BlockId>(3 - *their_turn);
    if (boxes)
      openvdb->fill(targets, *their_turn);
    else
      openvdb->set(positions, *their_turn);
    return count;
  };
  const auto by_array = [=] {
    *their_turn = static_cast<BlockId>(3 - *their_turn);
    for (const VoxelBox& t : targets)
      for (int x = t.min.x; x <= t.max.x; ++x)
        for (int y = t.min.y; y <= t.max.y; ++y) {
          uint8_t* row = &rival->bytes[rival->index({x, y, t.min.z})];
          std::fill(row, row + (t.max.z - t.min.z + 1), static_cast<uint8_t>(*their_turn));
        }
    keep(rival->bytes[0]);
    return count;
  };
  return Prepared{.ours = {"apply, with census and dirty set", ours},
                  .rivals = {{boxes ? "OpenVDB fill" : "OpenVDB accessor", by_openvdb}, {"dense byte array", by_array}},
                  .counters =
                      [=] {
                        return std::map<std::string, double>{{"voxels_written", count}};
                      },
                  .check = [=]() -> Status {
                    // Afterwards every target holds the block of the batch.
                    for (const auto& batch : *batches) {
                      TRY(const world::EditReport report, copy->store.apply(batch));
                      (void)report;
                      for (const VoxelBox& t : targets)
                        if (copy->store.get(t.min) != batch.ops()[0].block)
                          return world::input_error("an edit did not arrive");
                    }
                    return {};
                  }};
}

Result<Prepared> prepare_census(BenchContext& context) {
  TRY(const World* valley, context.world("valley"));
  const auto dense = dense_array(context, *valley);
  const auto theirs = [=] {
    std::vector<uint64_t> counts(256);
    for (uint8_t b : dense->bytes) ++counts[b];
    return counts;
  };
  return Prepared{.ours = {"kept by every edit",
                           [=] {
                             const world::Census census = valley->store.census();
                             keep(census);
                             return static_cast<double>(census.size());
                           }},
                  .rivals = {{"count of a dense byte array",
                              [=] {
                                const auto counts = theirs();
                                keep(counts[0]);
                                return 0.0;
                              }}},
                  .check = [=]() -> Status {
                    const auto counts = theirs();
                    world::Census census = valley->store.census();
                    uint64_t all = 0;
                    for (size_t b = 1; b < dense->blocks.size(); ++b) {
                      TRY_STATUS(equal(census[dense->blocks[b]], counts[b], "the count of a block"));
                      all += counts[b];
                    }
                    uint64_t ours = 0;
                    for (const auto& [block, n] : census) ours += n;
                    return equal(ours, all, "the count of all blocks");
                  }};
}

Result<Prepared> prepare_masks(BenchContext& context) {
  TRY(const World* valley, context.world("valley"));
  const VoxelBox box = part_box(*valley);
  const auto source = copy_of(*valley, box);
  const auto fresh = std::make_shared<std::shared_ptr<World>>();
  const auto dense = dense_array(context, *valley);
  const double count = static_cast<double>(box.volume());
  const auto bits = std::make_shared<std::vector<uint64_t>>(dense->bytes.size() / 64);
  std::vector<uint8_t> opaque(256);
  for (size_t b = 0; b < dense->blocks.size(); ++b)
    opaque[b] = valley->palette->masks()[dense->blocks[b]] >> static_cast<int>(world::MaskKind::opaque) & 1;
  const auto theirs = [=] {
    for (size_t w = 0; w < bits->size(); ++w) {
      uint64_t word = 0;
      for (size_t i = 0; i < 64; ++i) word |= static_cast<uint64_t>(opaque[dense->bytes[w * 64 + i]]) << i;
      (*bits)[w] = word;
    }
    keep((*bits)[0]);
    return static_cast<double>(dense->bytes.size());
  };
  const auto ours = [=] {
    keep((*fresh)->store.masks(world::MaskKind::opaque));
    return count;
  };
  return Prepared{.ours = {"Store::masks, first call", ours, [=] { *fresh = copy_of(*source, box); }},
                  .rivals = {{"bits of a dense byte array", theirs}},
                  .counters =
                      [=] {
                        const auto& masks = (*fresh)->store.masks(world::MaskKind::opaque);
                        return std::map<std::string, double>{{"voxels_set", static_cast<double>(masks.count())},
                                                             {"bytes", static_cast<double>(masks.bytes())}};
                      },
                  .check = [=]() -> Status {
                    uint64_t expected = 0;
                    const int bit = static_cast<int>(world::MaskKind::opaque);
                    for (const auto& [block, n] : source->store.census())
                      expected += source->palette->masks()[block] >> bit & 1 ? n : 0;
                    return equal(source->store.masks(world::MaskKind::opaque).count(), expected,
                                 "the count of opaque voxels");
                  }};
}

Result<Prepared> prepare_hash(BenchContext& context) {
  TRY(const World* valley, context.world("valley"));
  const auto dense = dense_array(context, *valley);
  const double count = static_cast<double>(dense->box.volume());
  return Prepared{
      .ours = {"content_hash",
               [=] {
                 const uint64_t hash = valley->store.content_hash();
                 keep(hash);
                 return count;
               }},
      .rivals = {{"mix64 over a dense byte array",
                  [=] {
                    uint64_t hash = 0;
                    const uint8_t* bytes = dense->bytes.data();
                    for (size_t i = 0; i < dense->bytes.size(); i += 8) {
                      uint64_t word;
                      std::copy_n(bytes + i, 8, reinterpret_cast<uint8_t*>(&word));
                      hash += world::mix64(word + i);
                    }
                    keep(hash);
                    return count;
                  }}},
      .counters = [=] {
        // 53 bits of the hash, so that a number holds it.
        return std::map<std::string, double>{{"hash_53_bits", static_cast<double>(valley->store.content_hash() >> 11)}};
      }};
}

struct SavedValley {
  std::filesystem::path path, rival_path;
  std::vector<std::string> blobs;
};

Result<std::shared_ptr<SavedValley>> saved_valley(BenchContext& context, const World& valley) {
  TRY(const std::filesystem::path folder, context.scratch());
  const auto saved = context.shared<SavedValley>("store/saved", [&] { return std::make_shared<SavedValley>(); });
  if (saved->path.empty()) {
    TRY_STATUS(world::write_world(valley, folder / "valley.loam"));
    TRY(saved->blobs, sqlite_read_blobs(folder / "valley.loam"));
    saved->rival_path = folder / "blobs.sqlite";
    TRY_STATUS(sqlite_write_blobs(saved->rival_path, saved->blobs));
    saved->path = folder / "valley.loam";
  }
  return saved;
}

std::map<std::string, double> file_counters(const std::filesystem::path& path) {
  return {{"file_bytes", static_cast<double>(std::filesystem::file_size(path))}};
}

double ok_or_nan(bool ok) { return ok ? 0.0 : std::nan(""); }

Result<Prepared> prepare_save(BenchContext& context) {
  TRY(const World* valley, context.world("valley"));
  TRY(const auto saved, saved_valley(context, *valley));
  return Prepared{
      .ours = {"write_world, .loam", [=] { return ok_or_nan(world::write_world(*valley, saved->path).ok()); }},
      .rivals = {{"SQLite, the same bytes",
                  [=] { return ok_or_nan(sqlite_write_blobs(saved->rival_path, saved->blobs).ok()); }}},
      .counters = [=] { return file_counters(saved->path); }};
}

Result<Prepared> prepare_open(BenchContext& context) {
  TRY(const World* valley, context.world("valley"));
  TRY(const auto saved, saved_valley(context, *valley));
  const auto read = [=] {
    world::ImportReport report;
    return world::read_world(saved->path, {}, report);
  };
  return Prepared{
      .ours = {"read_world, .loam", [=] { return ok_or_nan(read().ok()); }},
      .rivals = {{"SQLite, the same bytes", [=] { return ok_or_nan(sqlite_read_blobs(saved->rival_path).ok()); }}},
      .counters = [=] { return file_counters(saved->path); },
      .check = [=]() -> Status {
        TRY(const World opened, read());
        return equal(valley->store.content_hash(), opened.store.content_hash(), "the hash after opening");
      }};
}

Result<Prepared> prepare_generate(BenchContext& context) {
  TRY(const world::Scene scene, world::load_scene("valley"));
  TRY(const World* valley, context.world("valley"));
  const auto build = [=] {
    world::ImportReport report;
    return world::build_world(scene, report);
  };
  const VoxelBox box = region_box(valley->store);
  return Prepared{
      .ours = {"build_world", [=] { return ok_or_nan(build().ok()); }},
      .rivals = {{"copy into a fresh store",
                  [=] {
                    const auto copy = copy_of(*valley, box);
                    keep(*copy);
                    return 0.0;
                  }}},
      .counters =
          [=] {
            return std::map<std::string, double>{{"voxels", static_cast<double>(valley->store.voxel_count())}};
          },
      .check = [=]() -> Status {
        TRY(const World again, build());
        return equal(valley->store.content_hash(), again.store.content_hash(), "the hash of a second run");
      }};
}

Result<Prepared> prepare_memory(BenchContext& context) {
  TRY(const World* valley, context.world("valley"));
  const VoxelBox box = region_box(valley->store);
  const double volume = static_cast<double>(box.volume());
  const auto bytes = [=](bool masks) {
    double total = 0;
    for (const world::LayerInfo& layer : valley->store.layers())
      if ((layer.name.rfind("mask", 0) == 0) == masks) total += static_cast<double>(layer.bytes);
    return total;
  };
  return Prepared{.ours = {"block layer", [=] { return bytes(false) / volume; }},
                  .rivals = {{"dense byte array", [] { return 1.0; }}},
                  .counters = [=] {
                    return std::map<std::string, double>{
                        {"block_bytes", bytes(false)}, {"mask_bytes", bytes(true)}, {"volume", volume}};
                  }};
}

Result<Prepared> prepare_file_size(BenchContext& context) {
  TRY(const World* valley, context.world("valley"));
  TRY(const auto saved, saved_valley(context, *valley));
  const double volume = static_cast<double>(region_box(valley->store).volume());
  return Prepared{
      .ours = {"valley.loam", [=] { return static_cast<double>(std::filesystem::file_size(saved->path)) / volume; }},
      .rivals = {{"dense byte array", [] { return 1.0; }}},
      .counters = [=] { return file_counters(saved->path); }};
}

}  // namespace

void add_suite_store(Registry& registry) {
  registry.add({.name = "read_random",
                .what = "reads 524,288 voxels of the valley at random positions",
                .unit = "M voxels/s",
                .scale = 1e6,
                .threads = 1,
                .reach = Reach{30, "2.5 times the best of OpenVDB 10's accessor, 7 to 12 M/s measured at random"},
                .prepare = [](BenchContext& c) { return prepare_reads(c, false); }});
  registry.add({.name = "read_scan",
                .what = "reads two slabs of the valley voxel by voxel in order",
                .unit = "M voxels/s",
                .scale = 1e6,
                .threads = 1,
                .reach = Reach{296, "OpenVDB 10's accessor, measured scanning"},
                .prepare = [](BenchContext& c) { return prepare_reads(c, true); }});
  registry.add({.name = "read_leaves",
                .what = "sums the ids of all mixed leaves of the valley",
                .unit = "G voxels/s",
                .scale = 1e9,
                .threads = 1,
                .reach = Reach{1, "OpenVDB 10's leaf manager, measured: 0.97 to 0.99 G/s"},
                .limit = Reach{6, "12 GB/s of memory a core at 2 bytes a voxel"},
                .prepare = prepare_leaf_reads});
  registry.add({.name = "edit_scattered",
                .what = "one batch of 100,000 single voxels at random in 256^3 of the valley",
                .unit = "M voxels/s",
                .scale = 1e6,
                .threads = 1,
                .reach = Reach{8, "OpenVDB 10's accessor, measured: 4 M/s at random, 8 near each other"},
                .prepare = [](BenchContext& c) { return prepare_edits(c, false); }});
  registry.add({.name = "edit_boxes",
                .what = "one batch of 64 boxes of 32^3 voxels in 256^3 of the valley",
                .unit = "M voxels/s",
                .scale = 1e6,
                .threads = 1,
                .reach = Reach{1000, "13 times OpenVDB 10's setValueOn in rows, measured: 66 to 74 M/s"},
                .prepare = [](BenchContext& c) { return prepare_edits(c, true); }});
  registry.add({.name = "census",
                .what = "how many voxels of each block the valley holds",
                .unit = "ms",
                .better = Better::lower,
                .timing = Timing::milliseconds,
                .threads = 1,
                .reach = Reach{1, "asked each tick and each frame for the effects that are called for"},
                .prepare = prepare_census});
  registry.add({.name = "build_masks",
                .what = "derives the opaque bits of 256^3 of the valley from its blocks",
                .unit = "G voxels/s",
                .scale = 1e9,
                .threads = 1,
                .reach = Reach{1, "OpenVDB 10's raw leaf buffers, measured: 0.97 to 0.99 G/s"},
                .limit = Reach{6, "12 GB/s of memory a core at 2 bytes a voxel, where no leaf is uniform"},
                .prepare = prepare_masks});
  registry.add({.name = "content_hash",
                .what = "hashes the valley",
                .unit = "G voxels/s",
                .scale = 1e9,
                .threads = 1,
                .reach = Reach{1, "OpenVDB 10's raw leaf buffers, measured: 0.97 to 0.99 G/s"},
                .prepare = prepare_hash});
  registry.add({.name = "save",
                .what = "writes the valley as .loam, synced to disk",
                .unit = "ms",
                .better = Better::lower,
                .timing = Timing::milliseconds,
                .repetitions = 5,
                .reach = Reach{600, "OpenVDB 10 writes a world of that size in 0.6 s with Blosc, measured"},
                .prepare = prepare_save});
  registry.add({.name = "open",
                .what = "reads the valley's .loam",
                .unit = "ms",
                .better = Better::lower,
                .timing = Timing::milliseconds,
                .repetitions = 5,
                .reach = Reach{650, "OpenVDB 10 reads a world of that size in 0.65 s with Blosc, measured"},
                .prepare = prepare_open});
  registry.add({.name = "generate",
                .what = "generates the valley, 1024 x 256 x 1024",
                .unit = "ms",
                .better = Better::lower,
                .timing = Timing::milliseconds,
                .threads = 2,
                .repetitions = 5,
                .reach = Reach{1500, "the first milestone: 1.5 s on 2 threads"},
                .prepare = prepare_generate});
  registry.add({.name = "memory",
                .what = "bytes of the block layer for each cubic metre of the valley",
                .unit = "B/m^3",
                .better = Better::lower,
                .timing = Timing::reported,
                .repetitions = 1,
                .reach = Reach{0.5, "the first milestone: at most 0.5 byte a cubic metre"},
                .prepare = prepare_memory});
  registry.add(
      {.name = "file_size",
       .what = "bytes of the valley's .loam for each cubic metre",
       .unit = "B/m^3",
       .better = Better::lower,
       .timing = Timing::reported,
       .repetitions = 1,
       .reach = Reach{0.05, "the aim; OpenVDB 10's smallest file of such terrain, zip and mask, measured: 0.093"},
       .prepare = prepare_file_size});
  add_leaf_rows(registry);
  add_save_rows(registry);
}

}  // namespace tools
