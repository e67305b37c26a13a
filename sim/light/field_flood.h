/// One field of light: the sky or the lamps, in one band. Internal to sim/light; flood.h says what it computes.
#pragma once

#include <array>
#include <span>

#include "sim/light/flood.h"
#include "sim/light/queue_flood.h"

namespace sim {

/// Where light may have changed: voxels within `radius` steps of the box.
struct LightReach {
  world::VoxelBox box;
  int radius = 0;
};

/// Inclusive bounds in leaves.
struct LeafBox {
  world::LeafPos min, max;
  bool contains(world::LeafPos l) const {
    return l.x >= min.x && l.x <= max.x && l.y >= min.y && l.y <= max.y && l.z >= min.z && l.z <= max.z;
  }
};

/// What threads work in; kept, so that a small change allocates nothing. Shared by the fields, one after the other.
struct FloodWorker;
class FloodWorkers {
 public:
  FloodWorkers();
  ~FloodWorkers();
  FloodWorker& operator[](size_t i) { return *workers_[i]; }
  void at_least(size_t count);
  QueueFlood& queue() { return queue_; }
  size_t bytes() const;

 private:
  std::vector<std::unique_ptr<FloodWorker>> workers_;
  QueueFlood queue_;
};

class FieldFlood {
 public:
  FieldFlood(const LightDomain& domain, const OpticsVolume& optics, world::LightField& field, FloodWorkers& workers,
             int sky_level, bool is_sky);

  void compute(LightReport& report);
  /// dirty: changed leaves of the domain, sorted; the optics know of them already.
  /// Adds the leaves that it changed to `changed`, but those of regions that came or went.
  void update(std::span<const world::LeafPos> dirty, const DomainChange& change, LightReport& report,
              std::vector<world::LeafPos>& changed);

 private:
  using Worker = FloodWorker;
  struct Job {
    LeafBox box, write;                      // computed, and kept
    std::span<const uint32_t> reaches = {};  // indices of reaches_
    bool all = false;                        // instead of reaches: SkyAbove::free
    std::vector<uint64_t> sky = {};          // into the top of the box, by x, then z; where other jobs write above it
  };
  /// A bit for each leaf of a region: by row z*16 + y, bit x.
  using RegionBits = std::array<uint16_t, world::kRegionLeaves * world::kRegionLeaves>;
  /// What the sky does to a region while all is computed.
  struct SkyAbove {
    bool open = false;           // it lights all of it, and the rest is empty
    std::vector<uint64_t> into;  // the top of each leaf, by index_in_region
    RegionBits lit{}, dark{};    // leaves with sunlit voxels; with others that may get light
    RegionBits free{};           // those that may get light from sunlit voxels: all that is not known by columns alone
  };

  void find_sky();
  void find_sky(world::RegionPos r, std::vector<uint64_t>& into);
  void find_free(world::RegionPos r);
  void copy_rows(const LeafBox& box, RegionBits SkyAbove::*bits, std::vector<uint32_t>& rows) const;
  void compute_lamps(LightReport& report);
  void compute_sky(LightReport& report);
  uint64_t sky_into(world::LeafPos l) const;
  uint64_t sky_out_of(world::LeafPos l) const;
  void begin_regions(const DomainChange& change);
  void follow_sky(std::span<const world::LeafPos> dirty, const DomainChange& change);
  void check_leaf(world::LeafPos l);
  /// `sunlit` may be null: none.
  void add_broken(world::LeafPos l, const uint64_t* voxels, const uint64_t* sunlit);
  void check_regions(const DomainChange& change);
  std::vector<Job> plan_jobs(std::vector<uint32_t>& order) const;
  /// `changed` may be null.
  void run_jobs(std::vector<Job> jobs, LightReport& report, std::vector<world::LeafPos>* changed);
  void run(const Job& job, Worker& worker) const;
  void mark_free(const Job& job, Worker& worker) const;
  void load(const Job& job, Worker& worker) const;
  void fix_rim(Worker& worker) const;
  void spread(Worker& worker) const;
  void write(const Job& job, Worker& worker) const;

  const LightDomain& domain_;
  const OpticsVolume& optics_;
  world::LightField& field_;
  FloodWorkers& workers_;
  int top_;  // the highest level
  bool is_sky_;

  std::vector<LightReach> reaches_;
  std::vector<BrokenLeaf> broken_;          // the voxels that reaches_ are around, where is_small_
  bool is_small_ = false;                   // so far, what changes may be followed voxel by voxel
  std::vector<world::LeafPos> seeds_;       // scratch of follow_sky()
  std::vector<world::LeafPos> settled_;     // leaves that follow_sky() has seen to wholly, where is_small_
  world::RegionTable<SkyAbove> sky_above_;  // while all is computed
  bool computing_all_ = false;
  std::vector<std::pair<world::LeafPos, uint64_t>> new_sky_;  // out of leaves where it changed; by x, z, y downwards
};

}  // namespace sim
