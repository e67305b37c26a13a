#include "world/store/solid_field.h"

#include <algorithm>
#include <cmath>

#include "world/base/jobs.h"

namespace world {

namespace {

constexpr float kFinite = 1e30f;  // sums and products of a few stay finite

/// Adds the leaves that have cells which reach into this one.
void add_with_lower(LeafPos l, std::vector<LeafPos>& all) {
  for (int i = 0; i < 8; ++i) all.push_back(l - LeafPos{i & 1, i >> 1 & 1, i >> 2});
}

bool has_full_neighbours(const MaskVolume& blocks, LeafPos l) {
  for (int i = 0; i < 27; ++i)
    if (!(blocks.leaf(l + LeafPos{i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1}) == kAllMask)) return false;
  return true;
}

}  // namespace

SolidField::SolidField(const SurfaceField& field, const MaskVolume* blocks) : field_(&field), blocks_(blocks) {}

bool SolidField::read(LeafPos leaf, Values& values) const {
  std::array<float, Contours::kSamples> cube;
  field_->read(leaf, cube);
  const float beyond = field_->beyond();
  const LeafMask* masks[8];
  for (int i = 0; i < 8; ++i)
    masks[i] = blocks_ ? &blocks_->leaf(leaf + LeafPos{i & 1, i >> 1 & 1, i >> 2}) : &kNoneMask;
  const bool fog = field_->fog();
  uint32_t inside = 0;
  for (int x = 0; x < kAlong; ++x)
    for (int y = 0; y < kAlong; ++y) {
      const auto row = [&](int z) { return masks[x >> 3 | (y >> 3) << 1 | z << 2]->word[x & 7] >> 8 * (y & 7) & 0xff; };
      const auto bits = static_cast<uint32_t>(row(0) | (row(1) & 1) << 8);
      const float* in = &cube[static_cast<size_t>(((x + 1) * Contours::kAlong + y + 1) * Contours::kAlong + 1)];
      float* out = &values[static_cast<size_t>((x * kAlong + y) * kAlong)];
      for (int z = 0; z < kAlong; ++z) {
        const bool block = bits >> z & 1;
        // Thin fog is no block, so a block there contradicts nothing.
        const bool agree = !blocks_ || (in[z] <= 0) == block || (fog && block);
        const float value = agree && !std::isnan(in[z]) ? in[z] : block ? -beyond : beyond;
        out[z] = std::clamp(value, -kFinite, kFinite);
        inside += out[z] <= 0;
      }
    }
  return inside > 0 && inside < kSamples;
}

std::vector<LeafPos> SolidField::leaves() const {
  std::vector<LeafPos> all;
  for (const LeafPos& l : field_->leaves()) add_with_lower(l, all);
  if (blocks_)
    for (const MaskRegion* region : blocks_->regions())
      for (int i = 0; i < kLeavesPerRegion; ++i) {
        const LeafPos l = leaf_from_region(region->pos) + leaf_offset_in_region(i);
        if (region->leaf_any(l) && !(region->leaf_full(l) && has_full_neighbours(*blocks_, l))) add_with_lower(l, all);
      }
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

std::unique_ptr<SurfaceField> surface_field(const Store& store, float iso) {
  if (const FloatLayer* distance = store.find_layer(Layer::distance)) return level_set_surface(*distance);
  if (const FloatLayer* density = store.find_layer(Layer::density); density && iso > 0)
    return density_surface(*density, iso);
  return nullptr;
}

std::vector<LeafPos> crossed_leaves(const SolidField& field, std::vector<SolidField::Values>& values) {
  const std::vector<LeafPos> all = field.leaves();
  std::vector<LeafPos> crossed;
  values.clear();
  // A batch at a time, so that what isn't crossed takes no memory.
  constexpr size_t kBatch = 256;
  std::vector<SolidField::Values> batch(std::min(kBatch, all.size()));
  std::vector<uint8_t> passes(batch.size());
  for (size_t first = 0; first < all.size(); first += kBatch) {
    const size_t count = std::min(kBatch, all.size() - first);
    parallel_ranges(count, 16, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) passes[i] = field.read(all[first + i], batch[i]);
    });
    for (size_t i = 0; i < count; ++i)
      if (passes[i]) crossed.push_back(all[first + i]), values.push_back(batch[i]);
  }
  return crossed;
}

}  // namespace world
