#include "world/store/contour_walk.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace world {

namespace {

Vec3d face_normal(int face) {
  Vec3d n(0.0);
  if (face != kNoFace) n[face_axis(face)] = face_sign(face);
  return n;
}

/// Position in the voxel, relative to its middle.
Vec3d from_middle(const GridAxes& axes, VoxelPos voxel, double t) {
  Vec3d p;
  for (int a = 0; a < 3; ++a)
    p[a] = axes.fraction[a] + t * axes.direction[a] - (double(voxel[a]) - axes.origin[a]) - 0.5;
  return p;
}

/// Where a ray meets the solid part of a voxel.
struct Meeting {
  double t;
  Vec3d normal;
  double depth;  // of the place of entry below the surface, voxels; 0 where it is met on the way
};

std::optional<Meeting> meet_plane(const ContourPlane& plane, const GridAxes& axes, VoxelPos voxel, double t0,
                                  double t1) {
  const Vec3d direction(axes.direction[0], axes.direction[1], axes.direction[2]);
  const double height = glm::dot(plane.normal, from_middle(axes, voxel, t0)) - plane.offset;
  if (height <= 0) return Meeting{t0, plane.normal, -height};
  const double rise = glm::dot(plane.normal, direction);
  if (!(rise < 0)) return std::nullopt;
  const double t = t0 - height / rise;
  if (!(t <= t1)) return std::nullopt;
  return Meeting{t, plane.normal, 0};
}

/// a[0] + a[1] s + a[2] s^2 + a[3] s^3.
struct Cubic {
  double a[4];
  double at(double s) const { return ((a[3] * s + a[2]) * s + a[1]) * s + a[0]; }
  double slope(double s) const { return (3 * a[3] * s + 2 * a[2]) * s + a[1]; }

  /// The first s in (0, 1] at which it is 0 or below, given that it is above 0 at 0.
  std::optional<double> first_root() const {
    // Between its extremes it is monotone.
    double ends[3] = {1, 1, 1};
    const double qa = 3 * a[3], qb = 2 * a[2], qc = a[1], under = qb * qb - 4 * qa * qc;
    if (under > 0) {
      const double q = -0.5 * (qb + (qb < 0 ? -1 : 1) * std::sqrt(under));
      double r0 = qa != 0 ? q / qa : 1, r1 = q != 0 ? qc / q : 1;
      if (!(r0 <= r1)) std::swap(r0, r1);
      int n = 0;
      if (r0 > 0 && r0 < 1) ends[n++] = r0;
      if (r1 > 0 && r1 < 1) ends[n++] = r1;
    }
    double low = 0;
    for (const double end : ends) {
      if (at(end) <= 0) return root_between(low, end);
      low = end;
    }
    return std::nullopt;
  }

 private:
  /// at(low) > 0 >= at(high): Newton's steps, halving where they leave the bracket.
  double root_between(double low, double high) const {
    double s = 0.5 * (low + high);
    for (int i = 0; i < 60; ++i) {
      const double value = at(s);
      (value <= 0 ? high : low) = s;
      if (value == 0 || high - low < 1e-15) break;
      const double next = s - value / slope(s);
      const double moved = next > low && next < high ? next : 0.5 * (low + high);
      if (std::abs(moved - s) < 1e-16) break;
      s = moved;
    }
    return s;
  }
};

/// The trilinear field of one eighth of a voxel: eight values, places from 0 to 1 between them.
struct Eighth {
  double v[2][2][2];

