/// OpenVDB's VolumeRayIntersector on the topology of a world: it finds the stretches of a ray that lie in leaves with
/// active voxels, and inside those OpenVDB's DDA asks voxel after voxel through an accessor.
#pragma once

#include <memory>
#include <span>

#include "tools/bench/ray_sets.h"

namespace tools {

class OpenVdbRays {
 public:
  explicit OpenVdbRays(const world::MaskVolume& occupied);
  ~OpenVdbRays();
  /// Casts all rays on the threads that the row allows. Returns how many there were.
  double first_hits(std::span<const BenchRay> rays) const;
  std::vector<RayAnswer> answers(std::span<const BenchRay> rays) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tools
