/// What fills space and takes light from a ray: fog, smoke, water. A medium is a [[medium]] of a scene; its `kind` is a
/// member of world/media/, a file each (<kind>.shared.h, closed forms for C++ and GLSL), listed by the folder.
///
///   T = exp(-sigma_t integral of density ds),   sigma_t = absorption + scattering
/// source  McGuire, Hughes et al. Computer Graphics: Principles and Practice, 3rd edition. 2013,
/// sections 14.7.4, 14.10.3
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "world/base/errors.h"
#include "world/base/toml_reader.h"
#include "world/space/world_point.h"
#include "world/units/quantity.h"

namespace world {

/// A density that varies from place to place: an OpenVDB layer, a table. In [0, max()], 0 outside the box.
class DensityField {
 public:
  virtual ~DensityField() = default;
  virtual float density(const Vec3d& voxels) const = 0;  // at a point in the field's own voxels
  virtual float max() const = 0;
  virtual void bounds(Vec3d& low, Vec3d& high) const = 0;  // in its own voxels
};

/// As a scene says it; each kind reads the fields it documents and refuses the others.
struct Medium {
  std::string name, kind;
  Absorption3 absorption, scattering;  // 1/m at density 1, >= 0
  float anisotropy = 0;                // mean cosine of the phase function, (-1, 1); 0: the same in all directions
  Radiance3 emission;                  // source radiance of the medium itself: fog colour of the approximations
  WorldPoint position;         // centre of a box or ellipsoid; point of the plane of a half space or of height 0
  Vec3f half_extent{1, 1, 1};  // m: box, ellipsoid
  Vec3f normal{0, 1, 0};       // unit, out of the medium: half space
  float scale_height = 0;      // m, > 0: height fog has density exp(-(y - position.y) / scale_height)
  float voxel_size = 1;        // m: of a density grid
  std::string where;           // file:line:column of its table, for messages
  std::shared_ptr<const DensityField> field;  // density grid
};

/// What is wrong is noted in the table's document.
Medium read_medium(TomlTable& table, VoxelPos offset);
std::vector<std::string> medium_kinds();

struct MediumInterval {
  double t0 = 0, t1 = -1;  // m along the ray; t0 >= t1: the ray is never inside
  bool empty() const { return !(t0 < t1); }
};

/// All positions are relative to medium.position; directions have length 1, t is in metres.
MediumInterval medium_interval(const Medium& medium, const Vec3d& origin, const Vec3d& direction, double t_max);
/// In [0, medium_density_max]; 1 everywhere inside of the homogeneous kinds.
double medium_density(const Medium& medium, const Vec3d& point);
/// The largest density along the ray in [t0, t1]; a bound where the exact one is dear.
double medium_density_max(const Medium& medium, const Vec3d& origin, const Vec3d& direction, double t0, double t1);
/// Integral of the density over [t0, t1], in m: closed form, or fine marching for a density grid. Never NaN; may be
/// infinite (deep underground in height fog).
double medium_depth(const Medium& medium, const Vec3d& origin, const Vec3d& direction, double t0, double t1);

}  // namespace world
