#include "world/sources/mesh/triangle_tree.h"

#include <algorithm>
#include <cmath>

namespace world {
namespace {

constexpr size_t kLeafTriangles = 4;

bool before(const Vec3d& a, const Vec3d& b) {
  if (a.x != b.x) return a.x < b.x;
  return a.y != b.y ? a.y < b.y : a.z < b.z;
}

/// On which side of the edge a -> b, seen along x in the (y, z) plane, p lies: 1 or -1, never 0. p counts as moved by
/// (e, e^2) for a tiny e. The same for b -> a but for the sign, whatever the rounding.
int side(const Vec3d& a, const Vec3d& b, const Vec3d& p) {
  if (before(b, a)) return -side(b, a, p);
  const double area = (b.y - a.y) * (p.z - a.z) - (b.z - a.z) * (p.y - a.y);
  if (area != 0) return area > 0 ? 1 : -1;
  if (a.z != b.z) return a.z - b.z > 0 ? 1 : -1;
  return b.y - a.y >= 0 ? 1 : -1;
}

bool apart(double p, double q, double r, double reach) {
  return std::min({p, q, r}) > reach || std::max({p, q, r}) < -reach;
}

/// Separating axes of a triangle and a box.
/// source Tomas Akenine-Moeller. Fast 3D Triangle-Box Overlap Testing. 2001
bool overlaps(const TriangleTree::Triangle& t, const ShapeBox& box) {
  const Vec3d centre = box.centre(), h = 0.5 * (box.max - box.min);
  const Vec3d v[3] = {t[0] - centre, t[1] - centre, t[2] - centre};
  // Rounding must never tell a touching triangle apart.
  const double slack = 1e-12 * (glm::length(centre) + glm::length(h));
  for (int a = 0; a < 3; ++a) {
    if (apart(v[0][a], v[1][a], v[2][a], h[a] + slack)) return false;
  }
  const Vec3d edges[3] = {v[1] - v[0], v[2] - v[1], v[0] - v[2]};
  const auto apart_along = [&](const Vec3d& axis) {
    const double reach = glm::dot(h, glm::abs(axis)) + slack * (std::abs(axis.x) + std::abs(axis.y) + std::abs(axis.z));
    return apart(glm::dot(axis, v[0]), glm::dot(axis, v[1]), glm::dot(axis, v[2]), reach);
  };
  if (apart_along(glm::cross(edges[0], edges[1]))) return false;
  for (const Vec3d& e : edges) {
    if (apart_along({0, -e.z, e.y}) || apart_along({e.z, 0, -e.x}) || apart_along({-e.y, e.x, 0})) return false;
  }
  return true;
}

/// Square of the distance from p to the triangle.
/// source Christer Ericson. Real-Time Collision Detection. 2005, section 5.1.5
double distance2(const TriangleTree::Triangle& t, const Vec3d& p) {
  const Vec3d ab = t[1] - t[0], ac = t[2] - t[0], ap = p - t[0];
  const auto to = [&](const Vec3d& q) { return glm::dot(p - q, p - q); };
  const double d1 = glm::dot(ab, ap), d2 = glm::dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return to(t[0]);
  const Vec3d bp = p - t[1];
  const double d3 = glm::dot(ab, bp), d4 = glm::dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return to(t[1]);
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return to(t[0] + d1 / (d1 - d3) * ab);
  const Vec3d cp = p - t[2];
  const double d5 = glm::dot(ab, cp), d6 = glm::dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return to(t[2]);
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return to(t[0] + d2 / (d2 - d6) * ac);
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return to(t[1] + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (t[2] - t[1]));
  const double sum = va + vb + vc;
  if (!(sum > 0)) return std::min({to(t[0]), to(t[1]), to(t[2])});
  return to(t[0] + vb / sum * ab + vc / sum * ac);
}

double distance2(const ShapeBox& box, const Vec3d& p) {
  const Vec3d out = glm::max(glm::max(box.min - p, p - box.max), Vec3d(0.0));
  return glm::dot(out, out);
}

}  // namespace

TriangleTree::TriangleTree(std::vector<Triangle> triangles) : triangles_(std::move(triangles)) {
  for (const Triangle& t : triangles_)
    for (const Vec3d& v : t) bounds_.include(v);
  if (triangles_.empty()) return;
  nodes_.reserve(triangles_.size());
  build(triangles_, 0);
}

uint32_t TriangleTree::build(std::span<Triangle> part, size_t first) {
  const uint32_t at = static_cast<uint32_t>(nodes_.size());
  nodes_.emplace_back();
  ShapeBox box, middles;
  for (const Triangle& t : part) {
    for (const Vec3d& v : t) box.include(v);
    middles.include(t[0] + t[1] + t[2]);
  }
  nodes_[at].box = box;
  if (part.size() <= kLeafTriangles) {
    nodes_[at].second = static_cast<uint32_t>(first);
    nodes_[at].count = static_cast<uint32_t>(part.size());
    return at;
  }
  // Halves by the middles along the longest side: depth is log2 of the number, whatever the mesh.
  const Vec3d size = middles.max - middles.min;
  const int axis = size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
  const size_t half = part.size() / 2;
  std::nth_element(part.begin(), part.begin() + static_cast<std::ptrdiff_t>(half), part.end(),
                   [axis](const Triangle& a, const Triangle& b) {
                     return a[0][axis] + a[1][axis] + a[2][axis] < b[0][axis] + b[1][axis] + b[2][axis];
                   });
  build(part.first(half), first);
  const uint32_t second = build(part.subspan(half), first + half);
  nodes_[at].second = second;
  return at;
}

template <class Enter, class Visit>
bool TriangleTree::walk(Enter enter, Visit visit) const {
  if (nodes_.empty()) return false;
  uint32_t stack[64];
  int depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const uint32_t at = stack[--depth];
    const Node& node = nodes_[at];
    if (!enter(node.box)) continue;
    if (node.count == 0) {
      stack[depth++] = node.second;
      stack[depth++] = at + 1;
      continue;
    }
    for (uint32_t i = 0; i < node.count; ++i) {
      if (visit(triangles_[node.second + i])) return true;
    }
  }
  return false;
}