  Eighth(const Contours::Values& values, VoxelPos low) {
    for (int i = 0; i < 8; ++i)
      v[i >> 2][i >> 1 & 1][i & 1] = values[static_cast<size_t>(
          ((low.x + (i >> 2)) * Contours::kAlong + low.y + (i >> 1 & 1)) * Contours::kAlong + low.z + (i & 1))];
  }
  /// Along p + s d.
  Cubic along(const Vec3d& p, const Vec3d& d) const {
    double square[2][3];
    for (int x = 0; x < 2; ++x) {
      double line[2][2];
      for (int y = 0; y < 2; ++y) {
        const double step = v[x][y][1] - v[x][y][0];
        line[y][0] = v[x][y][0] + step * p.z, line[y][1] = step * d.z;
      }
      const double c0 = line[1][0] - line[0][0], c1 = line[1][1] - line[0][1];
      square[x][0] = line[0][0] + c0 * p.y;
      square[x][1] = line[0][1] + c0 * d.y + c1 * p.y;
      square[x][2] = c1 * d.y;
    }
    const double e[3] = {square[1][0] - square[0][0], square[1][1] - square[0][1], square[1][2] - square[0][2]};
    return {{square[0][0] + e[0] * p.x, square[0][1] + e[0] * d.x + e[1] * p.x, square[0][2] + e[1] * d.x + e[2] * p.x,
             e[2] * d.x}};
  }
};

std::optional<Meeting> meet_field(const Contours::Values& values, const GridAxes& axes, VoxelPos voxel, double t0,
                                  double t1) {
  // Cut the way through the voxel where it changes from one eighth to the next.
  double cuts[5] = {t0, t1, t1, t1, t1};
  for (int a = 0; a < 3; ++a) {
    const double t = (double(voxel[a]) - axes.origin[a] + 0.5 - axes.fraction[a]) * axes.inverse[a];
    cuts[1 + a] = t > t0 && t < t1 ? t : t1;
  }
  std::sort(cuts + 1, cuts + 4);
  const VoxelPos in_leaf = offset_in_leaf(index_in_leaf(voxel));
  const Vec3d direction(axes.direction[0], axes.direction[1], axes.direction[2]);
  for (int i = 0; i < 4; ++i) {
    const double from = cuts[i], length = cuts[i + 1] - from;
    if (i > 0 && !(length > 0)) continue;
    const Vec3d middle = from_middle(axes, voxel, from + 0.5 * length);
    VoxelPos low = in_leaf;
    Vec3d place = from_middle(axes, voxel, from);
    for (int a = 0; a < 3; ++a) {
      low[a] += middle[a] < 0 ? 0 : 1;
      place[a] += middle[a] < 0 ? 1 : 0;
    }
    const Eighth eighth(values, low);
    const Cubic cubic = eighth.along(place, direction * length);
    double s = 0;
    if (cubic.a[0] > 0) {
      const auto root = cubic.first_root();
      if (!root) continue;
      s = *root;
    }
    const Vec3d gradient = surface_gradient(values, in_leaf, from_middle(axes, voxel, from + s * length));
    const double steepness = glm::length(gradient);
    if (!(steepness > 0)) return Meeting{from + s * length, Vec3d(0.0), kInfinity};
    // Only the entry may lie below the surface; later eighths begin where the last one ended.
    const double depth = i == 0 && cubic.a[0] <= 0 ? -cubic.a[0] / steepness : 0;
    return Meeting{from + s * length, gradient / steepness, depth};
  }
  return std::nullopt;
}

}  // namespace

/// What a ray knows of the voxels behind it.
struct ContourWalker::Cursor {
  const Contours* contours;
  bool leaving = false;        // it left a surface: see blocked()
  bool own_is_behind = false;  // the start's own contour counts as behind it
  LeafPos at{INT32_MAX, 0, 0};
  Contours::Leaf leaf{};
  Vec3d last_normal{0.0};
  bool from_contour = false;  // the voxel before has a contour, of last_normal

  uint32_t word(VoxelPos v) {
    const LeafPos l = leaf_from_voxel(v);
    if (l != at) at = l, leaf = contours->leaf(l);
    return leaf.planes ? (*leaf.planes)[static_cast<size_t>(index_in_leaf(v))] : kNoContour;
  }
};

bool ContourWalker::next_hit(const GridAxes& axes, WalkPlace place, double t_limit, Cursor& cursor,
                             ContourHit& hit) const {
  for (;;) {
    const bool start = place.axis < 0;
    const int face = start ? kNoFace : entered_face(place.axis, axes.upwards[place.axis] != 0);
    const uint32_t word = cursor.word(place.voxel);
    hit = {{WalkEnd::hit, place.voxel, face, place.t}, face_normal(face), false};
    const bool field = shape_ == ContourShape::field && cursor.leaf.values;
    if (word == kNoContour || (word == kUnfitInside && !field && !start)) {
      if (cursor.from_contour) hit.normal = cursor.last_normal, hit.smooth = true;
      return true;
    }
    double t1 = t_limit;
    for (int a = 0; a < 3; ++a) t1 = std::min(t1, axes.t_at(a, place.voxel[a] + (axes.upwards[a] ? 1 : 0)));
    std::optional<Meeting> met;
    if (field && !(start && cursor.own_is_behind))
      met = meet_field(*cursor.leaf.values, axes, place.voxel, place.t, t1);
    else if (is_plane(word) && !(start && cursor.own_is_behind))
      met = meet_plane(unpack_plane(word), axes, place.voxel, place.t, t1);
    if (met) {
      const Vec3d direction(axes.direction[0], axes.direction[1], axes.direction[2]);
      const bool out = met->depth > 0 && cursor.leaving && met->depth <= kCrack && glm::dot(direction, met->normal) > 0;
      if (!(start && met->depth > 0) && !out) {
        hit.grid.t = met->t;
        if (met->depth <= kCrack) hit.normal = met->normal, hit.smooth = true;
        return true;
      }
    }
    // Go on; what the next voxel borders on matters to it.
    cursor.from_contour = is_plane(word);
    if (cursor.from_contour) cursor.last_normal = unpack_plane(word).normal;
    if (!mask_walk::leave_cube(axes, place, 0, t_limit)) return false;
    const double t_left = place.t;
    if (!walker_->find(axes, place, t_limit)) return false;
    cursor.from_contour &= place.t == t_left;
  }
}

