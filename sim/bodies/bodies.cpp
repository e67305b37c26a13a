#include "sim/bodies/bodies.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <mutex>

#include <fmt/format.h>

#include "sim/bodies/body_motion.h"
#include "world/base/jobs.h"

namespace sim {

using world::Vec3d;

namespace {

constexpr size_t kGrain = 16;  // bodies of a task

/// Whether any of the leaves, sorted, lies in the voxels' leaves.
bool any_leaf_in(const std::vector<world::LeafPos>& leaves, const world::VoxelBox& voxels) {
  const world::LeafPos low = world::leaf_from_voxel(voxels.min), high = world::leaf_from_voxel(voxels.max);
  for (int32_t x = low.x; x <= high.x; ++x)
    for (int32_t y = low.y; y <= high.y; ++y) {
      const auto at = std::lower_bound(leaves.begin(), leaves.end(), world::LeafPos{x, y, low.z});
      if (at != leaves.end() && at->x == x && at->y == y && at->z <= high.z) return true;
    }
  return false;
}

FixedVec3 corner_from_foot(const world::WorldPoint& foot, const FixedVec3& size) {
  FixedVec3 corner = fixed_from(foot);
  corner.x -= size.x / 2, corner.z -= size.z / 2;
  return corner;
}

world::Status in_range(const char* what, double value, double low, double high) {
  if (value >= low && value <= high) return {};
  return world::usage_error(fmt::format("a body's {} is {}; it must be in [{}, {}]", what, value, low, high));
}

bool fast_enough_to_hold(Vec3d v) {
  return is_finite(v) && std::abs(v.x) <= 1e9 && std::abs(v.y) <= 1e9 && std::abs(v.z) <= 1e9;
}

FixedVec3 held(Vec3d v) {
  for (int a = 0; a < 3; ++a) v[a] = std::clamp(v[a], -kFastestBody, kFastestBody);
  return fixed_from(v);
}

}  // namespace

void BodyReport::add(const BodyReport& part) {
  bodies += part.bodies, awake += part.awake, contacts += part.contacts, pushed += part.pushed, stuck += part.stuck;
  frozen += part.frozen, quarantined += part.quarantined, substeps_raised += part.substeps_raised;
}

world::WorldPoint drawn_at(const Body& body, double part) {
  const FixedVec3 way = body.box.min - body.drawn_from;
  FixedVec3 at = body.drawn_from;
  for (int a = 0; a < 3; ++a) at[a] += fixed_from(from_fixed(way[a]) * part);
  return world_point(at);
}

Bodies::Bodies(const world::Store& store) : store_(store), subscriber_(store.subscribe()), terrain_(store) {
  terrain_.refresh();
}

world::Result<BodyId> Bodies::add(const BodyDescription& d) {
  for (int a = 0; a < 3; ++a) TRY_STATUS(in_range("size", d.size[a], 1.0 / 256, 64));
  TRY_STATUS(in_range("density", d.density, 1, 1e5));
  TRY_STATUS(in_range("restitution", d.restitution, 0, 1));
  TRY_STATUS(in_range("friction", d.friction, 0, 10));
  TRY_STATUS(in_range("drag_coefficient", d.drag_coefficient, 0, 100));
  TRY_STATUS(in_range("step_height", d.step_height, 0, 2));
  if (!world::inside_world(d.foot.voxel)) return world::usage_error("a body's place is outside the world");
  Body body;
  body.id = next_id_++;
  body.described = d;
  body.box.size = fixed_from(d.size);
  body.box.min = corner_from_foot(d.foot, body.box.size);
  body.drawn_from = body.box.min;
  body.step_height = fixed_from(d.step_height);
  bodies_.push_back(body);
  set_velocity(body.id, d.velocity);
  return body.id;
}

bool Bodies::remove(BodyId id) {
  const Body* body = find(id);
  if (!body) return false;
  const BodyBox box = body->box;
  bodies_.erase(bodies_.begin() + (body - bodies_.data()));
  wake_beside(box, id);
  return true;
}

Body* Bodies::known(BodyId id) {
  const auto at =
      std::lower_bound(bodies_.begin(), bodies_.end(), id, [](const Body& b, BodyId i) { return b.id < i; });
  return at != bodies_.end() && at->id == id ? &*at : nullptr;
}
const Body* Bodies::find(BodyId id) const { return const_cast<Bodies*>(this)->known(id); }

void Bodies::wake(Body& body) {
  if (body.state == BodyState::asleep) body.state = BodyState::awake;
  body.calm_ticks = 0;
}

void Bodies::wake_beside(const BodyBox& box, BodyId but) {
  const BodyBox touched = grown(box, 1);
  for (Body& body : bodies_)
    if (body.id != but && body.state == BodyState::asleep && overlap(touched, body.box)) wake(body);
}

void Bodies::set_velocity(BodyId id, Vec3d mps) {
  Body* body = known(id);
  if (!body || body->state == BodyState::quarantined) return;
  if (!is_finite(mps)) {
    body->state = BodyState::quarantined;
    return;
  }
  body->velocity = held(mps);
  wake(*body);
}

void Bodies::set_drive(BodyId id, Vec3d mps2) {
  Body* body = known(id);
  if (!body || body->state == BodyState::quarantined) return;
  if (!fast_enough_to_hold(mps2)) {
    body->state = BodyState::quarantined;
    return;
  }
  body->drive = mps2;
  if (mps2 != Vec3d(0)) wake(*body);
}

void Bodies::teleport(BodyId id, const world::WorldPoint& foot) {
  Body* body = known(id);
  if (!body || !world::inside_world(foot.voxel)) return;
  const BodyBox left = body->box;
  body->box.min = corner_from_foot(foot, body->box.size);
  body->drawn_from = body->box.min;
  body->touching = 0;
  wake(*body);
  wake_beside(left, id);
}

bool Bodies::resize(BodyId id, Vec3d size) {
  Body* body = known(id);
  if (!body) return false;
  for (int a = 0; a < 3; ++a)
    if (!(size[a] >= 1.0 / 256 && size[a] <= 64)) return false;
  BodyBox box{body->box.min, fixed_from(size)};
  box.min.x += (body->box.size.x - box.size.x) / 2, box.min.z += (body->box.size.z - box.size.z) / 2;
  if (box == body->box) return true;
  terrain_.refresh();
  bool free = !terrain_.overlaps(box);
  for (const Body& other : bodies_)
    free = free && (other.id == id || other.state == BodyState::quarantined || overlap(other.box, body->box) ||
                    !overlap(other.box, box));
  if (!free) return false;
  body->box = box;
  wake(*body);
  return true;
}

bool Bodies::stands(BodyId id) {
  const Body* body = find(id);
  if (!body) return false;
  terrain_.refresh();
  obstacles_.clear();
  for (const Body& other : bodies_)
    if (other.id != id && other.state != BodyState::quarantined) obstacles_.push_back(other.box);
  return sweep(body->box, {0, -1, 0}, terrain_, obstacles_).hit();
}

Vec3d Bodies::current(BodyId id) {
  const Body* body = find(id);
  if (!body || body->submerged == 0) return Vec3d(0);
  terrain_.refresh();
  return terrain_.current(body->box);
}

void Bodies::set_unloaded(world::RegionPos r, bool unloaded) {
  terrain_.set_unloaded(r, unloaded);
  const world::VoxelPos low = world::voxel_from_region(r);
  BodyBox box;
  for (int a = 0; a < 3; ++a) box.min[a] = low[a] * kFixedOne, box.size[a] = world::kRegionSize * kFixedOne;
  wake_beside(box, 0);
}

void Bodies::wake_edited() {
  const std::vector<world::LeafPos> dirty = store_.take_dirty(subscriber_);
  if (dirty.empty()) return;
  for (Body& body : bodies_)
    if (body.state == BodyState::asleep && any_leaf_in(dirty, grown(body.box, kFixedOne).voxels())) wake(body);
}

// ---- the step ----

/// Finds the boxes that bodies stay within in this tick: their speed in any direction, and a voxel of being pushed.
void Bodies::find_reaches(const BodySettings& settings) {
  const double dt = settings.tick.seconds();
  reaches_.clear();
  widest_ = 0;
  for (uint32_t i = 0; i < bodies_.size(); ++i) {
    const Body& body = bodies_[i];
    if (body.state == BodyState::quarantined) continue;
    BodyBox box = body.box;
    if (body.state != BodyState::asleep)
      for (int a = 0; a < 3; ++a) {
        // Forces add at most what this much acceleration does, or drag takes it away.
        const double added = (std::abs(body.drive[a]) + 1000.0) * dt;
        const double way = std::min((std::abs(from_fixed(body.velocity[a])) + added) * dt, kFastestBody * dt);
        const int64_t margin = kFixedOne + body.step_height + fixed_from(std::min(way, 32768.0));
        box.min[a] -= margin, box.size[a] += 2 * margin;
      }
    widest_ = std::max(widest_, box.size.x);
    reaches_.push_back({box, i});
  }
  std::sort(reaches_.begin(), reaches_.end(), [](const Reach& a, const Reach& b) {
    return a.box.min.x != b.box.min.x ? a.box.min.x < b.box.min.x : a.body < b.body;
  });
  reach_of_.resize(bodies_.size());
  for (uint32_t r = 0; r < reaches_.size(); ++r) reach_of_[reaches_[r].body] = r;
}

/// What each can meet in this tick.
void Bodies::find_near() {
  if (near_.size() < order_.size()) near_.resize(order_.size());
  world::parallel_ranges(order_.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t place = begin; place < end; ++place) {
      const uint32_t body = order_[place];
      std::vector<uint32_t>& near = near_[place];
      near.clear();
      const BodyBox& reach = reaches_[reach_of_[body]].box;
      auto at = std::lower_bound(reaches_.begin(), reaches_.end(), reach.min.x - widest_,
                                 [](const Reach& r, int64_t x) { return r.box.min.x < x; });
      for (; at != reaches_.end() && at->box.min.x < reach.max(0); ++at)
        if (at->body != body && overlap(at->box, reach)) near.push_back(at->body);
      std::sort(near.begin(), near.end());
    }
  });
}

