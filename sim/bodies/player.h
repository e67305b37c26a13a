/// A player: a body that walks, jumps, crouches and swims as its controls say. Speeds and sizes are those that players
/// of block games know.
///
/// Walking is an acceleration towards the speed that is wanted: strong on ground, weak in the air, in between in
/// liquid. The rest, slopes of stairs and floating included, is what bodies do.
#pragma once

#include "sim/bodies/bodies.h"

namespace sim {

constexpr double kPlayerWidth = 0.6, kPlayerHeight = 1.8, kCrouchedHeight = 1.5;  // m
constexpr double kWalkSpeed = 4.3, kSprintSpeed = 5.6, kCrouchSpeed = 1.3;        // m/s
constexpr double kSwimSpeed = 2.2;                                                // m/s
constexpr double kJumpHeight = 1.25, kPlayerStep = 0.6;                           // m
constexpr double kPlayerDensity = 985;  // kg/m^3: with lungs half full people float in water, just (Archimedes)

struct PlayerInput {
  double east = 0, south = 0;  // the way that is wanted, along x and z; longer than 1 counts as 1
  bool jump = false, crouch = false, sprint = false;
};

class Player {
 public:
  /// Fails as Bodies::add().
  static world::Result<Player> enter(Bodies& bodies, const world::WorldPoint& foot);

  BodyId body() const { return body_; }
  /// Not as high as it stands: by wish, or because there is no room above.
  bool crouches() const { return crouches_; }
  /// Before each step of the bodies.
  void control(Bodies& bodies, const PlayerInput& input, const BodySettings& settings);

 private:
  explicit Player(BodyId body) : body_(body) {}
  BodyId body_;
  bool crouches_ = false;
};

}  // namespace sim
