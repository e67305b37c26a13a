/// Integer coordinates and spaces. A world point is a voxel coordinate plus a fraction, never one float.
///
/// Right-handed, y up, one voxel is one metre unless the scene says otherwise.
///   voxel   (x, y, z), int32, within +-kWorldBorder
///   leaf    8^3 voxels   = voxel >> 3      the unit of masks, edits and dirtiness
///   region  128^3 voxels = voxel >> 7      the unit of generation, census and saving (16^3 leaves)
/// In a leaf the voxel (x, y, z) has the index x*64 + y*8 + z: word x of a LeafMask, bit y*8 + z (OpenVDB's order).
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>

#include "world/base/random.h"

namespace world {

constexpr int kLeafLog2 = 3, kLeafSize = 8, kLeafVoxels = 512;
constexpr int kRegionLog2 = 7, kRegionSize = 128;
constexpr int kRegionLeavesLog2 = 4, kRegionLeaves = 16, kLeavesPerRegion = 4096;
/// No voxel lies outside [-kWorldBorder, kWorldBorder): OpenVDB's own arithmetic wraps near 2^31.
constexpr int32_t kWorldBorder = (1 << 30) - 4096;

template <class Space>
struct IntPos {
  int32_t x = 0, y = 0, z = 0;
  friend constexpr auto operator<=>(const IntPos&, const IntPos&) = default;
  friend constexpr IntPos operator+(IntPos a, IntPos b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend constexpr IntPos operator-(IntPos a, IntPos b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  constexpr int32_t operator[](int axis) const { return axis == 0 ? x : axis == 1 ? y : z; }
  constexpr int32_t& operator[](int axis) { return axis == 0 ? x : axis == 1 ? y : z; }
};
using VoxelPos = IntPos<struct VoxelSpace>;
using LeafPos = IntPos<struct LeafSpace>;
using RegionPos = IntPos<struct RegionSpace>;

constexpr LeafPos leaf_from_voxel(VoxelPos v) { return {v.x >> kLeafLog2, v.y >> kLeafLog2, v.z >> kLeafLog2}; }
constexpr RegionPos region_from_voxel(VoxelPos v) {
  return {v.x >> kRegionLog2, v.y >> kRegionLog2, v.z >> kRegionLog2};
}
constexpr RegionPos region_from_leaf(LeafPos l) {
  return {l.x >> kRegionLeavesLog2, l.y >> kRegionLeavesLog2, l.z >> kRegionLeavesLog2};
}
constexpr VoxelPos voxel_from_leaf(LeafPos l) { return {l.x * kLeafSize, l.y * kLeafSize, l.z * kLeafSize}; }
constexpr VoxelPos voxel_from_region(RegionPos r) { return {r.x * kRegionSize, r.y * kRegionSize, r.z * kRegionSize}; }
constexpr LeafPos leaf_from_region(RegionPos r) {
  return {r.x * kRegionLeaves, r.y * kRegionLeaves, r.z * kRegionLeaves};
}
/// 0..511, x*64 + y*8 + z.
constexpr int index_in_leaf(VoxelPos v) { return (v.x & 7) << 6 | (v.y & 7) << 3 | (v.z & 7); }
constexpr VoxelPos offset_in_leaf(int index) { return {index >> 6, index >> 3 & 7, index & 7}; }
/// 0..4095, x*256 + y*16 + z.
constexpr int index_in_region(LeafPos l) { return (l.x & 15) << 8 | (l.y & 15) << 4 | (l.z & 15); }
constexpr LeafPos leaf_offset_in_region(int index) { return {index >> 8, index >> 4 & 15, index & 15}; }

constexpr bool inside_world(VoxelPos v) {
  const auto in = [](int32_t c) { return c >= -kWorldBorder && c < kWorldBorder; };
  return in(v.x) && in(v.y) && in(v.z);
}

/// Inclusive voxel bounds; empty where max < min.
struct VoxelBox {
  VoxelPos min{0, 0, 0}, max{-1, -1, -1};
  constexpr bool empty() const { return max.x < min.x || max.y < min.y || max.z < min.z; }
  constexpr bool contains(VoxelPos v) const {
    return v.x >= min.x && v.x <= max.x && v.y >= min.y && v.y <= max.y && v.z >= min.z && v.z <= max.z;
  }
  constexpr void include(VoxelPos v) {
    if (empty()) {
      min = max = v;
      return;
    }
    for (int a = 0; a < 3; ++a) {
      if (v[a] < min[a]) min[a] = v[a];
      if (v[a] > max[a]) max[a] = v[a];
    }
  }
  constexpr void include(const VoxelBox& b) {
    if (!b.empty()) include(b.min), include(b.max);
  }
  /// Voxels inside; 64 bits hold any box within the world's border only up to 2^64, so it saturates.
  constexpr uint64_t volume() const {
    if (empty()) return 0;
    const unsigned __int128 v = static_cast<unsigned __int128>(int64_t{max.x} - min.x + 1) *
                                static_cast<uint64_t>(int64_t{max.y} - min.y + 1) *
                                static_cast<uint64_t>(int64_t{max.z} - min.z + 1);
    return v > UINT64_MAX ? UINT64_MAX : static_cast<uint64_t>(v);
  }
  friend constexpr bool operator==(const VoxelBox&, const VoxelBox&) = default;
};

/// The six faces of a voxel, in the order in which every table of the program lists them.
enum Face : int { kFaceNegX = 0, kFacePosX, kFaceNegY, kFacePosY, kFaceNegZ, kFacePosZ };
constexpr int kFaces = 6;
constexpr int face_axis(int face) { return face >> 1; }
constexpr int face_sign(int face) { return (face & 1) ? 1 : -1; }
constexpr int opposite_face(int face) { return face ^ 1; }
constexpr VoxelPos face_step(int face) {
  VoxelPos step;
  step[face_axis(face)] = face_sign(face);
  return step;
}

struct PosHash {
  template <class Space>
  size_t operator()(const IntPos<Space>& p) const {
    const uint64_t low = static_cast<uint64_t>(static_cast<uint32_t>(p.x)) << 32 | static_cast<uint32_t>(p.z);
    return mix64(low * 0x9e3779b97f4a7c15ull + static_cast<uint32_t>(p.y));
  }
};

}  // namespace world
