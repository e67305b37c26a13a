/// Sources of light beside the sun, the sky and emitting blocks. A luminaire is a [[luminaire]] of a scene; its `kind`
/// is a member of world/luminaires/, a file each (<kind>.shared.h, formulas for C++ and GLSL), listed by the folder.
///
/// What a renderer asks: a point and its biradiance, whether a ray meets it, its power, a photon.
///   M(P, Q) = L(Q -> P) max(0, -m . wi) A / |P - Q|^2     W/m^2, for one uniform point Q of area A with normal m
/// so that the radiance that a surface reflects is the mean over samples of f(wi, wo) max(0, n . wi) M V.
/// source  McGuire, Hughes et al. Computer Graphics: Principles and Practice, 3rd edition. 2013, section 14.11
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "world/base/errors.h"
#include "world/base/toml_reader.h"
#include "world/space/world_point.h"
#include "world/units/quantity.h"

namespace world {

using Vec2f = glm::vec2;

/// Linear values of an image, rows from the top; what modulates a gobo or a sky.
struct LightImage {
  int width = 0, height = 0;
  std::vector<Radiance3> pixels;  // width * height; no unit of its own: it scales the luminaire's
};

/// As a scene says it; each kind reads the fields it documents and refuses the others.
struct Luminaire {
  std::string name, kind;
  WorldPoint position;     // centre of the emitter; of the pattern, where the kind has no place
  Vec3f axis{0, -1, 0};    // unit: where it emits to; of a directional, where its light goes; of a sky, its pole
  Vec3f up{0, 0, 1};       // unit, perpendicular to axis: second edge of a rectangle, up in an image
  Power3 power;            // W, >= 0, of kinds that have a place
  Irradiance3 irradiance;  // W/m^2 on a plane that faces it: directional
  Radiance3 radiance;      // W/(m^2 sr): hemisphere; of kinds with an area, where the power is 0: Phi = pi A L
  Vec2f extent{1, 1};      // m, edges of a rectangle: along cross(up, axis), and along up
  float radius = 0;        // m: disk, sphere; of an omni the clamp's r_min
  float half_angle = 3.14159265f;                 // rad, 0..pi: spot, gobo, unified point
  float inner_half_angle = 3.14159265f;           // rad: where the soft edge of a spot or gobo begins; hard if larger
  Vec3f attenuation{0, 0, 1};                     // of 1, r, r^2: unified point
  bool at_infinity = false;                       // unified point with w = 0
  bool whole_sphere = false;                      // hemisphere: light comes from below its horizon too
  bool uniform_area = false;                      // rectangle, disk: sample by area, not by solid angle
  std::string image;                              // path of an image that modulates it; none where empty
  std::string mesh_file;                          // path of a mesh emitter's triangles
  std::string where;                              // file:line:column of its table, for messages
  std::shared_ptr<const LightImage> light_image;  // what `image` holds, once loaded
  std::vector<Vec3f> triangles;                   // mesh: three corners each, relative to position
  // Switches of the chapter's light class; all true is physics.
  bool lambertian = true, glossy = true, global_illumination = true, shadows = true, enabled = true;
  bool visible = true;  // seen by camera rays where it has an area
};

/// Whether it is on and has any light to give.
bool gives_light(const Luminaire& luminaire);
/// What is wrong (ranges, keys that the kind has no use for) is noted in the table's document. Opens no file; relative
/// paths are those from `folder`.
Luminaire read_luminaire(TomlTable& table, VoxelPos offset, const std::filesystem::path& folder = {});
/// The members, sorted.
std::vector<std::string> luminaire_kinds();

/// One point of a luminaire, seen from a receiver.
struct LuminaireSample {
  Vec3f direction{0};      // unit, from the receiver towards the point
  double distance = 0;     // m; infinity where it lies at no place
  Irradiance3 biradiance;  // M of the head of this file: radiance / pdf where pdf > 0
  float pdf = 0;           // density of direction at the receiver, 1/sr; 0: an impulse, which no other sampling meets
};

/// Where a ray meets the emitting side.
struct LuminaireHit {
  double distance = 0;  // m; infinity: at no place
  Radiance3 radiance;   // that it sends back along the ray
  float pdf = 0;        // with which sample() would have chosen this direction, 1/sr
};

/// A virtual photon: part of the total power, going from a point of the luminaire.
struct EmittedPhoton {
  Vec3d origin{0};  // relative to the luminaire's position
  Vec3f direction{0};
  Power3 power;  // total power / photons, if all photons had the same density: its mean is the total power
};

/// Where the scene lies, for photons of luminaires at no place: a sphere, relative to the luminaire's position.
struct SceneSphere {
  Vec3d centre{0};
  double radius = 1;
};

/// A luminaire made ready: image distributions, triangle areas. All positions are relative to the luminaire's.
/// Random numbers are in [0, 1).
class LuminaireSampler {
 public:
  /// Fails for what only shows now: an image whose values are no light, a mesh without area.
  static Result<LuminaireSampler> make(const Luminaire& luminaire);
  LuminaireSampler(LuminaireSampler&&) noexcept;
  LuminaireSampler& operator=(LuminaireSampler&&) noexcept;
  ~LuminaireSampler();

  LuminaireSample sample(const Vec3d& receiver, Vec2f u) const;
  /// The nearest emitting point along the ray (unit direction); none for impulses, and from behind.
  std::optional<LuminaireHit> meet(const Vec3d& origin, const Vec3f& direction) const;
  EmittedPhoton emit(Vec2f position, Vec2f direction, const SceneSphere& scene) const;
  Power3 total_power() const;  // infinity in each band that has light, where it lies at no place
  float surface_area() const;  // m^2; 0: a point, infinity: at no place
  bool impulse() const;        // a point or one direction: sample().pdf is 0
  const Luminaire& luminaire() const;

 private:
  struct State;
  explicit LuminaireSampler(std::unique_ptr<const State> state);
  std::unique_ptr<const State> state_;
};

}  // namespace world
