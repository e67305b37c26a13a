/// Rays against contours: where a ray meets the smooth surface, and along which normal.
///
/// A ray walks the cells of Contours. In a voxel without a contour it hits the face it entered by. In one with a
/// contour it hits where it first meets the solid part within the voxel; where it meets none it goes on.
/// Shapes: `planes` meets the voxel's plane; `field` the trilinear field itself, which is continuous, along the normal
/// of the quadric through the voxel's 27 values (the field's own gradient jumps between the eighths of a voxel).
///
/// The crack rule. Planes of neighbours do not meet exactly. A ray that enters a voxel already inside its solid part
/// hits at the face it entered by, and so does one that comes out of a contour into a full voxel. So every ray that
/// reaches a point of the solid, by its own voxel's plane, has hit by then: from outside none passes through.
/// Such a hit has the plane's normal (of the voxel; of the last contour, for a full voxel), if the surface lies at most
/// kCrack below the face; deeper is a cut through the solid, which shows the face.
///
/// A start within a contour's voxel counts as in front of the surface; what lies ahead of it there is met.
/// error  planes: as the contours. field: none but rounding, against the trilinear field; 1e-12 of a voxel in t
/// cost   beside cubes 0.2 to 0.6 us a ray more (planes), 0.8 to 1.6 us (field): single rays at balls of radius 4 to
///        64, each from elsewhere (subject contours, measured 2026-11-25); nothing is allocated
/// source Marmitt and others. Fast and Accurate Ray-Voxel Intersection Techniques for Iso-Surface Ray Tracing. 2004
/// (the
///        first root of the cubic: between its extremes)
#pragma once

#include <memory>
#include <optional>

#include "world/store/contours.h"
#include "world/store/ray_stream.h"

namespace world {

constexpr double kCrack = 0.25;  // voxels

/// grid: `voxel` and the face it was entered by (kNoFace: the start's own); `t` is where the surface is met.
struct ContourHit {
  GridHit grid;
  Vec3d normal{0.0};    // outwards, unit length; 0 where the ray starts in a full voxel
  bool smooth = false;  // of a contour, not of a face
  bool hit() const { return grid.hit(); }
};

/// The voxel whose block the surface in `voxel` is made of: its own, or where that is air the occupied neighbour that
/// lies farthest down the normal.
VoxelPos matter_voxel(const MaskVolume& occupied, VoxelPos voxel, const Vec3d& normal);

/// May be used by all threads. `contours` must outlive it.
class ContourWalker {
 public:
  ContourWalker(const Contours& contours, ContourShape shape) : contours_(&contours), shape_(shape) { refresh(); }
  /// After contours.update().
  void refresh() { walker_.emplace(contours_->cells()); }

  ContourHit first_hit(const GridRay& ray) const;
  /// The same, where the first set voxel of cells() is known: what a RayStream found.
  ContourHit first_hit_from(const GridRay& ray, const GridHit& first_cell) const;
  /// Whether anything of `blocking` lies along `direction` from the hit. What rises less than kCrack above the surface
  /// that the ray leaves does not: planes of neighbours differ by less.
  bool blocked(const GridRay& ray, const ContourHit& hit, const Vec3d& direction, const MaskVolume& blocking) const;

  /// As above.
  VoxelPos matter_voxel(VoxelPos voxel, const Vec3d& normal) const;
  const Contours& contours() const { return *contours_; }

 private:
  struct Cursor;
  bool next_hit(const GridAxes& axes, WalkPlace place, double t_limit, Cursor& cursor, ContourHit& hit) const;

  const Contours* contours_;
  ContourShape shape_;
  std::optional<MaskWalker> walker_;
};

/// The contours of one store's surface layer, which follow its edits: of `distance`, else of `density` where iso > 0.
/// Belongs to one thread; what follow() gave may be read by all until the next call. Values of a layer that change
/// after the first call are not seen.
class StoreContours {
 public:
  struct Followed {
    Contours contours;
    RayStream cells;
    ContourWalker walker;
    Followed(const MaskVolume& occupied, std::unique_ptr<SurfaceField> field, ContourShape shape)
        : contours(occupied, std::move(field), shape == ContourShape::field),
          cells(contours.cells()),
          walker(contours, shape) {}
    Followed(const Followed&) = delete;
    Followed& operator=(const Followed&) = delete;
  };
  /// Null where shape is off or the store has no such layer; then nothing is kept.
  const Followed* follow(const Store& store, ContourShape shape, float iso);
  size_t bytes() const { return followed_ ? followed_->contours.bytes() + followed_->cells.bricks().bytes() : 0; }

 private:
  uint64_t store_ = 0;
  int subscriber_ = 0;
  ContourShape shape_ = ContourShape::off;
  float iso_ = 0;
  std::unique_ptr<Followed> followed_;
};

}  // namespace world
