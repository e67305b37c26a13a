#include "render/light/sun_map.h"

#include <cmath>

#include <fmt/format.h>

#include "world/base/jobs.h"

namespace render {

using world::Vec3d;

namespace {
constexpr double kMostTexels = 1 << 25;  // 128 MiB
constexpr int kTile = 8;                 // texels a side whose rays are cast together
}  // namespace

void SunMap::clear() {
  if (depths_.empty()) return;
  depths_ = std::vector<float>();
  store_ = 0;
  ++version_;
}

world::Status SunMap::follow(const world::WorldView& view, const world::RayStream& opaque, float texel,
                             const Vec3d& sun) {
  const uint64_t blocks = opaque.walker().volume().version();
  if (store_ == view.store().identity() && blocks_ == blocks && sun_ == sun && frame_.w.w == texel) return {};
  const world::VoxelBox box = view.store().bounds();

  // Lay the map over the box as the sun sees it.
  const Vec3d w = -sun;
  const Vec3d aside = std::abs(w.y) < 0.9 ? Vec3d(0, 1, 0) : Vec3d(1, 0, 0);
  const Vec3d u = glm::normalize(glm::cross(aside, w)), v = glm::cross(w, u);
  Vec3d low(1e300), high(-1e300);
  for (int corner = 0; corner < 8; ++corner) {
    Vec3d p;
    for (int a = 0; a < 3; ++a) p[a] = corner >> a & 1 ? double(box.max[a]) - box.min[a] + 1 : 0;
    const Vec3d q(glm::dot(p, u), glm::dot(p, v), glm::dot(p, w));
    low = glm::min(low, q), high = glm::max(high, q);
  }
  const double width = std::ceil((high.x - low.x) / texel) + 2, height = std::ceil((high.y - low.y) / texel) + 2;
  if (width * height > kMostTexels)
    return world::usage_error(
        fmt::format("sun_map_texel: {} m would take {:.0f} x {:.0f} texels of this world, more than {}; "
                    "use a larger texel, or sun_shadow=ray",
                    texel, width, height, kMostTexels));
  frame_.u = glm::vec4(glm::vec3(u), static_cast<float>(low.x / texel - 1));
  frame_.v = glm::vec4(glm::vec3(v), static_cast<float>(low.y / texel - 1));
  frame_.w = glm::vec4(glm::vec3(w), texel);
  frame_.low = glm::ivec4(box.min.x, box.min.y, box.min.z, 0);
  frame_.size = glm::ivec4(static_cast<int>(width), static_cast<int>(height), 0, 0);
  store_ = view.store().identity(), blocks_ = blocks, sun_ = sun;
  ++version_;

  // Cast a ray through the middle of each texel, from before the box.
  depths_.assign(static_cast<size_t>(frame_.size.x) * static_cast<size_t>(frame_.size.y), 0);
  const int tiles_along = (frame_.size.x + kTile - 1) / kTile, rows = (frame_.size.y + kTile - 1) / kTile;
  const world::WorldPoint corner{box.min, Vec3d(0.0)};
  world::parallel_ranges(static_cast<size_t>(rows), 1, [&](size_t begin, size_t end) {
    std::vector<world::GridRay> rays;
    std::vector<world::GridHit> hits;
    std::vector<size_t> texels;
    for (size_t row = begin; row < end; ++row) {
      rays.clear(), texels.clear();
      for (int tile = 0; tile < tiles_along; ++tile)
        for (int i = 0; i < kTile * kTile; ++i) {
          const int x = tile * kTile + i % kTile, y = static_cast<int>(row) * kTile + i / kTile;
          if (x >= frame_.size.x || y >= frame_.size.y) continue;
          const Vec3d start =
              u * ((x + 0.5 + frame_.u.w) * texel) + v * ((y + 0.5 + frame_.v.w) * texel) + w * (low.z - 1);
          world::GridRay& ray = rays.emplace_back(corner + start, w);
          ray.t_max = high.z - low.z + 2;
          texels.push_back(static_cast<size_t>(y) * static_cast<size_t>(frame_.size.x) + static_cast<size_t>(x));
        }
      hits.resize(rays.size());
      opaque.first_set_coherent(rays, hits);
      for (size_t i = 0; i < rays.size(); ++i)
        depths_[texels[i]] = hits[i].hit() ? static_cast<float>(hits[i].t + low.z - 1) : 1e30f;
    }
  });
  return {};
}

float SunMap::lit_at(float x, float y, float reach) const {
  if (!(x >= 0 && y >= 0 && x < static_cast<float>(frame_.size.x - 1) && y < static_cast<float>(frame_.size.y - 1)))
    return 1;
  const size_t at = static_cast<size_t>(y) * static_cast<size_t>(frame_.size.x) + static_cast<size_t>(x);
  const size_t next = at + static_cast<size_t>(frame_.size.x);
  return shared::sun_map_lit({depths_[at], depths_[at + 1], depths_[next], depths_[next + 1]},
                             {x - std::floor(x), y - std::floor(y)}, reach);
}

float SunMap::lit(const world::WorldPoint& point, float cosine, int filter) const {
  if (depths_.empty()) return 1;
  const world::WorldPoint corner{{frame_.low.x, frame_.low.y, frame_.low.z}, Vec3d(0.0)};
  const glm::vec3 place = shared::sun_map_place(frame_, glm::vec3(point - corner));
  const float bias = shared::sun_map_filtered_bias(frame_.w.w, cosine, filter);
  const float first = 0.5f - 0.5f * static_cast<float>(filter);
  float sum = 0;
  for (int j = 0; j < filter; ++j)
    for (int i = 0; i < filter; ++i)
      sum += lit_at(place.x - 0.5f + first + static_cast<float>(i), place.y - 0.5f + first + static_cast<float>(j),
                    place.z - bias);
  return sum / static_cast<float>(filter * filter);
}

}  // namespace render
