#include "sim/bodies/sweep.h"

namespace sim {

using world::VoxelPos;

namespace {

constexpr int kOrder[3] = {0, 2, 1};  // of axes whose planes are reached at once
constexpr int kRank[3] = {0, 2, 1};   // place of an axis in kOrder

/// Whether a / b < c / d; b, d > 0.
bool less(int64_t a, int64_t b, int64_t c, int64_t d) { return __int128{a} * d < __int128{c} * b; }

int64_t size_of(int64_t v) { return v < 0 ? -v : v; }

/// Keeps the earlier of two; at once, the one whose axis comes first.
void keep_earlier(SweepHit& best, const SweepHit& other) {
  if (!other.hit()) return;
  if (best.hit()) {
    if (less(best.numerator, best.denominator, other.numerator, other.denominator)) return;
    const bool earlier = less(other.numerator, other.denominator, best.numerator, best.denominator);
    if (!earlier && kRank[other.axis] >= kRank[best.axis]) return;
  }
  best = other;
}

/// The walk of one box's leading faces.
class Sweep {
 public:
  Sweep(const BodyBox& box, const FixedVec3& d, const BodyTerrain& terrain) : box_(box), d_(d), terrain_(terrain) {
    for (int a = 0; a < 3; ++a) {
      const int64_t first = box.min[a] >> kFixedLog2, last = (box.max(a) - 1) >> kFixedLog2;
      lead_[a] = static_cast<int32_t>(d[a] > 0 ? last : first);
    }
  }

  void meet_box(const BodyBox& other, int obstacle, VoxelPos voxel) {
    SweepHit hit = time_of_impact(other);
    hit.obstacle = obstacle, hit.voxel = voxel;
    keep_earlier(best_, hit);
  }

  SweepHit run() {
    meet_shapes_at_start();
    while (true) {
      // Find the next plane.
      SweepHit next;
      for (const int a : kOrder) {
        if (d_[a] == 0) continue;
        SweepHit plane{a, distance_to_plane(a), size_of(d_[a])};
        if (plane.numerator < plane.denominator &&
            (!next.hit() || less(plane.numerator, plane.denominator, next.numerator, next.denominator)))
          next = plane;
      }
      if (!next.hit()) return best_;
      // Stop where something else is met before it.
      SweepHit first = best_;
      keep_earlier(first, next);
      if (best_.hit() && first.axis == best_.axis && first.numerator == best_.numerator &&
          first.denominator == best_.denominator)
        return best_;
      if (enter(next)) return best_;
    }
  }

 private:
  int64_t distance_to_plane(int a) const {
    return d_[a] > 0 ? (int64_t{lead_[a]} + 1) * kFixedOne - box_.max(a) : box_.min[a] - int64_t{lead_[a]} * kFixedOne;
  }

  /// Voxels that the box may overlap along an axis from the time on: from its trailing face to its leading one.
  void range_at(int b, const SweepHit& time, int32_t& low, int32_t& high) const {
    const int64_t gone = time.part_of(d_[b]);
    low = d_[b] < 0 ? lead_[b] : static_cast<int32_t>((box_.min[b] + gone) >> kFixedLog2);
    high = d_[b] > 0 ? lead_[b] : static_cast<int32_t>((box_.max(b) + gone - 1) >> kFixedLog2);
  }

  /// Looks at the layer behind the plane; true where something full is there.
  bool enter(const SweepHit& plane) {
    const int a = plane.axis, b = (a + 1) % 3, c = (a + 2) % 3;
    lead_[a] += d_[a] > 0 ? 1 : -1;
    int32_t low_b, high_b, low_c, high_c;
    range_at(b, plane, low_b, high_b), range_at(c, plane, low_c, high_c);
    VoxelPos v;
    v[a] = lead_[a];
    for (v[b] = low_b; v[b] <= high_b; ++v[b])
      for (v[c] = low_c; v[c] <= high_c; ++v[c]) {
        const BodyTerrain::Filling filling = terrain_.filling(v);
        if (filling == BodyTerrain::Filling::full) {
          best_ = plane;
          best_.voxel = v;
          return true;
        }
        if (filling == BodyTerrain::Filling::shaped)
          for (const BodyBox& part : terrain_.boxes(v)) meet_box(part, -1, v);
      }
    return false;
  }

  void meet_shapes_at_start() {
    const world::VoxelBox at = box_.voxels();
    VoxelPos v;
    for (v.x = at.min.x; v.x <= at.max.x; ++v.x)
      for (v.y = at.min.y; v.y <= at.max.y; ++v.y)
        for (v.z = at.min.z; v.z <= at.max.z; ++v.z)
          if (terrain_.filling(v) == BodyTerrain::Filling::shaped)
            for (const BodyBox& part : terrain_.boxes(v)) meet_box(part, -1, v);
  }

  /// When the boxes' overlap on the last of the three axes begins, if that is before it ends on any.
  SweepHit time_of_impact(const BodyBox& other) const {
    SweepHit enter;
    int64_t leave_numerator = 1, leave_denominator = 1;
    for (const int a : kOrder) {
      if (d_[a] == 0) {
        if (box_.max(a) <= other.min[a] || other.max(a) <= box_.min[a]) return {};
        continue;
      }
      const int64_t size = size_of(d_[a]);
      const int64_t begin = d_[a] > 0 ? other.min[a] - box_.max(a) : box_.min[a] - other.max(a);
      const int64_t end = d_[a] > 0 ? other.max(a) - box_.min[a] : box_.max(a) - other.min[a];
      if (end <= 0) return {};
      // Axes that overlap already don't count. Of those that begin at once the last in order is the one that is met,
      // as where planes of the grid are crossed.
      if (begin >= 0 && (!enter.hit() || !less(begin, size, enter.numerator, enter.denominator)))
        enter = {a, begin, size};
      if (less(end, size, leave_numerator, leave_denominator)) leave_numerator = end, leave_denominator = size;
    }
    if (!enter.hit() || enter.numerator >= enter.denominator) return {};
    if (!less(enter.numerator, enter.denominator, leave_numerator, leave_denominator)) return {};
    return enter;
  }

  const BodyBox& box_;
  const FixedVec3& d_;
  const BodyTerrain& terrain_;
  int32_t lead_[3];
  SweepHit best_;
};

}  // namespace

SweepHit sweep(const BodyBox& box, const FixedVec3& displacement, const BodyTerrain& terrain,
               std::span<const BodyBox> obstacles) {
  Sweep walk(box, displacement, terrain);
  for (size_t i = 0; i < obstacles.size(); ++i) walk.meet_box(obstacles[i], static_cast<int>(i), {});
  return walk.run();
}

}  // namespace sim
