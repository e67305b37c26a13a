/// Light as a cellular automaton: a voxel has the level of its brightest neighbour less what it takes, or the level it
/// gives itself, or the sky's.
///
///   level(v) = max(given by v, max over the six neighbours n of level(n) - loss(v))     in [0, 15]; 0 where loss says
///   so sky(v)   = sky_level where v passes the sky and sky(v + y) = sky_level; above the world it is so
///
/// Each step loses at least 1, and columns end at the top of the world, so that these equations have one solution: it
/// depends on neither the order of work, the threads, nor the edits that led to the blocks.
///
/// How it is found: sunlit columns first, by prefix-and of leaf masks from the top; then windows of leaves, level by
/// level (flood_window.h), which are independent of each other because light reaches no further than 14: each has a
/// margin of two leaves. After an edit only voxels whose equation no longer holds can start a change, and none spreads
/// further than the larger of the voxel's old level and the new right side, less 1; leaves within that are found anew
/// from the levels around them. Where an edit reaches a few voxels only, they are followed one by one (queue_flood.h).
///
/// Regions that are not loaded give no light and take none: it waits at their border, and arrives when they are loaded.
///
/// cost   see `loam bench run light`
/// knobs  light_model
/// source Luanti, voxelalgorithms.cpp (the rule of block games); Leslie Lamport. The parallel execution of DO loops.
///        1974 (fronts)
#pragma once

#include <memory>
#include <vector>

#include "sim/light/leaf_optics.h"
#include "sim/light/light_domain.h"
#include "world/store/light_changes.h"
#include "world/store/light_volume.h"

namespace sim {

struct LightReport {
  uint64_t leaves_computed = 0;  // in windows, margins included; in all fields
  uint64_t leaves_changed = 0;
  uint64_t windows = 0;
  // Changes of a field that were small enough to be followed voxel by voxel (queue_flood.h), and their voxels; and such
  // that were begun so and turned out to be large.
  uint64_t queues = 0, queue_voxels = 0, queues_left = 0;
};

class FieldFlood;
class FloodWorkers;

/// Keeps the light of one store. Not for two threads at once; it uses all threads itself.
class FloodLight {
 public:
  /// Follows the store's changes from now on; the store must outlive it, and stay where it is. model is not `none`.
  /// With rules of its own, `rules` has an entry for each block that the store will ever hold.
  FloodLight(const world::Store& store, world::LightModel model);
  FloodLight(const world::Store& store, world::LightModel model, LightRules rules);
  ~FloodLight();

  /// All light anew. Done by the constructor's first update() too.
  LightReport compute();
  /// What edits since the last call changed; equal to compute(), bit for bit. Costs nothing where nothing changed.
  LightReport update();

  /// That the region has blocks which are not in the store now; takes effect in update().
  void set_unloaded(world::RegionPos r, bool unloaded);

  const world::LightVolume& volume() const { return volume_; }
  /// Where the last compute() or update() changed the light of any field.
  const world::LightChange& changed() const { return changed_; }
  const LightRules& rules() const { return rules_; }
  /// Of the volume and of what is kept to bring it up to date.
  size_t bytes() const;

 private:
  /// Rules of blocks that the palette has gained.
  void follow_palette();
  bool has_blocks(world::RegionPos r, const std::vector<world::LeafPos>& dirty) const;

  const world::Store& store_;
  int subscriber_;
  bool own_rules_;
  LightRules rules_;
  LightDomain domain_;
  world::LightVolume volume_;
  std::vector<std::unique_ptr<OpticsVolume>> optics_;  // by band; one where all are alike
  std::unique_ptr<FloodWorkers> workers_;
  std::vector<std::unique_ptr<FieldFlood>> fields_;
  std::vector<world::LeafPos> inside_;  // scratch of update()
  world::LightChange changed_;
  bool computed_ = false;
};

}  // namespace sim
