/// Finds the emitting triangle that a ray meets first among many.
#pragma once

#include <functional>
#include <limits>
#include <vector>

#include "world/space/world_point.h"

namespace world {

/// A binary tree of boxes over triangles, split at the middle of the longest side of their centres' box; four to a
/// leaf. Thousands of triangles of a lamp, not millions of a scene: those are the renderer's.
class TriangleTree {
 public:
  /// Three corners a triangle.
  explicit TriangleTree(const std::vector<Vec3d>& corners = {});
  /// Calls test(triangle), which returns the distance along the ray or a negative number, for each triangle whose box
  /// the ray meets nearer than what was found so far. Returns the nearest triangle, or -1.
  int nearest(const Vec3d& origin, const Vec3d& direction, const std::function<double(int)>& test) const;

 private:
  struct Node {
    Vec3d low{std::numeric_limits<double>::infinity()}, high{-std::numeric_limits<double>::infinity()};
    int first = 0, count = 0;  // a leaf's triangles in order_
    int right = 0;             // an inner node (count 0): left is the next node
  };
  int build(int first, int count, const std::vector<Vec3d>& corners);

  std::vector<Node> nodes_;
  std::vector<int> order_;
};

}  // namespace world
