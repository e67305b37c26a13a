#include "render/raster/triangles.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <unordered_set>

#include <fmt/format.h>
#include <glm/mat3x3.hpp>

#include "render/raster/culling.h"
#include "world/base/jobs.h"
#include "world/store/contour_walk.h"

namespace render::raster {

using world::Vec3d;
using world::VoxelPos;

namespace {

/// A run of triangles that is drawn as one, though some of it may lie outside of the picture.
constexpr uint32_t kRunTriangles = 256;

uint32_t bits(float v) { return std::bit_cast<uint32_t>(v); }

Vec3d from_base(const world::WorldPoint& p, const VoxelPos& base) { return p - world::WorldPoint{base, Vec3d(0.0)}; }

float rounded_down(double x) {
  const float f = static_cast<float>(x);
  return f > x ? std::nextafter(f, -INFINITY) : f;
}

TriangleBox box_of(const std::array<Vec3d, 3>& corners) {
  const Vec3d low = glm::min(glm::min(corners[0], corners[1]), corners[2]),
              high = glm::max(glm::max(corners[0], corners[1]), corners[2]);
  TriangleBox box;
  for (int a = 0; a < 3; ++a) box.low[a] = rounded_down(low[a]), box.high[a] = -rounded_down(-high[a]);
  return box;
}

}  // namespace

world::Status add_meshes(const world::World& world, TriangleList& list) {
  for (const world::MeshInstance& instance : world.meshes) {
    if (instance.null_surface || !instance.mesh) continue;
    const world::TriangleMesh& mesh = *instance.mesh;
    const glm::dmat3& m = instance.transform;
    // Normals go with the cofactors, which are the inverse transpose times the determinant.
    glm::dmat3 of_normals(cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1]));
    const bool mirrored = dot(m[0], of_normals[0]) < 0;
    double largest = 0;
    for (int i = 0; i < 3; ++i) largest = std::max(largest, glm::length(of_normals[i]));
    if (largest > 0) of_normals = of_normals * ((mirrored ? -1 : 1) / largest);
    const bool checkered = instance.checkers.x > 0 && instance.checkers.y > 0;
    const auto first = static_cast<uint32_t>(list.vertices.size()),
               material = static_cast<uint32_t>(list.materials.size());
    if (list.vertices.size() + mesh.positions.size() > UINT32_MAX)
      return world::input_error(fmt::format("{}: all meshes together have more than 2^32 vertices", instance.where));
    for (size_t i = 0; i < mesh.positions.size(); ++i) {
      const Vec3d moved = m * Vec3d(mesh.positions[i]);
      for (int a = 0; a < 3; ++a)
        if (!(std::abs(instance.position.voxel[a] + instance.position.fraction[a] + moved[a]) <= world::kWorldBorder))
          return world::input_error(
              fmt::format("{}: the mesh \"{}\" reaches outside the world", instance.where, instance.name));
      TriangleList::Vertex& v = list.vertices.emplace_back();
      v.position = instance.position + moved;
      if (instance.smooth && !mesh.normals.empty()) v.normal = glm::vec3(of_normals * Vec3d(mesh.normals[i]));
      if (checkered && !mesh.texture_coordinates.empty()) v.checkers = mesh.texture_coordinates[i] * instance.checkers;
    }
    for (const glm::uvec3& t : mesh.triangles) {
      const auto at = [&](uint32_t v) { return from_base(list.vertices[first + v].position, instance.position.voxel); };
      if (!(glm::length(cross(at(t.y) - at(t.x), at(t.z) - at(t.x))) > 0)) continue;
      list.triangles.push_back(
          {{first + t.x, first + (mirrored ? t.z : t.y), first + (mirrored ? t.y : t.z)}, material});
    }
    const world::Radiance3& l = instance.radiance;
    list.materials.push_back({instance.block_id, checkered ? instance.checker_id : instance.block_id, {l.r, l.g, l.b}});
  }
  return {};
}

