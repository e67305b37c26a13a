// Windows of FieldFlood: which leaves are found anew, what they do to light, and how it spreads in them.
#include <algorithm>
#include <atomic>

#include "sim/light/field_flood.h"
#include "sim/light/flood_bits.h"
#include "sim/light/flood_worker.h"
#include "world/base/jobs.h"

namespace sim {

namespace {

/// Bit l: some voxel has level l; of levels up to `top`.
uint32_t levels_in(const LightLeaf& leaf, int top) {
  // Most leaves are of voxels that the sky reaches or that nothing does.
  uint64_t others = 0, lit = 0;
  for (int x = 0; x < 8; ++x) {
    const uint64_t at_top = leaf.equal(x, top);
    lit |= at_top, others |= ~(at_top | leaf.equal(x, 0));
  }
  uint32_t levels = lit ? 1u << top : 0;
  for (int level = 1; others && level < top; ++level)
    for (int x = 0; x < 8; ++x)
      if (leaf.equal(x, level)) {
        levels |= 1u << level;
        break;
      }
  return levels;
}

}  // namespace

FloodWorkers::FloodWorkers() = default;
FloodWorkers::~FloodWorkers() = default;
void FloodWorkers::at_least(size_t count) {
  while (workers_.size() < count) workers_.push_back(std::make_unique<FloodWorker>());
}
size_t FloodWorkers::bytes() const {
  size_t total = 0;
  for (const auto& worker : workers_) {
    for (const auto& plane : worker->window.planes) total += plane.capacity() * sizeof(LeafMask);
    total += (worker->window.open.capacity() + worker->window.bits.capacity()) * sizeof(LeafMask);
  }
  return total;
}
void FieldFlood::run_jobs(std::vector<Job> jobs, LightReport& report, std::vector<LeafPos>* changed) {
  std::vector<LightRegion*> written;
  for (const Job& job : jobs) {
    const RegionPos low = region_from_leaf(job.write.min), high = region_from_leaf(job.write.max);
    for (int x = low.x; x <= high.x; ++x)
      for (int y = low.y; y <= high.y; ++y)
        for (int z = low.z; z <= high.z; ++z)
          if (LightRegion* region = field_.regions().find({x, y, z})) {
            region->split();
            written.push_back(region);
          }
  }
  // What jobs read of leaves that others write, before any is written.
  if (is_sky_ && !computing_all_ && jobs.size() > 1)
    world::parallel_for(jobs.size(), [&](size_t i) {
      const LeafBox& box = jobs[i].box;
      for (int x = box.min.x; x <= box.max.x; ++x)
        for (int z = box.min.z; z <= box.max.z; ++z) {
          const LeafPos l{x, box.max.y, z};
          jobs[i].sky.push_back(domain_.contains(region_from_leaf(l)) ? sky_into(l) : 0);
        }
    });
  const size_t workers = std::min(static_cast<size_t>(world::thread_count()), jobs.size());
  workers_.at_least(workers);
  std::atomic<size_t> next{0};
  const auto work = [&](size_t w) {
    for (size_t i; (i = next++) < jobs.size();) run(jobs[i], workers_[w]);
  };
  if (workers == 1)
    work(0);
  else
    world::parallel_for(workers, work);
  for (size_t w = 0; w < workers; ++w) {
    report.leaves_computed += workers_[w].computed;
    report.leaves_changed += workers_[w].changed.size();
    if (changed) changed->insert(changed->end(), workers_[w].changed.begin(), workers_[w].changed.end());
    workers_[w].computed = 0;
    workers_[w].changed.clear();
  }
  report.windows += jobs.size();
  world::parallel_ranges(written.size(), 8, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) written[i]->join();
  });
}

void FieldFlood::run(const Job& job, Worker& worker) const {
  mark_free(job, worker);
  load(job, worker);
  fix_rim(worker);
  spread(worker);
  write(job, worker);
  worker.window.end();
}

