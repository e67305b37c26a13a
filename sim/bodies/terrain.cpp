#include "sim/bodies/terrain.h"

#include <algorithm>
#include <cmath>

namespace sim {

using world::MaskKind;
using world::VoxelBox;
using world::VoxelPos;

namespace {

constexpr int kFullLiquid = 4096;  // of the layer `liquid`; 0: not active, and full
constexpr double kGravity = 9.81;  // m/s^2

template <class Visit>
bool any_voxel(const VoxelBox& box, const Visit& visit) {
  for (int32_t x = box.min.x; x <= box.max.x; ++x)
    for (int32_t y = box.min.y; y <= box.max.y; ++y)
      for (int32_t z = box.min.z; z <= box.max.z; ++z)
        if (visit(VoxelPos{x, y, z})) return true;
  return false;
}

}  // namespace

BodyTerrain::BodyTerrain(const world::Store& store)
    : own_(std::make_unique<Known>(Known{.store = store})), known_(own_.get()) {
  boxes_.reserve(world::kMostProxyParts);
}

BodyTerrain::BodyTerrain(const Known& known) : known_(&known) {}

void BodyTerrain::refresh() {
  own_->solid = &own_->store.masks(MaskKind::solid), own_->liquid = &own_->store.masks(MaskKind::liquid);
  last_solid_ = {}, last_liquid_ = {};
  const world::BlockPalette& palette = own_->store.palette();
  for (size_t id = own_->filling.size(); id < palette.size(); ++id) {
    const world::Block& block = palette[static_cast<world::BlockId>(id)];
    const world::Proxy* shape = block.proxy.empty() ? nullptr : world::find_proxy(block.proxy);
    own_->shapes.shape.push_back(shape), own_->shapes.fills.push_back(!shape && block.opaque);
    own_->filling.push_back(!shape ? Filling::full : shape->stops_bodies() ? Filling::shaped : Filling::open);
    own_->density.push_back(block.density.value);
  }
}

void BodyTerrain::set_unloaded(world::RegionPos r, bool unloaded) {
  if (unloaded)
    own_->unloaded.insert(r);
  else
    own_->unloaded.erase(r);
}

bool BodyTerrain::is_unloaded(const VoxelBox& voxels) const {
  if (known_->unloaded.empty()) return false;
  const world::RegionPos low = world::region_from_voxel(voxels.min), high = world::region_from_voxel(voxels.max);
  const auto first = known_->unloaded.lower_bound({low.x, INT32_MIN, INT32_MIN});
  return std::any_of(first, known_->unloaded.upper_bound({high.x, INT32_MAX, INT32_MAX}), [&](world::RegionPos r) {
    return r.y >= low.y && r.y <= high.y && r.z >= low.z && r.z <= high.z;
  });
}

BodyTerrain::Filling BodyTerrain::filling(VoxelPos v) const {
  if (!world::inside_world(v)) return Filling::full;
  if (!last_solid_.test(*known_->solid, v)) return Filling::open;
  return known_->filling[known_->store.get(v)];
}

std::span<const BodyBox> BodyTerrain::boxes(VoxelPos v) const {
  const world::Proxy* shape = known_->shapes.shape[known_->store.get(v)];
  const uint8_t joins = known_->shapes.joins_at(*shape, v, [&](VoxelPos at) { return known_->store.get(at); });
  boxes_.clear();
  for (const world::ProxyBox& part : shape->boxes) {
    if (!world::Proxy::has_part(part.joins, joins)) continue;
    BodyBox box;
    for (int a = 0; a < 3; ++a) {
      const int64_t low = fixed_from(double(part.low[a])), high = fixed_from(double(part.high[a]));
      box.min[a] = v[a] * kFixedOne + low, box.size[a] = high - low;
    }
    boxes_.push_back(box);
  }
  return boxes_;
}

bool BodyTerrain::overlaps(const BodyBox& box) const {
  return any_overlap(box, [](const BodyBox&) { return true; });
}

bool BodyTerrain::any_liquid(const VoxelBox& voxels) const {
  if (known_->liquid->empty()) return false;
  const world::LeafPos low = world::leaf_from_voxel(voxels.min), high = world::leaf_from_voxel(voxels.max);
  for (int32_t x = low.x; x <= high.x; ++x)
    for (int32_t y = low.y; y <= high.y; ++y)
      for (int32_t z = low.z; z <= high.z; ++z) {
        const world::LeafMask& mask = known_->liquid->leaf({x, y, z});
        if (mask.is_none()) continue;
        VoxelBox inside{world::voxel_from_leaf({x, y, z}), {}};
        for (int a = 0; a < 3; ++a) {
          inside.max[a] = std::min(inside.min[a] + world::kLeafSize - 1, voxels.max[a]);
          inside.min[a] = std::max(inside.min[a], voxels.min[a]);
        }
        if (any_voxel(inside, [&](VoxelPos v) { return mask.test(v); })) return true;
      }
  return false;
}

/// Calls visit(voxel, m^3 of liquid in the box there, layer of amounts or null).
template <class Visit>
void BodyTerrain::each_liquid(const BodyBox& box, const Visit& visit) const {
  if (known_->liquid->empty()) return;
  // A liquid that doesn't fill its voxel lies at its bottom.
  const world::IntLayer* amounts = known_->store.find_int_layer(world::Layer::liquid);
  any_voxel(box.voxels(), [&](VoxelPos v) {
    if (!last_liquid_.test(*known_->liquid, v)) return false;
    const int32_t amount = amounts ? amounts->get(v) : 0;
    double volume = 1;
    for (int a = 0; a < 3; ++a) {
      const int64_t low = v[a] * kFixedOne;
      const int64_t high = low + (a == 1 && amount > 0 ? amount * (kFixedOne / kFullLiquid) : kFixedOne);
      volume *= std::max(0.0, from_fixed(std::min(box.max(a), high) - std::max(box.min[a], low)));
    }
    visit(v, volume, amounts);
    return false;
  });
}

Displaced BodyTerrain::displaced(const BodyBox& box) const {
  Displaced sum;
  each_liquid(box, [&](VoxelPos v, double volume, const world::IntLayer*) {
    sum.volume += volume, sum.mass += volume * known_->density[known_->store.get(v)];
  });
  return sum;
}

world::Vec3d BodyTerrain::current_at(VoxelPos v, const world::IntLayer* amounts) const {
  const auto amount = [&](VoxelPos at) {
    if (!last_liquid_.test(*known_->liquid, at)) return 0;
    const int32_t known = amounts ? amounts->get(at) : 0;
    return known > 0 ? known : kFullLiquid;
  };
  const int own = amount(v);
  world::Vec3d flow(0);
  for (const int face : {world::kFaceNegX, world::kFacePosX, world::kFaceNegZ, world::kFacePosZ}) {
    const VoxelPos beside = v + world::face_step(static_cast<world::Face>(face));
    if (filling(beside) != Filling::open) continue;
    const int other = amount(beside), higher = std::abs(own - other);
    if (higher <= 1) continue;
    const double speed = std::min(std::sqrt(2 * kGravity * higher / kFullLiquid), kFastestCurrent);
    // Half of it: a voxel has two faces along an axis.
    flow[world::face_axis(face)] += (own > other ? 0.5 : -0.5) * world::face_sign(face) * speed;
  }
  return flow;
}

world::Vec3d BodyTerrain::current(const BodyBox& box) const {
  world::Vec3d sum(0);
  double all = 0;
  each_liquid(box, [&](VoxelPos v, double volume, const world::IntLayer* amounts) {
    sum = sum + current_at(v, amounts) * volume;
    all += volume;
  });
  return all > 0 ? sum / all : sum;
}

}  // namespace sim