world::Status add_smooth_surface(const world::WorldView& view, SurfaceMethod method, float iso, TriangleList& list) {
  const std::unique_ptr<world::SurfaceField> field = world::surface_field(view.store(), iso);
  if (!field) return {};
  const world::MaskVolume& occupied = view.masks(world::MaskKind::occupied);
  TRY(const world::VoxelMesh mesh, isosurface(world::SolidField(*field, &occupied), method));
  std::vector<world::Vec3f> normals;
  if (method != SurfaceMethod::blocks) normals = vertex_normals(mesh);
  if (list.vertices.size() + mesh.vertices.size() > UINT32_MAX)
    return world::input_error("meshes and the smooth surface together have more than 2^32 vertices");
  const auto first = static_cast<uint32_t>(list.vertices.size());
  list.vertices.resize(first + mesh.vertices.size());
  for (size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Vec3d& v = mesh.vertices[i];
    list.vertices[first + i].position = world::WorldPoint::from(v.x, v.y, v.z);
    if (!normals.empty()) list.vertices[first + i].normal = normals[i];
  }
  // Of the voxel below the middle of a triangle, as the ray caster's contours.
  std::vector<world::BlockId> blocks(mesh.triangles.size(), world::kAir);
  world::parallel_ranges(mesh.triangles.size(), 4096, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const glm::uvec3& t = mesh.triangles[i];
      const Vec3d &a = mesh.vertices[t.x], &b = mesh.vertices[t.y], &c = mesh.vertices[t.z];
      const Vec3d across = cross(b - a, c - a);
      const double size = glm::length(across);
      if (!(size > 0)) continue;
      const Vec3d normal = across / size, middle = (a + b + c) / 3.0 - 1e-3 * normal;
      const VoxelPos own = world::WorldPoint::from(middle.x, middle.y, middle.z).voxel;
      blocks[i] = view.store().get(world::matter_voxel(occupied, own, normal));
    }
  });
  std::map<world::BlockId, uint32_t> materials;
  for (size_t i = 0; i < mesh.triangles.size(); ++i) {
    const glm::uvec3& t = mesh.triangles[i];
    if (blocks[i] == world::kAir) continue;  // without area, or of nothing
    const auto [material, added] = materials.try_emplace(blocks[i], static_cast<uint32_t>(list.materials.size()));
    if (added) list.materials.push_back({.block = blocks[i], .second = blocks[i], .smooth = true});
    list.triangles.push_back({{first + t.x, first + t.y, first + t.z}, material->second});
  }
  return {};
}

void DrawnTriangles::clear() {
  const uint64_t kept_limit = binding_limit, version = version_;
  *this = {};
  binding_limit = kept_limit, version_ = version + 1;
}

