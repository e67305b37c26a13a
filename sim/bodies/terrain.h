/// What bodies meet in a world: which voxels are solid, which hold boxes finer than a voxel, which are liquid, and
/// which are not loaded.
///
/// A solid block is a cube, or the boxes of its proxy (world/proxies): stairs, slabs and fences are what they look
/// like. Quads of proxies stop nothing: plants are passed through. Outside the world's border everything is solid.
/// Reads of one object are for one thread; reader() is for another.
#pragma once

#include <memory>
#include <set>
#include <vector>

#include "sim/bodies/body_box.h"
#include "world/proxies/proxy.h"
#include "world/store/store.h"

namespace sim {

/// What a box displaces where it is.
struct Displaced {
  double volume = 0;  // m^3 of liquid
  double mass = 0;    // kg
};

constexpr double kFastestCurrent = 4;  // m/s

class BodyTerrain {
 public:
  /// The store must outlive it and stay where it is.
  explicit BodyTerrain(const world::Store& store);

  /// The same for another thread, until the next refresh(): this must outlive it.
  BodyTerrain reader() const { return BodyTerrain(*known_); }

  /// After edits, and before the first read.
  void refresh();
  /// That the region has blocks which are not in the store now.
  void set_unloaded(world::RegionPos r, bool unloaded);
  bool is_unloaded(const world::VoxelBox& voxels) const;

  enum class Filling : uint8_t { open, full, shaped };
  Filling filling(world::VoxelPos v) const;
  /// The boxes of a shaped voxel: valid until the next call.
  std::span<const BodyBox> boxes(world::VoxelPos v) const;
  bool overlaps(const BodyBox& box) const;
  /// Calls visit(const BodyBox&) for each solid box that the box overlaps, until one call returns true.
  template <class Visit>
  bool any_overlap(const BodyBox& box, const Visit& visit) const;
  /// Whether any voxel of the box holds liquid.
  bool any_liquid(const world::VoxelBox& voxels) const;
  Displaced displaced(const BodyBox& box) const;
  /// How fast the liquid flows in which the box lies, in m/s: the mean over its volume in liquid. Where the level of a
  /// voxel differs by h from that beside it, liquid runs at sqrt(2 g h) (Torricelli 1644), at most kFastestCurrent; one
  /// unit of amount is level. Horizontal: what falls isn't asked.
  world::Vec3d current(const BodyBox& box) const;

 private:
  template <class Visit>
  void each_liquid(const BodyBox& box, const Visit& visit) const;
  world::Vec3d current_at(world::VoxelPos v, const world::IntLayer* amounts) const;
  /// The mask of the leaf that was looked at last: neighbours mostly ask for the same.
  struct LastLeaf {
    world::LeafPos leaf{INT32_MIN, 0, 0};
    const world::LeafMask* mask = nullptr;
    bool test(const world::MaskVolume& volume, world::VoxelPos v) {
      const world::LeafPos l = world::leaf_from_voxel(v);
      if (l != leaf) leaf = l, mask = &volume.leaf(l);
      return mask->test(v);
    }
  };

  struct Known {
    const world::Store& store;
    const world::MaskVolume *solid = nullptr, *liquid = nullptr;
    world::BlockShapes shapes = {};
    std::vector<Filling> filling = {};  // by block id, of solid ones
    std::vector<double> density = {};   // by block id, kg/m^3
    std::set<world::RegionPos> unloaded = {};
  };
  explicit BodyTerrain(const Known& known);

  std::unique_ptr<Known> own_;  // null: a reader
  const Known* known_;
  mutable LastLeaf last_solid_, last_liquid_;
  mutable std::vector<BodyBox> boxes_;
};

template <class Visit>
bool BodyTerrain::any_overlap(const BodyBox& box, const Visit& visit) const {
  const world::VoxelBox at = box.voxels();
  world::VoxelPos v;
  for (v.x = at.min.x; v.x <= at.max.x; ++v.x)
    for (v.y = at.min.y; v.y <= at.max.y; ++v.y)
      for (v.z = at.min.z; v.z <= at.max.z; ++v.z) {
        const Filling f = filling(v);
        if (f == Filling::full) {
          const FixedVec3 low{v.x * kFixedOne, v.y * kFixedOne, v.z * kFixedOne};
          if (visit(BodyBox{low, {kFixedOne, kFixedOne, kFixedOne}})) return true;
        } else if (f == Filling::shaped) {
          for (const BodyBox& part : boxes(v))
            if (overlap(box, part) && visit(part)) return true;
        }
      }
  return false;
}

}  // namespace sim
