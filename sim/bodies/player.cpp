#include "sim/bodies/player.h"

#include <algorithm>
#include <cmath>

namespace sim {

using world::Vec3d;

namespace {

// m/s^2. On ground full speed comes within a tenth of a second.
constexpr double kGroundGrip = 60, kAirGrip = 8, kLiquidGrip = 16, kSwimLift = 14;
constexpr double kSwims = 0.35;  // share in liquid from which legs swim

double toward(double wanted, double now, double most, double dt) {
  return std::clamp((wanted - now) / dt, -most, most);
}

}  // namespace

world::Result<Player> Player::enter(Bodies& bodies, const world::WorldPoint& foot) {
  BodyDescription d;
  d.foot = foot;
  d.size = {kPlayerWidth, kPlayerHeight, kPlayerWidth};
  d.density = kPlayerDensity;
  d.friction = 0;
  d.step_height = kPlayerStep;
  TRY(const BodyId id, bodies.add(d));
  return Player(id);
}

void Player::control(Bodies& bodies, const PlayerInput& input, const BodySettings& settings) {
  const Body* body = bodies.find(body_);
  if (!body) return;

  // Crouch, or stand up where there is room.
  if (input.crouch != crouches_ &&
      bodies.resize(body_, {kPlayerWidth, input.crouch ? kCrouchedHeight : kPlayerHeight, kPlayerWidth}))
    crouches_ = input.crouch;
  const Vec3d velocity = from_fixed(body->velocity);
  const bool swims = body->submerged > kSwims, stands = bodies.stands(body_);

  // Accelerate towards what is wanted.
  const double length = std::sqrt(input.east * input.east + input.south * input.south);
  const double top = swims ? kSwimSpeed : crouches_ ? kCrouchSpeed : input.sprint ? kSprintSpeed : kWalkSpeed;
  const double scale = length > 1 ? top / length : top;
  const double grip = stands ? kGroundGrip : swims ? kLiquidGrip : kAirGrip;
  const double dt = settings.tick.seconds();
  Vec3d drive(0);
  const bool wants = length > 0;
  // Who swims does so through water that flows.
  const Vec3d carried = swims ? bodies.current(body_) : Vec3d(0);
  if (wants || stands || swims) {
    drive.x = toward(input.east * scale + carried.x, velocity.x, grip, dt);
    drive.z = toward(input.south * scale + carried.z, velocity.z, grip, dt);
  }
  if (swims) drive.y = input.jump ? kSwimLift : input.crouch ? -kSwimLift : 0;
  if (swims && velocity.y * drive.y > 0 && std::abs(velocity.y) > kSwimSpeed) drive.y = 0;
  bodies.set_drive(body_, drive);

  // Jump: as fast as a fall from that height ends.
  if (input.jump && stands && !swims)
    bodies.set_velocity(body_, {velocity.x, std::sqrt(2 * settings.gravity * kJumpHeight), velocity.z});
}

}  // namespace sim