world::Result<uint64_t> DrawnTriangles::set(gpu::Device& device, const TriangleList& list, const std::string& what) {
  clear();
  if (list.triangles.empty()) return uint64_t{0};
  const uint64_t most_texels = std::min<uint64_t>(binding_limit / 16, device.limits().maxTexelBufferElements);
  const auto texels_of = [&](uint64_t nodes) {
    return 2 * nodes + list.triangles.size() + 3 * list.vertices.size() + 2 * list.materials.size();
  };
  const auto drop = [&](uint64_t texels) {
    dropped_.push_back(fmt::format("{} ({} triangles, {} MiB) are not drawn: a buffer of this device holds {} MiB",
                                   what, list.triangles.size(), texels >> 16, most_texels >> 16));
    return uint64_t{0};
  };
  if (texels_of(0) > most_texels || list.triangles.size() >= (uint64_t{1} << (32 - kNodeLeafBits)))
    return drop(texels_of(0));

  Vec3d low(INFINITY), high(-INFINITY);
  const VoxelPos anchor = list.vertices[0].position.voxel;
  for (const TriangleList::Vertex& v : list.vertices) {
    const Vec3d at = from_base(v.position, anchor);
    low = glm::min(low, at), high = glm::max(high, at);
  }
  const Vec3d middle = glm::floor(0.5 * (low + high));
  base_ =
      anchor + VoxelPos{static_cast<int32_t>(middle.x), static_cast<int32_t>(middle.y), static_cast<int32_t>(middle.z)};
  std::vector<TriangleBox> boxes;
  boxes.reserve(list.triangles.size());
  for (const TriangleList::Triangle& t : list.triangles) {
    std::array<Vec3d, 3> corners;
    for (size_t k = 0; k < 3; ++k) corners[k] = from_base(list.vertices[t.corners[k]].position, base_);
    boxes.push_back(box_of(corners));
  }
  tree_ = triangle_tree(boxes);
  const uint64_t texels = texels_of(tree_.nodes.size());
  if (texels > most_texels) {
    tree_ = {};
    return drop(texels);
  }
  for (int a = 0; a < 3; ++a)
    reach_ = std::max({reach_, std::abs(tree_.nodes[0].low[a]), std::abs(tree_.nodes[0].high[a])});

  bytes_ = texels * 16;
  TRY(texels_, gpu::make_texel_buffer(device, bytes_, VK_FORMAT_R32G32B32A32_UINT, 0, gpu::MemoryUse::upload));
  auto* out = reinterpret_cast<glm::uvec4*>(texels_.mapped());
  for (const TriangleNode& n : tree_.nodes) {
    *out++ = {bits(n.low.x), bits(n.low.y), bits(n.low.z), n.skip};
    *out++ = {bits(n.high.x), bits(n.high.y), bits(n.high.z), n.leaf};
  }
  triangles_at_ = static_cast<uint32_t>(2 * tree_.nodes.size());
  corners_.reserve(tree_.order.size());
  for (const uint32_t number : tree_.order) {
    const TriangleList::Triangle& t = list.triangles[number];
    *out++ = {t.corners[0], t.corners[1], t.corners[2], t.material};
    auto& corners = corners_.emplace_back();
    for (size_t k = 0; k < 3; ++k) corners[k] = glm::vec3(from_base(list.vertices[t.corners[k]].position, base_));
  }
  vertices_at_ = static_cast<uint32_t>(triangles_at_ + list.triangles.size());
  for (const TriangleList::Vertex& v : list.vertices) {
    const glm::vec3 fraction(v.position.fraction);
    const auto word = [](int32_t i) { return static_cast<uint32_t>(i); };
    *out++ = {word(v.position.voxel.x), word(v.position.voxel.y), word(v.position.voxel.z), bits(fraction.x)};
    *out++ = {bits(fraction.y), bits(fraction.z), bits(v.normal.x), bits(v.normal.y)};
    *out++ = {bits(v.normal.z), bits(v.checkers.x), bits(v.checkers.y), 0};
  }
  materials_at_ = static_cast<uint32_t>(vertices_at_ + 3 * list.vertices.size());
  for (const TriangleList::Material& m : list.materials) {
    *out++ = {m.block, m.second, m.smooth, 0};
    *out++ = {bits(m.emitted.x), bits(m.emitted.y), bits(m.emitted.z), 0};
  }
  return bytes_;
}

void DrawnTriangles::cull(const Camera& camera, const PixelRays& rays, double view_distance,
                          std::vector<Run>& out) const {
  out.clear();
  const Frustum frustum(rays);
  const Vec3d base = -from_base(camera.position, base_);  // relative to the camera
  for (uint32_t i = 0; i < tree_.nodes.size();) {
    const TriangleNode& node = tree_.nodes[i];
    const Vec3d low = base + Vec3d(node.low), high = base + Vec3d(node.high);
    const Frustum::Side side = frustum.side(low, high);
    if (side == Frustum::outside || distance_to_box(low, high) > view_distance) {
      i = node.skip;
      continue;
    }
    const uint32_t first = tree_.first[i], count = tree_.first[node.skip] - first;
    if (side == Frustum::straddling && count > kRunTriangles) {
      ++i;
      continue;
    }
    if (!out.empty() && out.back().first + out.back().count == first)
      out.back().count += count;
    else
      out.push_back({first, count});
    i = node.skip;
  }
}

