/// Edits that wait for the tick that they are for, from any thread.
#pragma once

#include <cstdint>
#include <mutex>
#include <vector>

#include "world/base/errors.h"
#include "world/store/edit.h"

namespace sim {

/// When an edit is made: at the start of a tick, or of the next where that is over, and there in the order of `serial`.
struct EditTime {
  uint64_t tick = 0;
  uint64_t serial = 0;
};

/// Voxels and boxes that may wait at once: about 64 MiB.
inline constexpr size_t kMostWaitingEdits = size_t{1} << 21;

class EditQueue {
 public:
  /// Fails where a box is outside of the world's border, a block isn't one of the `blocks` of the palette, or more than
  /// kMostWaitingEdits would wait; nothing of the batch is taken then, and nothing that waits is lost.
  world::Status push(const world::EditBatch& batch, const EditTime& time, size_t blocks);
  /// The same, after all that have a time of this tick.
  world::Status push(const world::EditBatch& batch, size_t blocks);
  /// What is due at the start of `tick`, by time; of equal times what came first.
  std::vector<world::EditBatch> take(uint64_t tick);
  size_t waiting() const;  // voxels and boxes

 private:
  struct Entry {
    EditTime time;
    uint64_t arrival = 0;
    world::EditBatch batch;
  };
  world::Status check(const world::EditBatch& batch, size_t blocks) const;
  mutable std::mutex mutex_;
  std::vector<Entry> entries_;
  uint64_t arrivals_ = 0;
  uint64_t next_tick_ = 0;  // one past that of the last take()
  size_t waiting_ = 0;
};

}  // namespace sim
