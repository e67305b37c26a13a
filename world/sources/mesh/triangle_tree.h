/// A tree of boxes over triangles: who meets a box, who lies before a point along +x, how far the nearest is.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "world/sources/shape.h"

namespace world {

class TriangleTree {
 public:
  using Triangle = std::array<Vec3d, 3>;

  explicit TriangleTree(std::vector<Triangle> triangles);

  const ShapeBox& bounds() const { return bounds_; }
  /// Whether a triangle touches the box, edges included.
  bool touches(const ShapeBox& box) const;
  /// Crossings of the ray from p along +x: out of fronts count 1, into them -1; and their number.
  struct Crossings {
    int winding = 0, count = 0;
  };
  Crossings crossings(const Vec3d& p) const;
  /// Whether a triangle lies within `distance` of p.
  bool within(const Vec3d& p, double distance) const;

 private:
  // Nodes in depth-first order: the first child follows its parent. 56 bytes.
  struct Node {
    ShapeBox box;
    uint32_t second = 0;  // the second child; in leaves the first triangle
    uint32_t count = 0;   // triangles of a leaf; 0 in inner nodes
  };
  uint32_t build(std::span<Triangle> part, size_t first);
  /// Calls visit(triangle) in leaves whose box and ancestors pass `enter`; stops where visit returns true.
  template <class Enter, class Visit>
  bool walk(Enter enter, Visit visit) const;

  std::vector<Triangle> triangles_;
  std::vector<Node> nodes_;
  ShapeBox bounds_;
};

}  // namespace world
