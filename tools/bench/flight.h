/// A flight over a world larger than memory, by a virtual clock: what it stalls the thread that flies, and what it
/// holds.
#pragma once

#include "world/streaming/streamer.h"

namespace tools {

struct FlightPlan {
  double seconds = 600, speed_mps = 100, frames_per_s = 60;
  world::VoxelPos from{-30000, 160, -20000};
  double heading_x = 0.8, heading_z = 0.6;  // unit length
};

struct FlightReport {
  double longest_stall_ms = 0;  // of any frame, on the thread that flies
  double mean_stall_ms = 0;
  size_t most_bytes = 0;                                                             // counted by the streamer
  size_t resident_bytes_start = 0, resident_bytes_end = 0, most_resident_bytes = 0;  // of the process, as Linux counts
  size_t resident_bytes_before = 0;  // before the streamer was made: what others keep in memory
  double least_held_radius_m = 0;    // all regions nearer than this were there, in every frame after the first second
  double frames_waited = 0;          // real frames spent waiting for regions; 0: the world always came in time
  world::StreamingReport streaming;
};

/// Each frame: update(), and where regions are still missing also the rest of a real frame, so that the streamer's
/// threads have no more time than they would have; else the next frame follows at once.
FlightReport fly(world::Streamer& streamer, const FlightPlan& plan);

/// Bytes of this process in memory.
size_t resident_bytes();

}  // namespace tools
