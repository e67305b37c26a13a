#include "world/scenes/sky_light.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace world {

namespace {

constexpr double kPi = std::numbers::pi, kDegree = kPi / 180;
constexpr double kLumensPerWatt = 179;       // see the header
constexpr double kSolarIlluminance = 128e3;  // lx above the air (IES Lighting Handbook)
constexpr double kSunRadius = 0.2665 * kDegree, kMoonRadius = 0.2590 * kDegree;
constexpr double kFullMoon = 0.25;      // lx on a surface that faces it, high in a clear sky
constexpr double kNightSky = 2e-4;      // cd/m^2, of air glow and faint stars, without a moon
constexpr double kBrightestStar = 0.5;  // cd/m^2 of a star of magnitude 0 (2.5e-6 lx) spread over its spot
constexpr double kGroundAlbedo = 0.25;
constexpr int kAngles = SkyLight::kAngles;
constexpr int kPolarSteps = 48, kAzimuthSteps = 96;  // of the integration, over the whole sphere
constexpr double kModelAltitude = 10 * kDegree;      // above it the daylight model holds as it is

double chord(double angle) { return 2 * std::sin(angle / 2); }
glm::vec4 vec4_of(const Vec3d& v, double w) { return {glm::vec3(v), static_cast<float>(w)}; }
double smooth(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}
double luminance(const Vec3d& rgb) { return 0.2126 * rgb.x + 0.7152 * rgb.y + 0.0722 * rgb.z; }

/// Air masses towards a point at this altitude. source: Kasten. 1965, as in [1] of sky_model.shared.h
double air_mass(double altitude) {
  const double zenith_deg = 90 - std::max(altitude, 0.0) / kDegree;
  return 1 / (std::cos(zenith_deg * kDegree) + 0.15 * std::pow(93.885 - zenith_deg, -1.253));
}

/// The part of light from there that arrives, by band: Rayleigh's and Angstrom's scattering and ozone at 610, 550 and
/// 465 nm. source: [1] of sky_model.shared.h, appendix 1; ozone: Iqbal. An Introduction to Solar Radiation. 1983
Vec3d air_transmittance(double altitude, double turbidity) {
  const double m = air_mass(altitude), beta = 0.04608 * turbidity - 0.04586;
  const double wavelengths[3] = {0.61, 0.55, 0.465}, ozone[3] = {0.12, 0.085, 0.0075};
  Vec3d passed;
  for (int b = 0; b < 3; ++b) {
    const double rayleigh = 0.008735 * std::pow(wavelengths[b], -4.08);
    const double aerosols = beta * std::pow(wavelengths[b], -1.3);
    passed[b] = std::exp(-m * (rayleigh + aerosols + 0.35 * ozone[b]));
  }
  return passed;
}

/// A black body's colour of luminance 1, at the sun's 5778 K. source: Kim and others, US patent 7024034. 2006
Vec3d sun_colour() {
  const double t = 5778, x = -3.0258469e9 / (t * t * t) + 2.1070379e6 / (t * t) + 0.2226347e3 / t + 0.240390;
  const double y = 3.0817580 * x * x * x - 5.87338670 * x * x + 3.75112997 * x - 0.37001483;
  return Vec3d(shared::rgb_from_Yxy({1.0f, static_cast<float>(x), static_cast<float>(y)}));
}

/// Towards what turns with the sky: `equator_a` points at the sun's meridian.
struct CelestialFrame {
  Vec3d pole, equator_a, equator_b;
};
CelestialFrame celestial_frame(const SkySetting& s) {
  const double latitude = s.latitude_deg * kDegree, hour = kPi * (s.time_of_day_h - 12) / 12;
  // North is -z, east +x.
  const Vec3d pole(0, std::sin(latitude), -std::cos(latitude)), south(0, std::cos(latitude), std::sin(latitude));
  const Vec3d west(-1, 0, 0);
  return {pole, std::cos(hour) * south + std::sin(hour) * west, std::cos(hour) * west - std::sin(hour) * south};
}

float bounded(double v) { return static_cast<float>(std::clamp(v, 0.0, 1e9)); }
template <class Bands>
Bands bands_of(const Vec3d& v) {
  return {bounded(v.x), bounded(v.y), bounded(v.z)};
}

}  // namespace

