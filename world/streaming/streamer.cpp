#include "world/streaming/streamer.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include <fmt/format.h>

#include "world/base/jobs.h"
#include "world/store/residency.h"

namespace world {

namespace {

using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

constexpr size_t kMostArrivals = 16;    // regions that wait for update(): bounds what is in memory beside the store
constexpr size_t kLooksAnUpdate = 256;  // resident regions looked after in each update

}  // namespace

Streamer::Streamer(World& world, SaveSession* session, const Generator* generator, const StreamingKnobs& knobs)
    : world_(world), session_(session), generator_(generator), knobs_(knobs) {
  knobs_.keep_radius_m = std::max(knobs_.keep_radius_m, knobs_.load_radius_m);
  std::vector<RegionPos> there = world_.store.regions();
  for (size_t i = 0; i < layer_rows().size(); ++i)
    if (const auto layer = static_cast<Layer>(i); layer != Layer::block)
      if (const AnyLayer* any = world_.store.find_any_layer(layer))
        for (const RegionPos& r : std::visit([](const auto& values) { return values.regions(); }, *any))
          there.push_back(r);
  for (const RegionPos& r : there) {
    if (resident_.contains(r)) continue;
    Resident& entry = resident_[r];
    entry.bytes = world_.store.region_bytes(r);
    resident_bytes_ += entry.bytes;
  }
  const int threads = knobs_.threads > 0 ? knobs_.threads : std::max(1, thread_count() - 1);
  for (int i = 0; i < threads; ++i) threads_.emplace_back([this] { run(); });
}

Streamer::~Streamer() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
  for (std::thread& t : threads_) t.join();
}

// ---- on the streamer's threads ---------------------------------------------------------------------------------

/// What the save holds of the region; leaves arrival.region empty where that is nothing.
Status Streamer::fetch_from_save(Arrival& arrival, unsigned mask_kinds) const {
  const RegionPos pos = arrival.pos;
  for (size_t i = 0; i < layer_rows().size(); ++i) {
    const auto layer = static_cast<Layer>(i);
    TRY(const std::optional<RegionRow> row, session_->file().read_row(layer, pos));
    if (!row) continue;
    const auto damaged = [&](const Error& error) {
      return input_error(fmt::format(
          "{}: region ({}, {}, {}){} is damaged: {}", session_->file().path(), pos.x, pos.y, pos.z,
          layer == Layer::block ? "" : fmt::format(" of the layer {}", layer_rows()[i].name), error.message));
    };
    if (layer == Layer::block) {
      const Result<RegionBuilder> builder = decode_blocks(*row, world_.palette->size());
      if (!builder.ok()) return damaged(builder.error());
      arrival.region.emplace(*builder, *world_.palette, mask_kinds);
      continue;
    }
    AnyLayer values = empty_layer(layer);
    const Status decoded = decode_values(*row, values);
    if (!decoded.ok()) return damaged(decoded.error());
    arrival.layers.emplace_back(layer, std::move(values));
  }
  return {};
}

Streamer::Arrival Streamer::fetch(RegionPos pos, unsigned mask_kinds) const {
  Arrival arrival;
  arrival.pos = pos;
  try {
    if (session_) {
      const Status read = fetch_from_save(arrival, mask_kinds);
      if (!read.ok()) {
        arrival.region.reset();
        arrival.error = read.error().message;
        return arrival;
      }
    }
    if (!arrival.region) {
      RegionBuilder builder(pos);
      if (generator_) generator_->generate(builder);
      arrival.generated = generator_ != nullptr;
      arrival.region.emplace(builder, *world_.palette, mask_kinds);
    }
    arrival.bytes = arrival.region->bytes();
    for (const auto& [layer, any] : arrival.layers)
      arrival.bytes += std::visit([&](const auto& values) { return values.region_bytes(pos); }, any);
  } catch (const std::bad_alloc&) {
    arrival.region.reset();
    arrival.error = fmt::format("region ({}, {}, {}): memory ran out while it was read", pos.x, pos.y, pos.z);
  }
  return arrival;
}

