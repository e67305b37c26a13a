/// Which luminaires light which part of a world: cubes of voxels with the numbers of those that reach each, so that a
/// point asks those of its cube alone. Made once for a set of luminaires, whatever the camera does. For both backends,
/// where they ask luminaires one by one: rays with a cut-off divided by their number, where the lists can hold that.
///
/// A luminaire reaches as far as the irradiance that it may give, I / r^2, stays above a cut-off. Where that would take
/// more than kMostEntries entries, or leave more than kMostEverywhere luminaires that are in no cell because they reach
/// too many, the cut-off is doubled until it doesn't: time and memory are bounded for any number of luminaires.
/// error   each luminaire's light is left out where it is below the cut-off; cutoff() says what that came to
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "world/luminaires/kinds.h"
#include "world/space/coords.h"
#include "world/space/world_point.h"

namespace render {

class LightCells {
 public:
  struct Light {
    world::WorldPoint position;
    bool finite = true;      // has a place
    double intensity = 0;    // W/sr, the largest of any direction and band; what it gives at r is at most that / r^2
    double radius = 0;       // m, of a sphere around the position that holds it
    bool one_sided = false;  // shines to the side of `axis` alone, within `half_angle`
    world::Vec3d axis{0, -1, 0};
    double half_angle = 4;  // rad; of a cone around the axis; above pi: all around
  };
  struct Cell {
    world::VoxelPos place;          // of cubes of 2^shift voxels
    uint32_t first = 0, count = 0;  // in numbers()
  };
  static constexpr size_t kFew = 16;                       // so many light everything, with no cells and no cut-off
  static constexpr size_t kMostEntries = size_t{1} << 22;  // 16 MiB
  static constexpr size_t kMostEverywhere = 32;
  static constexpr int64_t kMostCellsEach = 4096;

  static Light light_of(const world::Luminaire& luminaire, const world::LuminaireTables& tables);
  /// `cutoff`: W/m^2, >= 0; 0: every luminaire lights everything.
  static LightCells make(std::span<const Light> lights, double cutoff);
  /// What the knobs' luminaire_cutoff of `share` is, W/m^2: that share of the display's white at this exposure, as
  /// irradiance on a white surface.
  static double cutoff_of(float share, float exposure);

  const std::vector<uint32_t>& everywhere() const { return everywhere_; }
  const std::vector<Cell>& cells() const { return cells_; }
  const std::vector<uint32_t>& numbers() const { return numbers_; }
  /// Of those that are not everywhere the numbers of all that reach a point of this voxel, and of some that don't.
  std::span<const uint32_t> near(const world::VoxelPos& voxel) const;
  int shift() const { return shift_; }
  double cutoff() const { return cutoff_; }
  /// Of each light, m; infinite of those that are everywhere.
  const std::vector<double>& reaches() const { return reaches_; }
  /// Luminaires of the fullest cell, those that are everywhere included.
  size_t most_in_a_cell() const { return most_; }

 private:
  std::vector<uint32_t> everywhere_, numbers_;
  std::vector<Cell> cells_;
  std::vector<double> reaches_;
  int shift_ = 4;
  double cutoff_ = 0;
  size_t most_ = 0;
};

}  // namespace render
