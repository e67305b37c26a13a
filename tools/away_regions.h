/// What the light of a streamed world must know: which regions have blocks that are not in memory. Light waits at their
/// borders, and none comes down through them; so in a region whose 26 neighbours and the sky above are there, light is
/// that of the whole world, whatever came and went.
///
/// There are no end of regions that are away; only those count that lie in a column of, or beside, one that is there.
#pragma once

#include <map>
#include <set>

#include "sim/light/flood.h"
#include "world/streaming/streamer.h"

namespace tools {

class AwayRegions {
 public:
  /// The streamer must outlive it.
  explicit AwayRegions(world::Streamer& streamer) : streamer_(streamer), subscriber_(streamer.subscribe()) {}

  /// Tells the light what has come and gone since the last call; before each FloodLight::update().
  void follow(sim::FloodLight& light);
  /// Tells a light that has heard nothing yet what was away at the last follow().
  void tell_all(sim::FloodLight& light) const;

 private:
  using Column = std::pair<int32_t, int32_t>;  // x, z
  template <class Visit>
  void each_in_column(const Column& column, Visit visit) const;
  void set_away(sim::FloodLight& light, world::RegionPos r, bool away);

  world::Streamer& streamer_;
  int subscriber_;
  std::set<world::RegionPos> there_, away_;
  std::map<Column, int> near_;  // columns with regions of there_ in them or beside, and how many
};

}  // namespace tools
