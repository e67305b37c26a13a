/// The voxel grid as rays meet it: the one class of the ray backends that knows how masks are walked.
#pragma once

#include "world/store/mask_walk.h"

namespace render {

class GridCaster {
 public:
  explicit GridCaster(const world::MaskVolume& volume) : walker_(volume) {}

  /// From `place` on, its own voxel included, to the first voxel that is set; exact, as the flat walk's. t_limit is
  /// finite and is brought down to where the ray leaves the world's content. False: there is none.
  bool first_set(const world::GridAxes& axes, world::WalkPlace& place, double& t_limit) const {
    if (!walker_.in_bounds(place.voxel) && !walker_.clip(axes, place, t_limit)) return false;
    return walker_.find(axes, place, t_limit);
  }

 private:
  world::MaskWalker walker_;
};

}  // namespace render
