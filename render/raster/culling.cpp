#include "render/raster/culling.h"

#include <algorithm>
#include <array>

namespace render::raster {

namespace {

struct Frustum {
  std::array<Vec3d, 5> planes;  // inside: dot >= 0; through the camera

  explicit Frustum(const PixelRays& r)
      : planes{r.forward, r.tan_half_x * r.forward + r.right, r.tan_half_x * r.forward - r.right,
               r.tan_half_y * r.forward + r.up, r.tan_half_y * r.forward - r.up} {}

  enum Side { outside, straddling, inside };
  Side side(const Vec3d& low, const Vec3d& high) const {
    Side result = inside;
    for (const Vec3d& n : planes) {
      double nearest = 0, farthest = 0;
      for (int a = 0; a < 3; ++a) {
        farthest += n[a] * (n[a] > 0 ? high[a] : low[a]);
        nearest += n[a] * (n[a] > 0 ? low[a] : high[a]);
      }
      if (farthest < 0) return outside;
      if (nearest <= 0) result = straddling;
    }
    return result;
  }
};

double distance_to_box(const Vec3d& low, const Vec3d& high) {
  const Vec3d nearest = glm::max(low, glm::min(high, Vec3d(0)));
  return glm::length(nearest);
}

struct Candidate {
  const PooledChunk* chunk;
  double distance;
  bool straddles;
  uint8_t directions;  // bit: draw that direction
  ChunkCorner corner;
};

}  // namespace

void cull(const FacePool& pool, const Camera& camera, const PixelRays& rays, double view_distance, DrawList& out) {
  out.chunks.clear();
  out.pages.resize(pool.pages());
  for (auto& page : out.pages) page.clear();
  out.faces = out.draws = 0;

  const Frustum frustum(rays);
  std::vector<Candidate> seen;
  for (const PooledChunk& chunk : pool.chunks()) {
    const world::VoxelPos offset = chunk.origin - camera.position.voxel;
    Candidate c{&chunk, 1e300, false, 0, {offset.x, offset.y, offset.z, 0}};
    const Vec3d corner = Vec3d(offset.x, offset.y, offset.z) - camera.position.fraction;
    for (size_t d = 0; d < world::kFaces; ++d) {
      const CornerBox& box = chunk.bounds[d];
      if (chunk.first[d + 1] == chunk.first[d]) continue;
      const Vec3d low = corner + Vec3d(box.min[0], box.min[1], box.min[2]);
      const Vec3d high = corner + Vec3d(box.max[0], box.max[1], box.max[2]);
      const int axis = world::face_axis(static_cast<int>(d));
      // A face looks towards the camera where the camera lies on its outer side.
      if (world::face_sign(static_cast<int>(d)) > 0 ? low[axis] >= 0 : high[axis] <= 0) continue;
      const double distance = distance_to_box(low, high);
      if (distance > view_distance) continue;
      const Frustum::Side side = frustum.side(low, high);
      if (side == Frustum::outside) continue;
      c.distance = std::min(c.distance, distance);
      c.straddles |= side == Frustum::straddling;
      c.directions |= static_cast<uint8_t>(1 << d);
    }
    if (c.directions) seen.push_back(c);
  }
  std::sort(seen.begin(), seen.end(), [](const Candidate& a, const Candidate& b) {
    if (a.straddles != b.straddles) return b.straddles;
    if (a.distance != b.distance) return a.distance < b.distance;
    return a.chunk->origin < b.chunk->origin;
  });

  for (const Candidate& c : seen) {
    const uint32_t instance = static_cast<uint32_t>(out.chunks.size());
    out.chunks.push_back(c.corner);
    // Neighbouring directions lie together in memory: one draw for a run of them.
    for (size_t d = 0; d < world::kFaces; ++d) {
      if (!(c.directions >> d & 1)) continue;
      const uint32_t first = c.chunk->first[d];
      while (d + 1 < world::kFaces && (c.directions >> (d + 1) & 1)) ++d;
      const uint32_t count = c.chunk->first[d + 1] - first;
      out.pages[c.chunk->page].push_back({count * 6, 1, 0, static_cast<int32_t>(first * 4), instance});
      out.faces += count;
      ++out.draws;
    }
  }
}

}  // namespace render::raster