void Streamer::run() {
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [this] { return stop_ || (!wanted_.empty() && arrivals_.size() < kMostArrivals); });
    if (stop_) return;
    const RegionPos pos = wanted_.back().second;
    wanted_.pop_back();
    in_flight_.insert(pos);
    const unsigned mask_kinds = mask_kinds_;
    lock.unlock();
    Arrival arrival = fetch(pos, mask_kinds);
    lock.lock();
    if (arrival.region) arrival_bytes_ += arrival.bytes;
    arrivals_.push_back(std::move(arrival));
    arrived_.notify_all();
  }
}

// ---- on the thread that edits ----------------------------------------------------------------------------------

/// From the nearest viewer to the nearest point of the region.
double Streamer::distance_m(RegionPos r) const {
  const VoxelPos low = voxel_from_region(r);
  double nearest = INFINITY;
  for (const VoxelPos& v : viewers_) {
    double squared = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double below = double(low[axis]) - v[axis], above = double(v[axis]) - (double(low[axis]) + kRegionSize - 1);
      const double d = std::max({0.0, below, above});
      squared += d * d;
    }
    nearest = std::min(nearest, squared);
  }
  return std::sqrt(nearest);
}

/// What is wanted, nearest first, and what is there, farthest first.
void Streamer::plan(std::span<const VoxelPos> viewers) {
  viewers_.assign(viewers.begin(), viewers.end());
  viewer_regions_.clear();
  for (const VoxelPos& v : viewers_) viewer_regions_.push_back(region_from_voxel(v));
  full_beyond_m_ = INFINITY;

  std::vector<std::pair<float, RegionPos>> wanted;
  const int32_t low_y = knobs_.lowest_y >> kRegionLog2, high_y = knobs_.highest_y >> kRegionLog2;
  const auto reach = static_cast<int32_t>(std::ceil(knobs_.load_radius_m / kRegionSize));
  const int32_t border = kWorldBorder / kRegionSize;
  std::unordered_set<RegionPos, PosHash> seen;  // where several viewers want the same
  for (const RegionPos& at : viewer_regions_)
    for (int32_t x = std::max(at.x - reach, -border); x <= std::min(at.x + reach, border - 1); ++x)
      for (int32_t z = std::max(at.z - reach, -border); z <= std::min(at.z + reach, border - 1); ++z)
        for (int32_t y = std::max(at.y - reach, low_y); y <= std::min(at.y + reach, high_y); ++y) {
          const RegionPos r{x, y, z};
          if (resident_.contains(r) || unreadable_.contains(r)) continue;
          const double d = distance_m(r);
          if (d > knobs_.load_radius_m || (viewers_.size() > 1 && !seen.insert(r).second)) continue;
          wanted.emplace_back(static_cast<float>(d), r);
        }
  std::sort(wanted.begin(), wanted.end(), [](const auto& a, const auto& b) { return a > b; });

  farthest_first_.clear();
  next_farthest_ = 0;
  for (auto& [pos, entry] : resident_) {
    entry.distance_m = static_cast<float>(distance_m(pos));
    farthest_first_.push_back(pos);
  }
  std::sort(farthest_first_.begin(), farthest_first_.end(), [&](const RegionPos& a, const RegionPos& b) {
    const float da = resident_.at(a).distance_m, db = resident_.at(b).distance_m;
    return da != db ? da > db : a < b;
  });

  const std::lock_guard lock(mutex_);
  std::erase_if(wanted, [&](const auto& w) { return in_flight_.contains(w.second); });
  wanted_ = std::move(wanted);
}

void Streamer::evict(RegionPos r) {
  const auto found = resident_.find(r);
  resident_bytes_ -= found->second.bytes;
  resident_.erase(found);
  world_.store.evict(r);
  note_moved(r);
  ++report_.evicted;
}

void Streamer::evict_farther_than(double distance, const std::function<bool()>& more) {
  std::vector<RegionPos> kept;  // unsaved ones are passed over and looked at again later
  while (next_farthest_ < farthest_first_.size() && more()) {
    const RegionPos r = farthest_first_[next_farthest_];
    const auto found = resident_.find(r);
    if (found != resident_.end() && found->second.distance_m <= distance) break;
    ++next_farthest_;
    if (found == resident_.end()) continue;
    if (session_ ? session_->is_unsaved(r) : world_.store.is_unsaved(r))
      kept.push_back(r);
    else
      evict(r);
  }
  next_farthest_ -= kept.size();
  std::copy(kept.begin(), kept.end(), farthest_first_.begin() + static_cast<std::ptrdiff_t>(next_farthest_));
}