/// Marks the leaves to be found anew: within reach, and in the domain.
void FieldFlood::mark_free(const Job& job, Worker& worker) const {
  FloodWindow& w = worker.window;
  const LeafBox& box = job.box;
  w.begin(box.max.x - box.min.x + 1, box.max.y - box.min.y + 1, box.max.z - box.min.z + 1);
  const LeafPos rim{1, 1, 1};
  const LeafBox with_rim{box.min - rim, box.max + rim};
  worker.origin = with_rim.min;
  worker.low_region = region_from_leaf(worker.origin);
  for (int n = 0; n < 27; ++n) {
    Worker::RegionOptics& region = worker.regions[n];
    region.pos = worker.low_region + RegionPos{n / 9, n / 3 % 3, n % 3};
    region.met = !is_empty(common(with_rim, leaf_box(region.pos, 0)));
    if (!region.met) continue;
    region.light = field_.regions().find(region.pos);
    region.optics = optics_.region(region.pos);
  }
  std::vector<uint32_t>& reached = worker.reached;
  if (job.all) {
    copy_rows(with_rim, &SkyAbove::free, reached);
  } else {
    reached.assign(static_cast<size_t>(w.rows), 0);
    for (const uint32_t i : job.reaches) {
      const LightReach& reach = reaches_[i];
      const LeafBox part = common(with_rim, leaf_box(reach.box, reach.radius));
      const auto apart = [&](int axis, int leaf) {
        const int low = leaf * kLeafSize;
        return std::max({0, reach.box.min[axis] - (low + kLeafSize - 1), low - reach.box.max[axis]});
      };
      for (int z = part.min.z; z <= part.max.z; ++z)
        for (int y = part.min.y; y <= part.max.y; ++y) {
          const int left = reach.radius - apart(1, y) - apart(2, z);
          if (left < 0) continue;
          const int low = std::max((reach.box.min.x - left) >> world::kLeafLog2, part.min.x) - worker.origin.x;
          const int high = std::min((reach.box.max.x + left) >> world::kLeafLog2, part.max.x) - worker.origin.x;
          if (low <= high)
            reached[static_cast<size_t>(w.row(y - worker.origin.y, z - worker.origin.z))] |= bit_range(low, high);
        }
    }
    for (const Worker::RegionOptics& region : worker.regions) {
      if (region.light || !region.met) continue;
      const LeafBox part = common(with_rim, leaf_box(region.pos, 0));
      const uint32_t bits = bit_range(part.min.x - worker.origin.x, part.max.x - worker.origin.x);
      for (int z = part.min.z - worker.origin.z; z <= part.max.z - worker.origin.z; ++z)
        for (int y = part.min.y - worker.origin.y; y <= part.max.y - worker.origin.y; ++y)
          reached[static_cast<size_t>(w.row(y, z))] &= ~bits;
    }
  }
  worker.free.assign(static_cast<size_t>(w.rows), 0);
  const uint32_t inner = bit_range(1, w.size[0] - 2);
  for (int z = 1; z < w.size[2] - 1; ++z)
    for (int y = 1; y < w.size[1] - 1; ++y) {
      const size_t row = static_cast<size_t>(w.row(y, z));
      worker.free[row] = reached[row] & inner;
    }
}

