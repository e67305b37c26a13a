#include "render/extract/liquid_parts.h"

#include <memory>
#include <vector>

#include "render/extract/kernels.h"
#include "render/extract/unit_faces.h"

namespace render {

using namespace world;

void copy_regions(const MaskVolume& from, MaskVolume& to) {
  for (const MaskRegion* region : from.regions()) to.put_region(region->pos, std::make_unique<MaskRegion>(*region));
  to.finish();
}

bool LiquidParts::is_part(const BlockPalette& palette, BlockId block) const {
  return palette[block].phase == Phase::liquid && !(see_through_ && see_through_->contains(block));
}

LeafMask LiquidParts::mask_of(const WorldView& view, LeafPos l) const {
  LeafMask mask;
  const LiquidLevels::Leaf* const levels = levels_ ? levels_->leaf(l) : nullptr;
  if (!levels) return mask;
  const LeafBlocks blocks = view.store().leaf(l);
  for (int i = 0; i < kLeafVoxels; ++i)
    if ((*levels)[static_cast<size_t>(i)] < kFullLevel && is_part(view.palette(), blocks[i])) mask.set(i);
  return mask;
}

void LiquidParts::cut(LeafPos l, const LeafMask& parts, const MaskVolume& occupied, const MaskVolume& opaque) {
  const auto without = [&](const MaskVolume& whole, MaskVolume& cubes) {
    LeafMask mask = whole.leaf(l);
    for (int x = 0; x < kLeafSize; ++x) mask.word[x] &= ~parts.word[x];
    if (!(mask == cubes.leaf(l))) cubes.set_leaf(l, mask);
  };
  without(occupied, occupied_);
  without(opaque, opaque_);
  if (!(parts == parts_.leaf(l))) parts_.set_leaf(l, parts);
}

void LiquidParts::rebuild(const WorldView& view, const LiquidLevels* levels, const SeeThroughKinds* see_through,
                          const MaskVolume& occupied, const MaskVolume& opaque) {
  levels_ = levels, see_through_ = see_through;
  any_ = false;
  occupied_ = {}, opaque_ = {}, parts_ = {};
  if (!levels_) return;
  for (const auto& [leaf, leaf_levels] : levels_->leaves()) {
    const LeafMask parts = mask_of(view, leaf);
    if (parts.is_none()) continue;
    if (!any_) copy_regions(occupied, occupied_), copy_regions(opaque, opaque_);
    any_ = true;
    cut(leaf, parts, occupied, opaque);
  }
}

bool LiquidParts::update(const WorldView& view, std::span<const LeafPos> dirty, const MaskVolume& occupied,
                         const MaskVolume& opaque) {
  if (!levels_ || (!any_ && !levels_->any())) return true;
  for (const LeafPos l : dirty) {
    const LeafMask parts = mask_of(view, l);
    if (!any_ && !parts.is_none()) return false;
    if (any_) cut(l, parts, occupied, opaque);
  }
  return true;
}

std::vector<LeafPos> LiquidParts::concerned(const WorldView& view, std::span<const LeafPos> moved) const {
  std::vector<LeafPos> all;
  for (const LeafPos l : moved)
    if ((any_ && !parts_.leaf(l).is_none()) || !mask_of(view, l).is_none()) all.push_back(l);
  return all;
}

bool LiquidParts::in_chunk(const WorldView&, ChunkPos chunk) const {
  if (!any_) return false;
  for (int index = 0; index < kLeavesPerChunk; ++index)
    if (!parts_.leaf(leaf_in_chunk(chunk, index)).is_none()) return true;
  return false;
}

void LiquidParts::add_faces(const WorldView& view, ChunkPos chunk, bool merge_faces, ChunkRecords& out) const {
  if (!in_chunk(view, chunk)) return;
  std::vector<UnitFace> units;
  StoreReader reader(view.store());
  for (int index = 0; index < kLeavesPerChunk; ++index) {
    const LeafPos leaf = leaf_in_chunk(chunk, index);
    const LeafMask& parts = parts_.leaf(leaf);
    if (parts.is_none()) continue;
    for (int x = 0; x < kLeafSize; ++x)
      for (uint64_t bits = parts.word[x]; bits != 0; bits &= bits - 1) {
        const int i = x << 6 | __builtin_ctzll(bits);
        const VoxelPos voxel = voxel_from_leaf(leaf) + offset_in_leaf(i), in_chunk = voxel - voxel_from_chunk(chunk);
        const BlockId own = reader.get(voxel);
        const auto level = static_cast<uint8_t>(levels_->at(voxel));
        for (int f = 0; f < kFaces; ++f) {
          const VoxelPos there = voxel + face_step(f);
          const PlaneAxes& axes = kPlaneAxes[face_axis(f)];
          const auto at = [&](int a) { return static_cast<uint8_t>(in_chunk[a]); };
          UnitFace unit{own, static_cast<uint8_t>(f), at(axes.plane), at(axes.row), at(axes.bit)};
          if (f != kFaceNegY) unit.top = level;
          if (f != kFacePosY) {
            const bool part = parts_.test(there);
            if (!part && (opaque_.test(there) || reader.get(there) == own)) continue;
            if (part && face_axis(f) != 1) unit.bottom = static_cast<uint8_t>(levels_->at(there));
            if (unit.bottom >= unit.top) continue;
          }
          units.push_back(unit);
        }
      }
  }
  ChunkRecords parts;
  merge_units(
      units, merge_faces, [](uint32_t key, uint32_t upper) { return key | upper << 19; }, parts);
  ChunkRecords both;
  for (int f = 0; f < kFaces; ++f) {
    const auto d = static_cast<size_t>(f);
    both.first[d] = static_cast<uint32_t>(both.records.size());
    for (const ChunkRecords* from :
         {static_cast<const ChunkRecords*>(&out), static_cast<const ChunkRecords*>(&parts)}) {
      const std::span<const FaceRecord> records = from->of_direction(f);
      both.records.insert(both.records.end(), records.begin(), records.end());
      if (!from->bounds[d].empty()) both.bounds[d].include(from->bounds[d]);
    }
    if (!both.bounds[d].empty()) both.all_bounds.include(both.bounds[d]);
  }
  both.first[kFaces] = static_cast<uint32_t>(both.records.size());
  both.faces = out.faces + parts.faces;
  out = std::move(both);
}

}  // namespace render
