#include "sim/bodies/body_motion.h"

#include <algorithm>
#include <cmath>

#include "world/base/random.h"

namespace sim {

using world::Vec3d;

namespace {

constexpr int64_t kFurthestPush = 16 * kFixedOne;
constexpr int kMostContacts = 8;        // of one way; a corner takes three
constexpr double kLiquidDamping = 1.0;  // 1/s of a body that is all in liquid: bobbing ends, which drag alone leaves
constexpr int64_t kMostWay = int64_t{1} << 47;  // voxels * 2^32 a part of a tick, half of what sweep() takes

int64_t clamped_way(double metres) {
  constexpr double kMost = static_cast<double>(kMostWay) * 0x1p-32;
  return fixed_from(std::clamp(metres, -kMost, kMost));
}
FixedVec3 clamped_way(Vec3d v) { return {clamped_way(v.x), clamped_way(v.y), clamped_way(v.z)}; }

int64_t distance(const FixedVec3& a, const FixedVec3& b, int axis) {
  return a[axis] < b[axis] ? b[axis] - a[axis] : a[axis] - b[axis];
}

}  // namespace

bool is_finite(Vec3d v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

void BodyMotion::step(uint32_t index) {
  Body& body = bodies_[index];
  if (is_inside(body)) {
    if (push_out(body)) {
      ++report_.pushed;
      body.state = BodyState::awake;
    } else {
      ++report_.stuck;
      body.state = BodyState::stuck;
      body.velocity = {};
    }
    body.drive = Vec3d(0);
    body.calm_ticks = 0, body.touching = 0;
    return;
  }
  body.state = BodyState::awake;
  look_for_liquid(body.box);
  const int parts = substeps(body);
  body.touching = 0;
  for (int i = 0; i < parts; ++i)
    if (!move(body, settings_.tick.seconds() / parts)) break;
  body.drive = Vec3d(0);
}

/// Liquid is looked for around where a part of a tick begins.
void BodyMotion::look_for_liquid(const BodyBox& box) {
  wet_ = terrain_.any_liquid(grown(box, kFixedOne).voxels());
  current_ = wet_ ? terrain_.current(box) : Vec3d(0);
}

// ---- overlap ----

bool BodyMotion::is_inside(const Body& body) const {
  for (size_t i = 0; i < near_.size(); ++i)
    if (bodies_[near_[i]].id < body.id && overlap(body.box, obstacles_[i])) return true;
  return terrain_.overlaps(body.box);
}

/// How far it must go towards a face's side until it overlaps nothing; false where that is further than kFurthestPush,
/// or more than a voxel through terrain.
bool BodyMotion::clear_distance(const Body& body, int face, int64_t& distance) const {
  const int a = world::face_axis(face);
  const bool up = world::face_sign(face) > 0;
  distance = 0;
  while (distance <= kFurthestPush) {
    BodyBox box = body.box;
    box.min[a] += up ? distance : -distance;
    if (distance > kFixedOne && terrain_.overlaps(box)) return false;
    int64_t further = 0;
    const auto clear = [&](const BodyBox& other) {
      further = std::max(further, up ? other.max(a) - box.min[a] : box.max(a) - other.min[a]);
      return false;
    };
    for (size_t i = 0; i < near_.size(); ++i)
      if (bodies_[near_[i]].id < body.id && overlap(box, obstacles_[i])) clear(obstacles_[i]);
    terrain_.any_overlap(box, clear);
    if (further == 0) return true;
    distance += further;
  }
  return false;
}

bool BodyMotion::push_out(Body& body) {
  // Upwards where ways are as long; sideways begun by lot, so that heaps have no favourite side.
  const int turn = static_cast<int>(world::hash_combine(world::hash_combine(settings_.seed, body.id), tick_) & 3);
  constexpr int kSides[4] = {world::kFacePosX, world::kFacePosZ, world::kFaceNegX, world::kFaceNegZ};
  int best = -1;
  int64_t shortest = INT64_MAX;
  for (int i = 0; i < world::kFaces; ++i) {
    const int face = i == 0 ? world::kFacePosY : i == 5 ? world::kFaceNegY : kSides[(i - 1 + turn) & 3];
    int64_t distance;
    if (clear_distance(body, face, distance) && distance < shortest) best = face, shortest = distance;
  }
  if (best < 0) return false;
  const int a = world::face_axis(best), sign = world::face_sign(best);
  BodyBox box = body.box;
  box.min[a] += sign * std::min(shortest, kFixedOne);
  // Out of a heap it takes more than one tick, but not by way of terrain.
  if (shortest > kFixedOne && terrain_.overlaps(box)) return false;
  body.box = box;
  if (sign * body.velocity[a] < 0) body.velocity[a] = 0;
  return true;
}

// ---- forces ----

/// Gravity, buoyancy, drag, and what drives it. Drag is that of its way through what flows.
Vec3d BodyMotion::acceleration(const Body& body, const BodyBox& box, Vec3d velocity) const {
  const double volume = body.volume(), mass = volume * body.described.density;
  const Displaced liquid = wet_ ? terrain_.displaced(box) : Displaced{};
  const double share = std::min(1.0, liquid.volume / volume);
  const double moving_mass = mass + liquid.mass / 2;
  const double medium = kAirDensity * (1 - share) + liquid.mass / volume;
  Vec3d force(0, settings_.gravity * (liquid.mass - mass), 0);
  const Vec3d through = velocity - current_ * share;
  const double speed = std::sqrt(dot(through, through));
  for (int a = 0; a < 3; ++a) {
    const double area = volume / from_fixed(box.size[a]);
    force[a] -= 0.5 * medium * body.described.drag_coefficient * area * speed * through[a];
    force[a] -= kLiquidDamping * share * moving_mass * through[a];
  }
  return force / moving_mass + body.drive;
}

/// As many as keep drag and bobbing stable: their rates at the body's speed, all of it in liquid where some is near.
int BodyMotion::substeps(const Body& body) const {
  const double dt = settings_.tick.seconds();
  const Vec3d velocity = from_fixed(body.velocity), size = from_fixed(body.box.size);
  const Displaced liquid = wet_ ? terrain_.displaced(body.box) : Displaced{};
  const double mass = body.mass(), thinnest = std::min(size.x, std::min(size.y, size.z));
  const double medium = kAirDensity + (wet_ ? std::max(liquid.mass / body.volume(), 1000.0) : 0.0);
  const double flow = std::sqrt(dot(current_, current_));
  const double speed = std::sqrt(dot(velocity, velocity)) + flow + settings_.gravity * dt;
  double rate =
      medium * body.described.drag_coefficient * (body.volume() / thinnest) * speed / (mass + liquid.mass / 2);
  if (wet_) {
    rate += kLiquidDamping;
    // Of a box that floats: omega^2 = g * (density of liquid) / (its own * its height).
    const double square = settings_.gravity * medium / ((body.described.density + medium / 4) * size.y);
    rate = std::max(rate, std::sqrt(square));
  }
  return stable_substeps(rate, dt, settings_.substeps);
}

// ---- the way ----

bool BodyMotion::stands(const BodyBox& box) const { return sweep(box, {0, -1, 0}, terrain_, obstacles_).hit(); }

/// A part of a tick; false where the body waits, or is set apart.
bool BodyMotion::move(Body& body, double dt) {
  // Find where its forces would lead it.
  look_for_liquid(body.box);
  const Vec3d before = from_fixed(body.velocity);
  const auto force = [&](Vec3d offset, Vec3d velocity) {
    return acceleration(body, wet_ ? moved(body.box, clamped_way(offset)) : body.box, velocity);
  };
  const Motion<Vec3d> free = integrate(settings_.integrator, Motion<Vec3d>{Vec3d(0), before}, dt, force);
  if (!is_finite(free.position) || !is_finite(free.velocity)) {
    body.state = BodyState::quarantined;
    return false;
  }
  Way way{body.box, clamped_way(free.position), before, free.velocity, dt, 0};

  // Wait where it isn't known what lies there, or at a step above.
  BodyBox reach = hull(body.box, moved(body.box, way.left));
  reach.size.y += body.step_height;
  if (terrain_.is_unloaded(grown(reach, 1).voxels())) {
    ++report_.frozen;
    body.calm_ticks = 0;
    waits_ = true;
    return false;
  }

  // Go, and climb what is in the way where that leads further.
  const Way start = way;
  const bool stood = body.step_height > 0 && stands(body.box);
  follow(body, way);
  constexpr uint8_t kSideFaces =
      1 << world::kFaceNegX | 1 << world::kFacePosX | 1 << world::kFaceNegZ | 1 << world::kFacePosZ;
  if (stood && (way.touching & kSideFaces)) step_up(body, start, way);

  body.box = way.box;
  for (int a = 0; a < 3; ++a) way.to[a] = std::clamp(way.to[a], -kFastestBody, kFastestBody);
  body.velocity = fixed_from(way.to);
  body.touching |= way.touching;
  body.submerged = wet_ ? std::min(1.0, terrain_.displaced(body.box).volume / body.volume()) : 0;
  return true;
}

/// Along the way from contact to contact.
void BodyMotion::follow(Body& body, Way& way) {
  for (int contact = 0; contact < kMostContacts; ++contact) {
    const SweepHit hit = sweep(way.box, way.left, terrain_, obstacles_);
    const FixedVec3 gone = hit.part_of(way.left);
    way.box.min = way.box.min + gone;
    if (!hit.hit()) return;
    ++report_.contacts;
    meet(body, way, hit, gone);
  }
}

/// What a contact does to the rest of the way.
void BodyMotion::meet(Body& body, Way& way, const SweepHit& hit, const FixedVec3& gone) {
  const int a = hit.axis;
  const bool up = way.left[a] > 0;
  const double t = hit.time();
  way.touching |= static_cast<uint8_t>(1 << (2 * a + (up ? 1 : 0)));

  // Find the speed of impact from the energy along the axis, which an integrator's straight line would not keep.
  const double pull = way.time > 0 ? (way.to[a] - way.from[a]) / way.time : 0;
  const double square = way.from[a] * way.from[a] + 2 * pull * from_fixed(gone[a]);
  const double impact = (up ? 1.0 : -1.0) * std::sqrt(std::max(0.0, square));

  // Bounce from what is fast enough, share the momentum with another body, or stay on it.
  Body* other = hit.obstacle >= 0 ? &bodies_[near_[static_cast<size_t>(hit.obstacle)]] : nullptr;
  const Vec3d carried = other ? from_fixed(other->velocity + other->given) : Vec3d(0);
  const double approach = up ? impact - carried[a] : carried[a] - impact;
  const double e =
      other ? std::max(body.described.restitution, other->described.restitution) : body.described.restitution;
  bool bounces = approach > kBounceSpeed;
  double speed = carried[a];
  if (bounces && other) {
    const double ours = body.mass(), theirs = other->mass(), all = ours + theirs;
    speed = (ours * impact + theirs * carried[a] + theirs * e * (carried[a] - impact)) / all;
    const double theirs_after = (ours * impact + theirs * carried[a] + ours * e * (impact - carried[a])) / all;
    other->given[a] += fixed_from(theirs_after) - fixed_from(carried[a]);
  } else if (bounces) {
    speed = -e * impact;
    bounces = e > 0;
  }

  // Rub: along the face no more than Coulomb's share of what the contact took across it.
  const double across = std::abs((bounces ? impact : way.to[a]) - speed);
  const int b = (a + 1) % 3, c = (a + 2) % 3;
  const double along_b = way.to[b] - carried[b], along_c = way.to[c] - carried[c];
  const double along = std::sqrt(along_b * along_b + along_c * along_c);
  const double friction = body.described.friction;
  const double kept = friction > 0 && along > 0 ? std::max(0.0, 1 - friction * across / along) : 1.0;
  way.left = way.left - gone;
  for (const int other_axis : {b, c}) {
    way.from[other_axis] += (way.to[other_axis] - way.from[other_axis]) * t;
    if (kept == 1) continue;
    way.to[other_axis] = carried[other_axis] + (way.to[other_axis] - carried[other_axis]) * kept;
    way.left[other_axis] = fixed_from(from_fixed(way.left[other_axis]) * kept);
  }
  way.time *= 1 - t;
  way.from[a] = speed;
  way.to[a] = bounces ? speed + pull * way.time : speed;
  // A bounce goes on with the rest of the time.
  way.left[a] = bounces ? clamped_way(speed * way.time + pull * way.time * way.time / 2) : 0;
}

/// The same way a step higher, if it ends on ground and further along; false where it doesn't.
bool BodyMotion::step_up(const Body& body, const Way& start, Way& way) const {
  Way higher = start;
  const FixedVec3 lift{0, body.step_height, 0};
  const FixedVec3 lifted = sweep(higher.box, lift, terrain_, obstacles_).part_of(lift);
  higher.box = moved(higher.box, lifted);
  FixedVec3 left{start.left.x, 0, start.left.z};
  for (int contact = 0; contact < 3; ++contact) {
    const SweepHit hit = sweep(higher.box, left, terrain_, obstacles_);
    const FixedVec3 gone = hit.part_of(left);
    higher.box = moved(higher.box, gone);
    if (!hit.hit()) break;
    higher.touching |= static_cast<uint8_t>(1 << (2 * hit.axis + (left[hit.axis] > 0 ? 1 : 0)));
    left = left - gone;
    left[hit.axis] = 0, higher.to[hit.axis] = 0;
  }
  const auto progress = [&](const BodyBox& box) {
    return distance(start.box.min, box.min, 0) + distance(start.box.min, box.min, 2);
  };
  if (progress(higher.box) <= progress(way.box)) return false;
  const FixedVec3 down{0, -lifted.y + std::min<int64_t>(0, start.left.y), 0};
  const SweepHit ground = sweep(higher.box, down, terrain_, obstacles_);
  if (!ground.hit()) return false;
  higher.box = moved(higher.box, ground.part_of(down));
  higher.to.y = 0;
  higher.touching |= 1 << world::kFaceNegY;
  way = higher;
  return true;
}

}  // namespace sim
