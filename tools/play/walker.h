/// The player in the world: walks, jumps, crouches and swims as sim::Player, flies, and passes through blocks where
/// that is asked for. Ticks of 1/60 s, apart from those of matter: pausing the world doesn't stop who looks at it.
#pragma once

#include <cstdint>

#include "sim/bodies/player.h"

namespace tools {

constexpr sim::TickLength kWalkTick{1, 60};
constexpr double kSprintFlight = 2.5;                           // times as fast flies who runs
constexpr double kEyeHeight = 1.62, kCrouchedEyeHeight = 1.27;  // m above the feet

/// What the player wants in one tick, in whole numbers, so that a recording holds exactly what was done.
struct WalkInput {
  int16_t east = 0, south = 0;                        // along x and z, 1/1024 of full speed each
  int16_t fly_dm_per_s = 109;                         // speed of flight, 1/10 m/s
  bool jump = false, crouch = false, sprint = false;  // up and down where it flies
  friend bool operator==(const WalkInput&, const WalkInput&) = default;
};

struct WalkState {
  world::WorldPoint foot;  // the middle of the bottom
  double eye_height = kEyeHeight;
  world::Vec3d velocity{0};  // m/s
  bool flies = false, passes = false, crouches = false, swims = false, stands = false;
  world::WorldPoint eye() const { return foot + world::Vec3d(0, eye_height, 0); }
};

class Walker {
 public:
  /// The store must outlive it and stay where it is. Fails where the place is outside of the world.
  static world::Result<std::unique_ptr<Walker>> make(const world::Store& store, const world::WorldPoint& foot);

  void step(const WalkInput& input);
  void set_flying(bool flies);
  void set_passing(bool passes);  // through blocks; flies then
  /// Not through what lies between.
  void teleport(const world::WorldPoint& foot);

  WalkState state() const;
  /// A whole tick between two places, or none: after a teleport.
  bool jumped() const { return jumped_; }
  /// Whether the player's box would overlap this voxel: nothing solid may be placed there.
  bool overlaps(world::VoxelPos v) const;
  uint64_t hash() const;

 private:
  explicit Walker(const world::Store& store) : store_(store), bodies_(store) {}
  const sim::Body& body() const;
  world::Vec3d wanted_flight(const WalkInput& input) const;

  const world::Store& store_;
  sim::Bodies bodies_;
  std::optional<sim::Player> player_;
  sim::BodySettings settings_;
  bool flies_ = false, passes_ = false, jumped_ = true, stands_ = false;
};

}  // namespace tools