double clear_sky_illuminance(double altitude_deg) {
  struct Piece {
    double above, c[4];
  };
  constexpr Piece kPieces[] = {{20, {3.74, 3.97, -4.07, 1.47}},         {5, {3.05, 13.28, -45.98, 64.33}},
                               {-0.8, {2.88, 22.26, -207.64, 1034.30}}, {-5, {2.88, 21.81, -258.11, -858.36}},
                               {-12, {2.70, 12.17, -431.69, -1899.83}}, {-18, {13.84, 262.72, 1447.42, 2797.93}}};
  const double h = std::clamp(altitude_deg, -18.0, 90.0), x = h / 90;
  for (const Piece& p : kPieces)
    if (h >= p.above) return std::pow(10.0, p.c[0] + x * (p.c[1] + x * (p.c[2] + x * p.c[3])));
  return 0;
}

SkyLight::SkyLight(const SkySetting& setting) : setting_(setting) {
  const CelestialFrame frame = celestial_frame(setting);
  // Declination: [1] of sky_model.shared.h, appendix 2.
  const double declination = 0.4093 * std::sin(2 * kPi * (setting.day_of_year - 81) / 368);
  sun_ = glm::normalize(std::sin(declination) * frame.pole + std::cos(declination) * frame.equator_a);
  model_.pole = vec4_of(frame.pole, 0);
  model_.equator_a = vec4_of(frame.equator_a, 0), model_.equator_b = vec4_of(frame.equator_b, 0);
  const Vec3d level(sun_.x, 0, sun_.z);
  if (glm::length(level) > 1e-6) aside_ = glm::normalize(level);
  set_model();
  tabulate();
}

