/// A tree over triangles in an order that a shader walks without a stack: a node's children follow it, and `skip` leads
/// past all that lies below it.
///
/// memory  some 24 bytes a triangle
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <glm/common.hpp>
#include <glm/vec3.hpp>

#include "render/raster/raster.shared.h"

namespace render::raster {

struct TriangleBox {
  glm::vec3 low{1e30f}, high{-1e30f};
  void include(const glm::vec3& p) { low = glm::min(low, p), high = glm::max(high, p); }
  void include(const TriangleBox& b) { low = glm::min(low, b.low), high = glm::max(high, b.high); }
};

struct TriangleNode {
  glm::vec3 low;
  uint32_t skip;  // the node that comes next where this one's box is missed
  glm::vec3 high;
  uint32_t leaf;  // first triangle << kNodeLeafBits | how many; 0: an inner node
};
static_assert(sizeof(TriangleNode) == 32);
constexpr uint32_t kMostInLeaf = 4;

struct TriangleTree {
  std::vector<TriangleNode> nodes;
  std::vector<uint32_t> order;  // numbers of the boxes in the order of leaves
  std::vector<uint32_t> first;  // by node, then the end: where in `order` it begins; it ends where its skip begins
};
/// Splits where the sum of surfaces times triangles is least, among 16 slices of each axis. At most 2^29 - 1 boxes.
/// source  Ingo Wald. On fast Construction of SAH-based Bounding Volume Hierarchies. 2007
TriangleTree triangle_tree(std::span<const TriangleBox> boxes);

}  // namespace render::raster
