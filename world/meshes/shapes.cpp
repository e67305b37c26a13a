// Meshes that a scene spells out itself: quads, and profiles turned round an axis.
#include <cmath>

#include "world/meshes/builder.h"
#include "world/space/ray_shapes.h"

namespace world {

namespace {

constexpr double kPi = 3.14159265358979323846;
const double kCosineOfEdge = std::cos(35 * kPi / 180);

}  // namespace

Result<TriangleMesh> quads_mesh(std::span<const double> quads, std::string_view where, MeshReport& report) {
  MeshBuilder builder;
  for (size_t i = 0; i + 2 < quads.size(); i += 3) builder.positions.emplace_back(quads[i], quads[i + 1], quads[i + 2]);
  for (uint32_t i = 0; i + 3 < builder.positions.size(); i += 4) {
    const MeshCorner corners[] = {{i}, {i + 1}, {i + 2}, {i + 3}};
    CHECK(builder.add_face(corners));
  }
  return std::move(builder).finish(where, report);
}

Result<TriangleMesh> revolved_mesh(std::span<const double> profile, int steps, std::string_view where,
                                   MeshReport& report) {
  const size_t count = profile.size() / 2;
  std::vector<glm::dvec2> points;  // radius, height
  for (size_t i = 0; i < count; ++i) points.emplace_back(profile[2 * i], profile[2 * i + 1]);

  // To the right of each edge; 0 where it has no length.
  std::vector<glm::dvec2> sideways;
  for (size_t i = 0; i + 1 < count; ++i) {
    const glm::dvec2 way = points[i + 1] - points[i];
    const double length = glm::length(way);
    sideways.push_back(length > 0 ? glm::dvec2(way.y, -way.x) / length : glm::dvec2(0));
  }
  const bool closed = points.front() == points.back();
  const auto normal_at = [&](size_t edge, bool end) {
    const size_t edges = sideways.size(), beside = end ? edge + 1 : edge + edges - 1;
    const bool has_neighbour = closed || (end ? edge + 1 < edges : edge > 0);
    const glm::dvec2 mine = sideways[edge], other = has_neighbour ? sideways[beside % edges] : mine;
    return dot(mine, other) > kCosineOfEdge ? glm::normalize(mine + other) : mine;
  };

  MeshBuilder builder;
  for (int s = 0; s < steps; ++s) {
    const double angle = 2 * kPi * s / steps, c = std::cos(angle), d = std::sin(angle);
    for (const glm::dvec2& p : points) builder.positions.emplace_back(p.x * c, p.y, p.x * d);
    for (size_t edge = 0; edge + 1 < count; ++edge)
      for (const bool end : {false, true}) {
        const glm::dvec2 n = normal_at(edge, end);
        builder.normals.emplace_back(n.x * c, n.y, n.x * d);
      }
  }
  const auto corner = [&](int step, size_t edge, bool end) {
    const uint32_t s = static_cast<uint32_t>(step % steps), e = static_cast<uint32_t>(edge);
    const uint32_t points_a_step = static_cast<uint32_t>(count), edges = points_a_step - 1;
    return MeshCorner{s * points_a_step + e + end, MeshCorner::kNone, 2 * (s * edges + e) + end};
  };
  for (int s = 0; s < steps; ++s)
    for (size_t edge = 0; edge + 1 < count; ++edge) {
      if (sideways[edge] == glm::dvec2(0)) continue;
      // On the axis a quad is a triangle.
      std::vector<MeshCorner> face{corner(s, edge, false), corner(s, edge, true)};
      if (points[edge + 1].x > 0) face.push_back(corner(s + 1, edge, true));
      if (points[edge].x > 0) face.push_back(corner(s + 1, edge, false));
      if (face.size() > 2) CHECK(builder.add_face(face));
    }
  return std::move(builder).finish(where, report);
}

}  // namespace world
