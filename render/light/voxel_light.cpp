#include "render/light/voxel_light.h"

#include <algorithm>
#include <bit>

#include "world/base/jobs.h"

namespace render {

using world::LeafPos;
using world::VoxelPos;

namespace {

/// Voxels from one of the irradiance's box to the box's end, itself among them; 0 outside of it.
int voxels_to_end(const world::SurfaceIrradiance& irradiance, VoxelPos v, int face) {
  int to_end = 0;
  for (int a = 0; a < 3; ++a) {
    const int at = v[a] - irradiance.low[a] * world::kLeafSize,
              size = irradiance.size[static_cast<size_t>(a)] * world::kLeafSize;
    if (at < 0 || at >= size) return 0;
    if (a == world::face_axis(face)) to_end = world::face_sign(face) > 0 ? size - at : at + 1;
  }
  return to_end;
}

}  // namespace

VoxelCodes::VoxelCodes(const world::WorldView& view, const WorldLight& light, SurfaceLight::Kind kind)
    : levels_(light.levels),
      irradiance_(light.irradiance),
      occupied_(view.masks(world::MaskKind::occupied)),
      opaque_(view.masks(world::MaskKind::opaque)),
      kind_(kind) {}

uint32_t VoxelCodes::outside() const {
  if (kind_ != SurfaceLight::Kind::levels) return SurfaceLight::kUnknown;
  const auto sky = static_cast<uint8_t>(levels_->sky_level());
  return light_code(world::LightSample{.sky = {sky, sky, sky}, .block = {}});
}

uint32_t VoxelCodes::code(VoxelPos v, int face) const {
  if (opaque_.test(v)) return shared::kLightClosed;
  if (kind_ == SurfaceLight::Kind::levels) {
    const uint32_t code = light_code(levels_->sample(v));
    // Stairs and the like stop light as whole blocks do.
    return code == 0 && occupied_.test(v) ? shared::kLightClosed : code;
  }
  const int inwards = world::opposite_face(face);
  return wall_code(*irradiance_, v, face, voxels_to_end(*irradiance_, v, inwards));
}

std::vector<world::RegionPos> VoxelCodes::regions() const {
  if (kind_ == SurfaceLight::Kind::levels) return levels_->sky().regions().positions();
  std::vector<world::RegionPos> all;
  if (kind_ != SurfaceLight::Kind::irradiance || irradiance_->leaves.empty()) return all;
  const LeafPos low = irradiance_->low,
                high = low + LeafPos{irradiance_->size[0] - 1, irradiance_->size[1] - 1, irradiance_->size[2] - 1};
  const world::RegionPos first = world::region_from_leaf(low), last = world::region_from_leaf(high);
  for (int x = first.x; x <= last.x; ++x)
    for (int y = first.y; y <= last.y; ++y)
      for (int z = first.z; z <= last.z; ++z) all.push_back({x, y, z});
  return all;
}

PointLight light_at_point(const SurfaceLightDecoder& decoder, LightInterpolation interpolation,
                          const VoxelCodes& voxels, const world::WorldPoint& point, const world::Vec3d& normal,
                          const Rgb& sky) {
  const world::WorldPoint first = point + world::Vec3d(-0.5);
  const glm::vec3 place(first.fraction), n(normal), whole(sky.r, sky.g, sky.b);
  const auto voxel_of = [&](int i) { return first.voxel + VoxelPos{i & 1, i >> 1 & 1, i >> 2}; };
  const auto light_in = [&](int i) {
    const auto decoded = [&](int face) {
      const Rgb c = decoder.under(voxels.code(voxel_of(i), face), sky);
      return glm::vec3(c.r, c.g, c.b);
    };
    if (voxels.per_voxel() == 1) return decoded(0);
    glm::vec3 lit = whole;
    for (int a = 0; a < 3; ++a) lit += n[a] * n[a] * (decoded(2 * a + (n[a] > 0)) - whole);
    return lit;
  };
  const auto clear_of = [&](uint32_t which) {
    uint32_t clear = 0;
    for (; which; which &= which - 1)
      if (!voxels.closed(voxel_of(std::countr_zero(which)))) clear |= which & -which;
    return clear;
  };
  const bool linear = interpolation != LightInterpolation::face;
  uint32_t clear = clear_of(linear ? 0xffu : 1u << shared::own_voxel(place));
  if (!linear && clear == 0) clear = clear_of(0xff);
  if (clear == 0) return {{0, 0, 0}, false};
  const int lit = shared::lit_voxel(clear, place);
  const glm::vec3 own = light_in(lit);
  glm::vec3 sum(0);
  float total = 1e-6f;
  for (uint32_t left = linear ? shared::reached_voxels(clear, lit) : 0; left; left &= left - 1) {
    const int i = std::countr_zero(left);
    const float weight = shared::voxel_weight(place, i);
    sum += weight * (light_in(i) - own);
    total += weight;
  }
  const glm::vec3 light = own + sum / total;
  return {{light.x, light.y, light.z},
          voxels.kind() != SurfaceLight::Kind::levels || sees_whole_sky(voxels.code(voxel_of(lit), 0))};
}

void VoxelLight::clear() { *this = {}; }

bool VoxelLight::follow(const world::WorldView& view, const WorldLight& light, SurfaceLight::Kind kind,
                        std::span<const LeafPos> leaves) {
  patched_.clear();
  const bool same_store = view.store().identity() == store_;
  if (!same_store) store_ = view.store().identity(), block_subscriber_ = view.store().subscribe();
  std::vector<LeafPos> dirty = view.store().take_dirty(block_subscriber_);
  world::LightChange changed;
  changed.all =
      !same_store || kind != kind_ || !std::equal(leaves.begin(), leaves.end(), leaves_.begin(), leaves_.end());
  if (light.changes) {
    if (light.changes->identity() != changes_)
      changes_ = light.changes->identity(), light_subscriber_ = light.changes->subscribe();
    changed.add(light.changes->take(light_subscriber_));
  }
  if (light.version != light_ && (kind == SurfaceLight::Kind::irradiance || !light.changes)) changed.all = true;
  kind_ = kind, light_ = light.version;

  const VoxelCodes voxels(view, light, kind);
  if (changed.all) {
    leaves_.assign(leaves.begin(), leaves.end());
    codes_per_leaf_ = static_cast<uint32_t>(world::kLeafVoxels * voxels.per_voxel());
    codes_.resize(leaves_.size() * codes_per_leaf_);
    world::parallel_for(leaves_.size(), [&](size_t i) { make(voxels, i); });
    return true;
  }
  const auto at_or_after = [&](LeafPos l) { return std::lower_bound(leaves_.begin(), leaves_.end(), l); };
  for (const auto* list : {&dirty, &changed.leaves})
    for (const LeafPos& l : *list)
      if (const auto found = at_or_after(l); found != leaves_.end() && *found == l)
        patched_.push_back(static_cast<uint32_t>(found - leaves_.begin()));
  if (!changed.regions.empty())
    for (size_t i = 0; i < leaves_.size(); ++i)
      if (std::find(changed.regions.begin(), changed.regions.end(), world::region_from_leaf(leaves_[i])) !=
          changed.regions.end())
        patched_.push_back(static_cast<uint32_t>(i));
  std::sort(patched_.begin(), patched_.end());
  patched_.erase(std::unique(patched_.begin(), patched_.end()), patched_.end());
  world::parallel_for(patched_.size(), [&](size_t i) { make(voxels, patched_[i]); });
  return !patched_.empty();
}

void VoxelLight::make(const VoxelCodes& voxels, size_t leaf) {
  uint32_t* out = codes_.data() + leaf * codes_per_leaf_;
  const VoxelPos corner = world::voxel_from_leaf(leaves_[leaf]);
  for (int i = 0; i < world::kLeafVoxels; ++i)
    for (int face = 0; face < voxels.per_voxel(); ++face) *out++ = voxels.code(corner + world::offset_in_leaf(i), face);
}

}  // namespace render