bool Streamer::make_room(size_t bytes, double distance) {
  const auto fits = [&] { return resident_bytes_ + bytes <= knobs_.memory_budget_bytes; };
  evict_farther_than(distance, [&] { return !fits(); });
  if (fits()) return true;
  // What can't go because it is unsaved can go after a save.
  if (session_ && world_.store.has_unsaved() && !session_->is_saving()) session_->begin_save();
  return false;
}

/// Puts a region that has come into the store, where it is still wanted and fits.
void Streamer::place(Arrival&& arrival, double now_s) {
  const RegionPos pos = arrival.pos;
  if (!arrival.region) {
    if (unreadable_.insert(pos).second) report_.errors.push_back(arrival.error);
    return;
  }
  const double distance = distance_m(pos);
  if (resident_.contains(pos) || world_.store.is_unsaved(pos) || distance > knobs_.keep_radius_m) return;
  if (!make_room(arrival.bytes, distance)) {
    report_.budget_full = true;
    full_beyond_m_ = std::min(full_beyond_m_, distance);
    return;
  }
  Resident& entry = install(std::move(arrival));
  entry.edits = region_edits(world_.store, pos);
  entry.rests_since_s = now_s;
}

Streamer::Resident& Streamer::install(Arrival&& arrival) {
  const RegionPos pos = arrival.pos;
  world_.store.install(std::move(*arrival.region));
  for (auto& [layer, values] : arrival.layers) world_.store.install(layer, pos, std::move(values));
  Resident& entry = resident_[pos];
  note_moved(pos);
  entry.bytes = world_.store.region_bytes(pos);
  entry.distance_m = static_cast<float>(distance_m(pos));
  resident_bytes_ += entry.bytes;
  ++(arrival.generated ? report_.generated : report_.read);
  return entry;
}

/// Counts the bytes of some of the resident regions anew, and packs those that have rested.
void Streamer::look_after_resident(double now_s) {
  for (size_t n = 0; n < kLooksAnUpdate; ++n) {
    if (next_look_ >= look_at_.size()) {
      look_at_.clear();
      for (const auto& [pos, entry] : resident_) look_at_.push_back(pos);
      next_look_ = 0;
      if (look_at_.empty() || n > 0) return;
    }
    const RegionPos r = look_at_[next_look_++];
    const auto found = resident_.find(r);
    if (found == resident_.end()) continue;
    Resident& entry = found->second;
    Store& store = world_.store;
    const uint64_t edits = region_edits(store, r);
    const size_t thawed = region_thaw_bytes(store, r);
    if (edits != entry.edits || thawed != entry.thaw_bytes) {
      entry.edits = edits, entry.thaw_bytes = thawed, entry.rests_since_s = now_s;
    } else if (now_s - entry.rests_since_s >= knobs_.idle_s) {
      if (thawed > 0) {
        store.refreeze(r);
        entry.thaw_bytes = 0;
        ++report_.packed;
      } else if (!store.is_packed(r) && store.region_bytes(r) > 0) {
        store.pack(r);
        entry.edits = region_edits(store, r);
        ++report_.packed;
      }
    }
    const size_t bytes = store.region_bytes(r);
    resident_bytes_ += bytes - entry.bytes;
    entry.bytes = bytes;
  }
}

