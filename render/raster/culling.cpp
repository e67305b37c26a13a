#include "render/raster/culling.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <tuple>
#include <utility>

#include "render/raster/face_blocks.shared.h"

namespace render::raster {

Frustum::Frustum(const PixelRays& r)
    : planes{r.forward, r.window_half_x * r.forward + r.window_right, r.window_half_x * r.forward - r.window_right,
             r.window_half_y * r.forward + r.window_up, r.window_half_y * r.forward - r.window_up} {}

Frustum::Side Frustum::side(const Vec3d& low, const Vec3d& high) const {
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

double distance_to_box(const Vec3d& low, const Vec3d& high) {
  const Vec3d nearest = glm::max(low, glm::min(high, Vec3d(0)));
  return glm::length(nearest);
}

bool looks_away(const FaceCluster& cluster, const Vec3d& low, const Vec3d& high) {
  if (cluster.direction >= world::kFaces) return false;
  const int axis = world::face_axis(cluster.direction);
  return world::face_sign(cluster.direction) > 0 ? low[axis] >= 0 : high[axis] <= 0;
}

namespace {

Vec3d from_camera(const Camera& camera, world::VoxelPos cell, int level) {
  Vec3d corner;
  for (int a = 0; a < 3; ++a)
    corner[a] =
        static_cast<double>((int64_t{cell[a]} << level) - camera.position.voxel[a]) - camera.position.fraction[a];
  return corner;
}

double distance_to_chunk(const Camera& camera, world::VoxelPos origin, int level) {
  const Vec3d corner = from_camera(camera, origin, level);
  return distance_to_box(corner, corner + std::ldexp(kChunkSize, level));
}

/// 0..255: how much of a level is drawn at a distance.
uint32_t share_of_level(double distance, double from) {
  if (from <= 0) return 255;
  return static_cast<uint32_t>(255 * std::clamp((distance - from) / ((kBlendBand - 1) * from), 0.0, 1.0));
}

constexpr uint32_t kNotDrawn = ~0u;

/// Of a chunk, by its distance and by that of the chunk of the next level that holds it: so each place is drawn once,
/// in one level or in shares of two.
uint32_t detail_of(const CulledPool& pool, const Camera& camera, world::VoxelPos origin) {
  uint32_t own = 255, next = 0;
  if (pool.from > 0) own = share_of_level(distance_to_chunk(camera, origin, pool.level), pool.from);
  if (own == 0) return kNotDrawn;
  if (pool.to < kNoNextLevel) {
    const auto parent = [](int32_t cell) { return (cell >> (kChunkLog2 + 1)) << kChunkLog2; };
    next = share_of_level(
        distance_to_chunk(camera, {parent(origin.x), parent(origin.y), parent(origin.z)}, pool.level + 1), pool.to);
  }
  if (next == 255) return kNotDrawn;
  return static_cast<uint32_t>(pool.level) | own << kChunkOwnShift | next << kChunkNextShift;
}

VkDrawIndexedIndirectCommand draw_of(const FaceCluster& cluster, bool points, uint32_t instance, uint32_t instances) {
  return {cluster.count * (points ? 1 : 6), instances, 0, static_cast<int32_t>(cluster.first * (points ? 1 : 4)),
          instance};
}

/// Calls see(record) for each of a cluster's records, of its page, whose bit is set.
template <class See>
void each_record(const FaceCluster& cluster, const RecordBits& bits, const See& see) {
  for (uint32_t word = 0; 32 * word < cluster.count; ++word)
    for (uint32_t rest = bits[word]; rest; rest &= rest - 1) {
      const uint32_t record = 32 * word + static_cast<uint32_t>(std::countr_zero(rest));
      if (record >= cluster.count) break;
      see(cluster.first + record);
    }
}

/// Six indices for each of a cluster's faces whose bit is set.
void append_faces(const FaceCluster& cluster, const RecordBits& bits, std::vector<uint32_t>& indices) {
  each_record(cluster, bits, [&](uint32_t record) {
    for (const uint32_t of_face : kQuadCorners) indices.push_back(4 * record + of_face);
  });
}

/// Fewer faces than this in the frustum cost less than the occlusion test.
constexpr uint64_t kFewFaces = 16384;

}  // namespace

double pixels_at_one_metre(const PixelRays& rays, int height) { return height / (2 * rays.window_half_y); }

double level_distance(int level, const PixelRays& rays, int height, double error_px) {
  return 0.5 * std::ldexp(1.0, level) * pixels_at_one_metre(rays, height) / error_px;
}

void cull(std::span<const CulledPool> pools, const Camera& camera, const PixelRays& rays, double view_distance,
          bool may_test, const ListWhere& list, DrawList& out, const TakeChunks& take) {
  out.chunks.clear();
  out.pages.clear();
  out.culled = {};
  out.blends = false;
  out.draws.clear();
  out.candidates.clear();
  out.clusters.clear();
  std::vector<bool> points, by_face;  // of each page
  for (const CulledPool& p : pools) {
    points.insert(points.end(), p.pool->pages(), p.points);
    by_face.insert(by_face.end(), p.pool->pages(), p.by_face);
  }
  const auto pages = static_cast<uint32_t>(points.size());
  out.first_end.assign(pages, 0);
  out.second_end.assign(pages, 0);
  out.candidates_end.assign(pages, 0);
  out.indices.clear();
  out.listed.clear();
  out.listed_end.assign(pages, 0);
  out.second_listed.assign(pages, 0);
  out.points.clear();
  out.points_end.assign(pages, 0);
  out.second_faces = 0;
  out.first_faces = out.left_out = 0;
  const Frustum frustum(rays);
  const auto box_corner = [](const std::array<uint8_t, 3>& p) { return Vec3d(p[0], p[1], p[2]); };

  // Chunks in the frustum, front to back.
  std::vector<SeenChunk> seen;
  uint32_t first_page = 0;
  for (const CulledPool& p : pools) {
    for (PooledChunk& chunk : p.pool->chunks()) {
      const bool counts = p.level == 0 && !p.points;
      if (counts) out.culled.world += chunk.count;
      const double scale = std::ldexp(1.0, p.level);
      const Vec3d corner = from_camera(camera, chunk.origin, p.level);
      const Vec3d low = corner + scale * box_corner(chunk.box.min), high = corner + scale * box_corner(chunk.box.max);
      const double distance = distance_to_box(low, high);
      if (distance > view_distance) {
        if (counts) out.culled.distance += chunk.count;
        continue;
      }
      if (p.nearest > 0 || p.farthest < kNoNextLevel) {
        const double of_chunk = distance_to_chunk(camera, chunk.origin, p.level);
        if (of_chunk < p.nearest || of_chunk >= p.farthest) continue;
      }
      const uint32_t detail = detail_of(p, camera, chunk.origin);
      if (detail == kNotDrawn) {
        if (counts) out.culled.detail += chunk.count;
        continue;
      }
      const Frustum::Side side = frustum.side(low, high);
      if (side != Frustum::outside)
        seen.push_back({&chunk, first_page + chunk.page, &p, p.level, detail, distance, side == Frustum::straddling,
                        corner, low, high});
      else if (counts)
        out.culled.frustum += chunk.count;
    }
    first_page += static_cast<uint32_t>(p.pool->pages());
  }
  std::sort(seen.begin(), seen.end(), [](const SeenChunk& a, const SeenChunk& b) {
    return std::tie(a.distance, a.chunk->origin, a.page) < std::tie(b.distance, b.chunk->origin, b.page);
  });

  if (take) take(seen);

  // Their clusters in the frustum that look towards the camera.
  uint64_t faces = 0;
  std::vector<uint32_t> instances;  // of each cluster
  std::vector<double> distances;
  for (const SeenChunk& s : seen) {
    if (s.taken) {
      out.culled.taken += s.chunk->count;
      continue;
    }
    const size_t before = out.clusters.size();
    const double scale = std::ldexp(1.0, s.level);
    uint64_t ignored = 0;
    const auto count = [&](uint64_t& of_voxels) -> uint64_t& {
      return s.level == 0 && !s.pool->points ? of_voxels : ignored;
    };
    if (out.chunks.size() >= s.pool->most_chunks) {
      out.left_out += s.chunk->count;
      continue;
    }
    for (FaceCluster& cluster : s.chunk->clusters) {
      const Vec3d low = s.corner + scale * box_corner(cluster.box.min),
                  high = s.corner + scale * box_corner(cluster.box.max);
      if (looks_away(cluster, low, high)) {
        count(out.culled.back) += cluster.count;
        continue;
      }
      const double distance = distance_to_box(low, high);
      if (distance > view_distance) {
        count(out.culled.distance) += cluster.count;
        continue;
      }
      if (s.straddles && frustum.side(low, high) == Frustum::outside) {
        count(out.culled.frustum) += cluster.count;
        continue;
      }
      if (s.level > 0) out.culled.coarse += cluster.count;
      out.clusters.push_back(&cluster);
      instances.push_back(static_cast<uint32_t>(out.chunks.size()));
      distances.push_back(distance);
      faces += cluster.count;
    }
    if (out.clusters.size() == before) continue;
    int32_t at[3];
    for (int a = 0; a < 3; ++a)
      at[a] = static_cast<int32_t>((int64_t{s.chunk->origin[a]} << s.level) - camera.position.voxel[a]);
    out.chunks.push_back({at[0], at[1], at[2], s.detail});
    out.pages.push_back(s.page);
    out.blends |= (s.detail >> kChunkOwnShift) != 255;
  }
  const bool test = may_test && faces > kFewFaces;

  // What the first pass draws: what may have been seen last time; where little was, for instance before the first
  // picture, the nearest too.
  std::vector<RecordBits> in_first(out.clusters.size(), kAllRecords);
  if (test) {
    uint64_t first_faces = 0;
    for (size_t i = 0; i < out.clusters.size(); ++i) {
      in_first[i] = out.clusters[i]->seen;
      first_faces += out.clusters[i]->among(in_first[i]);
    }
    for (size_t i = 0; i < out.clusters.size() && first_faces < kFewFaces; ++i) {
      first_faces += out.clusters[i]->count - out.clusters[i]->among(in_first[i]);
      in_first[i] = kAllRecords;
    }
  }
  uint64_t of_cubes = 0, of_points = 0;
  for (size_t i = 0; i < out.clusters.size(); ++i) {
    const uint32_t page = out.pages[instances[i]];
    if (by_face[page]) of_cubes += out.clusters[i]->among(in_first[i]);
    if (points[page] && list.points) of_points += out.clusters[i]->among(in_first[i]);
  }
  // A point costs a pipeline half of what a face does.
  out.lists_faces = of_cubes + of_points / 2 >= list.from && of_cubes <= kMostListed && of_points <= kMostListed;
  // By page, each front to back.
  std::vector<std::vector<size_t>> of_page(pages);
  for (size_t i = 0; i < out.clusters.size(); ++i) of_page[out.pages[instances[i]]].push_back(i);

  // First pass: a draw for each run of clusters that lie together in memory, or of the faces of a chunk.
  for (uint32_t page = 0; page < pages; ++page) {
    const FaceCluster* last = nullptr;
    const uint32_t page_begin = static_cast<uint32_t>(out.draws.size());
    for (const size_t i : of_page[page]) {
      const FaceCluster& cluster = *out.clusters[i];
      const uint32_t some = cluster.among(in_first[i]);
      if (some == 0) continue;
      out.first_faces += some;
      if (out.lists_faces && by_face[page]) {
        each_record(cluster, in_first[i], [&](uint32_t record) { out.listed.push_back({record, instances[i]}); });
        continue;
      }
      if (out.lists_faces && points[page] && list.points) {
        out.points.push_back({cluster.first, cluster.count, instances[i], static_cast<float>(distances[i])});
        continue;
      }
      VkDrawIndexedIndirectCommand draw;
      bool joins = out.draws.size() > page_begin && out.draws.back().firstInstance == instances[i];
      if (test && by_face[page]) {
        draw = {6 * some, 1, static_cast<uint32_t>(out.indices.size()), 0, instances[i]};
        append_faces(cluster, in_first[i], out.indices);
      } else {
        draw = draw_of(cluster, points[page], instances[i], 1);
        joins = joins && last->first + last->count == cluster.first;
      }
      if (joins)
        out.draws.back().indexCount += draw.indexCount;
      else
        out.draws.push_back(draw);
      last = &cluster;
    }
    out.first_end[page] = static_cast<uint32_t>(out.draws.size());
    out.listed_end[page] = static_cast<uint32_t>(out.listed.size());
    out.points_end[page] = static_cast<uint32_t>(out.points.size());
  }
  if (!test) {
    for (FaceCluster* cluster : out.clusters) cluster->seen = kAllRecords;  // as far as anyone knows
    out.clusters.clear();
    out.second_end.assign(pages, static_cast<uint32_t>(out.draws.size()));
    return;
  }

  // Second pass: a draw a cluster, which the occlusion test turns on.
  std::vector<FaceCluster*> tested;
  for (uint32_t page = 0; page < pages; ++page) {
    out.second_listed[page] = out.second_faces;
    for (const size_t i : of_page[page]) {
      const FaceCluster& cluster = *out.clusters[i];
      const ChunkCorner& corner = out.chunks[instances[i]];
      const int level = static_cast<int>(corner.detail & kChunkLevel);
      const auto at = [&](int32_t chunk, uint8_t cell) { return chunk + (int32_t{cell} << level); };
      const CornerBox& box = cluster.box;
      const uint32_t rest = cluster.count - cluster.among(in_first[i]);
      Candidate candidate{{at(corner.x, box.min[0]), at(corner.y, box.min[1]), at(corner.z, box.min[2])},
                          -1,
                          {at(corner.x, box.max[0]), at(corner.y, box.max[1]), at(corner.z, box.max[2])},
                          static_cast<int32_t>(instances[i]),
                          in_first[i],
                          cluster.first,
                          cluster.count,
                          out.second_faces,
                          by_face[page] ? 1u : 0u};
      if (rest > 0) {
        candidate.draw = static_cast<int32_t>(out.draws.size());
        if (by_face[page]) {
          if (!out.lists_faces) out.draws.push_back({0, 0, 6 * out.second_faces, 0, instances[i]});
          out.second_faces += rest;
        } else {
          out.draws.push_back(draw_of(cluster, points[page], instances[i], 0));
        }
      }
      out.candidates.push_back(candidate);
      tested.push_back(out.clusters[i]);
    }
    out.candidates_end[page] = static_cast<uint32_t>(out.candidates.size());
    out.second_end[page] = static_cast<uint32_t>(out.draws.size());
  }
  out.clusters = std::move(tested);
}

}  // namespace render::raster
