/// Visible faces: masks of the valley, one chunk of terrain from masks to rectangles, an edit, sealed cavities.
#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "render/extract/cavities.h"
#include "render/extract/extractor.h"
#include "render/extract/greedy.h"
#include "tools/bench/benchmark.h"
#include "tools/bench/world_copy.h"
#include "world/gen/noise.h"

namespace tools {

namespace {

using render::FaceSource;
using world::BlockId;
using world::kFaces;
using world::LeafPos;
using world::MaskKind;
using world::VoxelPos;
using world::World;

FaceSource source_of(const World& w) {
  return {&w.store, &w.store.masks(MaskKind::occupied), &w.store.masks(MaskKind::opaque), nullptr};
}

std::shared_ptr<render::Extractor> extracted(const World& w, bool merge) {
  auto extractor = std::make_shared<render::Extractor>();
  extractor->rebuild(world::WorldView(w), {merge, true});
  return extractor;
}

/// Face masks of every chunk of the valley. `dense` counts all voxels of the chunks as work, else only those of the
/// leaves that had to be looked at one by one.
Result<Prepared> prepare_masks(BenchContext& context, bool dense) {
  TRY(const World* valley, context.world("valley"));
  const FaceSource source = source_of(*valley);
  const auto totals = [=] { return render::count_visible_faces(source); };
  return Prepared{.ours = {"leaf masks",
                           [=] {
                             const render::FaceTotals t = totals();
                             keep(t.faces);
                             return static_cast<double>(dense ? t.voxels_dense : t.leaves * world::kLeafVoxels);
                           }},
                  .counters =
                      [=] {
                        const render::FaceTotals t = totals();
                        return std::map<std::string, double>{{"faces", static_cast<double>(t.faces)},
                                                             {"leaves", static_cast<double>(t.leaves)},
                                                             {"voxels", static_cast<double>(t.voxels_dense)}};
                      },
                  .check = [=]() -> Status {
                    uint64_t records = 0;
                    const auto extractor = extracted(*valley, false);
                    for (const auto* chunk : extractor->chunks()) records += chunk->records.size();
                    if (records == totals().faces) return {};
                    return world::input_error(fmt::format("{} faces counted, {} listed", totals().faces, records));
                  }};
}

/// A chunk of hills by density noise over a flat floor, three blocks, with the terrain that goes on around it.
struct TerrainChunk {
  static constexpr int kSize = 64, kPadded = 66;
  std::vector<uint8_t> bytes;             // padded by one voxel on each side, x slowest, z fastest
  std::vector<BlockId> ids;               // by leaf, then by voxel
  std::vector<world::LeafBlocks> blocks;  // by slot of `faces`
  world::MaskVolume opaque;
  render::ChunkFaces faces;

  static size_t at(int x, int y, int z) {
    return (static_cast<size_t>(x + 1) * kPadded + static_cast<size_t>(y + 1)) * kPadded + static_cast<size_t>(z + 1);
  }

