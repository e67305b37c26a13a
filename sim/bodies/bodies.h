/// Bodies: boxes that fall, slide, bounce, float and lie still: players, debris.
///
/// A step moves one after the other, those that lie lower first and of these the older first, each along its swept box
/// (sweep.h) against terrain and all others where they are then. What a contact gives to the other body takes effect at
/// the end of the step. So the result is a function of the bodies and the terrain: not of threads, of the order in
/// memory, or of where in the world it happens.
///
///   threads     a step finds for each body the wave in which it moves: after all before it in the order that it, or
///   what
///               it may meet, has to do with. Bodies of one wave have nothing to do with each other, and move at once
///   resting     restitution ends below kBounceSpeed; what has stayed where it is for kSleepTicks sleeps, bit for bit
///               the same and at no cost, until terrain beside it is edited, something hits it or its support moves
///   overlap     with terrain, or with bodies of lower ids: out by the shortest way, at most a voxel a tick and not
///               faster than before; where there is none (out of terrain: within a voxel) it is stuck, at rest, until
///               there is
///   current     liquid that flows carries a body along: drag is that of its way through the liquid
///   unloaded    where its way meets a region that is not loaded it waits, with its velocity
///   not finite  a body of which a speed or force isn't a number is set apart: it moves no more, nothing meets it, and
///               the others go on as if it were not there
///
/// cost   0.3 to 2 us a body that moves (see `loam bench run matter`); no memory once vectors have grown
/// knobs  body_integrator, body_substeps
/// fails  never; what went wrong is counted in BodyReport
/// source Erin Catto. Box2D 3.0 (sleep, the speed below which nothing bounces, the larger restitution of two); Horace
///        Lamb. Hydrodynamics. 1932, section 92 (half of the displaced mass moves with a body)
#pragma once

#include <string>
#include <vector>

#include "sim/bodies/terrain.h"
#include "sim/clock.h"
#include "sim/knobs.h"
#include "world/base/errors.h"

namespace sim {

using BodyId = uint32_t;  // in order of creation, from 1; never given again

constexpr double kBounceSpeed = 1.0;    // m/s: what comes slower stays; Box2D's restitutionThreshold
constexpr double kCalmSpeed = 0.01;     // m/s
constexpr int kSleepTicks = 30;         // half a second, as Box2D's b2_timeToSleep
constexpr double kFastestBody = 16384;  // m/s; faster ones are slowed to it
constexpr double kAirDensity = 1.225;   // kg/m^3, at 288.15 K and sea level (International Standard Atmosphere)

struct BodyDescription {
  world::WorldPoint foot;         // the middle of its bottom
  world::Vec3d size{1, 1, 1};     // m; each in [1/256, 64]
  world::Vec3d velocity{0};       // m/s
  double density = 1000;          // kg/m^3, in [1, 1e5]
  double restitution = 0;         // of speed, in [0, 1]
  double friction = 0.5;          // Coulomb's coefficient, in [0, 10]
  double drag_coefficient = 1.0;  // of a cube 1.05 (Hoerner. Fluid-Dynamic Drag. 1965); in [0, 100]
  double step_height = 0;         // m that it climbs without a jump, in [0, 2]
};

enum class BodyState : uint8_t { awake, asleep, stuck, quarantined };

struct Body {
  BodyId id = 0;
  BodyState state = BodyState::awake;
  uint8_t touching = 0;     // bit f: something stands against its Face f since the last step
  uint16_t calm_ticks = 0;  // <= kSleepTicks
  BodyBox box;
  FixedVec3 velocity;         // voxels/s
  FixedVec3 drawn_from;       // box.min at the last tick; box.min itself after a teleport
  FixedVec3 given;            // velocity that contacts of this step add at its end
  world::Vec3d drive{0};      // m/s^2 that a player or a machine adds in the next step
  double submerged = 0;       // share of its volume that was in liquid in the last step
  BodyDescription described;  // constants; foot, size and velocity are those of the beginning
  int64_t step_height = 0;    // voxels * 2^32
  double volume() const { return from_fixed(box.size.x) * from_fixed(box.size.y) * from_fixed(box.size.z); }
  double mass() const { return volume() * described.density; }
};

/// Where it is drawn at a part of the way from the last tick to this one: its lowest corner.
world::WorldPoint drawn_at(const Body& body, double part);

struct BodySettings {
  Integrator integrator = SimKnobs{}.body_integrator;
  int substeps = 1;  // 1 .. kMostSubsteps; raised for a body where forces ask for it
  TickLength tick;
  double gravity = 9.81;  // m/s^2, downwards
  uint64_t seed = 0;