/// A body's wave comes after those of all before it that have to do with what it has to do with: itself, and what it
/// can meet, to which it may give speed and which it may wake.
void Bodies::find_waves() {
  met_.assign(bodies_.size(), 0);
  wave_of_.resize(order_.size());
  waves_.assign(1, 0);
  for (size_t place = 0; place < order_.size(); ++place) {
    uint32_t wave = met_[order_[place]];
    for (const uint32_t other : near_[place]) wave = std::max(wave, met_[other]);
    wave_of_[place] = wave;
    if (wave + 2 > waves_.size()) waves_.resize(wave + 2);
    ++waves_[wave + 1];
    met_[order_[place]] = wave + 1;
    for (const uint32_t other : near_[place]) met_[other] = wave + 1;
  }
  for (size_t w = 1; w < waves_.size(); ++w) waves_[w] += waves_[w - 1];
  places_.resize(order_.size());
  std::vector<uint32_t>& next = met_;  // not needed any more
  next.assign(waves_.begin(), waves_.end());
  for (uint32_t place = 0; place < order_.size(); ++place) places_[next[wave_of_[place]]++] = place;
}

void Bodies::step_body(uint32_t place, const BodySettings& settings, Worker& worker) {
  const uint32_t index = order_[place];
  worker.near.clear(), worker.obstacles.clear();
  for (const uint32_t i : near_[place]) {
    if (bodies_[i].state == BodyState::quarantined) continue;
    worker.near.push_back(i), worker.obstacles.push_back(bodies_[i].box);
  }
  Body& body = bodies_[index];
  const BodyBox before = body.box;
  BodyMotion motion(worker.terrain, bodies_, worker.near, worker.obstacles, settings, tick_, worker.report);
  motion.step(index);
  if (body.state != BodyState::awake || motion.waits()) return;

  // Sleep once nothing has happened for a while; wake what leaned on it where something has.
  const Vec3d v = from_fixed(body.velocity);
  const bool calm = body.box == before || dot(v, v) < kCalmSpeed * kCalmSpeed;
  body.calm_ticks = static_cast<uint16_t>(calm ? std::min(body.calm_ticks + 1, kSleepTicks) : 0);
  if (body.calm_ticks == kSleepTicks) {
    body.state = BodyState::asleep;
    body.velocity = {};
  }
  if (body.box == before) return;
  const BodyBox touched = grown(before, 1);
  for (const uint32_t i : worker.near)
    if (bodies_[i].state == BodyState::asleep && overlap(bodies_[i].box, touched)) wake(bodies_[i]);
}

