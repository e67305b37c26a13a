/// One body's way through a tick: forces, contacts, steps, and out of what it overlaps. Internal to sim/bodies.
#pragma once

#include "sim/bodies/bodies.h"
#include "sim/bodies/sweep.h"

namespace sim {

class BodyMotion {
 public:
  /// near: places in `bodies` of what the body can meet in this tick, sorted; obstacles: their boxes now.
  BodyMotion(const BodyTerrain& terrain, std::span<Body> bodies, std::span<const uint32_t> near,
             std::span<const BodyBox> obstacles, const BodySettings& settings, uint64_t tick, BodyReport& report)
      : terrain_(terrain),
        bodies_(bodies),
        near_(near),
        obstacles_(obstacles),
        settings_(settings),
        tick_(tick),
        report_(report) {}

  /// Moves bodies[index] through the tick.
  void step(uint32_t index);
  /// It did not go on, because it isn't known what lies there.
  bool waits() const { return waits_; }

 private:
  /// A way through `time` seconds, of which `left` remains; velocities at its two ends, in m/s.
  struct Way {
    BodyBox box;
    FixedVec3 left;
    world::Vec3d from, to;
    double time = 0;
    uint8_t touching = 0;
  };

  bool is_inside(const Body& body) const;
  bool clear_distance(const Body& body, int face, int64_t& distance) const;
  bool push_out(Body& body);
  world::Vec3d acceleration(const Body& body, const BodyBox& box, world::Vec3d velocity) const;
  int substeps(const Body& body) const;
  bool move(Body& body, double dt);
  void follow(Body& body, Way& way);
  void meet(Body& body, Way& way, const SweepHit& hit, const FixedVec3& gone);
  bool step_up(const Body& body, const Way& start, Way& way) const;
  bool stands(const BodyBox& box) const;
  void look_for_liquid(const BodyBox& box);

  const BodyTerrain& terrain_;
  std::span<Body> bodies_;
  std::span<const uint32_t> near_;
  std::span<const BodyBox> obstacles_;
  const BodySettings& settings_;
  uint64_t tick_;
  BodyReport& report_;
  bool wet_ = false;         // liquid is near
  world::Vec3d current_{0};  // its velocity, m/s
  bool waits_ = false;
};

bool is_finite(world::Vec3d v);

}  // namespace sim
