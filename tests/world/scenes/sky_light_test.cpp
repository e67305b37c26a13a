#include "world/scenes/sky_light.h"

#include <cmath>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "world/scenes/scene.h"

namespace world {
namespace {

constexpr double kPi = 3.14159265358979323846;

double luminance(auto b) { return 0.2126 * b.r + 0.7152 * b.g + 0.0722 * b.b; }

/// Of the radiance over the hemisphere around n, by midpoints in a frame of its own.
Vec3d integrated(const SkyLight& sky, const Vec3d& n) {
  const Vec3d a = glm::normalize(std::abs(n.y) < 0.9 ? glm::cross(n, Vec3d(0, 1, 0)) : glm::cross(n, Vec3d(1, 0, 0)));
  const Vec3d b = glm::cross(n, a);
  constexpr int kRings = 64, kSpokes = 128;
  Vec3d sum(0);
  for (int i = 0; i < kRings; ++i)
    for (int j = 0; j < kSpokes; ++j) {
      const double r = std::sqrt((i + 0.5) / kRings), phi = 2 * kPi * (j + 0.5) / kSpokes;
      const Radiance3 l = sky.radiance(r * std::cos(phi) * a + r * std::sin(phi) * b + std::sqrt(1 - r * r) * n);
      sum += Vec3d(l.r, l.g, l.b);
    }
  return sum * (kPi / (kRings * kSpokes));
}

TEST(SkyLight, TheTableOfIrradianceIsTheIntegralToOnePercent) {
  for (const double hours : {4.2, 6.0, 9.0, 12.0, 19.5, 23.0}) {
    SkySetting setting;
    setting.time_of_day_h = hours;
    const SkyLight sky(setting);
    const Vec3d up = integrated(sky, {0, 1, 0});
    for (int i = 0; i < 24; ++i) {
      const double y = 1 - 2 * (i + 0.5) / 24, phi = 2.4 * i, r = std::sqrt(1 - y * y);
      const Vec3d n(r * std::cos(phi), y, r * std::sin(phi)), exact = integrated(sky, n);
      const Irradiance3 table = sky.irradiance(n);
      EXPECT_NEAR(table.r, exact.x, 0.01 * up.x) << hours << ' ' << i;
      EXPECT_NEAR(table.g, exact.y, 0.01 * up.y) << hours << ' ' << i;
      EXPECT_NEAR(table.b, exact.z, 0.01 * up.z) << hours << ' ' << i;
    }
  }
}

TEST(SkyLight, TheSunStandsWhereAstronomyHasIt) {
  SkySetting setting;  // noon, 47 degrees north, midsummer: altitude 90 - 47 + 23.45
  const SkyLight noon(setting);
  EXPECT_NEAR(std::asin(noon.sun_position().y) * 180 / kPi, 90 - 47 + 23.4, 0.3);
  EXPECT_GT(noon.sun_position().z, 0.3);  // in the south
  EXPECT_NEAR(noon.sun_position().x, 0, 1e-9);
  setting.day_of_year = 81, setting.time_of_day_h = 6;  // equinox: rises due east
  const SkyLight rising(setting);
  EXPECT_NEAR(rising.sun_position().x, 1, 1e-3);
  setting.latitude_deg = -35, setting.time_of_day_h = 12, setting.day_of_year = 172;
  EXPECT_LT(SkyLight(setting).sun_position().z, -0.5);  // in the north
}

TEST(SkyLight, IlluminancesAreThoseOfClearDaysAndNights) {
  SkySetting setting;
  const auto level_lux = [&](double hours) {
    setting.time_of_day_h = hours;
    const SkyLight sky(setting);
    return 179 * (luminance(sky.irradiance({0, 1, 0})) +
                  luminance(sky.light_irradiance()) * std::max(sky.light_direction().y, 0.0));
  };
  const double noon = level_lux(12);
  EXPECT_GT(noon, 8e4);  // lx
  EXPECT_LT(noon, 13e4);
  // The formula of the almanac for the sun and sky of noon.
  EXPECT_NEAR(std::log10(noon), std::log10(clear_sky_illuminance(66.4)), 0.08);
  const double midnight = level_lux(0);
  EXPECT_GT(midnight, 0.01);
  EXPECT_LT(midnight, 0.4);
  setting.moon = false;
  EXPECT_LT(level_lux(0), 0.02);
  EXPECT_GT(level_lux(0), 2e-4);
}

TEST(SkyLight, ChangesWithoutAJumpOverTheDay) {
  SkySetting setting;
  double before = 0;
  for (int minute = 0; minute <= 24 * 60; minute += 6) {
    setting.time_of_day_h = minute / 60.0;
    const SkyLight sky(setting);
    const double level = luminance(sky.irradiance({0, 1, 0}));
    ASSERT_TRUE(std::isfinite(level) && level > 0) << minute;
    // By the formula of the almanac twilight loses up to 0.36 decades in six minutes.
    if (minute > 0) {
      EXPECT_LT(std::abs(std::log10(level / before)), 0.4) << minute;
    }
    before = level;
    // The sun and the moon change places while neither shines.
    EXPECT_GE(sky.light_irradiance().g * sky.light_direction().y, 0) << minute;
  }
}

TEST(SkyLight, IsNeverNotANumberNorNegative) {
  for (const double latitude : {-90.0, -23.0, 0.0, 60.0, 90.0})
    for (const double turbidity : {2.0, 10.0})
      for (const double hours : {0.0, 5.9, 12.0, 24.0})
        for (const double day : {1.0, 81.0, 172.0, 366.0}) {
          const SkyLight sky({hours, latitude, day, turbidity, true});
          for (int i = 0; i < 40; ++i) {
            const double y = 1 - 2 * i / 39.0, r = std::sqrt(std::max(0.0, 1 - y * y));
            const Radiance3 l = sky.seen({r * std::cos(3.0 * i), y, r * std::sin(3.0 * i)});
            for (const float v : {l.r, l.g, l.b}) ASSERT_TRUE(std::isfinite(v) && v >= 0) << latitude << ' ' << hours;
          }
        }
}

TEST(SkyLight, ALinearSkyStandsForItOnALevelSurface) {
  Environment e;
  const SkyLight sky({10, 47, 172, 3, true});
  set_sky(e, sky);
  const Irradiance3 up = sky.irradiance({0, 1, 0});
  const auto level = [](float horizon, float zenith) { return kPi / 3 * (horizon + 2 * zenith); };
  EXPECT_NEAR(level(e.sky_horizon.g, e.sky_zenith.g), up.g, 0.01 * up.g);
  EXPECT_EQ(e.sun_direction, sky.sun_position());
}

TEST(SkyLight, AScenesTimeOfDayIsItsSunItsSkyAndItsKnobs) {
  const std::filesystem::path path = std::filesystem::temp_directory_path() / "loam_time_of_day_test.toml";
  const auto scene_of = [&](const std::string& more) {
    std::ofstream(path) << "[world]\ngenerator = \"empty\"\nsize = [8, 8, 8]\n" + more;
    return load_scene(path.string());
  };
  const auto scene = scene_of("[environment]\ntime_of_day = 18.5\nday_of_year = 100\n");
  ASSERT_TRUE(scene.ok()) << scene.error().message;
  EXPECT_EQ(scene->knobs.at("time_of_day"), "18.5");
  EXPECT_EQ(scene->environment.sun_direction, SkyLight({18.5, 47, 100, 2.3, true}).light_direction());
  EXPECT_FALSE(scene_of("[environment]\ntime_of_day = 25\n").ok());
  EXPECT_FALSE(scene_of("[environment]\nturbidity = 3\n").ok());
  EXPECT_FALSE(scene_of("[environment]\ntime_of_day = 5\n[sun]\ndirection = [0, 1, 0]\n").ok());
  std::filesystem::remove(path);
}

}  // namespace
}  // namespace world
