#include "tools/play/walker.h"

#include <algorithm>
#include <cmath>

#include "world/base/random.h"

namespace tools {

using world::Vec3d;
using world::WorldPoint;

namespace {

constexpr double kFlightGrip = 0.3;  // of the difference to the wanted speed, a tick: full speed in a quarter second
constexpr double kSwims = 0.35;      // as sim::Player

}  // namespace

world::Result<std::unique_ptr<Walker>> Walker::make(const world::Store& store, const WorldPoint& foot) {
  std::unique_ptr<Walker> walker(new Walker(store));
  TRY(const sim::Player player, sim::Player::enter(walker->bodies_, foot));
  walker->player_.emplace(player);
  walker->settings_.tick = kWalkTick;
  return walker;
}

const sim::Body& Walker::body() const { return *bodies_.find(player_->body()); }

Vec3d Walker::wanted_flight(const WalkInput& input) const {
  Vec3d way(input.east / 1024.0, (input.jump ? 1.0 : 0.0) - (input.crouch ? 1.0 : 0.0), input.south / 1024.0);
  const double across = std::sqrt(way.x * way.x + way.z * way.z);
  if (across > 1) way.x /= across, way.z /= across;
  const double speed = input.fly_dm_per_s / 10.0 * (input.sprint ? kSprintFlight : 1.0);
  return {way.x * speed, way.y * std::min(speed, 0.75 * speed + 2), way.z * speed};
}

void Walker::step(const WalkInput& input) {
  jumped_ = false;
  sim::PlayerInput wishes;
  wishes.east = input.east / 1024.0, wishes.south = input.south / 1024.0;
  wishes.jump = input.jump && !flies_, wishes.crouch = input.crouch && !flies_, wishes.sprint = input.sprint;
  settings_.gravity = flies_ ? 0 : 9.81;
  if (!flies_) {
    player_->control(bodies_, wishes, settings_);
    bodies_.step(settings_);
    stands_ = bodies_.stands(player_->body());
    return;
  }
  if (player_->crouches()) player_->control(bodies_, {}, settings_);  // stands up
  bodies_.set_drive(player_->body(), Vec3d(0));
  const Vec3d now = sim::from_fixed(body().velocity);
  Vec3d next = now + (wanted_flight(input) - now) * kFlightGrip;
  if (glm::length(next) < 0.01) next = Vec3d(0);
  bodies_.set_velocity(player_->body(), next);
  if (passes_) {
    const WorldPoint foot = state().foot + next * kWalkTick.seconds();
    if (world::inside_world(foot.voxel)) bodies_.teleport(player_->body(), foot);
    bodies_.set_velocity(player_->body(), next);
    stands_ = false;
    return;
  }
  bodies_.step(settings_);
  stands_ = bodies_.stands(player_->body());
  if (stands_ && input.crouch) flies_ = false;  // landed
}

void Walker::set_flying(bool flies) {
  flies_ = flies;
  if (!flies) passes_ = false;
}

void Walker::set_passing(bool passes) {
  passes_ = passes;
  if (passes) flies_ = true;
}

void Walker::teleport(const WorldPoint& foot) {
  bodies_.teleport(player_->body(), foot);
  bodies_.set_velocity(player_->body(), Vec3d(0));
  jumped_ = true;
}

WalkState Walker::state() const {
  const sim::Body& b = body();
  WalkState s;
  sim::FixedVec3 foot = b.box.min;
  foot.x += b.box.size.x / 2, foot.z += b.box.size.z / 2;
  s.foot = sim::world_point(foot);
  s.velocity = sim::from_fixed(b.velocity);
  s.flies = flies_, s.passes = passes_, s.crouches = player_->crouches();
  s.swims = b.submerged > kSwims, s.stands = stands_;
  s.eye_height = s.crouches ? kCrouchedEyeHeight : kEyeHeight;
  return s;
}

bool Walker::overlaps(world::VoxelPos v) const {
  const world::VoxelBox at = body().box.voxels();
  return at.contains(v);
}

uint64_t Walker::hash() const {
  return world::hash_combine(bodies_.content_hash(),
                             static_cast<uint64_t>(flies_) << 1 | static_cast<uint64_t>(passes_));
}

}  // namespace tools
