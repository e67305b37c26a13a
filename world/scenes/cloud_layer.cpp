#include "world/scenes/cloud_layer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace world {

namespace {

using shared::CloudLayer;

constexpr double kLowestSun = 0.08;      // sine of the lowest sun whose shadows go as far as they should
constexpr float kShadedLand = 0.5f;      // of the light that land sends up, what a closed layer takes
constexpr size_t kQuantiles = 64;        // steps of the table below
constexpr int kPlaces = 128;             // a side, that it is measured at
constexpr float kBetweenPlaces = 0.37f;  // cells

/// Of the lumps of any seed: below the i-th number lie i / kQuantiles of all places.
const std::array<float, kQuantiles + 1>& lump_quantiles() {
  static const auto table = [] {
    std::vector<float> lumps;
    const CloudLayer layer{};
    for (int x = 0; x < kPlaces; ++x)
      for (int z = 0; z < kPlaces; ++z) lumps.push_back(cloud_lumps(layer, kBetweenPlaces * glm::vec2(x, z), 0));
    std::sort(lumps.begin(), lumps.end());
    std::array<float, kQuantiles + 1> t{};
    for (size_t i = 1; i < kQuantiles; ++i) t[i] = lumps[i * lumps.size() / kQuantiles];
    t[kQuantiles] = 1;  // what noise can't reach
    return t;
  }();
  return table;
}

/// How far above the threshold lumps hide half of what lies behind them.
float half_opaque(const Clouds& clouds) {
  float low = 0, high = 1;
  for (int i = 0; i < 24; ++i) {
    const float middle = 0.5f * (low + high);
    const bool thin = shared::cloud_column(middle) * clouds.extinction * clouds.thickness < std::numbers::ln2_v<float>;
    (thin ? low : high) = middle;
  }
  return high;
}

/// So that `cover` of all places are more than half opaque.
float threshold_of(const Clouds& clouds) {
  const float at = std::clamp(1 - clouds.cover, 0.0f, 1.0f) * kQuantiles;
  const auto i = std::min(static_cast<size_t>(at), kQuantiles - 1);
  const auto& table = lump_quantiles();
  return glm::mix(table[i], table[i + 1], at - static_cast<float>(i)) - half_opaque(clouds);
}

glm::vec4 vec4_of(const auto& bands) { return {bands.r, bands.g, bands.b, 0}; }

}  // namespace

CloudLayer cloud_layer(const Environment& e, VoxelPos from) {
  const Clouds& clouds = e.clouds;
  CloudLayer layer{};
  const double size = clouds.size;
  // With the wind lumps come from where it blows from.
  const glm::dvec2 cells = (glm::dvec2(from.x, from.z) - glm::dvec2(clouds.drifted.x, clouds.drifted.z)) / size,
                   whole = glm::floor(cells), rest = cells - whole;
  layer.place = glm::vec4(rest.x, double{clouds.height} - from.y, rest.y, 1 / size);
  layer.cell = {static_cast<int>(whole.x), static_cast<int>(whole.y),
                static_cast<int>(clouds.seed * 0x9e3779b1u & 0x7fffffffu), 0};
  layer.shape = {clouds.thickness, clouds.extinction, threshold_of(clouds),
                 static_cast<float>(std::max(e.sun_direction.y, kLowestSun))};
  layer.sun = glm::vec4(glm::vec3(e.sun_direction), 0);
  layer.sun_light = vec4_of(e.sun_irradiance);
  layer.sky_light = 0.5f * (vec4_of(e.sky_zenith) + vec4_of(e.sky_horizon));
  layer.ground_light = (1 - kShadedLand * clouds.cover) * vec4_of(e.sky_ground);
  return layer;
}

}  // namespace world