void SkyLight::set_model() {
  const double t = setting_.turbidity, altitude = std::asin(std::clamp(sun_.y, -1.0, 1.0));
  const double theta = std::min(std::acos(std::clamp(sun_.y, -1.0, 1.0)), kPi / 2);
  const auto row = [t](double y1, double y0, double x1, double x0, double z1, double z0) {
    return glm::vec4(static_cast<float>(y1 * t + y0), static_cast<float>(x1 * t + x0), static_cast<float>(z1 * t + z0),
                     0);
  };
  // [1] of sky_model.shared.h, appendix 2.
  model_.a = row(0.1787, -1.4630, -0.0193, -0.2592, -0.0167, -0.2608);
  model_.b = row(-0.3554, 0.4275, -0.0665, 0.0008, -0.0950, 0.0092);
  model_.c = row(-0.0227, 5.3251, -0.0004, 0.2125, -0.0079, 0.2102);
  model_.d = row(0.1206, -2.5771, -0.0641, -0.8989, -0.0441, -1.6537);
  model_.e = row(-0.0670, 0.3703, -0.0033, 0.0452, -0.0109, 0.0529);
  const double chi = (4.0 / 9 - t / 120) * (kPi - 2 * theta);
  const double luminance_zenith = 1e3 * ((4.0453 * t - 4.9710) * std::tan(chi) - 0.2155 * t + 2.4192);  // cd/m^2
  const auto cubic = [theta](double a, double b, double c, double d) {
    return ((a * theta + b) * theta + c) * theta + d;
  };
  const double x = (cubic(0.00166, -0.00375, 0.00209, 0) * t + cubic(-0.02903, 0.06377, -0.03202, 0.00394)) * t +
                   cubic(0.11693, -0.21196, 0.06052, 0.25886);
  const double y = (cubic(0.00275, -0.00610, 0.00317, 0) * t + cubic(-0.04214, 0.08970, -0.04153, 0.00516)) * t +
                   cubic(0.15346, -0.26756, 0.06670, 0.26688);
  model_.sun = vec4_of(sun_, 0);
  const float cosine = static_cast<float>(std::cos(theta));
  const glm::vec3 at_zenith = shared::sky_perez(model_, 1, static_cast<float>(theta), cosine);
  model_.zenith = glm::vec4(static_cast<float>(luminance_zenith / kLumensPerWatt) / at_zenith.x,
                            static_cast<float>(x) / at_zenith.y, static_cast<float>(y) / at_zenith.z, 0);

  // Near and below the horizon the model says too much: there it is scaled to measured illuminances.
  if (altitude < kModelAltitude) {
    Vec3d up(0);
    for (int i = 0; i < 32; ++i)
      for (int j = 0; j < 64; ++j) {
        const double cosine_up = std::sqrt((i + 0.5) / 32), sine = std::sqrt(1 - cosine_up * cosine_up);
        const double azimuth = 2 * kPi * (j + 0.5) / 64;
        up +=
            Vec3d(shared::sky_above(model_, glm::vec3(sine * std::cos(azimuth), cosine_up, sine * std::sin(azimuth))));
      }
    const double modelled = kLumensPerWatt * luminance(up) * kPi / (32 * 64);
    const double wanted = clear_sky_illuminance(std::min(altitude, 0.0) / kDegree);
    model_.zenith.x *= static_cast<float>(std::pow(wanted / modelled, 1 - smooth(0, 1, altitude / kModelAltitude)));
  }

  // The sun, as far as it is above the horizon; at night the moon.
  const Vec3d moon = -sun_;
  const Vec3d sun_above = sun_colour() * (kSolarIlluminance / kLumensPerWatt);
  const double risen = smooth(-kSunRadius, kSunRadius, altitude);
  const Vec3d sun_light = sun_above * air_transmittance(altitude, t) * risen;
  const double night = setting_.moon ? smooth(6 * kDegree, 9 * kDegree, -altitude) : 0;
  const Vec3d moon_light = Vec3d(0.93, 1.0, 1.13) * (kFullMoon / kLumensPerWatt * night) *
                           air_transmittance(-altitude, t) / luminance(air_transmittance(kPi / 2, t));
  light_direction_ = risen > 0 || night == 0 ? sun_ : moon;
  light_ = bands_of<Irradiance3>(risen > 0 ? sun_light : moon_light);
  if (light_direction_.y < 0) light_ = {};
  const auto disk = [](const Vec3d& irradiance, double radius) {
    return irradiance / (kPi * std::sin(radius) * std::sin(radius));
  };
  model_.sun.w = risen > 0 ? 1 : 0;
  model_.sun_disk = vec4_of(glm::min(disk(sun_light, kSunRadius), Vec3d(1e9)), chord(kSunRadius));
  model_.moon = vec4_of(moon, night > 0 ? 1 : 0);
  model_.moon_disk = vec4_of(disk(moon_light, kMoonRadius), chord(kMoonRadius));

  // Stars drown in daylight: none are sought where the sky outshines the brightest.
  const bool dark = altitude < -3 * kDegree;
  const Vec3d glow = Vec3d(0.85, 1.0, 1.25) * (kNightSky / kLumensPerWatt);
  model_.glow = vec4_of(glow + Vec3d(0.75, 1.0, 1.6) * (0.02 * luminance(moon_light) / kPi),
                        dark ? kBrightestStar / kLumensPerWatt : 0);
}

