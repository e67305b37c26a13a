#include "world/space/box_tree.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <glm/common.hpp>

namespace world {

namespace {

constexpr int kLeafBoxes = 4;
constexpr int kDeepest = 64;  // halves: 2^31 boxes make 29 levels

Vec3d centre_of(const Box& box) { return box.low + box.high; }

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

BoxTree::BoxTree(const std::vector<Box>& boxes) : order_(boxes.size()) {
  std::iota(order_.begin(), order_.end(), 0);
  if (!order_.empty()) build(0, static_cast<int>(order_.size()), boxes);
}

int BoxTree::build(int first, int count, const std::vector<Box>& boxes) {
  const int index = static_cast<int>(nodes_.size());
  nodes_.emplace_back();
  Node node;
  Box centres;
  for (int i = first; i < first + count; ++i) {
    const Box& box = boxes[static_cast<size_t>(order_[static_cast<size_t>(i)])];
    node.box.include(box.low), node.box.include(box.high);
    centres.include(centre_of(box));
  }
  if (count <= kLeafBoxes) {
    node.first = first, node.count = count;
  } else {
    const Vec3d size = centres.high - centres.low;
    const int axis = size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
    const auto from = order_.begin() + first;
    std::nth_element(from, from + count / 2, from + count, [&](int a, int b) {
      const double ca = centre_of(boxes[static_cast<size_t>(a)])[axis],
                   cb = centre_of(boxes[static_cast<size_t>(b)])[axis];
      return ca < cb || (ca == cb && a < b);
    });
    build(first, count / 2, boxes);
    node.right = build(first + count / 2, count - count / 2, boxes);
  }
  nodes_[static_cast<size_t>(index)] = node;
  return index;
}

int BoxTree::nearest(const Vec3d& origin, const Vec3d& direction, FunctionRef<double(int)> test, double limit) const {
  const Vec3d inverse = 1.0 / direction;
  int found = -1, stack[kDeepest], depth = 0;
  if (!nodes_.empty()) stack[depth++] = 0;
  while (depth) {
    const int index = stack[--depth];
    const Node& node = nodes_[static_cast<size_t>(index)];
    if (!meets(node.box.low, node.box.high, origin, inverse, limit)) continue;
    for (int i = node.first; i < node.first + node.count; ++i) {
      const int one = order_[static_cast<size_t>(i)];
      const double t = test(one);
      // Ties go to the first of the list, whatever the tree's order.
      if (t >= 0 && (found < 0 ? t <= limit : t < limit || (t == limit && one < found))) limit = t, found = one;
    }
    if (node.count) continue;
    // The nearer half is looked at first.
    const Node& right = nodes_[static_cast<size_t>(node.right)];
    const Node& left = nodes_[static_cast<size_t>(index) + 1];
    const bool left_first = dot(centre_of(right.box) - centre_of(left.box), direction) > 0;
    stack[depth++] = left_first ? node.right : index + 1;
    stack[depth++] = left_first ? index + 1 : node.right;
  }
  return found;
}

}  // namespace world
