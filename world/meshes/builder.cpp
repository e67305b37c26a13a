#include "world/meshes/builder.h"

#include <algorithm>

#include <fmt/format.h>

#include "world/base/random.h"
#include "world/space/ray_shapes.h"

namespace world {
namespace {

constexpr int kMostLooks = 8;  // at all corners of a face, each of which takes the square of their number

struct CornerHash {
  size_t operator()(const MeshCorner& c) const { return hash_combine(hash_combine(c.position, c.texture), c.normal); }
};

/// Twice the signed area of a, b, c.
double area(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// The corners as seen along the axis on which the face is widest, counter-clockwise.
std::vector<glm::dvec2> flattened(std::span<const MeshCorner> corners, const std::vector<Vec3f>& positions) {
  // The sum over edges is twice the vector area, whatever the shape.
  // source Martin Newell's method, as in Ivan Sutherland, Robert Sproull, Robert Schumacker. A Characterization of Ten
  // Hidden-Surface Algorithms. 1974
  const Vec3d base(positions[corners[0].position]);
  Vec3d normal(0.0);
  for (size_t i = 0; i < corners.size(); ++i)
    normal += cross(Vec3d(positions[corners[i].position]) - base,
                    Vec3d(positions[corners[(i + 1) % corners.size()].position]) - base);
  const Vec3d size = abs(normal);
  const int axis = size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  std::vector<glm::dvec2> flat;
  flat.reserve(corners.size());
  for (const MeshCorner& c : corners) {
    const Vec3d p = Vec3d(positions[c.position]) - base;
    flat.emplace_back(normal[axis] < 0 ? p[v] : p[u], normal[axis] < 0 ? p[u] : p[v]);
  }
  return flat;
}

bool convex(const std::vector<glm::dvec2>& flat) {
  const size_t n = flat.size();
  for (size_t i = 0; i < n; ++i)
    if (area(flat[i], flat[(i + 1) % n], flat[(i + 2) % n]) < 0) return false;
  // All turns go left; so they do in a star that winds round twice.
  int rises = 0;
  for (size_t i = 0; i < n; ++i) {
    const double before = flat[(i + 1) % n].y - flat[i].y, after = flat[(i + 2) % n].y - flat[(i + 1) % n].y;
    rises += before <= 0 && after > 0;
  }
  return rises <= 1;
}

}  // namespace

void MeshBuilder::add_triangle(const MeshCorner& a, const MeshCorner& b, const MeshCorner& c) {
  triangles_.insert(triangles_.end(), {a, b, c});
  materials_.push_back(material);
}

bool MeshBuilder::clip_ears(std::span<const MeshCorner> corners) {
  const std::vector<glm::dvec2> flat = flattened(corners, positions);
  const size_t n = corners.size();
  if (convex(flat)) {
    for (size_t i = 2; i < n; ++i) add_triangle(corners[0], corners[i - 1], corners[i]);
    return true;
  }
  if (n > kMostCorners) return false;
  // A ring of those that are left.
  std::vector<uint32_t> before(n), after(n);
  for (uint32_t i = 0; i < n; ++i)
    before[i] = static_cast<uint32_t>((i + n - 1) % n), after[i] = static_cast<uint32_t>((i + 1) % n);
  const auto is_ear = [&](uint32_t tip) {
    const glm::dvec2 &a = flat[before[tip]], &b = flat[tip], &c = flat[after[tip]];
    if (!(area(a, b, c) > 0)) return false;
    for (uint32_t i = after[after[tip]]; i != before[tip]; i = after[i]) {
      const glm::dvec2& p = flat[i];
      if (p == a || p == b || p == c) continue;  // the seam of a hole
      if (area(a, b, p) >= 0 && area(b, c, p) >= 0 && area(c, a, p) >= 0) return false;
    }
    return true;
  };
  enum class Corner : char { gone, plain, ear };
  const auto kind_of = [&](uint32_t i) { return is_ear(i) ? Corner::ear : Corner::plain; };
  std::vector<Corner> kinds(n);
  for (uint32_t i = 0; i < n; ++i) kinds[i] = kind_of(i);
  const auto first = [&](Corner kind) {
    return static_cast<uint32_t>(std::find(kinds.begin(), kinds.end(), kind) - kinds.begin());
  };
  int looks = 0;
  uint32_t tip = 0;
  for (size_t left = n; left > 3; --left) {
    tip = first(Corner::ear);
    if (tip == n && looks++ < kMostLooks) {
      // Rounding, or a face that touches itself, may have hidden one.
      for (uint32_t i = 0; i < n; ++i)
        if (kinds[i] != Corner::gone) kinds[i] = kind_of(i);
      tip = first(Corner::ear);
    }
    if (tip == n) tip = first(Corner::plain);  // it crosses itself: any corner is as good
    add_triangle(corners[before[tip]], corners[tip], corners[after[tip]]);
    kinds[tip] = Corner::gone;
    after[before[tip]] = after[tip], before[after[tip]] = before[tip];
    // In a face that doesn't cross itself no other corner becomes an ear, or stops being one.
    kinds[before[tip]] = kind_of(before[tip]), kinds[after[tip]] = kind_of(after[tip]);
  }
  tip = first(Corner::ear);
  if (tip == n) tip = first(Corner::plain);
  add_triangle(corners[before[tip]], corners[tip], corners[after[tip]]);
  return true;
}

bool MeshBuilder::add_face(std::span<const MeshCorner> corners) {
  if (corners.size() < 3) return false;
  ++facts.faces;
  ++facts.face_sizes[static_cast<uint32_t>(corners.size())];
  face_sizes.push_back(static_cast<uint32_t>(corners.size()));
  for (const MeshCorner& c : corners) face_corners.push_back(c.position);
  for (const MeshCorner& c : corners) {
    all_have_textures_ = all_have_textures_ && c.texture != MeshCorner::kNone;
    all_have_normals_ = all_have_normals_ && c.normal != MeshCorner::kNone;
  }
  if (corners.size() > 3) return clip_ears(corners);
  add_triangle(corners[0], corners[1], corners[2]);
  return true;
}

Result<TriangleMesh> MeshBuilder::finish(std::string_view file, MeshReport& report, MeshColours* colours_out) && {
  TriangleMesh mesh;
  const bool coloured = !positions.empty() && position_colours.size() == positions.size();
  if (triangles_.empty()) return input_error(fmt::format("{}: the mesh is empty: it has no face", file));
  std::unordered_map<MeshCorner, uint32_t, CornerHash> vertices;
  const auto vertex = [&](MeshCorner c) {
    if (!all_have_textures_) c.texture = MeshCorner::kNone;
    if (!all_have_normals_) c.normal = MeshCorner::kNone;
    const auto [it, added] = vertices.try_emplace(c, static_cast<uint32_t>(mesh.positions.size()));
    if (added) {
      mesh.positions.push_back(positions[c.position]);
      if (coloured) colours.of_vertices.push_back(position_colours[c.position]);
      if (all_have_textures_) mesh.texture_coordinates.push_back(textures[c.texture]);
      if (all_have_normals_) mesh.normals.push_back(Vec3f(safe_normalize(Vec3d(normals[c.normal]))));
    }
    return it->second;
  };
  for (size_t i = 0; i < triangles_.size(); i += 3) {
    const MeshCorner* t = &triangles_[i];
    if (!triangle_normal(positions[t[0].position], positions[t[1].position], positions[t[2].position])) {
      ++report.degenerate;
      continue;
    }
    const uint32_t a = vertex(t[0]), b = vertex(t[1]), c = vertex(t[2]);
    mesh.triangles.emplace_back(a, b, c);
    if (!colours.materials.empty()) colours.of_triangles.push_back(materials_[i / 3]);
  }
  if (std::find(colours.of_triangles.begin(), colours.of_triangles.end(), kNoMaterial) != colours.of_triangles.end()) {
    std::replace(colours.of_triangles.begin(), colours.of_triangles.end(), kNoMaterial,
                 static_cast<uint32_t>(colours.materials.size()));
    colours.materials.push_back({.name = "none", .diffuse = {0.8f, 0.8f, 0.8f}, .texture = {}, .found = true});
  }
  if (colours_out) *colours_out = std::move(colours);
  if (mesh.triangles.empty())
    return input_error(
        fmt::format("{}: the mesh is empty: none of its {} triangles has an area", file, triangles_.size() / 3));
  return mesh;
}

}  // namespace world
