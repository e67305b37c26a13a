// The sky's part of FieldFlood: columns straight from above, and which leaves they leave open.
#include <algorithm>

#include "sim/light/field_flood.h"
#include "sim/light/flood_bits.h"
#include "world/base/jobs.h"

namespace sim {

uint64_t FieldFlood::sky_out_of(LeafPos l) const {
  if (!new_sky_.empty()) {
    const auto found = std::lower_bound(new_sky_.begin(), new_sky_.end(), l, [](const auto& entry, const LeafPos& at) {
      return downwards(entry.first, at);
    });
    if (found != new_sky_.end() && found->first == l) return found->second;
  }
  return bottom_row(field_.leaf(l), top_);
}

uint64_t FieldFlood::sky_into(LeafPos l) const {
  const RegionPos r = region_from_leaf(l);
  if (computing_all_) {
    const SkyAbove& above = *sky_above_.find(r);
    return above.open ? ~0ull : above.into[static_cast<size_t>(index_in_region(l))];
  }
  const LeafPos over = l + LeafPos{0, 1, 0};
  if (domain_.contains(region_from_leaf(over))) return sky_out_of(over);
  const LightDomain::Above above = domain_.above(r);
  if (above.unloaded) return 0;
  if (!above.region) return ~0ull;
  return sky_out_of({l.x, leaf_from_region(*above.region).y, l.z});
}

/// Lights a region from above: what columns alone decide goes into the field.
void FieldFlood::find_sky(RegionPos r, std::vector<uint64_t>& into) {
  SkyAbove& above = *sky_above_.find(r);
  LightRegion& region = *field_.regions().find(r);
  const OpticsVolume::RegionOptics optics = optics_.region(r);
  above.open = optics.like_air() && std::all_of(into.begin(), into.end(), [](uint64_t sky) { return sky == ~0ull; });
  region.set_tile(above.open ? top_ : 0);
  if (above.open) {
    above.lit.fill(0xffff);
    return;
  }
  above.into.resize(world::kLeavesPerRegion);
  if (optics.like_air() && std::all_of(into.begin(), into.end(), [](uint64_t sky) { return sky == 0; })) {
    above.dark.fill(0xffff);
    return;
  }
  region.split();
  const LeafPos low = leaf_from_region(r);
  for (int x = 0; x < kRegionLeaves; ++x)
    for (int y = kRegionLeaves - 1; y >= 0; --y)
      for (int z = 0; z < kRegionLeaves; ++z) {
        const LeafPos l = low + LeafPos{x, y, z};
        const int index = index_in_region(l);
        uint64_t& sky = into[static_cast<size_t>(x * kRegionLeaves + z)];
        above.into[static_cast<size_t>(index)] = sky;
        const auto kind = optics.kind(l);
        if (kind == OpticsVolume::RegionOptics::Kind::closed) {
          sky = 0;
          continue;
        }
        const size_t row = static_cast<size_t>(z * kRegionLeaves + y);
        const auto bit = static_cast<uint16_t>(1u << x);
        if (sky == 0) {
          above.dark[row] |= bit;  // perhaps none of it may get light
          continue;
        }
        if (sky == ~0ull && kind == OpticsVolume::RegionOptics::Kind::clear) {
          above.lit[row] |= bit;
          region.set_leaf(index, top_);
          continue;
        }
        const LeafOptics leaf = optics.leaf(l);
        uint64_t lit[8], any_lit = 0, any_dark = 0;
        sky = sky_through(*leaf.stops_sky, sky, lit);
        for (int i = 0; i < 8; ++i) any_lit |= lit[i], any_dark |= ~leaf.closed->word[i] & ~lit[i];
        if (any_lit) above.lit[row] |= bit;
        if (any_dark)
          above.dark[row] |= bit;
        else if (any_lit)
          region.set_leaf(index, sunlit(lit, top_));
      }
}

/// Calls find_sky for all regions, columns in parallel, each from the top.
void FieldFlood::find_sky() {
  const std::vector<RegionPos> all = domain_.columns();
  std::vector<size_t> starts;
  for (size_t i = 0; i < all.size(); ++i) {
    if (i == 0 || all[i].x != all[i - 1].x || all[i].z != all[i - 1].z) starts.push_back(i);
    sky_above_.insert_later(all[i]);
  }
  sky_above_.finish();
  starts.push_back(all.size());
  world::parallel_for(starts.size() - 1, [&](size_t c) {
    std::vector<uint64_t> into(size_t{kRegionLeaves} * kRegionLeaves, ~0ull);  // by x*16 + z
    for (size_t i = starts[c]; i < starts[c + 1]; ++i) {
      if (domain_.above(all[i]).unloaded) std::fill(into.begin(), into.end(), 0);
      find_sky(all[i], into);
    }
  });
  world::parallel_for(all.size(), [&](size_t i) { find_free(all[i]); });
}

/// Bits of the leaves of a box of at most 32 leaves along x, by row z * size.y + y.
void FieldFlood::copy_rows(const LeafBox& box, RegionBits SkyAbove::*bits, std::vector<uint32_t>& rows) const {
  const int size_y = box.max.y - box.min.y + 1, size_z = box.max.z - box.min.z + 1;
  rows.assign(static_cast<size_t>(size_y) * static_cast<size_t>(size_z), 0);
  const RegionPos low = region_from_leaf(box.min), high = region_from_leaf(box.max);
  for (int x = low.x; x <= high.x; ++x)
    for (int y = low.y; y <= high.y; ++y)
      for (int z = low.z; z <= high.z; ++z) {
        const SkyAbove* above = sky_above_.find({x, y, z});
        if (!above) continue;
        const RegionBits& from = above->*bits;
        const LeafBox part = common(box, leaf_box(RegionPos{x, y, z}, 0));
        const LeafPos first = part.min - world::leaf_from_region({x, y, z});
        const uint32_t mask = bit_range(0, part.max.x - part.min.x);
        for (int lz = part.min.z; lz <= part.max.z; ++lz)
          for (int ly = part.min.y; ly <= part.max.y; ++ly) {
            const uint32_t row = from[static_cast<size_t>((lz & 15) * kRegionLeaves + (ly & 15))];
            rows[static_cast<size_t>((lz - box.min.z) * size_y + ly - box.min.y)] |= (row >> first.x & mask)
                                                                                     << (part.min.x - box.min.x);
          }
      }
}

/// Of leaves with dark voxels those within 14 steps of one with sunlit voxels. From leaf to leaf it is 1 step, 9 to the
/// next but one, so these are at most one away along each axis, or two along one of them.
void FieldFlood::find_free(RegionPos r) {
  SkyAbove& above = *sky_above_.find(r);
  if (std::all_of(above.dark.begin(), above.dark.end(), [](uint16_t row) { return row == 0; })) return;
  constexpr int kSize = kRegionLeaves + 2 * kMargin;
  std::vector<uint32_t> lit;
  copy_rows(leaf_box(r, kMargin), &SkyAbove::lit, lit);
  for (uint32_t& row : lit) row |= row << 1 | row >> 1;
  std::vector<uint32_t> near_y = lit, near = lit;
  const auto at = [](int y, int z) { return static_cast<size_t>(z * kSize + y); };
  for (int z = 0; z < kSize; ++z)
    for (int y = 1; y < kSize - 1; ++y) near_y[at(y, z)] = lit[at(y - 1, z)] | lit[at(y, z)] | lit[at(y + 1, z)];
  for (int z = 1; z < kSize - 1; ++z)
    for (int y = 0; y < kSize; ++y) near[at(y, z)] = near_y[at(y, z - 1)] | near_y[at(y, z)] | near_y[at(y, z + 1)];
  for (int z = kMargin; z < kSize - kMargin; ++z)
    for (int y = kMargin; y < kSize - kMargin; ++y) {
      const uint32_t n = near[at(y, z)];
      const uint32_t around =
          n | n << 1 | n >> 1 | near[at(y - 1, z)] | near[at(y + 1, z)] | near[at(y, z - 1)] | near[at(y, z + 1)];
      const size_t row = static_cast<size_t>((z - kMargin) * kRegionLeaves + y - kMargin);
      above.free[row] = static_cast<uint16_t>(around >> kMargin) & above.dark[row];
    }
}

void FieldFlood::follow_sky(std::span<const LeafPos> dirty, const DomainChange& change) {
  // Leaves whose columns may differ: those that changed, and those under regions that were loaded or not, or that went
  // with the blocks they had. Regions that come are of air until their leaves change.
  seeds_.assign(dirty.begin(), dirty.end());
  for (const auto* regions : {&change.removed, &change.loaded_or_unloaded})
    for (const RegionPos& r : *regions)
      if (const auto below = domain_.below(r))
        for (int i = 0; i < kRegionLeaves * kRegionLeaves; ++i)
          seeds_.push_back(leaf_from_region(*below) + LeafPos{i / kRegionLeaves, kRegionLeaves - 1, i % kRegionLeaves});
  std::sort(seeds_.begin(), seeds_.end(),
            [](const LeafPos& a, const LeafPos& b) { return std::tie(a.x, a.z, b.y) < std::tie(b.x, b.z, a.y); });
  LeafPos done{INT32_MAX, 0, 0};  // the lowest leaf seen of its column
  for (const LeafPos& seed : seeds_) {
    if (done.x == seed.x && done.z == seed.z && seed.y >= done.y) continue;
    // Downwards for as long as what leaves a leaf differs from before.
    const size_t first_reach = reaches_.size();
    uint64_t into = sky_into(seed);
    RegionPos r = region_from_leaf(seed);
    const LightRegion* light = field_.regions().find(r);
    OpticsVolume::RegionOptics optics = optics_.region(r);
    for (LeafPos l = seed;;) {
      done = l;
      const LightLeafView old = light->leaf(index_in_region(l));
      const LeafOptics optics_of_leaf = optics.leaf(l);
      const LeafMask& stops = *optics_of_leaf.stops_sky;
      uint64_t out = into, old_out = 0;
      VoxelBox changed;
      if (!old.leaf && &stops == &world::kNoneMask && (into == 0 || into == ~0ull)) {
        old_out = old.tile == top_ ? ~0ull : 0;
        if (out == old_out) break;
        constexpr int kLast = world::kLeafSize - 1;
        changed = {voxel_from_leaf(l), voxel_from_leaf(l) + VoxelPos{kLast, kLast, kLast}};
        is_small_ = false;
      } else {
        if (&stops == &world::kAllMask && !old.leaf && old.tile != top_) break;
        uint64_t lit[8], differs[8], any = 0, seen_to = ~0ull;
        out = sky_through(stops, into, lit);
        const AtLevel at_top(old, top_), at_none(old, 0);
        for (int x = 0; x < 8; ++x) {
          const uint64_t was_lit = at_top[x];
          differs[x] = lit[x] ^ was_lit;
          any |= differs[x];
          seen_to &= lit[x] | was_lit | (optics_of_leaf.closed->word[x] & at_none[x]);
          old_out |= (was_lit & kRow) << 8 * x;
        }
        if (is_small_ && seen_to == ~0ull) settled_.push_back(l);
        if (!any) break;
        changed = bounds_of(l, differs);
        add_broken(l, differs, lit);
      }
      // What changes of one column is one reach.
      if (reaches_.size() > first_reach)
        reaches_.back().box.include(changed);
      else
        reaches_.push_back({changed, top_ - 1});
      new_sky_.emplace_back(l, out);
      if (out == old_out) break;
      into = out;
      l.y -= 1;
      if ((l.y & (kRegionLeaves - 1)) != kRegionLeaves - 1) continue;
      // The next region of the column.
      const auto below = domain_.below(r);
      if (!below || domain_.above(*below).unloaded) break;
      r = *below;
      l.y = leaf_from_region(r).y + kRegionLeaves - 1;
      light = field_.regions().find(r);
      optics = optics_.region(r);
    }
  }
}

void FieldFlood::compute_sky(LightReport& report) {
  computing_all_ = true;
  find_sky();
  std::vector<Job> jobs;
  const std::vector<RegionPos> all = domain_.columns();
  for (const RegionPos& r : all) {
    const LeafBox free = bounds_of(r, sky_above_.find(r)->free);
    if (is_empty(free)) continue;
    const LeafPos margin{kMargin, kMargin, kMargin};
    jobs.push_back({.box = {free.min - margin, free.max + margin}, .write = free, .all = true});
  }
  run_jobs(std::move(jobs), report, nullptr);
  world::parallel_for(all.size(), [&](size_t i) { field_.regions().find(all[i])->join(); });
  computing_all_ = false;
  sky_above_ = {};
}

}  // namespace sim
