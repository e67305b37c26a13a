#include "world/saves/meta.h"

#include <array>
#include <charconv>
#include <cmath>
#include <span>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "world/saves/surroundings.h"
#include "world/scenes/cloud_limits.h"

namespace world {

namespace {

bool parse_numbers(const std::string& text, std::span<double> out) {
  const char *at = text.data(), *end = at + text.size();
  for (double& value : out) {
    while (at != end && *at == ' ') ++at;
    const auto parsed = std::from_chars(at, end, value);
    if (parsed.ec != std::errc() || !std::isfinite(value)) return false;
    at = parsed.ptr;
  }
  return at == end;
}

/// In the order of this row's numbers.
std::array<double, 12> numbers_of(const Clouds& c) {
  return {c.cover,   c.height,  c.thickness, c.size,      c.extinction, c.drift.x,
          c.drift.y, c.drift.z, c.drifted.x, c.drifted.y, c.drifted.z,  static_cast<double>(c.seed)};
}

bool read_clouds(Clouds& clouds, const std::string& text) {
  double v[12];
  if (!parse_numbers(text, v)) return false;
  const auto number = [&](int i) { return static_cast<float>(v[i]); };
  clouds = {number(0), number(1), number(2), number(3), number(4), {v[5], v[6], v[7]}, {v[8], v[9], v[10]}, 0};
  if (!(v[11] >= 0 && v[11] <= UINT32_MAX)) return false;
  clouds.seed = static_cast<uint32_t>(v[11]);
  return within_limits(clouds);
}

bool read_environment(Environment& e, const std::string& key, const std::string& text) {
  if (key == "environment.temperature") {
    const char* const end = text.data() + text.size();
    const auto parsed = std::from_chars(text.data(), end, e.temperature.value);
    return parsed.ec == std::errc() && parsed.ptr == end && e.temperature.value > 0 &&
           e.temperature.value <= kHighestTemperature;
  }
  if (key == "environment.clouds") return read_clouds(e.clouds, text);
  double v[3];
  if (!parse_numbers(text, v)) return false;
  const auto bands = [&](auto& field) {
    field = {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
    return v[0] >= 0 && v[1] >= 0 && v[2] >= 0;
  };
  if (key == "environment.sun_direction") {
    e.sun_direction = {v[0], v[1], v[2]};
    return std::abs(glm::length(e.sun_direction) - 1) < 1e-6;
  }
  if (key == "environment.sun_irradiance") return bands(e.sun_irradiance);
  if (key == "environment.sky_zenith") return bands(e.sky_zenith);
  if (key == "environment.sky_horizon") return bands(e.sky_horizon);
  if (key == "environment.sky_ground") return bands(e.sky_ground);
  return false;
}

}  // namespace

Meta meta_of(const World& world) {
  const auto three = [](auto a, auto b, auto c) { return fmt::format("{} {} {}", a, b, c); };
  const Environment& e = world.environment;
  Meta meta;
  meta.rows = {{"environment.sun_direction", three(e.sun_direction.x, e.sun_direction.y, e.sun_direction.z)},
               {"environment.sun_irradiance", three(e.sun_irradiance.r, e.sun_irradiance.g, e.sun_irradiance.b)},
               {"environment.sky_zenith", three(e.sky_zenith.r, e.sky_zenith.g, e.sky_zenith.b)},
               {"environment.sky_horizon", three(e.sky_horizon.r, e.sky_horizon.g, e.sky_horizon.b)},
               {"environment.sky_ground", three(e.sky_ground.r, e.sky_ground.g, e.sky_ground.b)},
               {"environment.temperature", fmt::format("{}", e.temperature.value)}};
  if (e.clouds != Clouds{}) meta.rows["environment.clouds"] = fmt::format("{}", fmt::join(numbers_of(e.clouds), " "));
  for (const auto& [key, value] : world.metadata) meta.rows["metadata." + key] = value;
  put_surroundings(world, meta.rows, meta.assets);
  return meta;
}

Status read_meta_row(World& world, const std::string& key, const std::string& text, const std::string& where,
                     AssetReader& assets) {
  if (key.starts_with("metadata.")) {
    world.metadata[key.substr(9)] = text;
    return {};
  }
  if (key.starts_with("save.")) return {};
  if (key.starts_with("scene.")) return read_surroundings(world, key, text, where, assets);
  if (read_environment(world.environment, key, text)) return {};
  return input_error(fmt::format("{}: the entry \"{}\" = \"{}\" is not what it should be, numbers in their range",
                                 where, key.substr(0, 60), text.substr(0, 60)));
}

}  // namespace world