  TerrainChunk() : bytes(size_t{kPadded} * kPadded * kPadded), ids(size_t{512} * 512) {
    constexpr int kMargin = 8, kLine = kSize + 2 * kMargin;
    std::vector<int32_t> density(size_t{kLine} * kLine * kLine);
    const auto at_line = [&](int x, int y) {
      return (static_cast<size_t>(x) * kLine + static_cast<size_t>(y)) * kLine;
    };
    for (int x = 0; x < kLine; ++x)
      for (int y = 0; y < kLine; ++y)
        for (int octave = 0; octave < 4; ++octave) {
          std::array<int32_t, kLine> row;
          world::noise3_row(77 + static_cast<uint64_t>(octave), 7 - octave, 7 - octave, x + 1000, y, 2000, 1, kLine,
                            row.data());
          for (size_t z = 0; z < kLine; ++z) density[at_line(x, y) + z] += row[z] >> octave;
        }
    const auto block = [&](int x, int y, int z) -> uint8_t {
      const auto solid = [&](int v) {
        if (v >= kSize + kMargin) return false;
        const size_t i = at_line(x + kMargin, v + kMargin) + static_cast<size_t>(z + kMargin);
        return (density[i] + 2400) * 12 > v * 1024;
      };
      if (solid(y)) return solid(y + 1) ? 2 : 3;
      return y < 25 ? 1 : 0;
    };
    for (int lx = -1; lx <= 8; ++lx)
      for (int ly = -1; ly <= 8; ++ly)
        for (int lz = -1; lz <= 8; ++lz) {
          world::LeafMask mask;
          for (int i = 0; i < world::kLeafVoxels; ++i) {
            const VoxelPos o = world::offset_in_leaf(i), v{lx * 8 + o.x, ly * 8 + o.y, lz * 8 + o.z};
            const uint8_t id = block(v.x, v.y, v.z);
            if (id) mask.set(i);
            if (std::min({v.x, v.y, v.z}) >= -1 && std::max({v.x, v.y, v.z}) <= kSize) bytes[at(v.x, v.y, v.z)] = id;
            if (std::min({lx, ly, lz}) >= 0 && std::max({lx, ly, lz}) < 8)
              ids[static_cast<size_t>(render::index_in_chunk({lx, ly, lz})) * 512 + static_cast<size_t>(i)] = id;
          }
          opaque.set_leaf({lx, ly, lz}, mask);
        }
    extract(faces);
    for (const uint16_t leaf : faces.leaf) blocks.push_back({&ids[size_t{leaf} * 512], 0});
  }
  void extract(render::ChunkFaces& out) const {
    extract_chunk_faces({nullptr, &opaque, &opaque}, nullptr, {0, 0, 0}, out);
  }
};

struct Quads {
  uint64_t quads = 0, faces = 0;
};

/// The rival: a byte a voxel, slice by slice, greedy. As most games did it.
/// source  Mikola Lysenko. Meshing in a Minecraft Game. 2012
Quads mesh_bytes(const TerrainChunk& chunk, std::vector<render::FaceRecord>& out) {
  constexpr int kSize = TerrainChunk::kSize;
  Quads result;
  out.clear();
  std::array<uint8_t, size_t{kSize} * kSize> slice;
  for (int f = 0; f < kFaces; ++f) {
    const int axis = world::face_axis(f), u = axis == 2 ? 1 : 2, v = axis == 0 ? 1 : 0;
    const std::ptrdiff_t stride[3] = {TerrainChunk::kPadded * TerrainChunk::kPadded, TerrainChunk::kPadded, 1};
    const std::ptrdiff_t beyond = stride[axis] * world::face_sign(f);
    for (int p = 0; p < kSize; ++p) {
      const uint8_t* const first = chunk.bytes.data() + TerrainChunk::at(0, 0, 0) + p * stride[axis];
      for (int j = 0; j < kSize; ++j) {
        const uint8_t* const row = first + j * stride[v];
        for (int i = 0; i < kSize; ++i) {
          const uint8_t id = row[i * stride[u]];
          const bool hidden = row[i * stride[u] + beyond] != 0;
          slice[static_cast<size_t>(j * kSize + i)] = hidden ? 0 : id;
        }
      }
      for (int j = 0; j < kSize; ++j)
        for (int i = 0; i < kSize;) {
          const uint8_t id = slice[static_cast<size_t>(j * kSize + i)];
          if (id == 0) {
            ++i;
            continue;
          }
          int width = 1, height = 1;
          while (i + width < kSize && slice[static_cast<size_t>(j * kSize + i + width)] == id) ++width;
          for (bool goes_on = true; goes_on && j + height < kSize; height += goes_on)
            for (int k = 0; k < width && goes_on; ++k)
              goes_on = slice[static_cast<size_t>((j + height) * kSize + i + k)] == id;
          for (int h = 0; h < height; ++h)
            for (int k = 0; k < width; ++k) slice[static_cast<size_t>((j + h) * kSize + i + k)] = 0;
          VoxelPos at;
          at[axis] = p, at[u] = i, at[v] = j;
          const auto n = [](int value) { return static_cast<uint32_t>(value); };
          out.push_back(render::make_face_record(n(at.x), n(at.y), n(at.z), n(width), n(height), n(f), id));
          result.faces += static_cast<uint64_t>(width * height);
          i += width;
        }
    }
  }
  result.quads = out.size();
  return result;
}

enum class Stage { masks, merge, both };

Result<Prepared> prepare_chunk(BenchContext& context, Stage stage) {
  const auto chunk = context.shared<TerrainChunk>("extract/chunk", [] { return std::make_shared<TerrainChunk>(); });
  const auto faces = std::make_shared<render::ChunkFaces>();
  const auto records = std::make_shared<render::ChunkRecords>();
  const auto theirs = std::make_shared<std::vector<render::FaceRecord>>();
  const auto ours = [=] {
    if (stage != Stage::merge) chunk->extract(*faces);
    if (stage != Stage::masks) merge_faces(stage == Stage::merge ? chunk->faces : *faces, chunk->blocks, *records);
    return Quads{records->records.size(), records->faces};
  };
  const auto naive = [=] { return mesh_bytes(*chunk, *theirs); };
  const auto timed = [](auto work) {
    return [=] {
      keep(work().quads);
      return 1.0;
    };
  };
  Prepared prepared{.ours = {"leaf masks", timed(ours)}, .counters = [=] {
                      merge_faces(chunk->faces, chunk->blocks, *records);
                      return std::map<std::string, double>{{"faces", static_cast<double>(chunk->faces.count())},
                                                           {"quads", static_cast<double>(records->records.size())},
                                                           {"quads_byte_loop", static_cast<double>(naive().quads)},
                                                           {"leaves", static_cast<double>(chunk->faces.leaf.size())}};
                    }};
  if (stage == Stage::masks) return prepared;
  prepared.rivals = {{"byte loop", timed(naive)}};
  prepared.check = [=]() -> Status {
    const Quads a = ours(), b = naive();
    if (a.faces == b.faces && a.quads <= b.quads) return {};
    return world::input_error(
        fmt::format("{} faces in {} quads, the byte loop has {} in {}", a.faces, a.quads, b.faces, b.quads));
  };
  return prepared;
}

/// A copy of the 256^3 voxels in the middle of the valley, to be edited, and what follows it.
struct EditedWorld {
  World world;
  render::Extractor extractor;
  int subscriber;
  std::vector<LeafPos> dirty;
  std::vector<VoxelPos> surface;
  size_t turn = 0;
  render::ExtractReport last;