bool TriangleTree::touches(const ShapeBox& box) const {
  return walk(
      [&](const ShapeBox& node) {
        return node.min.x <= box.max.x && node.max.x >= box.min.x && node.min.y <= box.max.y &&
               node.max.y >= box.min.y && node.min.z <= box.max.z && node.max.z >= box.min.z;
      },
      [&](const Triangle& t) { return overlaps(t, box); });
}

TriangleTree::Crossings TriangleTree::crossings(const Vec3d& p) const {
  Crossings found;
  walk(
      [&](const ShapeBox& node) {
        return node.max.x >= p.x && node.min.y <= p.y && node.max.y >= p.y && node.min.z <= p.z && node.max.z >= p.z;
      },
      [&](const Triangle& t) {
        const int s = side(t[0], t[1], p);
        if (side(t[1], t[2], p) != s || side(t[2], t[0], p) != s) return false;
        // Where the ray meets the triangle's plane.
        const Vec3d n = glm::cross(t[1] - t[0], t[2] - t[0]);
        if (n.x == 0) return false;  // seen on edge: it has no inside in this view
        const double beyond = glm::dot(n, t[0] - p) / n.x;
        if (!(beyond > 0)) return false;
        found.winding += n.x > 0 ? 1 : -1;
        ++found.count;
        return false;
      });
  return found;
}

bool TriangleTree::within(const Vec3d& p, double distance) const {
  const double limit = distance * distance;
  return walk([&](const ShapeBox& node) { return distance2(node, p) <= limit; },
              [&](const Triangle& t) { return distance2(t, p) <= limit; });
}

}  // namespace world
