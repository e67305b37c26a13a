#include "sim/matter/edit_queue.h"

#include <algorithm>
#include <limits>

#include <fmt/format.h>

#include "world/space/coords.h"

namespace sim {

/// With the mutex held.
world::Status EditQueue::check(const world::EditBatch& batch, size_t blocks) const {
  for (const world::EditBatch::Op& op : batch.ops()) {
    if (!world::inside_world(op.box.min) || !world::inside_world(op.box.max))
      return world::input_error(
          fmt::format("an edit of ({}, {}, {}) to ({}, {}, {}) lies outside of the world's border", op.box.min.x,
                      op.box.min.y, op.box.min.z, op.box.max.x, op.box.max.y, op.box.max.z));
    if (op.block >= blocks)
      return world::input_error(
          fmt::format("an edit writes block id {}, but the world's palette has only {} blocks", op.block, blocks));
  }
  if (waiting_ + batch.ops().size() > kMostWaitingEdits)
    return world::input_error(
        fmt::format("{} voxels and boxes wait to be edited, and {} more would be over {}: simulate a tick first",
                    waiting_, batch.ops().size(), kMostWaitingEdits));
  return {};
}

world::Status EditQueue::push(const world::EditBatch& batch, const EditTime& time, size_t blocks) {
  const std::lock_guard lock(mutex_);
  TRY_STATUS(check(batch, blocks));
  entries_.push_back({time, arrivals_++, batch});
  waiting_ += batch.ops().size();
  return {};
}

world::Status EditQueue::push(const world::EditBatch& batch, size_t blocks) {
  const std::lock_guard lock(mutex_);
  TRY_STATUS(check(batch, blocks));
  entries_.push_back({{next_tick_, std::numeric_limits<uint64_t>::max()}, arrivals_++, batch});
  waiting_ += batch.ops().size();
  return {};
}

std::vector<world::EditBatch> EditQueue::take(uint64_t tick) {
  const std::lock_guard lock(mutex_);
  next_tick_ = tick + 1;
  const auto due =
      std::stable_partition(entries_.begin(), entries_.end(), [&](const Entry& e) { return e.time.tick > tick; });
  std::sort(due, entries_.end(), [](const Entry& a, const Entry& b) {
    if (a.time.tick != b.time.tick) return a.time.tick < b.time.tick;
    return a.time.serial != b.time.serial ? a.time.serial < b.time.serial : a.arrival < b.arrival;
  });
  std::vector<world::EditBatch> batches;
  for (auto e = due; e != entries_.end(); ++e) {
    waiting_ -= e->batch.ops().size();
    batches.push_back(std::move(e->batch));
  }
  entries_.erase(due, entries_.end());
  return batches;
}

size_t EditQueue::waiting() const {
  const std::lock_guard lock(mutex_);
  return waiting_;
}

}  // namespace sim
