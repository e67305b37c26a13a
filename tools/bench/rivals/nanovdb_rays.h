/// NanoVDB's HDDA on a grid of value masks of a world: the tree is walked at the size of the node that a ray is in.
#pragma once

#include <memory>
#include <span>

#include "tools/bench/ray_sets.h"

namespace tools {

class NanoVdbRays {
 public:
  explicit NanoVdbRays(const world::MaskVolume& occupied);
  ~NanoVdbRays();
  /// Casts all rays on the threads that the row allows. Returns how many there were.
  double first_hits(std::span<const BenchRay> rays) const;
  /// The same by nanovdb::firstActive as it comes, which skips voxels: for the record.
  double stock_first_hits(std::span<const BenchRay> rays) const;
  std::vector<RayAnswer> answers(std::span<const BenchRay> rays) const;
  std::vector<RayAnswer> stock_answers(std::span<const BenchRay> rays) const;
  size_t bytes() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace tools