void Bodies::step_all(const BodySettings& settings) {
  find_reaches(settings);
  find_near();
  // One thread goes by the order itself: that comes to the same.
  const bool alone = order_.size() < 2 * kGrain || world::thread_count() == 1;
  if (alone) {
    Worker worker{terrain_.reader(), {}, {}, {}};
    for (uint32_t place = 0; place < order_.size(); ++place) step_body(place, settings, worker);
    return report_.add(worker.report);
  }
  find_waves();
  std::mutex adding;
  for (size_t w = 0; w + 1 < waves_.size(); ++w)
    world::parallel_ranges(waves_[w + 1] - waves_[w], kGrain, [&](size_t begin, size_t end) {
      Worker worker{terrain_.reader(), {}, {}, {}};
      for (size_t n = begin; n < end; ++n) step_body(places_[waves_[w] + n], settings, worker);
      const std::lock_guard lock(adding);
      report_.add(worker.report);
    });
}

BodyReport Bodies::step(const BodySettings& settings) {
  report_ = {};
  terrain_.refresh();
  wake_edited();
  for (Body& body : bodies_) body.drawn_from = body.box.min;
  order_.clear();
  for (uint32_t i = 0; i < bodies_.size(); ++i)
    if (bodies_[i].state == BodyState::awake || bodies_[i].state == BodyState::stuck) order_.push_back(i);
  std::sort(order_.begin(), order_.end(), [&](uint32_t a, uint32_t b) {
    const int64_t ya = bodies_[a].box.min.y, yb = bodies_[b].box.min.y;
    return ya != yb ? ya < yb : a < b;
  });
  report_.bodies = bodies_.size(), report_.awake = order_.size();
  if (!order_.empty()) step_all(settings);
  for (Body& body : bodies_) {
    report_.quarantined += body.state == BodyState::quarantined;
    if (body.given == FixedVec3{}) continue;
    body.velocity = held(from_fixed(body.velocity + body.given));
    body.given = {};
    wake(body);
  }
  ++tick_;
  return report_;
}

}  // namespace sim