/// What the free leaves do to light, and what the sky gives them; columns from the top down.
void FieldFlood::load(const Job& job, Worker& worker) const {
  FloodWindow& w = worker.window;
  worker.slow.clear(), worker.sources.clear(), worker.fixed.clear();
  for (auto* rows : {&worker.want, &worker.full_sky}) rows->assign(static_cast<size_t>(w.rows), 0);
  worker.sky.resize(static_cast<size_t>(w.size[0] * w.size[2]));
  int most_loss = 1;
  for (int y = w.size[1] - 2; y >= 1; --y)
    for (int z = 1; z < w.size[2] - 1; ++z) {
      const int row = w.row(y, z);
      const size_t r = static_cast<size_t>(row);
      for (uint32_t free = worker.free[r]; free; free &= free - 1) {
        const int x = std::countr_zero(free);
        const uint32_t bit = 1u << x;
        ++worker.computed;
        const LeafPos l = worker.leaf_at(x, y, z);
        const LeafOptics optics = worker.region_of(l).optics.leaf(l);
        uint64_t& sky = worker.sky[static_cast<size_t>(x * w.size[2] + z)];
        if (is_sky_ && (computing_all_ || !(worker.free[r + 1] & bit)))
          sky = y == w.size[1] - 2 && !job.sky.empty()
                    ? job.sky[static_cast<size_t>(x - 1) * static_cast<size_t>(w.size[2] - 2) +
                              static_cast<size_t>(z - 1)]
                    : sky_into(l);
        if (optics.closed == &world::kAllMask && optics.sources.empty()) {
          sky = 0;
          continue;
        }
        if (is_sky_ && sky == ~0ull && optics.stops_sky == &world::kNoneMask) {
          worker.full_sky[r] |= bit;  // no more than the bit, where nobody beside it asks
          continue;
        }
        uint64_t lit[8];
        if (!is_sky_ || sky == 0)
          std::fill_n(lit, 8, 0);
        else
          sky = sky_through(*optics.stops_sky, sky, lit);
        uint64_t* open = w.open_of(w.leaf(x, row));
        uint64_t any_lit = 0, all_lit = ~0ull, any_open = 0;
        for (int i = 0; i < 8; ++i) {
          open[i] = ~optics.closed->word[i] & ~lit[i];
          any_lit |= lit[i], all_lit &= lit[i], any_open |= open[i];
        }
        if (any_open) worker.want[r] |= bit;
        for (const NumberedMask& slow : optics.slow) {
          Worker::Slow part{x, row, slow.number, {}};
          for (int i = 0; i < 8; ++i) part.open.word[i] = open[i] & slow.mask.word[i], open[i] &= ~slow.mask.word[i];
          if (part.open.is_none()) continue;
          most_loss = std::max(most_loss, part.loss);
          worker.slow.push_back(part);
        }
        if (!optics.slow.empty()) {
          any_open = 0;
          for (int i = 0; i < 8; ++i) any_open |= open[i];
        }
        if (any_open) w.openable[r] |= bit;
        if (all_lit == ~0ull)
          worker.full_sky[r] |= bit;
        else if (any_lit)
          w.mark(x, row, top_, lit);
        if (!is_sky_)
          for (const NumberedMask& source : optics.sources)
            worker.sources.push_back({x, row, source.number, &source.mask});
      }
    }
  w.set_most_loss(std::min(most_loss, kMaxLight));
}

/// The fronts that stand at the beginning: the sky's, and those of levels that don't change.
void FieldFlood::fix_rim(Worker& worker) const {
  FloodWindow& w = worker.window;
  const int plane = std::countr_zero(static_cast<unsigned>(top_));
  for (int z = 0; z < w.size[2]; ++z)
    for (int y = 0; y < w.size[1]; ++y) {
      const int row = w.row(y, z);
      const size_t r = static_cast<size_t>(row);
      for (uint32_t partly = w.touched[r]; partly; partly &= partly - 1) {
        const int x = std::countr_zero(partly);
        w.inject(x, row, top_, w.bits_of(w.leaf(x, row)) + plane * 8);
      }
      const uint32_t asked = worker.beside(worker.want, y, z) & bit_range(0, w.size[0] - 1);
      for (uint32_t lit = worker.full_sky[r] & asked; lit; lit &= lit - 1)
        w.inject(std::countr_zero(lit), row, top_, kOnes);
      for (uint32_t fixed = asked & ~worker.reached[r]; fixed; fixed &= fixed - 1) {
        const int x = std::countr_zero(fixed);
        const LeafPos l = worker.leaf_at(x, y, z);
        const LightRegion* light = worker.region_of(l).light;
        if (!light) continue;
        const LightLeafView leaf = light->leaf(index_in_region(l));
        if (!leaf.leaf && leaf.tile == top_) {
          w.inject(x, row, top_, kOnes);
          continue;
        }
        uint32_t levels = leaf.leaf ? levels_in(*leaf.leaf, top_) : 1u << leaf.tile;
        if (levels &= ~3u) worker.fixed.push_back({x, row, levels, leaf});
      }
    }
}

