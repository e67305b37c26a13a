#include "render/extract/greedy.h"

#include <algorithm>
#include <deque>
#include <memory>

#include "render/extract/kernels.h"

namespace render {

using namespace world;

void CornerBox::include(const CornerBox& other) {
  for (int a = 0; a < 3; ++a) {
    min[a] = std::min(min[a], other.min[a]);
    max[a] = std::max(max[a], other.max[a]);
  }
}

namespace {

struct Scratch {
  ChunkPlanes planes;
  std::array<const BlockId*, kLeavesPerChunk> ids;  // by index_in_chunk, of leaves with faces
  std::unique_ptr<LeafMask[][3]> equal = std::make_unique<LeafMask[][3]>(kLeavesPerChunk);  // by slot
  std::deque<std::array<BlockId, kLeafVoxels>> uniform;                                     // 512 times one id
  size_t uniform_used = 0;
  std::vector<FaceRecord> records;

  const BlockId* uniform_ids(BlockId id) {
    for (size_t i = 0; i < uniform_used; ++i)
      if (uniform[i][0] == id) return uniform[i].data();
    if (uniform_used == uniform.size()) uniform.emplace_back();
    uniform[uniform_used].fill(id);
    return uniform[uniform_used++].data();
  }
};

/// Compares ids with those of the next voxels along x, y and z.
void compare_ids(const ChunkFaces& faces, ChunkBlocks blocks, Scratch& s) {
  s.uniform_used = 0;
  for (size_t i = 0; i < faces.leaf.size(); ++i)
    s.ids[faces.leaf[i]] = blocks[i].values ? blocks[i].values : s.uniform_ids(blocks[i].uniform);
  for (size_t i = 0; i < faces.leaf.size(); ++i) {
    const int index = faces.leaf[i];
    const BlockId* next[3] = {};
    constexpr int kStep[3] = {64, 8, 1};
    for (int a = 0; a < 3; ++a)
      if (offset_in_leaf(index)[a] < 7 && faces.slot[index + kStep[a]] != ChunkFaces::kNone)
        next[a] = s.ids[index + kStep[a]];
    equal_neighbours(s.ids[index], next, s.equal[i]);
  }
}

/// Bounds of a direction in voxel corners.
CornerBox corner_box(int face, const DirectionExtent& extent) {
  CornerBox box;
  if (extent.planes == 0) return box;
  const PlaneAxes& axes = kPlaneAxes[face_axis(face)];
  const auto set = [&](int axis, uint64_t cells, int low, int high) {
    box.min[axis] = static_cast<uint8_t>(__builtin_ctzll(cells) + low);
    box.max[axis] = static_cast<uint8_t>(63 - __builtin_clzll(cells) + high);
  };
  set(axes.plane, extent.planes, face & 1, face & 1);
  set(axes.row, extent.rows, 0, 1);
  set(axes.bit, extent.bits, 0, 1);
  return box;
}

}  // namespace

void merge_faces(const ChunkFaces& faces, ChunkBlocks blocks, ChunkRecords& out) {
  thread_local const std::unique_ptr<Scratch> scratch = std::make_unique<Scratch>();
  Scratch& s = *scratch;
  compare_ids(faces, blocks, s);
  gather_planes(faces, s.equal.get(), s.planes);
  out.faces = faces.count();
  if (s.records.size() < out.faces + kMergeSlack) s.records.resize(2 * out.faces + kMergeSlack);
  FaceRecord* end = s.records.data();
  out.all_bounds = {};
  for (int f = 0; f < kFaces; ++f) {
    out.first[f] = static_cast<uint32_t>(end - s.records.data());
    DirectionExtent extent;
    end = merge_direction(s.planes, f, end, extent);
    out.bounds[f] = corner_box(f, extent);
    out.all_bounds.include(out.bounds[f]);
  }
  add_blocks(s.records.data(), end, s.ids.data());
  out.first[kFaces] = static_cast<uint32_t>(end - s.records.data());
  out.records.assign(s.records.data(), end);
}

void list_faces(const ChunkFaces& faces, ChunkBlocks blocks, ChunkRecords& out) {
  out.records.clear();
  out.all_bounds = {};
  for (int f = 0; f < kFaces; ++f) {
    out.first[f] = static_cast<uint32_t>(out.records.size());
    CornerBox& box = out.bounds[f];
    box = {};
    // Leaves in the order of their positions, whatever their slots.
    for (int index = 0; index < kLeavesPerChunk; ++index) {
      const uint16_t slot = faces.slot[index];
      if (slot == ChunkFaces::kNone) continue;
      const LeafMask& mask = faces.faces[slot].face[f];
      for (int word = 0; word < 8; ++word) {
        for (uint64_t bits = mask.word[word]; bits != 0; bits &= bits - 1) {
          const int i = word << 6 | __builtin_ctzll(bits);
          const VoxelPos leaf = offset_in_leaf(index), in_leaf = offset_in_leaf(i);
          uint32_t at[3];
          for (int a = 0; a < 3; ++a) {
            at[a] = static_cast<uint32_t>(leaf[a] * 8 + in_leaf[a]);
            const uint32_t low = at[a] + (a == face_axis(f) ? f & 1 : 0),
                           high = at[a] + (a == face_axis(f) ? f & 1 : 1);
            box.min[a] = static_cast<uint8_t>(std::min<uint32_t>(box.min[a], low));
            box.max[a] = static_cast<uint8_t>(std::max<uint32_t>(box.max[a], high));
          }
          out.records.push_back(make_face_record(at[0], at[1], at[2], 1, 1, static_cast<uint32_t>(f), blocks[slot][i]));
        }
      }
    }
    out.all_bounds.include(box);
  }
  out.first[kFaces] = static_cast<uint32_t>(out.records.size());
  out.faces = out.records.size();
}

}  // namespace render