double DrawnTriangles::distance(const world::WorldPoint& from, double most) const {
  const Vec3d base = -from_base(from, base_);
  for (uint32_t i = 0; i < tree_.nodes.size();) {
    const TriangleNode& node = tree_.nodes[i];
    // Corners are rounded by half a unit of their last place.
    const double rounding = reach_ * 0x1p-23,
                 box = distance_to_box(base + Vec3d(node.low), base + Vec3d(node.high)) - rounding;
    if (box >= most) {
      i = node.skip;
      continue;
    }
    for (uint32_t k = node.leaf >> kNodeLeafBits, end = k + (node.leaf & ((1u << kNodeLeafBits) - 1)); k < end; ++k) {
      const Vec3d a = base + Vec3d(corners_[k][0]), b = base + Vec3d(corners_[k][1]), c = base + Vec3d(corners_[k][2]),
                  normal = cross(b - a, c - a);
      const double size = glm::length(normal);
      const double plane = size > 0 ? std::abs(dot(normal, a)) / size - rounding : 0;
      most = std::min(
          most,
          std::max({plane, distance_to_box(glm::min(glm::min(a, b), c), glm::max(glm::max(a, b), c)) - rounding, 0.0}));
    }
    ++i;
  }
  return most;
}

std::vector<world::LeafPos> DrawnTriangles::leaves_around(std::span<const world::RegionPos> regions) const {
  const std::unordered_set<world::RegionPos, world::PosHash> wanted(regions.begin(), regions.end());
  std::unordered_set<world::LeafPos, world::PosHash> found;
  constexpr double kAround = 1.25;  // shading looks at middles of voxels less than 1 from a point at most 0.25 off
  for (const auto& corners : corners_) {
    const Vec3d a(corners[0]), b(corners[1]), c(corners[2]), normal = cross(b - a, c - a);
    const Vec3d low = glm::min(glm::min(a, b), c), high = glm::max(glm::max(a, b), c);
    // A cube of 2^level leaves, relative to the base: whether the triangle's box and its plane come near; and its
    // parts.
    const auto add = [&](const auto& self, const world::LeafPos& corner, int level) -> void {
      if (level == 0 && found.contains(corner)) return;
      const double half = 0.5 * world::kLeafSize * (1 << level);
      const VoxelPos first = world::voxel_from_leaf(corner);
      const Vec3d middle =
          Vec3d(double(first.x) - base_.x, double(first.y) - base_.y, double(first.z) - base_.z) + half;
      const double near = half + kAround;
      for (int k = 0; k < 3; ++k)
        if (middle[k] + near < low[k] || middle[k] - near > high[k]) return;
      if (std::abs(dot(normal, middle - a)) > near * (std::abs(normal.x) + std::abs(normal.y) + std::abs(normal.z)))
        return;
      if (level == 0) {
        found.insert(corner);
        return;
      }
      const int step = 1 << (level - 1);
      for (int i = 0; i < 8; ++i)
        self(self, corner + world::LeafPos{(i & 1) * step, (i >> 1 & 1) * step, (i >> 2) * step}, level - 1);
    };
    constexpr int kRegionLevel = std::countr_zero(static_cast<unsigned>(world::kRegionLeaves));
    const auto region_of = [&](const Vec3d& p, double off) {
      const world::WorldPoint at = world::WorldPoint{base_, Vec3d(0.0)} + (p + off);
      return world::region_from_voxel(at.voxel);
    };
    const world::RegionPos first = region_of(low, -kAround), last = region_of(high, kAround);
    double count = 1;
    for (int k = 0; k < 3; ++k) count *= double(last[k]) - first[k] + 1;
    if (count > double(regions.size())) {
      for (const world::RegionPos& r : regions) add(add, world::leaf_from_region(r), kRegionLevel);
      continue;
    }
    for (int x = first.x; x <= last.x; ++x)
      for (int y = first.y; y <= last.y; ++y)
        for (int z = first.z; z <= last.z; ++z)
          if (const world::RegionPos r{x, y, z}; wanted.contains(r)) add(add, world::leaf_from_region(r), kRegionLevel);
  }
  std::vector<world::LeafPos> all(found.begin(), found.end());
  std::sort(all.begin(), all.end());
  return all;
}

void DrawnTriangles::describe(PictureConstants& picture) const {
  picture.meshes = uvec4(static_cast<uint32_t>(tree_.nodes.size()), triangles_at_, vertices_at_, materials_at_);
  picture.mesh_base = ivec4(base_.x, base_.y, base_.z, std::bit_cast<int>(reach_));
}

}  // namespace render::raster
