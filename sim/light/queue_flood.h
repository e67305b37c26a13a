/// A change of light followed voxel by voxel, by queues as in block games, where it can reach only a few voxels: there
/// they beat windows of masks (flood_window.h), which cost microseconds however little changes. Internal to sim/light.
///
///   darkened   voxels whose light came from one that lost it: each neighbour whose level is no more than what the
///              voxel gave it, unless it gives itself as much
///   again      all of those and the broken voxels: each gets what its neighbours now give it
///   raised     by level from the highest: each gives to its neighbours, so that none is raised twice
///
/// Leaves are copied when a voxel of theirs changes, and written back at the end: where the change turns out to be
/// large, nothing has happened, and the windows begin from the same levels.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "sim/light/flood.h"

namespace sim {

/// Voxels of a leaf whose equation doesn't hold.
struct BrokenLeaf {
  world::LeafPos pos;
  world::LeafMask voxels;
  world::LeafMask sunlit;  // those among them that the sky lights straight from above
};

class QueueFlood {
 public:
  /// Above this a change is left to windows: voxels taken from the queues, and the levels of those that wait there as
  /// a guess of how many each will add. Measured by a lantern in the dark on 2026-11-26 (AMD EPYC): queues against
  /// windows take 2.6 and 6.2 us for 1 voxel, 5.5 and 10.5 for the 29 of a tunnel, 5.5 and 8.6 for 25 of a slab, 6.9
  /// and 7.2 for 27 of a room, 6.6 and 4.5 for 49 of a slab, 18 and 8 for 125 of a room. With 96 all up to the third
  /// are followed by queues, and the lantern's six neighbours in the open are enough to stop, after 0.3 us.
  static constexpr int kMostWork = 96;

  /// Brings the field up to date after a change that broke the equations of these voxels, and only those; true where it
  /// did, and the leaves are added to `changed`. False where the change is too large: then the field is as it was. A
  /// voxel may be named twice.
  bool follow(std::span<const BrokenLeaf> broken, const OpticsVolume& optics, world::LightField& field, int top,
              bool is_sky, LightReport& report, std::vector<world::LeafPos>& changed);

 private:
  static constexpr size_t kMostLeaves = 32;   // that a change may meet
  static constexpr size_t kMostVoxels = 256;  // in all queues; above what kMostWork lets in
  static constexpr int16_t kUnknown = -1, kOutside = -2, kNoRoom = -3;

  struct Voxel {
    int16_t leaf;
    int16_t index;
  };
  struct Entry {
    Voxel voxel;
    int16_t next;   // of the same level, or -1
    uint8_t level;  // it had, when darkened; it is given, when broken
  };
  struct Leaf {
    const world::LightLeaf* levels;  // the field's, or `changed`
    LeafOptics optics;
    world::LeafPos pos;
    std::array<int16_t, world::kFaces> beside;
    world::LightRegion* region;
    world::LightLeaf changed;
  };

  int16_t find_leaf(world::LeafPos l);
  /// The leaf across a face; negative where no light is kept.
  int16_t leaf_beside(int16_t leaf, int face);
  /// Calls visit(Voxel) for the neighbours where light is kept.
  template <class Visit>
  void around(Voxel v, Visit visit);
  int level(Voxel v) const { return leaves_[static_cast<size_t>(v.leaf)].levels->get(v.index); }
  void set_level(Voxel v, int level);
  bool is_closed(Voxel v) const { return leaves_[static_cast<size_t>(v.leaf)].optics.closed->test(v.index); }
  int loss(Voxel v) const;
  int own_level(Voxel v) const;
  struct Gathered {
    int level = 0;                  // what the neighbours give the voxel
    int lowest = world::kMaxLight;  // of the neighbours that light enters
  };
  Gathered gather(Voxel v);
  bool take_broken(std::span<const BrokenLeaf> broken, int top);
  bool darken();
  bool raise_again();
  bool spread();
  bool raise(Voxel v, int level);
  void write(LightReport& report, std::vector<world::LeafPos>& changed);

  const OpticsVolume* optics_ = nullptr;
  world::LightField* field_ = nullptr;
  bool is_sky_ = false;
  std::array<Leaf, kMostLeaves> leaves_;
  std::array<uint8_t, 2 * kMostLeaves> place_;  // by hash: 1 + place in leaves_
  size_t leaf_count_ = 0;
  bool no_room_ = false;

  std::array<Entry, kMostVoxels> dark_, again_, raised_;
  size_t dark_count_ = 0, again_count_ = 0, raised_count_ = 0;
  std::array<int16_t, world::kMaxLight + 1> first_raised_;
  uint32_t waiting_levels_ = 0;  // bit l: something waits to be spread at level l
  int work_ = 0;                 // against kMostWork
};

}  // namespace sim
