/// Small worlds for the tests of extraction, and brute force to hold it against.
#pragma once

#include <algorithm>
#include <functional>
#include <tuple>
#include <vector>

#include "render/extract/extractor.h"
#include "world/base/random.h"
#include "world/world.h"

namespace render {

using namespace world;

/// A world of a few blocks: 1..3 opaque, 4 and 5 transparent (glass, water).
inline World small_world() {
  World w;
  const auto add = [&](const char* name, bool opaque, Phase phase) {
    Block block;
    block.name = name, block.opaque = opaque, block.phase = phase;
    const auto id = w.palette->add(block);
    CHECK(id.ok());
  };
  add("test_stone", true, Phase::solid);
  add("test_dirt", true, Phase::solid);
  add("test_sand", true, Phase::granular);
  add("test_glass", false, Phase::solid);
  add("test_water", false, Phase::liquid);
  return w;
}
constexpr BlockId kStone = 1, kDirt = 2, kSand = 3, kGlass = 4, kWater = 5;

using BlockAt = std::function<BlockId(VoxelPos)>;

/// Writes f(v) into every voxel of the box, region by region.
inline void fill(World& w, const VoxelBox& box, const BlockAt& f) {
  const RegionPos low = region_from_voxel(box.min), high = region_from_voxel(box.max);
  for (int rx = low.x; rx <= high.x; ++rx)
    for (int ry = low.y; ry <= high.y; ++ry)
      for (int rz = low.z; rz <= high.z; ++rz) {
        RegionBuilder builder({rx, ry, rz});
        for (int l = 0; l < kLeavesPerRegion; ++l) {
          const LeafPos o = leaf_offset_in_region(l);
          const VoxelPos first = voxel_from_leaf({rx * 16 + o.x, ry * 16 + o.y, rz * 16 + o.z});
          if (first.x > box.max.x || first.y > box.max.y || first.z > box.max.z || first.x + 7 < box.min.x ||
              first.y + 7 < box.min.y || first.z + 7 < box.min.z)
            continue;
          std::array<BlockId, kLeafVoxels> ids;
          for (int i = 0; i < kLeafVoxels; ++i) {
            const VoxelPos v = first + offset_in_leaf(i);
            ids[static_cast<size_t>(i)] = box.contains(v) ? f(v) : kAir;
          }
          builder.set_leaf(l, ids);
        }
        w.store.adopt(std::move(builder));
      }
}

inline VoxelBox box_at(VoxelPos min, int size_x, int size_y, int size_z) {
  return {min, {min.x + size_x - 1, min.y + size_y - 1, min.z + size_z - 1}};
}

/// Each voxel air, or one of the first `kinds` blocks.
inline BlockAt random_blocks(uint64_t seed, float density, int kinds) {
  return [=](VoxelPos v) -> BlockId {
    const uint64_t bits = random_bits(seed, v.x, v.y, v.z);
    if (uniform01(bits) >= density) return kAir;
    return static_cast<BlockId>(1 + (bits & 0xffff) % static_cast<uint64_t>(kinds));
  };
}

/// Rolling hills with caves, a lake and layers; heights are about `base`.
inline BlockAt terrain_blocks(VoxelPos origin, int base) {
  return [=](VoxelPos v) -> BlockId {
    const double x = v.x - origin.x, y = v.y - origin.y, z = v.z - origin.z;
    const double height = base + 9 * std::sin(x * 0.11) * std::cos(z * 0.07) + 5 * std::sin((x + 2 * z) * 0.05);
    if (y > height) return y <= base - 5 ? kWater : kAir;
    if (std::sin(x * 0.21) + std::sin(y * 0.33) + std::sin(z * 0.27) > 2.0) return kAir;
    return y > height - 1 ? (y < base - 3 ? kSand : kDirt) : kStone;
  };
}

/// (voxel, direction, block), sorted: what is visible.
using UnitFace = std::tuple<VoxelPos, int, BlockId>;
using UnitFaces = std::vector<UnitFace>;

inline bool face_is_visible(const BlockPalette& palette, BlockId a, BlockId b) {
  if (a == kAir || (b != kAir && palette[b].opaque)) return false;
  if (palette[a].opaque || b == kAir) return true;
  return a > b;
}

/// Every face of every voxel of the box, one by one. `seen` says of a voxel that is not opaque whether it counts.
inline UnitFaces brute_force_faces(const World& w, const VoxelBox& box,
                                   const std::function<bool(VoxelPos)>& seen = {}) {
  UnitFaces all;
  StoreReader reader(w.store);
  for (int x = box.min.x; x <= box.max.x; ++x)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int z = box.min.z; z <= box.max.z; ++z) {
        const VoxelPos v{x, y, z};
        const BlockId a = reader.get(v);
        if (a == kAir) continue;
        for (int f = 0; f < kFaces; ++f) {
          const VoxelPos n = v + face_step(f);
          if (face_is_visible(*w.palette, a, reader.get(n)) && (!seen || seen(n))) all.emplace_back(v, f, a);
        }
      }
  std::sort(all.begin(), all.end());
  return all;
}

/// The unit faces that records cover; a face covered twice appears twice.
inline UnitFaces unit_faces(const Extractor& extractor) {
  UnitFaces all;
  for (const ExtractedChunk* chunk : extractor.chunks())
    for (int f = 0; f < kFaces; ++f)
      for (const FaceRecord& r : chunk->of_direction(f)) {
        const uvec3 p = face_voxel(r.word0);
        CHECK_EQ(face_direction(r.word1), static_cast<uint32_t>(f));
        for (uint32_t v = 0; v < face_height(r.word0); ++v)
          for (uint32_t u = 0; u < face_width(r.word0); ++u) {
            const int axis = face_axis(f);
            VoxelPos at{static_cast<int>(p.x), static_cast<int>(p.y), static_cast<int>(p.z)};
            at[axis == 2 ? 1 : 2] += static_cast<int>(u);
            at[axis == 0 ? 1 : 0] += static_cast<int>(v);
            all.emplace_back(chunk->origin + at, f, static_cast<BlockId>(face_block(r.word1)));
          }
      }
  std::sort(all.begin(), all.end());
  return all;
}

}  // namespace render