const StreamingReport& Streamer::update(std::span<const VoxelPos> viewers, double now_s) {
  const auto start = Clock::now();
  if (session_) session_->tick(now_s);
  std::vector<RegionPos> at;
  for (const VoxelPos& v : viewers) at.push_back(region_from_voxel(v));
  const bool moved = at != viewer_regions_;
  if (moved) plan(viewers);
  viewers_.assign(viewers.begin(), viewers.end());
  look_after_resident(now_s);

  // Out with what is far, some at a time; unsaved regions stay until a save has them.
  evict_farther_than(knobs_.keep_radius_m, [&] { return ms_since(start) < knobs_.update_ms; });
  if (!make_room(0, knobs_.load_radius_m)) (void)make_room(0, 0);

  // In with what has come.
  report_.budget_full = std::isfinite(full_beyond_m_);
  while (ms_since(start) < knobs_.update_ms) {
    std::optional<Arrival> arrival;
    {
      const std::lock_guard lock(mutex_);
      mask_kinds_ = world_.store.mask_kinds();
      if (arrivals_.empty()) break;
      arrival = std::move(arrivals_.front());
      arrivals_.erase(arrivals_.begin());
      if (arrival->region) arrival_bytes_ -= arrival->bytes;
      in_flight_.erase(arrival->pos);
    }
    if (overtaken_.erase(arrival->pos)) continue;
    place(std::move(*arrival), now_s);
  }
  {
    const std::lock_guard lock(mutex_);
    // Nothing is asked for that would not fit anyway.
    const auto limit = static_cast<float>(full_beyond_m_);
    const auto fits = std::find_if(wanted_.begin(), wanted_.end(), [&](const auto& w) { return w.first < limit; });
    wanted_.erase(wanted_.begin(), fits);
    report_.waiting = wanted_.size() + in_flight_.size();
    report_.held_radius_m = std::min(full_beyond_m_, knobs_.load_radius_m);
    if (!wanted_.empty()) report_.held_radius_m = std::min<double>(report_.held_radius_m, wanted_.back().first);
    for (const RegionPos& r : in_flight_) report_.held_radius_m = std::min(report_.held_radius_m, distance_m(r));
    report_.bytes = resident_bytes_ + arrival_bytes_;
  }
  wake_.notify_all();
  report_.resident = resident_.size();
  report_.update_ms = ms_since(start);
  report_.longest_update_ms = std::max(report_.longest_update_ms, report_.update_ms);
  return report_;
}

const StreamingReport& Streamer::settle(std::span<const VoxelPos> viewers, double now_s) {
  while (update(viewers, now_s).waiting > 0) {
    std::unique_lock lock(mutex_);
    arrived_.wait(lock, [this] { return !arrivals_.empty() || (wanted_.empty() && in_flight_.empty()); });
  }
  return report_;
}

int Streamer::subscribe() {
  std::unordered_set<RegionPos, PosHash>& moved = moved_.emplace_back();
  for (const auto& [pos, entry] : resident_) moved.insert(pos);
  return static_cast<int>(moved_.size()) - 1;
}

std::vector<RegionPos> Streamer::take_moved(int subscriber) {
  std::unordered_set<RegionPos, PosHash>& moved = moved_[static_cast<size_t>(subscriber)];
  std::vector<RegionPos> taken(moved.begin(), moved.end());
  moved.clear();
  std::sort(taken.begin(), taken.end());
  return taken;
}

void Streamer::note_moved(RegionPos r) {
  for (auto& moved : moved_) moved.insert(r);
}

Status Streamer::require(const VoxelBox& box) {
  if (box.empty()) return {};
  const RegionPos low = region_from_voxel(box.min), high = region_from_voxel(box.max);
  for (int32_t x = low.x; x <= high.x; ++x)
    for (int32_t y = low.y; y <= high.y; ++y)
      for (int32_t z = low.z; z <= high.z; ++z) {
        const RegionPos r{x, y, z};
        if (resident_.contains(r) || world_.store.is_unsaved(r)) continue;
        {
          // What is on its way now would be older than the edit by the time that it comes.
          const std::lock_guard lock(mutex_);
          if (in_flight_.contains(r)) overtaken_.insert(r);
        }
        Arrival arrival = fetch(r, world_.store.mask_kinds());
        if (!arrival.region) return input_error(arrival.error + ": it can't be edited");
        install(std::move(arrival));
      }
  return {};
}

Result<EditReport> Streamer::apply(const EditBatch& batch, UndoLog* undo) {
  for (const EditBatch::Op& op : batch.ops()) {
    if (!inside_world(op.box.min) || !inside_world(op.box.max)) continue;  // Store::apply refuses the batch
    TRY_STATUS(require(op.box));
  }
  return world_.store.apply(batch, undo);
}

}  // namespace world