void FieldFlood::spread(Worker& worker) const {
  FloodWindow& w = worker.window;
  uint32_t pending = 0;
  for (const Worker::Source& s : worker.sources) pending |= 1u << s.level;
  for (const Worker::Fixed& f : worker.fixed) pending |= f.levels;
  for (int level = top_; level >= 1; --level) {
    if (level < top_) {
      w.clear_plane_for(level);
      spread_level(w, level);
      for (Worker::Slow& s : worker.slow) {
        const int from = level + s.loss;
        if (from > top_ || !w.near_front(s.x, s.row, from)) continue;
        uint64_t got[8], any = 0;
        w.gather(s.x, s.row, from, got);
        for (int i = 0; i < 8; ++i) got[i] &= s.open.word[i], s.open.word[i] &= ~got[i], any |= got[i];
        if (any) w.give(s.x, s.row, level, got);
      }
    }
    if (pending >> level & 1) {
      for (const Worker::Source& s : worker.sources) {
        if (s.level != level) continue;
        uint64_t given[8];
        uint64_t* open = w.open_of(w.leaf(s.x, s.row));
        for (int i = 0; i < 8; ++i) {
          given[i] = s.voxels->word[i] & w.dark(s.x, s.row, i);
          open[i] &= ~given[i];
        }
        for (Worker::Slow& slow : worker.slow)
          if (slow.x == s.x && slow.row == s.row)
            for (int i = 0; i < 8; ++i) slow.open.word[i] &= ~given[i];
        w.give(s.x, s.row, level, given);
      }
      for (const Worker::Fixed& f : worker.fixed) {
        if (!(f.levels >> level & 1)) continue;
        uint64_t at[8];
        for (int i = 0; i < 8; ++i) at[i] = f.leaf.equal(i, level);
        w.inject(f.x, f.row, level, at);
      }
    }
    if (!(pending & ((1u << level) - 1))) {
      bool moving = false;
      for (int l = level; l < level + static_cast<int>(w.plane_count) - 1 && l <= top_; ++l) moving |= w.any_front(l);
      if (!moving) break;
    }
  }
}

void FieldFlood::write(const Job& job, Worker& worker) const {
  FloodWindow& w = worker.window;
  LightLeaf packed;
  LightRegion* region = nullptr;
  RegionPos region_pos{INT32_MAX, 0, 0};
  const LeafPos low = job.write.min - worker.origin, high = job.write.max - worker.origin;
  for (int z = low.z; z <= high.z; ++z)
    for (int y = low.y; y <= high.y; ++y) {
      const int row = w.row(y, z);
      const size_t r = static_cast<size_t>(row);
      for (uint32_t free = worker.free[r] & bit_range(low.x, high.x); free; free &= free - 1) {
        const int x = std::countr_zero(free);
        const LeafPos l = worker.leaf_at(x, y, z);
        if (const RegionPos pos = region_from_leaf(l); pos != region_pos)
          region_pos = pos, region = field_.regions().find(pos);
        int tile = worker.full_sky[r] >> x & 1 ? top_ : 0;
        if (w.touched[r] >> x & 1) tile = pack_leaf(w.bits_of(w.leaf(x, row)), packed);
        const int index = index_in_region(l);
        if (tile < 0 ? region->set_leaf(index, packed) : region->set_leaf(index, tile)) worker.changed.push_back(l);
      }
    }
}

}  // namespace sim
