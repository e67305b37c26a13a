#include "tools/bench/save_rows.h"

#include <cmath>
#include <random>

#include <fmt/format.h>
#include <malloc.h>

#include "tools/bench/flight.h"
#include "tools/bench/world_copy.h"
#include "world/base/random.h"
#include "world/saves/session.h"
#include "world/scenes/scene.h"

namespace tools {

namespace {

using world::BlockId;
using world::RegionPos;
using world::SaveFile;
using world::SaveSession;
using world::VoxelBox;
using world::VoxelPos;
using world::World;

double ok_or_nan(const Status& status) { return status.ok() ? 0.0 : std::nan(""); }

std::shared_ptr<World> valley_copy(const World& valley) {
  const VoxelBox box = region_box(valley.store);
  return std::make_shared<World>(
      copy_regions(valley, world::region_from_voxel(box.min), world::region_from_voxel(box.max)));
}

/// The valley at rest.
Result<std::shared_ptr<World>> packed_valley(BenchContext& context) {
  TRY(const World* valley, context.world("valley"));
  return context.shared<World>("store/packed", [&] {
    std::shared_ptr<World> copy = valley_copy(*valley);
    copy->store.pack();
    return copy;
  });
}

// ---- regions at rest -------------------------------------------------------------------------------------------

Result<Prepared> prepare_packed_memory(BenchContext& context) {
  TRY(const World* valley, context.world("valley"));
  TRY(const auto packed, packed_valley(context));
  const double volume = static_cast<double>(region_box(valley->store).volume());
  const auto block_bytes = [](const World& w) { return static_cast<double>(w.store.layers().front().bytes); };
  return Prepared{.ours = {"packed by palette", [=] { return block_bytes(*packed) / volume; }},
                  .rivals = {{"open", [=] { return block_bytes(*valley) / volume; }}},
                  .counters =
                      [=] {
                        return std::map<std::string, double>{{"block_bytes", block_bytes(*packed)}, {"volume", volume}};
                      },
                  .check = [=]() -> Status {
                    if (packed->store.content_hash() == valley->store.content_hash()) return {};
                    return world::input_error("the packed valley differs from the open one");
                  }};
}

Result<Prepared> prepare_packed_reads(BenchContext& context) {
  TRY(const World* valley, context.world("valley"));
  TRY(const auto packed, packed_valley(context));
  const VoxelBox box = region_box(valley->store);
  const auto positions = std::make_shared<std::vector<VoxelPos>>(size_t{1} << 19);
  for (size_t i = 0; i < positions->size(); ++i)
    for (int a = 0; a < 3; ++a) {
      const double u = world::uniform01_double(world::random_bits(context.seed(), static_cast<int64_t>(i), a, 0));
      (*positions)[i][a] = box.min[a] + static_cast<int32_t>(u * (double(box.max[a]) - box.min[a] + 1));
    }
  const auto reads = [positions](const world::Store* store) {
    return [=] {
      world::StoreReader reader(*store);
      uint64_t sum = 0;
      for (const VoxelPos& v : *positions) sum += reader.get(v);
      keep(sum);
      return static_cast<double>(positions->size());
    };
  };
  return Prepared{.ours = {"packed", [=, read = reads(&packed->store)] { return read(); }},
                  .rivals = {{"open", [read = reads(&valley->store)] { return read(); }}}};
}

Result<Prepared> prepare_pack(BenchContext& context) {
  TRY(const World* valley, context.world("valley"));
  const auto fresh = std::make_shared<std::shared_ptr<World>>();
  const VoxelBox box = region_box(valley->store);
  return Prepared{.ours = {"Store::pack",
                           [=] {
                             (*fresh)->store.pack();
                             return static_cast<double>(box.volume());
                           },
                           [=] { *fresh = valley_copy(*valley); }}};
}

// ---- saving ----------------------------------------------------------------------------------------------------

/// A session over a copy of the valley; each edit writes a million voxels of two blocks in turn.
struct EditedValley {
  std::unique_ptr<SaveSession> session;
  int round = 0;
  Status edit() {
    world::EditBatch batch;
    const VoxelPos low{400 + round % 2, 60, 400};
    const auto stone = *session->world().palette->find("stone"), sand = *session->world().palette->find("sand");
    batch.fill({low, low + VoxelPos{99, 99, 99}}, round % 2 ? stone : sand);
    ++round;
    TRY([[maybe_unused]] const world::EditReport report, session->world().store.apply(batch));
    return {};
  }
  /// A million single voxels at random in 256^3: hardly a leaf stays as it was, and few stay simple.
  Status scatter(uint64_t seed) {
    world::EditBatch batch;
    const auto stone = *session->world().palette->find("stone"), sand = *session->world().palette->find("sand");
    for (int64_t i = 0; i < 1'000'000; ++i) {
      const uint64_t bits = world::random_bits(seed, i, round, 0);
      const auto part = [&](int shift) { return static_cast<int32_t>(bits >> shift & 255); };
      batch.set({part(0) - 128, part(8), part(16) - 128}, bits >> 24 & 1 ? stone : sand);
    }
    ++round;
    TRY([[maybe_unused]] const world::EditReport report, session->world().store.apply(batch));
    return {};
  }
};

Result<std::shared_ptr<EditedValley>> edited_valley(BenchContext& context, const std::string& name) {
  TRY(const World* valley, context.world("valley"));
  TRY(const std::filesystem::path folder, context.scratch());
  const auto edited = context.shared<EditedValley>("store/" + name, [&] { return std::make_shared<EditedValley>(); });
  if (!edited->session) {
    SaveSession::Options options;
    options.autosave_s = 0;
    TRY(edited->session, SaveSession::create(folder / (name + ".loam"), std::move(*valley_copy(*valley)), options));
  }
  return edited;
}

Result<Prepared> prepare_save_edit(BenchContext& context, bool scattered) {
  TRY(const auto edited, edited_valley(context, scattered ? "scattered" : "edited"));
  const uint64_t seed = context.seed();
  return Prepared{
      .ours = {"SaveSession::save", [=] { return ok_or_nan(edited->session->save()); },
               [=] { (void)(scattered ? edited->scatter(seed) : edited->edit()); }},
      .counters = [=] {
        return std::map<std::string, double>{{"regions", static_cast<double>(edited->session->last_report().regions)}};
      }};
}

Result<Prepared> prepare_save_stall(BenchContext& context) {
  TRY(const auto edited, edited_valley(context, "edited"));
  return Prepared{.ours = {"begin_save, then an edit of all that is being saved", [=] {
                             if (!edited->edit().ok()) return std::nan("");
                             if (!edited->session->begin_save()) return std::nan("");
                             const double ms = edited->session->last_report().snapshot_ms;
                             return edited->session->wait().ok() ? ms : std::nan("");
                           }}};
}

// ---- opening ---------------------------------------------------------------------------------------------------

/// A save of `side`^2 columns of two regions each. What a region holds does not matter to how it is found, so each
/// holds one voxel: of the valley's own regions it would be 22 GB, which open as fast (5 to 11 ms, measured by hand).
Status write_large_save(const World& valley, const std::filesystem::path& path, int side) {
  TRY(const auto file, SaveFile::create(path));
  TRY(const auto transaction, SaveFile::Transaction::begin(*file));
  std::vector<world::Block> blocks;
  for (size_t id = 1; id < valley.palette->size(); ++id) blocks.push_back((*valley.palette)[static_cast<BlockId>(id)]);
  TRY_STATUS(transaction->put_blocks(1, blocks));
  std::vector<BlockId> leaf(world::kLeafVoxels, world::kAir);
  leaf[17] = 1;
  const world::PackedRegion packed([&](int i) {
    return i == 0 ? world::LeafBlocks{leaf.data(), world::kAir} : world::LeafBlocks{};
  });
  world::RegionRow one;
  one.voxels = 1, one.codec = world::Codec::zstd;
  one.census = "1 1 " + (*valley.palette)[1].name + "\n";
  TRY(one.bytes, world::encode_payload(packed, {}, {}));
  for (int x = 0; x < side; ++x)
    for (int y = 0; y < 2; ++y)
      for (int z = 0; z < side; ++z) {
        world::RegionRow row = one;
        row.pos = {x - side / 2, y, z - side / 2};
        TRY_STATUS(transaction->put(std::move(row)));
      }
  return transaction->commit();
}

Result<Prepared> prepare_open_large(BenchContext& context) {
  TRY(const World* valley, context.world("valley"));
  TRY(const std::filesystem::path folder, context.scratch());
  const int side = context.quick() ? 64 : 512;
  const std::filesystem::path path = folder / "large.loam";
  if (!std::filesystem::exists(path)) TRY_STATUS(write_large_save(*valley, path, side));
  const double size = static_cast<double>(std::filesystem::file_size(path));
  const auto open = [=]() -> Status {
    TRY(const auto file, SaveFile::open(path, SaveFile::Access::edit));
    TRY(const World frame, file->read_frame());
    TRY(const auto row, file->read_row(world::Layer::block, {side / 3, 0, -side / 5}));
    if (!row) return world::input_error("the region is not there");
    // A region's blocks may lie elsewhere than its row: the payload is the valley's.
    TRY(const std::string stream, world::stream_of(*row));
    keep(stream);
    return {};
  };
  return Prepared{.ours = {"open, palette, one region's blocks", [=] { return ok_or_nan(open()); }},
                  .counters =
                      [=] {
                        return std::map<std::string, double>{{"rows", 2.0 * side * side}, {"file_bytes", size}};
                      },
                  .check = open};
}

// ---- flying ----------------------------------------------------------------------------------------------------

/// The valley's generator over a world of 65,536 x 65,536 m, flown over once; rows report of the same flight.
Result<std::shared_ptr<FlightReport>> flown(BenchContext& context) {
  const auto report = context.shared<FlightReport>("store/flight", [] { return std::make_shared<FlightReport>(); });
  if (report->streaming.resident > 0) return report;
  malloc_trim(0);  // so that what the rows before gave back isn't taken again unseen
  const size_t before = resident_bytes();
  World world(world::standard_blocks());
  TRY(const auto generator, world::make_generator("valley", 1, {}, *world.palette));
  world.store.masks(world::MaskKind::occupied);  // as a picture would have it
  world.store.masks(world::MaskKind::opaque);
  world::StreamingKnobs knobs;
  knobs.lowest_y = 0, knobs.highest_y = 255;
  world::Streamer streamer(world, nullptr, generator.get(), knobs);
  FlightPlan plan;
  if (context.quick()) plan.seconds = 30;
  *report = fly(streamer, plan);
  report->resident_bytes_before = before;
  return report;
}

Result<Prepared> prepare_flight(BenchContext& context, double (*value)(const FlightReport&)) {
  TRY(const auto report, flown(context));
  return Prepared{.ours = {"Streamer::update", [=] { return value(*report); }}};
}

}  // namespace

void add_save_rows(Registry& registry) {
  registry.add({.name = "memory_packed",
                .what = "bytes of the block layer for each cubic metre of the valley at rest, readable in O(1)",
                .unit = "B/m^3",
                .better = Better::lower,
                .timing = Timing::reported,
                .repetitions = 1,
                .reach = Reach{0.3, "the aim; Minecraft's palettes reach 0.23 on such a valley, measured"},
                .prepare = prepare_packed_memory});
  registry.add({.name = "read_random_packed",
                .what = "reads 524,288 voxels of the packed valley at random positions",
                .unit = "M voxels/s",
                .scale = 1e6,
                .threads = 1,
                .reach = Reach{7, "OpenVDB 10's accessor, measured at random: 7 to 12 M/s"},
                .prepare = prepare_packed_reads});
  registry.add({.name = "pack",
                .what = "packs the valley by palette",
                .unit = "G voxels/s",
                .scale = 1e9,
                .threads = 1,
                .repetitions = 5,
                .reach = Reach{1, "OpenVDB 10's raw leaf buffers, measured: 0.97 to 0.99 G/s"},
                .prepare = prepare_pack});
  registry.add({.name = "save_edit",
                .what = "saves the valley after an edit of 1,000,000 voxels, synced to disk",
                .unit = "ms",
                .better = Better::lower,
                .timing = Timing::milliseconds,
                .repetitions = 7,
                .reach = Reach{200, "the aim: unnoticed beside the edits themselves"},
                .prepare = [](BenchContext& c) { return prepare_save_edit(c, false); }});
  registry.add({.name = "save_scattered",
                .what = "saves the valley after 1,000,000 single voxels at random in 256^3 of it, again and again",
                .unit = "ms",
                .better = Better::lower,
                .timing = Timing::milliseconds,
                .repetitions = 7,
                .reach = Reach{200, "the same as for an edit in one piece"},
                .prepare = [](BenchContext& c) { return prepare_save_edit(c, true); }});
  registry.add({.name = "save_stall",
                .what = "what beginning that save takes on the thread that edits",
                .unit = "ms",
                .better = Better::lower,
                .timing = Timing::reported,
                .repetitions = 7,
                .reach = Reach{16, "a frame at 60 a second"},
                .prepare = prepare_save_stall});
  registry.add({.name = "open_large",
                .what = "opens a save of 524,288 regions, 65,536 x 65,536 m, to the first region",
                .unit = "ms",
                .better = Better::lower,
                .timing = Timing::milliseconds,
                .repetitions = 7,
                .reach = Reach{100, "the aim: at once, whatever the size"},
                .prepare = prepare_open_large});
  registry.add({.name = "flight_stall",
                .what = "longest frame of a flight of 60 km at 100 m/s, on the thread that flies",
                .unit = "ms",
                .better = Better::lower,
                .timing = Timing::reported,
                .repetitions = 1,
                .reach = Reach{16, "a frame at 60 a second"},
                .prepare = [](BenchContext& c) {
                  return prepare_flight(c, [](const FlightReport& r) { return r.longest_stall_ms; });
                }});
  registry.add({.name = "flight_memory",
                .what = "most memory that flight takes of the process, under a budget of 2 GiB",
                .unit = "MiB",
                .better = Better::lower,
                .timing = Timing::reported,
                .repetitions = 1,
                .reach = Reach{2048, "the budget asked for"},
                .prepare = [](BenchContext& c) {
                  return prepare_flight(c, [](const FlightReport& r) {
                    const double more =
                        static_cast<double>(r.most_resident_bytes) - static_cast<double>(r.resident_bytes_before);
                    return more / (1 << 20);
                  });
                }});
  registry.add({.name = "flight_held_radius",
                .what = "least distance to a region that was not there yet, in any frame of that flight; 512 m wanted",
                .unit = "m",
                .timing = Timing::reported,
                .repetitions = 1,
                .reach = Reach{256, "the view distance of the rasterizer's first milestone"},
                .prepare = [](BenchContext& c) {
                  return prepare_flight(c, [](const FlightReport& r) { return r.least_held_radius_m; });
                }});
}

}  // namespace tools