ContourHit ContourWalker::first_hit_from(const GridRay& ray, const GridHit& first_cell) const {
  if (!first_cell.hit()) return {first_cell};
  const GridAxes axes(ray);
  Cursor cursor{contours_};
  ContourHit hit;
  const WalkPlace place{first_cell.voxel, first_cell.t, first_cell.face == kNoFace ? -1 : face_axis(first_cell.face)};
  if (next_hit(axes, place, std::min(ray.t_max, std::numeric_limits<double>::max()), cursor, hit)) return hit;
  return {{WalkEnd::t_max, {}, kNoFace, ray.t_max}};
}

ContourHit ContourWalker::first_hit(const GridRay& ray) const { return first_hit_from(ray, walker_->first_set(ray)); }

bool ContourWalker::blocked(const GridRay& ray, const ContourHit& hit, const Vec3d& direction,
                            const MaskVolume& blocking) const {
  GridRay away;
  if (hit.smooth) {
    const Vec3d place = from_middle(GridAxes(ray), hit.grid.voxel, hit.grid.t);
    away.voxel = hit.grid.voxel;
    for (int a = 0; a < 3; ++a) away.fraction[a] = std::clamp(place[a] + 0.5, 0.0, 1.0);
    away.direction = direction;
  }
  // From a full voxel, and from a face, a ray starts in front of it.
  const bool full = contours_->plane(hit.grid.voxel) == kNoContour;
  if (!hit.smooth || full) {
    if (hit.grid.face == kNoFace) return true;
    away = ray_from_surface(ray, hit.grid, direction);
  }
  const GridAxes axes(away);
  Cursor cursor{contours_};
  cursor.leaving = true, cursor.own_is_behind = hit.smooth;
  WalkPlace place{away.voxel, 0, -1};
  const double t_limit = std::numeric_limits<double>::max();
  if (!walker_->in_bounds(place.voxel)) return false;
  if (!walker_->find(axes, place, t_limit)) return false;
  ContourHit met;
  while (next_hit(axes, place, t_limit, cursor, met)) {
    if (blocking.test(matter_voxel(met.grid.voxel, met.normal))) return true;
    place = {met.grid.voxel, met.grid.t, met.grid.face == kNoFace ? -1 : face_axis(met.grid.face)};
    cursor.from_contour = false;
    if (!mask_walk::leave_cube(axes, place, 0, t_limit) || !walker_->find(axes, place, t_limit)) return false;
  }
  return false;
}

VoxelPos ContourWalker::matter_voxel(VoxelPos voxel, const Vec3d& normal) const {
  return world::matter_voxel(contours_->occupied(), voxel, normal);
}

VoxelPos matter_voxel(const MaskVolume& occupied, VoxelPos voxel, const Vec3d& normal) {
  if (occupied.test(voxel)) return voxel;
  VoxelPos best = voxel;
  double lowest = kInfinity;
  for (int i = 0; i < 27; ++i) {
    const VoxelPos step{i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1};
    if (i == 13 || !occupied.test(voxel + step)) continue;
    const Vec3d way(step.x, step.y, step.z);
    const double height = glm::dot(way, normal) / glm::length(way);
    if (height < lowest) lowest = height, best = voxel + step;
  }
  return best;
}

const StoreContours::Followed* StoreContours::follow(const Store& store, ContourShape shape, float iso) {
  const FloatLayer* distance = store.find_layer(Layer::distance);
  const FloatLayer* density = store.find_layer(Layer::density);
  if (shape == ContourShape::off || (!distance && !(density && iso > 0))) {
    followed_.reset();
    return nullptr;
  }
  const bool same_store = store_ == store.identity();
  if (!same_store) store_ = store.identity(), subscriber_ = store.subscribe();
  const std::vector<LeafPos> dirty = store.take_dirty(subscriber_);
  if (!same_store || !followed_ || shape != shape_ || iso != iso_) {
    shape_ = shape, iso_ = iso;
    followed_ =
        std::make_unique<Followed>(store.masks(MaskKind::occupied),
                                   distance ? level_set_surface(*distance) : density_surface(*density, iso), shape);
  } else if (!dirty.empty()) {
    const std::vector<LeafPos> changed = followed_->contours.update(dirty);
    followed_->cells.update(changed);
    followed_->walker.refresh();
  }
  return followed_.get();
}

}  // namespace world
