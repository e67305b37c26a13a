#include "tools/away_regions.h"

namespace tools {

using world::RegionPos;

/// Of what the streamer ever asks for: beyond that nothing is.
template <class Visit>
void AwayRegions::each_in_column(const Column& column, Visit visit) const {
  const world::StreamingKnobs& knobs = streamer_.knobs();
  for (int32_t y = knobs.lowest_y >> world::kRegionLog2; y <= knobs.highest_y >> world::kRegionLog2; ++y)
    visit(RegionPos{column.first, y, column.second});
}

void AwayRegions::set_away(sim::FloodLight& light, RegionPos r, bool away) {
  if (away == away_.contains(r)) return;
  if (away)
    away_.insert(r);
  else
    away_.erase(r);
  light.set_unloaded(r, away);
}

void AwayRegions::follow(sim::FloodLight& light) {
  for (const RegionPos& r : streamer_.take_moved(subscriber_)) {
    const bool is_there = streamer_.is_resident(r);
    if (is_there == there_.contains(r)) continue;
    if (is_there)
      there_.insert(r);
    else
      there_.erase(r);
    for (int32_t x = r.x - 1; x <= r.x + 1; ++x)
      for (int32_t z = r.z - 1; z <= r.z + 1; ++z) {
        const int count = near_[{x, z}] += is_there ? 1 : -1;
        if (count == 0) near_.erase({x, z});
        // A column that matters from now on, or no longer.
        if (count == (is_there ? 1 : 0))
          each_in_column({x, z}, [&](RegionPos other) { set_away(light, other, is_there && !there_.contains(other)); });
      }
    // In a column that mattered before and still does.
    if (near_.contains({r.x, r.z}))
      each_in_column({r.x, r.z}, [&](RegionPos other) {
        if (other == r) set_away(light, r, !is_there);
      });
  }
}

void AwayRegions::tell_all(sim::FloodLight& light) const {
  for (const RegionPos& r : away_) light.set_unloaded(r, true);
}

}  // namespace tools
