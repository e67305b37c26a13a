/// Finds what a ray meets first among many things that have boxes.
#pragma once

#include <limits>
#include <vector>

#include "world/base/function_ref.h"
#include "world/space/world_point.h"

namespace world {

struct Box {
  Vec3d low{std::numeric_limits<double>::infinity()}, high{-std::numeric_limits<double>::infinity()};
  void include(const Vec3d& point) { low = glm::min(low, point), high = glm::max(high, point); }
};

/// A binary tree over boxes, split at the median of their centres along the axis on which these spread most; four to a
/// leaf. Thousands of triangles of a lamp, or of lamps, not millions of a scene: those are the renderer's.
/// memory  72 bytes a box
class BoxTree {
 public:
  explicit BoxTree(const std::vector<Box>& boxes = {});
  /// Calls test(i), which returns the distance along the ray or a negative number, for each box that the ray meets
  /// nearer than what was found so far, and than `limit`. Returns the nearest, or -1; of several at one distance the
  /// first in the list.
  int nearest(const Vec3d& origin, const Vec3d& direction, FunctionRef<double(int)> test,
              double limit = std::numeric_limits<double>::infinity()) const;
  size_t bytes() const { return nodes_.capacity() * sizeof(Node) + order_.capacity() * sizeof(int); }

 private:
  struct Node {
    Box box;
    int first = 0, count = 0;  // a leaf's things in order_
    int right = 0;             // an inner node (count 0): left is the next node
  };
  int build(int first, int count, const std::vector<Box>& boxes);

  std::vector<Node> nodes_;
  std::vector<int> order_;
};

}  // namespace world
