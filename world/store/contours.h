/// Contours: in each voxel that a smooth surface passes, a plane, so that what was sampled smooth looks smooth at the
/// same voxel size. Derived from values at the middles of voxels (a density, a level set, a function), leaf by leaf.
///
///   leaf -> block: 512 planes of 32 bits (2 KiB), where any voxel of the leaf has one;
///           and, where values are kept, 10^3 floats: those of the leaf and of one voxel around it
///
/// The field in a voxel is what lies trilinearly between the values at the 27 middles around it. In eighths of the
/// voxel its extremes are at their corners, so the signs of 27 numbers say exactly whether the surface (value 0)
/// passes the voxel. That is so in air voxels too: the surface of a full voxel may lie up to half a voxel outside it.
/// So rays walk cells(): occupied voxels, and air ones with a contour.
///
/// Blocks win: where a block and the value at its middle contradict each other (somebody dug or built there) it and
/// the 26 voxels around it are plain cubes.
///
/// A plane goes through the mean of the places where the edges of the eighths cross the surface, along the gradient
/// there of the quadric through the 27 values (least squares). Where it would put one of the 27 corners on the wrong
/// side by more than kMisfit there is none: the surface is finer than the voxel.
///
/// error  of a sphere of radius R voxels: distance at most 0.4 / R + 0.0025 voxel, normal at most 60 / R + 0.3
///        degrees (tests/world/store/contours_test.cpp); of the 32 bits: kNormalError, kOffsetError
/// cost   150 us a leaf that the surface passes, one core; update(): 1.7 ms for a leaf whose 26 neighbours it passes
///        too (a ball of radius 60, measured 2026-11-25)
/// source Samuli Laine, Tero Karras. Efficient Sparse Voxel Octrees. 2010, section 3.2 (contours; theirs are slabs,
///        ours half spaces: the field is one-sided). Sarah Frisken Gibson. Constrained Elastic Surface Nets. 1998 (the
///        mean)
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

#include "world/space/world_point.h"
#include "world/store/layer.h"
#include "world/store/mask_volume.h"

namespace world {

enum class ContourShape { off, planes, field };

/// dot(normal, p - middle of the voxel) <= offset is solid; in voxels.
struct ContourPlane {
  Vec3d normal;
  double offset;
};

constexpr double kLargestOffset = 0.875;                    // > sqrt(3) / 2: further out the plane misses the voxel
constexpr double kOffsetError = kLargestOffset / 2047 / 2;  // voxels
constexpr double kNormalError = 4.2427 / 1022;              // radians: sqrt(18) half steps of an octahedron's face
constexpr double kMisfit = 0.25;                            // voxels

/// Bits 0..9 and 10..19: the normal folded onto an octahedron; 20..31: offset, never 0. Axes and offset 0 are exact.
/// source Cigolle and others. A Survey of Efficient Representations for Independent Unit Vectors. 2014 (oct)
uint32_t pack_plane(const ContourPlane& plane);
ContourPlane unpack_plane(uint32_t word);

/// Where the values come from: below or at 0 is inside.
class SurfaceField {
 public:
  virtual ~SurfaceField() = default;
  /// Values at the middles of the leaf's voxels and of those one further out, kSamples of them by
  /// (x * 10 + y) * 10 + z; NaN where only the block is known: +-beyond() by its being there.
  virtual void read(LeafPos leaf, std::span<float> values) const = 0;
  /// All leaves that the surface passes, and any others; sorted.
  virtual std::vector<LeafPos> leaves() const = 0;
  virtual float beyond() const = 0;
  /// Blocks stand where anything is at all, however thin: those outside the surface count as air.
  virtual bool fog() const { return false; }
};

/// density - iso, iso > 0. The layer must outlive the field.
std::unique_ptr<SurfaceField> density_surface(const FloatLayer& density, float iso);
/// The layer `distance`: voxels, below 0 inside.
std::unique_ptr<SurfaceField> level_set_surface(const FloatLayer& distance);
/// A function of the voxel whose middle is asked for; `box` holds the surface.
std::unique_ptr<SurfaceField> function_surface(std::function<float(VoxelPos)> value, const VoxelBox& box);

/// What a voxel has: nothing, a plane, or a surface that no plane fits.
constexpr uint32_t kNoContour = 0, kUnfitInside = 1, kUnfitOutside = 2;  // of kUnfit..: where the middle lies
constexpr bool is_plane(uint32_t word) { return word > kUnfitOutside; }

/// The contours of one mask of blocks, which must outlive them. Reading is free for any number of threads.
class Contours {
 public:
  static constexpr int kAlong = kLeafSize + 2, kSamples = kAlong * kAlong * kAlong;
  using Planes = std::array<uint32_t, kLeafVoxels>;
  using Values = std::array<float, kSamples>;
  /// What a leaf has; null where the surface doesn't pass it, or values aren't kept.
  struct Leaf {
    const Planes* planes = nullptr;
    const Values* values = nullptr;
  };

  /// Builds all leaves, on all threads. Without a field there are no contours and no bytes.
  Contours(const MaskVolume& occupied, std::unique_ptr<SurfaceField> field, bool keep_values);
  /// After blocks or values of these leaves changed; gives the leaves of cells() that may have, sorted. Leaves that
  /// get their first values are seen by building anew only.
  std::vector<LeafPos> update(std::span<const LeafPos> dirty);

  Leaf leaf(LeafPos l) const {
    const auto found = index_.find(l);
    if (found == index_.end()) return {};
    return {&planes_[found->second], values_.empty() ? nullptr : &values_[found->second]};
  }
  uint32_t plane(VoxelPos v) const {
    const Leaf l = leaf(leaf_from_voxel(v));
    return l.planes ? (*l.planes)[static_cast<size_t>(index_in_leaf(v))] : kNoContour;
  }
  const MaskVolume& cells() const { return cells_; }
  const MaskVolume& occupied() const { return *occupied_; }
  size_t leaves() const { return index_.size(); }
  /// Of planes and values, and of cells().
  size_t bytes() const;

 private:
  struct Built;
  Built build(LeafPos l) const;
  void put(LeafPos l, const Built& built);

  const MaskVolume* occupied_;
  std::unique_ptr<SurfaceField> field_;
  std::vector<LeafPos> field_leaves_;
  bool keep_values_;
  MaskVolume cells_;
  std::unordered_map<LeafPos, uint32_t, PosHash> index_;
  std::vector<Planes> planes_;
  std::vector<Values> values_;
  std::vector<uint32_t> free_;
};

/// The gradient, at a place relative to the middle of a voxel, of the quadric through the 27 values around it.
Vec3d surface_gradient(const Contours::Values& values, VoxelPos in_leaf, const Vec3d& from_middle);

}  // namespace world
