#include "tools/bench/ray_sets.h"

#include <cmath>

#include "world/base/random.h"
#include "world/store/mask_walk.h"

namespace tools {

namespace {

using world::GridHit;
using world::GridRay;
using world::MaskWalker;
using world::Vec3d;
using world::Vec3f;

constexpr int kTile = 8;

BenchRay bench_ray(const GridRay& ray) {
  return {ray.voxel, Vec3f(ray.fraction), Vec3f(glm::normalize(ray.direction))};
}

void add_primary(const render::Camera& camera, int width, int height, std::vector<BenchRay>& rays) {
  const render::PixelRays pixels(camera, width, height);
  for (int ty = 0; ty < height; ty += kTile)
    for (int tx = 0; tx < width; tx += kTile)
      for (int i = 0; i < kTile * kTile; ++i) {
        const int x = tx + ((i & 1) | (i >> 1 & 2) | (i >> 2 & 4)),
                  y = ty + ((i >> 1 & 1) | (i >> 2 & 2) | (i >> 3 & 4));
        if (x < width && y < height)
          rays.push_back(bench_ray(GridRay(camera.position, pixels.direction(x + 0.5, y + 0.5))));
      }
}

/// source Malley's method: a uniform point of the disk, lifted onto the hemisphere
Vec3d cosine_direction(int face, uint64_t seed, size_t index) {
  const auto random = [&](int k) {
    return world::uniform01_double(world::random_bits(seed, static_cast<int64_t>(index), k, 0));
  };
  const double u = random(0), radius = std::sqrt(u), angle = 2 * 3.14159265358979323846 * random(1);
  const int axis = world::face_axis(face);
  Vec3d direction;
  direction[axis] = world::face_sign(face) * std::sqrt(1 - u);
  direction[(axis + 1) % 3] = radius * std::cos(angle);
  direction[(axis + 2) % 3] = radius * std::sin(angle);
  return direction;
}

}  // namespace

RaySets make_ray_sets(const world::MaskVolume& occupied, std::span<const render::Camera> cameras, int width, int height,
                      const Vec3d& sun, uint64_t seed) {
  RaySets sets;
  for (const render::Camera& camera : cameras) add_primary(camera, width, height, sets.primary);

  const MaskWalker walker(occupied);
  std::vector<GridHit> hits(sets.primary.size());
  cast_in_parallel(hits.size(), [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) hits[i] = walker.first_set(sets.primary[i].grid());
  });
  for (size_t i = 0; i < hits.size(); ++i) {
    const GridHit& hit = hits[i];
    if (!hit.hit() || hit.face == world::kNoFace) continue;
    const GridRay ray = sets.primary[i].grid();
    sets.diffuse.push_back(bench_ray(world::ray_from_surface(ray, hit, cosine_direction(hit.face, seed, i))));
    if (world::face_sign(hit.face) * sun[world::face_axis(hit.face)] > 0)
      sets.shadow.push_back(bench_ray(world::ray_from_surface(ray, hit, sun)));
  }
  return sets;
}

std::vector<BenchRay> sample_blocks(std::span<const BenchRay> rays, size_t every) {
  constexpr size_t kBlock = 64;
  std::vector<BenchRay> sample;
  for (size_t begin = 0; begin < rays.size(); begin += every * kBlock) {
    const auto block = rays.subspan(begin, std::min(kBlock, rays.size() - begin));
    sample.insert(sample.end(), block.begin(), block.end());
  }
  return sample;
}

}  // namespace tools
