#include "sim/light/lamps.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "world/base/jobs.h"
#include "world/store/ray_stream.h"

namespace sim {

using world::Vec3d;

namespace {

constexpr double kPi = 3.14159265358979323846;

/// Glowing faces of one block in one plane: a rectangle of whole faces.
struct Lamp {
  int face = 0;                               // of the clear voxels before it, towards it
  int32_t plane = 0;                          // voxel of those along the face's axis
  int32_t low[2] = {0, 0}, size[2] = {1, 1};  // voxels along the other two axes
  world::BlockId block = world::kAir;
  std::vector<uint32_t> surfaces;
  double power = 0;  // W/m^2 summed over faces, to choose by
};

struct Axes {
  int normal, u, v;
};
Axes axes_of(int face) {
  const int n = world::face_axis(face);
  return {n, n == 0 ? 1 : 0, n == 2 ? 1 : 2};
}

std::vector<Lamp> merge_lamps(const FluxGrid& grid, const world::BlockPalette& palette) {
  // Runs along u, then runs of equal extent along v.
  using Plane = std::tuple<int, int32_t, world::BlockId>;
  std::map<Plane, std::map<std::pair<int32_t, int32_t>, uint32_t>> planes;  // (v, u) -> surface
  for (uint32_t i = 0; i < grid.surfaces.size(); ++i) {
    const Surface& s = grid.surfaces[i];
    if (!(palette[s.block].emission.max() > 0)) continue;
    const Axes a = axes_of(s.face);
    planes[{s.face, s.voxel[a.normal], s.block}][{s.voxel[a.v], s.voxel[a.u]}] = i;
  }
  std::vector<Lamp> lamps;
  for (const auto& [plane, faces] : planes) {
    std::vector<Lamp> open;  // whose last row is that above the one at hand
    std::vector<Lamp> row;
    int32_t row_v = INT32_MIN;
    const auto end_row = [&](int32_t next_v) {
      for (Lamp& run : row) {
        const auto above = std::find_if(open.begin(), open.end(), [&](const Lamp& l) {
          return l.low[0] == run.low[0] && l.size[0] == run.size[0] && l.low[1] + l.size[1] == run.low[1];
        });
        if (above == open.end()) continue;
        run.low[1] = above->low[1], run.size[1] = above->size[1] + 1;
        run.surfaces.insert(run.surfaces.end(), above->surfaces.begin(), above->surfaces.end());
        open.erase(above);
      }
      lamps.insert(lamps.end(), open.begin(), open.end());
      open = std::move(row);
      row.clear();
      row_v = next_v;
    };
    for (const auto& [place, surface] : faces) {
      const auto [v, u] = place;
      if (v != row_v) end_row(v);
      if (!row.empty() && row.back().low[0] + row.back().size[0] == u) {
        ++row.back().size[0];
        row.back().surfaces.push_back(surface);
        continue;
      }
      Lamp& run = row.emplace_back();
      run.face = std::get<0>(plane), run.plane = std::get<1>(plane), run.block = std::get<2>(plane);
      run.low[0] = u, run.low[1] = v;
      run.surfaces = {surface};
    }
    end_row(INT32_MAX);
    end_row(INT32_MAX);
  }
  for (Lamp& l : lamps) l.power = double(palette[l.block].emission.max()) * l.size[0] * l.size[1];
  return lamps;
}

/// Relative to the grid's corner, m.
std::vector<Vec3d> points_of(const Lamp& lamp, const world::VoxelPos& corner, int points) {
  // As even as the rectangle allows: n_u / n_v near its sides' ratio.
  const double ratio = double(lamp.size[0]) / lamp.size[1];
  const int along_u = std::clamp(static_cast<int>(std::lround(std::sqrt(points * ratio))), 1, points);
  const int along_v = std::max(1, (points + along_u - 1) / along_u);
  const Axes a = axes_of(lamp.face);
  std::vector<Vec3d> all;
  for (int j = 0; j < along_v; ++j)
    for (int i = 0; i < along_u; ++i) {
      Vec3d p;
      p[a.normal] = double(lamp.plane - corner[a.normal]) + (world::face_sign(lamp.face) > 0 ? 1 : 0);
      p[a.u] = double(lamp.low[0] - corner[a.u]) + lamp.size[0] * (i + 0.5) / along_u;
      p[a.v] = double(lamp.low[1] - corner[a.v]) + lamp.size[1] * (j + 0.5) / along_v;
      all.push_back(p);
    }
  return all;
}

}  // namespace

LampLight lamps_on_surfaces(const world::Store& store, const FluxGrid& grid, int points, size_t most_lamps) {
  LampLight light;
  const world::BlockPalette& palette = store.palette();
  std::vector<Lamp> lamps = merge_lamps(grid, palette);
  if (lamps.empty()) return light;
  std::stable_sort(lamps.begin(), lamps.end(), [](const Lamp& a, const Lamp& b) { return a.power > b.power; });
  if (lamps.size() > most_lamps) lamps.resize(most_lamps);
  light.lamps = lamps.size();
  for (const Lamp& l : lamps) light.glowing.insert(light.glowing.end(), l.surfaces.begin(), l.surfaces.end());
  std::sort(light.glowing.begin(), light.glowing.end());

  const world::VoxelPos corner = world::voxel_from_leaf(grid.low);
  std::vector<std::vector<Vec3d>> points_of_lamp;
  for (const Lamp& l : lamps) points_of_lamp.push_back(points_of(l, corner, std::max(points, 1)));
  light.irradiance.resize(grid.surfaces.size());
  world::StoreRays rays;
  const world::RayStream& opaque = rays.stream(store, world::MaskKind::opaque);
  constexpr size_t kAtOnce = 256;  // surfaces
  world::parallel_ranges(grid.surfaces.size(), kAtOnce, [&](size_t begin, size_t end) {
    struct Sent {
      uint32_t surface, lamp;
      float irradiance;  // of radiance 1
    };
    std::vector<world::GridRay> starts;
    std::vector<Sent> sent;
    std::vector<uint8_t> blocked;
    for (size_t i = begin; i < end; ++i) {
      const Surface& s = grid.surfaces[i];
      const int axis = world::face_axis(s.face);
      Vec3d middle;
      for (int a = 0; a < 3; ++a) middle[a] = double(s.voxel[a] - corner[a]) + 0.5;
      middle[axis] += 0.5 * world::face_sign(s.face);
      for (size_t l = 0; l < lamps.size(); ++l) {
        const int lamp_axis = world::face_axis(lamps[l].face);
        const double area = double(lamps[l].size[0]) * lamps[l].size[1] / double(points_of_lamp[l].size());
        for (const Vec3d& point : points_of_lamp[l]) {
          const Vec3d way = point - middle;
          // Both look at each other: the surface away from its wall, the lamp away from its block.
          const double here = -world::face_sign(s.face) * way[axis];
          const double there = world::face_sign(lamps[l].face) * way[lamp_axis];
          if (!(here > 1e-9 && there > 1e-9)) continue;
          const double square = glm::dot(way, way);
          world::GridRay ray;
          ray.voxel = s.voxel;
          ray.fraction = Vec3d(0.5);
          ray.fraction[axis] = world::face_sign(s.face) > 0 ? 1.0 : 0.0;
          ray.direction = way;
          ray.t_max = 1 - 1e-6;  // the lamp's own block begins at 1
          starts.push_back(ray);
          // A point closer than half a voxel stands for the part of its rectangle around it.
          sent.push_back({static_cast<uint32_t>(i), static_cast<uint32_t>(l),
                          static_cast<float>(here * there * area / (square * std::max(square, area / kPi)))});
        }
      }
    }
    blocked.resize(starts.size());
    opaque.any_set(starts, blocked);
    for (size_t k = 0; k < sent.size(); ++k) {
      if (blocked[k]) continue;
      const world::Power3& p = palette[lamps[sent[k].lamp].block].emission;
      const float of_watts = sent[k].irradiance / static_cast<float>(6 * kPi);
      world::Irradiance3& e = light.irradiance[sent[k].surface];
      e = e + world::Irradiance3{p.r * of_watts, p.g * of_watts, p.b * of_watts};
    }
  });
  return light;
}

}  // namespace sim
