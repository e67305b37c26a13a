#include "sim/light/field_flood.h"

#include <algorithm>

#include "sim/light/flood_bits.h"
#include "sim/light/flood_window.h"

namespace sim {

namespace {

constexpr size_t kMostSmall = 16;  // dirty leaves, and leaves with broken voxels, of a change that queues are tried on
constexpr int kMostBox = FloodWindow::kMostLeaves - 2;  // leaves along an axis, without the rim

/// Of all that give light in a leaf.
LightReach reach_of_sources(LeafPos l, const LeafOptics& optics) {
  LeafMask all;
  int highest = 0;
  for (const NumberedMask& source : optics.sources) {
    highest = std::max<int>(highest, source.number);
    for (int x = 0; x < 8; ++x) all.word[x] |= source.mask.word[x];
  }
  return {bounds_of(l, all.word), highest - 1};
}

}  // namespace

FieldFlood::FieldFlood(const LightDomain& domain, const OpticsVolume& optics, LightField& field, FloodWorkers& workers,
                       int sky_level, bool is_sky)
    : domain_(domain),
      optics_(optics),
      field_(field),
      workers_(workers),
      top_(is_sky ? sky_level : kMaxLight),
      is_sky_(is_sky) {}

void FieldFlood::compute(LightReport& report) {
  for (const RegionPos& r : field_.regions().positions())
    if (!domain_.contains(r)) field_.regions().erase_later(r);
  const std::vector<RegionPos> all = domain_.columns();
  for (const RegionPos& r : all) field_.regions().insert_later(r);
  field_.regions().finish();

  if (is_sky_)
    compute_sky(report);
  else
    compute_lamps(report);
}

void FieldFlood::compute_lamps(LightReport& report) {
  for (const RegionPos& r : domain_.columns()) field_.regions().find(r)->set_tile(0);
  reaches_.clear();
  for (const RegionPos& r : optics_.regions_with_sources())
    optics_.for_each_source_leaf(
        r, [&](LeafPos l, const LeafOptics& optics) { reaches_.push_back(reach_of_sources(l, optics)); });
  if (reaches_.empty()) return;
  std::vector<uint32_t> order;
  run_jobs(plan_jobs(order), report, nullptr);
}

// ---- after edits -----------------------------------------------------------------------------------------------

void FieldFlood::begin_regions(const DomainChange& change) {
  for (const RegionPos& r : change.removed) {
    field_.regions().erase_later(r);
  }
  for (const RegionPos& r : change.added) {
    field_.regions().insert_later(r).set_tile(0);
  }
  field_.regions().finish();
  if (!is_sky_) return;
  // As if they were air and nothing shone from the side: so that columns below find what they expect.
  std::vector<RegionPos> downwards = change.added;
  std::sort(downwards.begin(), downwards.end(), [](const RegionPos& a, const RegionPos& b) { return a.y > b.y; });
  for (const RegionPos& r : downwards) {
    LightRegion& region = *field_.regions().find(r);
    const LeafPos low = leaf_from_region(r);
    std::array<uint64_t, static_cast<size_t>(kRegionLeaves) * kRegionLeaves> into;  // by x*16 + z
    for (int i = 0; i < kRegionLeaves * kRegionLeaves; ++i)
      into[static_cast<size_t>(i)] = sky_into(low + LeafPos{i / kRegionLeaves, kRegionLeaves - 1, i % kRegionLeaves});
    const auto all_are = [&](uint64_t sky) {
      return std::all_of(into.begin(), into.end(), [&](uint64_t s) { return s == sky; });
    };
    if (all_are(~0ull) || all_are(0)) {
      region.set_tile(into[0] ? top_ : 0);
      continue;
    }
    region.split();
    for (int i = 0; i < kRegionLeaves * kRegionLeaves; ++i) {
      const uint64_t sky = into[static_cast<size_t>(i)];
      uint64_t lit[8];
      sky_through(world::kNoneMask, sky, lit);
      const LightLeaf column = sunlit(lit, top_);
      for (int y = 0; y < kRegionLeaves; ++y) {
        const int index = world::index_in_region({i / kRegionLeaves, y, i % kRegionLeaves});
        if (sky == 0 || sky == ~0ull)
          region.set_leaf(index, sky ? top_ : 0);
        else
          region.set_leaf(index, column);
      }
    }
    region.join();
  }
}

/// Finds the voxels of a leaf whose equation no longer holds, all other levels being as they were.
///
/// Let S be the voxels that get darker. One of the brightest of S before has no brighter support in S, so its own
/// equation is broken; each other one loses a support in S that was brighter than it. So all of S lie within
/// old level - 1 steps of a broken voxel. Likewise a voxel that gets brighter has a path of light from one whose right
/// side is now above its level.
void FieldFlood::check_leaf(LeafPos l) {
  const RegionPos r = region_from_leaf(l);
  const LightRegion& region = *field_.regions().find(r);
  const LightLeafView self = region.leaf(index_in_region(l));
  const LeafOptics optics = optics_.leaf(l);
  uint64_t lit[8] = {}, asked[8];
  std::fill_n(asked, 8, ~0ull);
  bool dark = !self.leaf && self.tile == 0;
  if (is_sky_) {
    const uint64_t sky = sky_into(l);
    sky_through(*optics.stops_sky, sky, lit);
    uint64_t all_lit = ~0ull;
    for (const uint64_t slice : lit) all_lit &= slice;
    // Voxels that are sunlit, or were, are right or in the reach of their columns; closed dark ones are right.
    if (all_lit == ~0ull) return;
    uint64_t any_asked = 0;
    const AtLevel at_top(self, top_), at_none(self, 0);
    for (int x = 0; x < 8; ++x) {
      asked[x] = ~(lit[x] | at_top[x] | (optics.closed->word[x] & at_none[x]));
      any_asked |= asked[x];
    }
    if (!any_asked) return;
    dark &= sky == 0;
  } else {
    if (dark && optics.sources.empty() && optics.closed->is_all()) return;
  }
  // In the dark inside a region, as most leaves are to lamps.
  if (dark && region.is_tile() && optics.sources.empty() && is_inside_region(l)) return;
  LightLeafView beside[6];
  for (int face = 0; face < world::kFaces; ++face) {
    const VoxelPos step = world::face_step(face);
    const LeafPos n = l + LeafPos{step.x, step.y, step.z};
    const RegionPos pos = region_from_leaf(n);
    const LightRegion* other = pos == r ? &region : field_.regions().find(pos);
    if (other) beside[face] = other->leaf(index_in_region(n));
    dark &= !beside[face].leaf && beside[face].tile <= 1;
  }
  if (dark) {
    if (is_sky_ || optics.sources.empty()) return;
    reaches_.push_back(reach_of_sources(l, optics));
    for (const NumberedMask& source : optics.sources) add_broken(l, source.mask.word, nullptr);
    return;
  }

  // The levels as numbers of four bits, for a slice at a time; what the right sides give, and where that differs.
  uint64_t broken[8], any_broken = 0;
  Levels highest{};
  for (int x = 0; x < 8; ++x) {
    broken[x] = 0;
    if (!asked[x]) continue;
    const Levels here = levels_of(self, x);
    const Levels below = levels_of(beside[world::kFaceNegY], x), above = levels_of(beside[world::kFacePosY], x);
    const Levels behind = levels_of(beside[world::kFaceNegZ], x), before = levels_of(beside[world::kFacePosZ], x);
    Levels along_y, against_y, along_z, against_z;
    constexpr uint64_t kLowZ = kEachRow, kHighZ = kLowZ << 7;
    for (int k = 0; k < 4; ++k) {
      const uint64_t w = here.bit[k];
      along_y.bit[k] = w << 8 | below.bit[k] >> 56;
      against_y.bit[k] = w >> 8 | above.bit[k] << 56;
      along_z.bit[k] = (w << 1 & ~kLowZ) | (behind.bit[k] >> 7 & kLowZ);
      against_z.bit[k] = (w >> 1 & ~kHighZ) | (before.bit[k] << 7 & kHighZ);
    }
    const Levels near = highest_of(highest_of(highest_of(along_y, against_y), highest_of(along_z, against_z)),
                                   highest_of(x > 0 ? levels_of(self, x - 1) : levels_of(beside[world::kFaceNegX], 7),
                                              x < 7 ? levels_of(self, x + 1) : levels_of(beside[world::kFacePosX], 0)));
    uint64_t fast = ~optics.closed->word[x];
    for (const NumberedMask& slow : optics.slow) fast &= ~slow.mask.word[x];
    Levels right = masked(less(near, 1), fast);
    for (const NumberedMask& slow : optics.slow)
      right = highest_of(right, masked(less(near, slow.number), slow.mask.word[x]));
    if (is_sky_)
      right = highest_of(right, masked(levels_of(LightLeafView{nullptr, static_cast<uint8_t>(top_)}, x), lit[x]));
    else
      for (const NumberedMask& source : optics.sources)
        right = highest_of(right, masked(levels_of(LightLeafView{nullptr, source.number}, x), source.mask.word[x]));
    for (int k = 0; k < 4; ++k) broken[x] |= right.bit[k] ^ here.bit[k];
    broken[x] &= asked[x];
    if (!broken[x]) continue;
    any_broken |= broken[x];
    highest = highest_of(highest, masked(highest_of(right, here), broken[x]));
  }
  if (!any_broken) return;
  // The highest of 64 numbers, bit by bit.
  int level = 0;
  uint64_t candidates = ~0ull;
  for (int k = 3; k >= 0; --k)
    if (candidates & highest.bit[k]) level |= 1 << k, candidates &= highest.bit[k];
  reaches_.push_back({bounds_of(l, broken), level - 1});
  add_broken(l, broken, lit);
}

/// Leaves whose equations have lost or gained a region beside them; of regions that came, all but those that are surely
/// right.
void FieldFlood::check_regions(const DomainChange& change) {
  const auto is_tile = [&](RegionPos r, int level) {
    const LightRegion& region = *field_.regions().find(r);
    return region.is_tile() && region.leaf(0).tile == level;
  };
  const auto check_face = [&](RegionPos r, int face) {
    const int axis = world::face_axis(face);
    for (int i = 0; i < kRegionLeaves * kRegionLeaves; ++i) {
      LeafPos l;
      l[axis] = world::face_sign(face) > 0 ? kRegionLeaves - 1 : 0;
      l[(axis + 1) % 3] = i / kRegionLeaves, l[(axis + 2) % 3] = i % kRegionLeaves;
      check_leaf(leaf_from_region(r) + l);
    }
  };
  for (const auto* regions : {&change.added, &change.removed})
    for (const RegionPos& r : *regions) {
      const bool added = regions == &change.added;
      const bool dark = added && is_tile(r, 0);
      for (int face = 0; face < world::kFaces; ++face) {
        const VoxelPos step = world::face_step(face);
        const RegionPos n = r + RegionPos{step.x, step.y, step.z};
        if (!domain_.contains(n)) continue;
        if (!dark && !(is_sky_ && is_tile(n, top_))) check_face(n, world::opposite_face(face));
        if (dark && !is_tile(n, 0)) check_face(r, face);
      }
      if (!added || field_.regions().find(r)->is_tile()) continue;
      for (int i = 0; i < world::kLeavesPerRegion; ++i)
        check_leaf(leaf_from_region(r) + world::leaf_offset_in_region(i));
    }
}

void FieldFlood::add_broken(LeafPos l, const uint64_t* voxels, const uint64_t* sunlit) {
  is_small_ &= broken_.size() < kMostSmall;
  if (!is_small_) return;
  BrokenLeaf& broken = broken_.emplace_back();
  broken.pos = l;
  std::copy_n(voxels, 8, broken.voxels.word);
  if (sunlit) std::copy_n(sunlit, 8, broken.sunlit.word);
}

void FieldFlood::update(std::span<const LeafPos> dirty, const DomainChange& change, LightReport& report,
                        std::vector<LeafPos>& changed) {
  reaches_.clear();
  broken_.clear();
  new_sky_.clear();
  settled_.clear();
  is_small_ = change.empty() && dirty.size() <= kMostSmall;
  begin_regions(change);
  if (is_sky_) follow_sky(dirty, change);
  check_regions(change);
  for (const LeafPos& l : dirty)
    if (std::find(settled_.begin(), settled_.end(), l) == settled_.end()) check_leaf(l);
  if (reaches_.empty()) return;
  if (is_small_) {
    if (workers_.queue().follow(broken_, optics_, field_, top_, is_sky_, report, changed)) return;
    ++report.queues_left;
  }
  std::vector<uint32_t> order;
  run_jobs(plan_jobs(order), report, &changed);
}

std::vector<FieldFlood::Job> FieldFlood::plan_jobs(std::vector<uint32_t>& order) const {
  LeafBox whole = leaf_box(reaches_[0].box, reaches_[0].radius);
  for (const LightReach& reach : reaches_) include(whole, leaf_box(reach.box, reach.radius));
  bool fits = true;
  for (int a = 0; a < 3; ++a) fits &= whole.max[a] - whole.min[a] < kMostBox;
  if (fits) {
    order.resize(reaches_.size());
    for (uint32_t i = 0; i < order.size(); ++i) order[i] = i;
    return {{.box = whole, .write = whole, .reaches = order}};
  }
  // Elsewhere a window for each region that is met, with all that reaches its margin.
  std::vector<std::pair<RegionPos, uint32_t>> by_region;
  for (uint32_t i = 0; i < reaches_.size(); ++i) {
    const LeafBox box = leaf_box(reaches_[i].box, reaches_[i].radius);
    const LeafPos margin{kMargin + 1, kMargin + 1, kMargin + 1};  // and the rim
    const RegionPos low = region_from_leaf(box.min - margin), high = region_from_leaf(box.max + margin);
    for (int x = low.x; x <= high.x; ++x)
      for (int y = low.y; y <= high.y; ++y)
        for (int z = low.z; z <= high.z; ++z)
          if (domain_.contains({x, y, z})) by_region.push_back({{x, y, z}, i});
  }
  std::sort(by_region.begin(), by_region.end());
  order.resize(by_region.size());
  std::vector<Job> jobs;
  for (size_t first = 0, last; first < by_region.size(); first = last) {
    const RegionPos r = by_region[first].first;
    LeafBox met = leaf_box(reaches_[by_region[first].second].box, reaches_[by_region[first].second].radius);
    for (last = first; last < by_region.size() && by_region[last].first == r; ++last) {
      order[last] = by_region[last].second;
      include(met, leaf_box(reaches_[order[last]].box, reaches_[order[last]].radius));
    }
    const Job job{.box = common(met, leaf_box(r, kMargin)),
                  .write = common(met, leaf_box(r, 0)),
                  .reaches = std::span(order).subspan(first, last - first)};
    if (!is_empty(job.write)) jobs.push_back(job);
  }
  return jobs;
}

}  // namespace sim
