/// What fills space and takes light from a ray: fog, smoke, water. A medium is a [[medium]] of a scene; its `kind` is a
/// member of world/media/, a file each (<kind>.shared.h, closed forms for C++ and GLSL), listed by the folder.
///
///   T = exp(-sigma_t integral of density ds),   sigma_t = absorption + scattering
/// source  McGuire, Hughes et al. Computer Graphics: Principles and Practice, 3rd edition. 2013,
/// sections 14.7.4, 14.10.3
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "world/base/errors.h"
#include "world/base/function_ref.h"
#include "world/base/toml_reader.h"
#include "world/space/world_point.h"
#include "world/units/quantity.h"

namespace world {

/// 8^3 samples at voxel_from_leaf(leaf), in the order of index_in_leaf.
struct FieldLeaf {
  LeafPos leaf;
  std::array<float, kLeafVoxels> values;
};

/// A density that varies from place to place: an OpenVDB layer, a table. In [0, max()], 0 outside the bounds. Free for
/// any number of threads. Points and lines are in its own voxels, t counts in lengths of the direction.
class DensityField {
 public:
  virtual ~DensityField() = default;
  virtual float density(const Vec3d& voxels) const = 0;
  virtual float max() const = 0;
  virtual void bounds(Vec3d& low, Vec3d& high) const = 0;
  /// The integral of the density over t in [t0, t1], both finite.
  virtual double depth(const Vec3d& origin, const Vec3d& direction, double t0, double t1) const = 0;
  /// The t in [t0, t1] at which the depth from t0 on is `depth`; infinity where it never is.
  virtual double reach(const Vec3d& origin, const Vec3d& direction, double t0, double t1, double depth) const = 0;
  /// Calls visit(end, largest) for the pieces of [t0, t1] in order, until it returns false: up to `end` no density is
  /// above `largest`.
  virtual void pieces(const Vec3d& origin, const Vec3d& direction, double t0, double t1,
                      FunctionRef<bool(double end, double largest)> visit) const = 0;
  virtual size_t bytes() const = 0;
  /// Calls visit for each leaf that holds a density above 0, always in the same order.
  virtual void for_each_leaf(FunctionRef<void(const FieldLeaf&)> visit) const = 0;
};

/// Between the centres of voxels: the voxel's own value, or the mean of the eight around weighed by their distance.
enum class FieldSampling : int { nearest, trilinear };

/// As a scene says it; each kind reads the fields it documents and refuses the others.
struct Medium {
  std::string name, kind;
  int kind_number = -1;                // in medium_kinds(); -1: sought by the kind's name at each call, which is slow
  Absorption3 absorption, scattering;  // 1/m at density 1, >= 0
  float anisotropy = 0;                // mean cosine of the phase function, (-1, 1); 0: the same in all directions
  Radiance3 emission;                  // source radiance of the medium itself: fog colour of the approximations
  WorldPoint position;         // centre of a box or ellipsoid; point of the plane of a half space or of height 0; low
                               // corner of voxel (0, 0, 0) of a density grid
  Vec3f half_extent{1, 1, 1};  // m: box, ellipsoid
  Vec3f normal{0, 1, 0};       // unit, out of the medium: half space
  float scale_height = 0;      // m, > 0: height fog has density exp(-(y - position.y) / scale_height)
  float voxel_size = 1;        // m: of a density grid
  FieldSampling sampling = FieldSampling::trilinear;  // of a density grid
  std::string where;                                  // file:line:column of its table, for messages
  std::shared_ptr<const DensityField> field;          // density grid; the world's layer comes when the world is built
};

/// What is wrong is noted in the table's document. `folder` is where relative files lie.
///
///   name = "fog"                   required; meshes refer to it
///   kind = "height_fog"            required: one of medium_kinds()
///   absorption_per_m = [r, g, b]   1/m at density 1, >= 0; one number means three equal ones
///   scattering_per_m = [r, g, b]
///   anisotropy = 0.5               in (-1, 1): mean cosine between the ways of light before and after
///   emission = [r, g, b]           W/(m^2 sr), >= 0
///   position = [x, y, z]           m; all but homogeneous
///   half_extent = [x, y, z]        m, > 0; box_fog, ellipsoid_fog: required
///   normal = [x, y, z]             not 0, need not be unit; halfspace_fog
///   scale_height_m = 20            m, > 0; height_fog: required
///   density_grid: voxel_size_m > 0; sampling = "trilinear" or "nearest"; and layer = "density", the world's own, or
///   file = "smoke.vol" (Mitsuba's), whose outermost voxels may be repeated extend_voxels times
Medium read_medium(TomlTable& table, VoxelPos offset, const std::filesystem::path& folder);
/// The members, sorted.
std::vector<std::string> medium_kinds();

struct MediumInterval {
  double t0 = 0, t1 = -1;  // m along the ray; t0 >= t1: the ray is never inside
  bool empty() const { return !(t0 < t1); }
};

/// All positions are relative to medium.position; directions have length 1, t is in metres, t0 <= t1. No answer is ever
/// NaN; where origin or direction are not finite the ray is never inside.
MediumInterval medium_interval(const Medium& medium, const Vec3d& origin, const Vec3d& direction, double t_max);
/// In [0, medium_density_max]; 1 everywhere inside of the homogeneous kinds. Infinite deep underground in height fog.
double medium_density(const Medium& medium, const Vec3d& point);
/// No density along the ray in [t0, t1] is larger; the largest itself, but for density grids.
double medium_density_max(const Medium& medium, const Vec3d& origin, const Vec3d& direction, double t0, double t1);
/// Integral of the density over [t0, t1], in m: closed form, of density grids cell by cell, which is exact too. May be
/// infinite (deep underground in height fog).
double medium_depth(const Medium& medium, const Vec3d& origin, const Vec3d& direction, double t0, double t1);
/// The t at which the depth from t0 on is `depth`, the inverse of medium_depth; infinity where it is not before t1.
double medium_reach(const Medium& medium, const Vec3d& origin, const Vec3d& direction, double t0, double t1,
                    double depth);
/// Calls visit(end, largest) for the pieces of [t0, t1] in order, until it returns false: up to `end` no density is
/// above `largest`, but within rounding of the piece's ends. Pieces are short where densities vary: what delta tracking
/// needs.
void medium_pieces(const Medium& medium, const Vec3d& origin, const Vec3d& direction, double t0, double t1,
                   FunctionRef<bool(double end, double largest)> visit);

}  // namespace world
