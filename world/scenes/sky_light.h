/// The sky of a time of day: where the sun stands, how much of its light the air lets through, what the air itself
/// sends, the moon and the stars. The sun and a linear sky of an Environment are made from it (set_sky); pictures show
/// it itself.
///
/// Units: Loam's bands are W/m^2 that make 179 lm each where all three are equal, as in Radiance (Greg Ward. The
/// RADIANCE Lighting Simulation and Rendering System. 1994), so that daylight's illuminances come out as measured.
#pragma once

#include <memory>
#include <vector>

#include "world/base/errors.h"
#include "world/scenes/environment.h"
#include "world/scenes/sky_model.shared.h"

namespace world {

/// As a scene says it:
///   [environment]
///   time_of_day = 6.5     h of local solar time, 0 <= t <= 24; noon at 12. Without it there is no such sky
///   latitude_deg = 47     -90 to 90, north above 0
///   day_of_year = 172     1 to 366; 172 is midsummer in the north
///   turbidity = 2.3       2 (clear) to 10 (hazy)
///   moon = true           a full moon, opposite the sun
struct SkySetting {
  double time_of_day_h = 12, latitude_deg = 47, day_of_year = 172, turbidity = 2.3;
  bool moon = true;
  friend bool operator==(const SkySetting&, const SkySetting&) = default;
};

class SkyLight {
 public:
  explicit SkyLight(const SkySetting& setting);

  const SkySetting& setting() const { return setting_; }
  const shared::SkyModel& model() const { return model_; }
  /// Unit, of the sun, wherever it stands.
  const Vec3d& sun_position() const { return sun_; }

  /// What lights surfaces, without disks and stars. `direction`: unit.
  Radiance3 radiance(const Vec3d& direction) const;
  /// The same with what an eye sees beside: stars, and the disks of the sun and the moon, whose light on surfaces is
  /// light_irradiance().
  Radiance3 seen(const Vec3d& direction) const;
  /// On a surface of any unit normal that nothing hides. From a table of 21 x 21 normals, made by integration.
  /// error  below 1 % of the irradiance of an upward surface for all normals and times (sky_light_test.cpp)
  Irradiance3 irradiance(const Vec3d& normal) const;
  /// That table, for those who look it up elsewhere: by angle from the zenith, then by azimuth from the sun's, 0 to pi.
  static constexpr int kAngles = 21;
  const std::vector<Irradiance3>& irradiances() const { return table_; }

  /// What shines on the world: the sun, or at night the moon, towards it and on a surface that faces it.
  const Vec3d& light_direction() const { return light_direction_; }
  Irradiance3 light_irradiance() const { return light_; }

 private:
  void set_model();
  void tabulate();
  Vec3d radiance_of(const Vec3d& direction) const;

  SkySetting setting_;
  shared::SkyModel model_{};
  Vec3d sun_{0, 1, 0}, light_direction_{0, 1, 0};
  Irradiance3 light_;
  Vec3d aside_{1, 0, 0};            // level, towards the sun's azimuth
  std::vector<Irradiance3> table_;  // [angle of the normal from the zenith][azimuth from the sun's], 0 to pi both
};

/// The sun of the environment becomes the sky's, its linear sky one of the same zenith and the same light on a level
/// surface: what stands for the sky where nothing but a linear one will do.
void set_sky(Environment& environment, const SkyLight& sky);

/// The whole horizontal illuminance of a clear day, lx, from the sun's altitude in degrees, above -18.
/// source  P. M. Janiczek, J. A. DeYoung. Computer Programs for Sun and Moon Illuminance. USNO Circular 171. 1987
double clear_sky_illuminance(double altitude_deg);

}  // namespace world
