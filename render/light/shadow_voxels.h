/// The voxels that hold the sun's light back in pictures: the world's opaque ones but liquids that end within theirs
/// (render/liquid_levels.h), of which a whole voxel would throw a shadow where there is nothing. Their own shadow, that
/// of less than a voxel's height, is left out. Shared by both backends.
///
/// A world without such liquids has no copy of its voxels, and is asked as it is.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "render/liquid_levels.h"
#include "world/store/parallel_rays.h"
#include "world/store/ray_stream.h"
#include "world/world.h"

namespace render {

class ShadowVoxels {
 public:
  /// What a follow() changed: all may have, or these leaves, sorted.
  struct Change {
    bool all = false;
    std::vector<world::LeafPos> leaves;
    bool any() const { return all || !leaves.empty(); }
  };
  /// Follows blocks and levels. `moved`: what levels.follow() returned. `rays`: of the same store, which the others
  /// below ask where nothing is left out; it must outlive what they return.
  Change follow(const world::WorldView& view, const LiquidLevels& levels, std::span<const world::LeafPos> moved,
                world::StoreRays& rays);

  /// Of the store that was followed, until the next follow().
  const world::MaskVolume& volume() const { return cut_ ? cut_->volume : *whole_; }
  const world::RayStream& stream() const { return cut_ ? cut_->stream : rays_->stream(*store_, kOpaque); }
  const world::ParallelRays& parallel(const world::Vec3d& direction);
  size_t bytes() const;

 private:
  static constexpr world::MaskKind kOpaque = world::MaskKind::opaque;
  /// The voxels without those liquids, where there are any.
  struct Cut {
    explicit Cut(world::MaskVolume&& voxels) : volume(std::move(voxels)), stream(volume) {}
    world::MaskVolume volume;
    world::RayStream stream;
    std::unique_ptr<world::ParallelRays> parallel;
  };
  void cut(const world::WorldView& view, const LiquidLevels& levels);

  std::unique_ptr<Cut> cut_;
  const world::Store* store_ = nullptr;
  const world::MaskVolume* whole_ = nullptr;
  world::StoreRays* rays_ = nullptr;
  uint64_t identity_ = 0;  // of the store; 0: none
  int subscriber_ = 0;
};

}  // namespace render