void SkyLight::tabulate() {
  // Light from above, then the ground that it lights.
  struct Part {
    Vec3d direction, radiance;
  };
  std::vector<Part> parts;
  const auto integrate = [&](bool above) {
    for (int i = 0; i < kPolarSteps; ++i) {
      const double y = 1 - (i + 0.5) * 2 / kPolarSteps, sine = std::sqrt(1 - y * y);
      if ((y > 0) != above) continue;
      for (int j = 0; j < kAzimuthSteps; ++j) {
        const double azimuth = 2 * kPi * (j + 0.5) / kAzimuthSteps;
        const Vec3d direction(sine * std::cos(azimuth), y, sine * std::sin(azimuth));
        parts.push_back({direction, radiance_of(direction)});
      }
    }
  };
  constexpr double kPart = 4 * kPi / (kPolarSteps * kAzimuthSteps);
  integrate(true);
  Vec3d up(0);
  for (const Part& p : parts) up += p.radiance * (p.direction.y * kPart);
  const Vec3d sun(light_.r, light_.g, light_.b);
  model_.ground = vec4_of((up + sun * std::max(light_direction_.y, 0.0)) * (kGroundAlbedo / kPi), 0);
  integrate(false);

  const Vec3d across = glm::cross(Vec3d(0, 1, 0), aside_);
  table_.resize(kAngles * kAngles);
  for (int i = 0; i < kAngles; ++i)
    for (int j = 0; j < kAngles; ++j) {
      const double polar = kPi * i / (kAngles - 1), azimuth = kPi * j / (kAngles - 1);
      const Vec3d n =
          std::sin(polar) * (std::cos(azimuth) * aside_ + std::sin(azimuth) * across) + Vec3d(0, std::cos(polar), 0);
      Vec3d sum(0);
      for (const Part& p : parts) sum += p.radiance * std::max(glm::dot(n, p.direction), 0.0);
      table_[static_cast<size_t>(i * kAngles + j)] = bands_of<Irradiance3>(sum * kPart);
    }
}

Vec3d SkyLight::radiance_of(const Vec3d& direction) const {
  return Vec3d(shared::sky_model_radiance(model_, glm::vec3(direction)));
}

Radiance3 SkyLight::radiance(const Vec3d& direction) const { return bands_of<Radiance3>(radiance_of(direction)); }

Irradiance3 SkyLight::irradiance(const Vec3d& n) const {
  const double polar = std::acos(std::clamp(n.y, -1.0, 1.0));
  const double level = std::sqrt(n.x * n.x + n.z * n.z);
  const double azimuth = level > 1e-9 ? std::acos(std::clamp((n.x * aside_.x + n.z * aside_.z) / level, -1.0, 1.0)) : 0;
  const double u = polar / kPi * (kAngles - 1), v = azimuth / kPi * (kAngles - 1);
  const int i = std::min(static_cast<int>(u), kAngles - 2), j = std::min(static_cast<int>(v), kAngles - 2);
  const float s = static_cast<float>(u - i), t = static_cast<float>(v - j);
  const auto at = [&](int a, int b) { return table_[static_cast<size_t>(a * kAngles + b)]; };
  return (at(i, j) * (1 - t) + at(i, j + 1) * t) * (1 - s) + (at(i + 1, j) * (1 - t) + at(i + 1, j + 1) * t) * s;
}

Radiance3 SkyLight::seen(const Vec3d& direction) const {
  return radiance(direction) + bands_of<Radiance3>(Vec3d(shared::sky_model_disks(model_, glm::vec3(direction))));
}

void set_sky(Environment& e, const SkyLight& sky) {
  e.sun_direction = sky.light_direction();
  e.sun_irradiance = sky.light_irradiance();
  // Of a linear sky, E = pi/3 horizon + 2 pi/3 zenith on a level surface.
  const Radiance3 zenith = sky.radiance({0, 1, 0});
  const Irradiance3 up = sky.irradiance({0, 1, 0});
  const auto horizon_of = [](float level, float top) {
    return std::max(static_cast<float>(3 / kPi) * level - 2 * top, 0.0f);
  };
  e.sky_horizon = {horizon_of(up.r, zenith.r), horizon_of(up.g, zenith.g), horizon_of(up.b, zenith.b)};
  const auto zenith_of = [](float level, float horizon) {
    return std::max(0.5f * (static_cast<float>(3 / kPi) * level - horizon), 0.0f);
  };
  e.sky_zenith = {zenith_of(up.r, e.sky_horizon.r), zenith_of(up.g, e.sky_horizon.g), zenith_of(up.b, e.sky_horizon.b)};
  e.sky_ground = {sky.model().ground.x, sky.model().ground.y, sky.model().ground.z};
}

}  // namespace world