  static BodySettings from(const SimKnobs& knobs) {
    BodySettings settings;
    settings.integrator = knobs.body_integrator, settings.substeps = knobs.body_substeps;
    return settings;
  }
};

struct BodyReport {
  uint64_t bodies = 0, awake = 0, contacts = 0, pushed = 0, stuck = 0, frozen = 0, quarantined = 0;
  uint64_t substeps_raised = 0;  // bodies that asked for more sub-steps
  /// Adds what a part of the bodies met with.
  void add(const BodyReport& part);
};

class Bodies {
 public:
  /// Follows the store's edits from now on; it must outlive this and stay where it is.
  explicit Bodies(const world::Store& store);

  /// Fails where a property is out of its range or the place outside the world.
  world::Result<BodyId> add(const BodyDescription& description);
  bool remove(BodyId id);
  const Body* find(BodyId id) const;
  std::span<const Body> all() const { return bodies_; }  // by id

  // Each wakes the body. Values that are not finite set it apart.
  void set_velocity(BodyId id, world::Vec3d mps);
  void set_drive(BodyId id, world::Vec3d mps2);
  /// No picture between there and here.
  void teleport(BodyId id, const world::WorldPoint& foot);
  /// Keeps the middle of the bottom; false, and as before, where there is no room.
  bool resize(BodyId id, world::Vec3d size);
  /// Whether something solid is right below.
  bool stands(BodyId id);
  /// How fast the liquid flows that it lies in, m/s.
  world::Vec3d current(BodyId id);

  void set_unloaded(world::RegionPos r, bool unloaded);

  BodyReport step(const BodySettings& settings);
  uint64_t ticks() const { return tick_; }

  /// Of all that the next steps depend on, by id.
  uint64_t content_hash() const;
  /// All bodies as bytes, and back: the same bit for bit. Fails where the bytes are none of ours or out of range.
  std::string bytes() const;
  world::Status restore(std::string_view bytes);

 private:
  Body* known(BodyId id);
  void wake(Body& body);
  void wake_beside(const BodyBox& box, BodyId but);
  void wake_edited();
  void find_reaches(const BodySettings& settings);
  void find_near();
  void find_waves();
  /// Scratch of one thread.
  struct Worker {
    BodyTerrain terrain;
    std::vector<uint32_t> near;      // places in bodies_, sorted
    std::vector<BodyBox> obstacles;  // of near
    BodyReport report;
  };
  void step_body(uint32_t place, const BodySettings& settings, Worker& worker);
  void step_all(const BodySettings& settings);

  const world::Store& store_;
  int subscriber_;
  BodyTerrain terrain_;
  std::vector<Body> bodies_;
  BodyId next_id_ = 1;
  uint64_t tick_ = 0;
  BodyReport report_;

  // Scratch of a step. A place is that of a body in order_.
  struct Reach {
    BodyBox box;
    uint32_t body;
  };
  std::vector<Reach> reaches_;  // by box.min.x
  int64_t widest_ = 0;
  std::vector<uint32_t> reach_of_;           // by body
  std::vector<uint32_t> order_;              // bodies
  std::vector<std::vector<uint32_t>> near_;  // by place: bodies, sorted
  std::vector<uint32_t> met_;                // by body: the wave after the last that has to do with it
  std::vector<uint32_t> wave_of_;            // by place
  std::vector<uint32_t> places_, waves_;     // wave w: places_[waves_[w] .. waves_[w + 1]), by place
  std::vector<BodyBox> obstacles_;           // of stands()
};

}  // namespace sim
