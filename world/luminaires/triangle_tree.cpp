#include "world/luminaires/triangle_tree.h"

#include <algorithm>
#include <numeric>

#include <glm/common.hpp>

namespace world {

namespace {

constexpr int kLeafTriangles = 4;
constexpr int kDeepest = 64;  // halves: 2^31 triangles make 29 levels

Vec3d centre_of(const std::vector<Vec3d>& corners, int triangle) {
  const size_t i = 3 * static_cast<size_t>(triangle);
  return corners[i] + corners[i + 1] + corners[i + 2];
}

/// Whether the ray is in the box at some t in [0, limit]. Widened by 1e-12 of the box's distance, more than rounding
/// takes.
bool meets(const Vec3d& low, const Vec3d& high, const Vec3d& origin, const Vec3d& inverse, double limit) {
  double near = 0, far = limit;
  for (int axis = 0; axis < 3; ++axis) {
    if (std::isinf(inverse[axis])) {
      if (origin[axis] < low[axis] || origin[axis] > high[axis]) return false;
      continue;
    }
    const double a = (low[axis] - origin[axis]) * inverse[axis], b = (high[axis] - origin[axis]) * inverse[axis];
    const double first = std::min(a, b), last = std::max(a, b);
    if (first > near) near = first - 1e-12 * std::abs(first);
    if (last < far) far = last + 1e-12 * std::abs(last);
  }
  return !(near > far);
}

}  // namespace

TriangleTree::TriangleTree(const std::vector<Vec3d>& corners) : order_(corners.size() / 3) {
  std::iota(order_.begin(), order_.end(), 0);
  if (!order_.empty()) build(0, static_cast<int>(order_.size()), corners);
}

int TriangleTree::build(int first, int count, const std::vector<Vec3d>& corners) {
  const int index = static_cast<int>(nodes_.size());
  nodes_.emplace_back();
  Node node;
  Vec3d low(std::numeric_limits<double>::infinity()), high = -low;
  for (int i = first; i < first + count; ++i) {
    const int triangle = order_[static_cast<size_t>(i)];
    for (size_t c = 0; c < 3; ++c) {
      const Vec3d& corner = corners[3 * static_cast<size_t>(triangle) + c];
      node.low = glm::min(node.low, corner), node.high = glm::max(node.high, corner);
    }
    low = glm::min(low, centre_of(corners, triangle)), high = glm::max(high, centre_of(corners, triangle));
  }
  if (count <= kLeafTriangles) {
    node.first = first, node.count = count;
  } else {
    const Vec3d size = high - low;
    const int axis = size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
    const auto from = order_.begin() + first;
    std::nth_element(from, from + count / 2, from + count, [&](int a, int b) {
      const double ca = centre_of(corners, a)[axis], cb = centre_of(corners, b)[axis];
      return ca < cb || (ca == cb && a < b);
    });
    build(first, count / 2, corners);
    node.right = build(first + count / 2, count - count / 2, corners);
  }
  nodes_[static_cast<size_t>(index)] = node;
  return index;
}

int TriangleTree::nearest(const Vec3d& origin, const Vec3d& direction, const std::function<double(int)>& test) const {
  const Vec3d inverse = 1.0 / direction;
  double limit = std::numeric_limits<double>::infinity();
  int found = -1, stack[kDeepest], depth = 0;
  if (!nodes_.empty()) stack[depth++] = 0;
  while (depth) {
    const int index = stack[--depth];
    const Node& node = nodes_[static_cast<size_t>(index)];
    if (!meets(node.low, node.high, origin, inverse, limit)) continue;
    for (int i = node.first; i < node.first + node.count; ++i) {
      const int triangle = order_[static_cast<size_t>(i)];
      const double t = test(triangle);
      // Ties go to the first of the mesh, whatever the tree's order.
      if (t >= 0 && (t < limit || (t == limit && triangle < found))) limit = t, found = triangle;
    }
    if (!node.count) stack[depth++] = node.right, stack[depth++] = index + 1;
  }
  return found;
}

}  // namespace world