  explicit EditedWorld(const World& from)
      : world(copy_regions(from, {-1, INT32_MIN, -1}, {0, INT32_MAX, 0})), subscriber(world.store.subscribe()) {
    extractor.rebuild(world::WorldView(world), {});
    // The highest voxel of columns all over.
    const world::VoxelBox box = world.store.bounds();
    for (int i = 0; i < 64; ++i) {
      VoxelPos v{box.min.x + 17 + i * 37 % 220, box.max.y, box.min.z + 11 + i * 91 % 220};
      while (v.y > box.min.y && world.store.get(v) == world::kAir) --v.y;
      surface.push_back(v);
    }
    world.store.take_dirty(subscriber);
  }
  void edit() {
    // Each place is dug, and at the next round filled again.
    const VoxelPos v = surface[turn % surface.size()];
    world::EditBatch batch;
    batch.set(v, turn / surface.size() % 2 == 0 ? world::kAir : BlockId{1});
    ++turn;
    const auto applied = world.store.apply(batch);
    CHECK(applied.ok());
    dirty = world.store.take_dirty(subscriber);
  }
  void update() { last = extractor.update(world::WorldView(world), dirty); }
};

Result<Prepared> prepare_edit(BenchContext& context, bool masks_only) {
  TRY(const World* valley, context.world("valley"));
  const auto edited = std::make_shared<EditedWorld>(*valley);
  const auto update = [=] {
    if (masks_only) {
      const FaceSource source = source_of(edited->world);
      world::StoreReader reader(edited->world.store);
      for (const LeafPos l : edited->dirty) {
        keep(extract_leaf_faces(source, &reader, l));
        for (int f = 0; f < kFaces; ++f) {
          const VoxelPos s = world::face_step(f);
          keep(extract_leaf_faces(source, &reader, {l.x + s.x, l.y + s.y, l.z + s.z}));
        }
      }
    } else {
      edited->update();
    }
    return 1.0;
  };
  return Prepared{
      .ours = {masks_only ? "seven leaves" : "seven leaves and their chunks", update, [=] { edited->edit(); }},
      .check = [=]() -> Status {
        if (masks_only) return {};
        edited->edit();
        update();
        render::Extractor anew;
        const render::ExtractReport all = anew.rebuild(world::WorldView(edited->world), {});
        if (edited->last.faces == all.faces && edited->last.quads == all.quads) return {};
        return world::input_error(fmt::format("{} quads after edits, {} anew", edited->last.quads, all.quads));
      }};
}

Result<Prepared> prepare_valley(BenchContext& context, bool merge) {
  TRY(const World* valley, context.world("valley"));
  return Prepared{.ours = {merge ? "rectangles" : "unit faces",
                           [=] {
                             keep(extracted(*valley, merge)->chunks().size());
                             return 1.0;
                           }},
                  .counters = [=] {
                    const auto extractor = extracted(*valley, merge);
                    double quads = 0;
                    for (const auto* chunk : extractor->chunks()) quads += static_cast<double>(chunk->records.size());
                    return std::map<std::string, double>{{"quads", quads},
                                                         {"chunks", static_cast<double>(extractor->chunks().size())},
                                                         {"bytes", static_cast<double>(extractor->bytes())}};
                  }};
}

Result<Prepared> prepare_cavities(BenchContext& context) {
  TRY(const World* valley, context.world("valley"));
  const world::MaskVolume& opaque = valley->store.masks(MaskKind::opaque);
  return Prepared{.ours = {"leaf flood",
                           [&opaque] {
                             keep(render::find_sealed_cavities(opaque).bytes());
                             return 1.0;
                           }},
                  .counters = [&opaque] {
                    const auto sealed = static_cast<double>(render::find_sealed_cavities(opaque).count());
                    return std::map<std::string, double>{{"voxels_sealed", sealed}};
                  }};
}

}  // namespace

void add_suite_extract(Registry& registry) {
  constexpr double kMicroseconds = 1e-3;
  const char* const mesher =
      "cgerikj/binary-greedy-meshing af8c688, 62^3 terrain of 6,124 faces: 87 to 92 us, 2,191 quads";
  registry.add({.name = "face_masks",
                .what = "face masks of the valley, made and counted; all voxels of the chunks that hold any block",
                .unit = "G voxels/s",
                .scale = 1e9,
                .threads = 1,
                .reach = Reach{10, "a prototype of plain 64-bit masks did every voxel of a dense array at 15.9"},
                .prepare = [](BenchContext& c) { return prepare_masks(c, true); }});
  registry.add({.name = "face_masks_surface",
                .what = "the same, counting only voxels of leaves that had to be looked at, water and plants included",
                .unit = "G voxels/s",
                .scale = 1e9,
                .threads = 1,
                .reach = Reach{10, "as much as with inner and empty leaves counted: 51 ns a leaf"},
                .prepare = [](BenchContext& c) { return prepare_masks(c, false); }});
  registry.add({.name = "chunk",
                .what = "one 64^3 chunk of terrain from opaque masks to merged records",
                .unit = "us",
                .better = Better::lower,
                .timing = Timing::milliseconds,
                .scale = kMicroseconds,
                .threads = 1,
                .reach = Reach{89, mesher},
                .prepare = [](BenchContext& c) { return prepare_chunk(c, Stage::both); }});
  registry.add({.name = "chunk_merge",
                .what = "the same chunk from face masks to merged records",
                .unit = "us",
                .better = Better::lower,
                .timing = Timing::milliseconds,
                .scale = kMicroseconds,
                .threads = 1,
                .reach = Reach{30, "a third of the best known mesher's time, which includes its culling"},
                .prepare = [](BenchContext& c) { return prepare_chunk(c, Stage::merge); }});
  registry.add({.name = "chunk_masks",
                .what = "the same chunk from opaque masks to face masks",
                .unit = "us",
                .better = Better::lower,
                .timing = Timing::milliseconds,
                .scale = kMicroseconds,
                .threads = 1,
                .reach = Reach{15, "culling alone of cgerikj/binary-greedy-meshing, 62^3"},
                .limit = Reach{2.2, "six masks and counts of a dense 62^3 by AVX-512, output not stored; measured"},
                .prepare = [](BenchContext& c) { return prepare_chunk(c, Stage::masks); }});
  registry.add({.name = "edit_masks",
                .what = "face masks of the leaf of a dug voxel and of its six neighbours",
                .unit = "us",
                .better = Better::lower,
                .timing = Timing::milliseconds,
                .scale = kMicroseconds,
                .threads = 1,
                .reach = Reach{3, "seven leaves at 10 ns, and finding them"},
                .prepare = [](BenchContext& c) { return prepare_edit(c, true); }});
  registry.add({.name = "edit",
                .what = "the valley's faces after one voxel is dug: seven leaves, and their chunks merged again",
                .unit = "us",
                .better = Better::lower,
                .timing = Timing::milliseconds,
                .scale = kMicroseconds,
                .threads = 1,
                .reach = Reach{89, mesher},
                .prepare = [](BenchContext& c) { return prepare_edit(c, false); }});
  registry.add({.name = "valley",
                .what = "all faces of the valley as merged records",
                .unit = "ms",
                .better = Better::lower,
                .timing = Timing::milliseconds,
                .prepare = [](BenchContext& c) { return prepare_valley(c, true); }});
  registry.add({.name = "valley_unmerged",
                .what = "all faces of the valley, one record each",
                .unit = "ms",
                .better = Better::lower,
                .timing = Timing::milliseconds,
                .prepare = [](BenchContext& c) { return prepare_valley(c, false); }});
  registry.add({.name = "cavities",
                .what = "the valley's sealed cavities, by a flood from outside",
                .unit = "ms",
                .better = Better::lower,
                .timing = Timing::milliseconds,
                .threads = 1,
                .prepare = prepare_cavities});
}

}  // namespace tools
