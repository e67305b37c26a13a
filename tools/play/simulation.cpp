#include "tools/play/simulation.h"

#include <chrono>
#include <cmath>
#include <cstdio>

#include <fmt/format.h>

#include "world/proxies/proxy.h"

namespace tools {

using world::VoxelPos;
using world::WorldPoint;

namespace {

constexpr const char* kTickKey = "simulated_ticks";  // as `loam sim` has it
constexpr const char* kPlayerKey = "player";
constexpr int kMostDrop = 512;  // m above ground at which a player still begins standing

/// Whether a player can be there: in air, fluids, and plants.
bool is_open(const world::World& world, VoxelPos v) {
  const world::Block& block = (*world.palette)[world.store.get(v)];
  if (block.name == (*world.palette)[world::kAir].name) return true;
  if (block.phase == world::Phase::gas || block.phase == world::Phase::liquid) return true;
  const world::Proxy* shape = block.proxy.empty() ? nullptr : world::find_proxy(block.proxy);
  return shape && !shape->stops_bodies();
}

/// The first voxel below that holds up a player, as far as kMostDrop.
std::optional<VoxelPos> ground_below(const world::World& world, VoxelPos v) {
  for (int i = 0; i < kMostDrop && world::inside_world(v); ++i, --v.y) {
    const world::Phase phase = (*world.palette)[world.store.get(v)].phase;
    if (world.store.get(v) != world::kAir && (phase == world::Phase::solid || phase == world::Phase::granular))
      return v;
  }
  return std::nullopt;
}

/// The highest voxel of a column that isn't open, where it is ground: neither liquid, nor the crown of a tree.
std::optional<int32_t> dry_top(const world::World& world, int32_t x, int32_t z, const world::VoxelBox& box) {
  for (VoxelPos v{x, box.max.y, z}; v.y >= box.min.y; --v.y) {
    const world::Block& block = (*world.palette)[world.store.get(v)];
    if (block.phase == world::Phase::liquid) return std::nullopt;
    if (is_open(world, v)) continue;
    if (block.name.find("leaves") != std::string::npos || block.name.find("log") != std::string::npos)
      return std::nullopt;
    return v.y;
  }
  return std::nullopt;
}

/// Where a newcomer would like to stand: on dry ground under the open sky, level for 3 m around, as near to the middle
/// as there is any; the voxel above it.
std::optional<VoxelPos> clearing_of(const world::World& world) {
  constexpr int kApart = 4, kLevel = 3, kSteps = 64;
  const world::VoxelBox box = world.store.bounds();
  if (box.empty()) return std::nullopt;
  const VoxelPos middle{(box.min.x + box.max.x) / 2, 0, (box.min.z + box.max.z) / 2};
  for (int ring = 0; ring <= kSteps; ++ring)
    for (int i = -ring; i <= ring; ++i)
      for (int j = -ring; j <= ring; j += ring > 0 && std::abs(i) < ring ? 2 * ring : 1) {
        const VoxelPos at = middle + VoxelPos{i * kApart, 0, j * kApart};
        const auto top = dry_top(world, at.x, at.z, box);
        if (!top) continue;
        bool level = true;
        for (int dx = -kLevel; dx <= kLevel && level; dx += kLevel)
          for (int dz = -kLevel; dz <= kLevel && level; dz += kLevel) {
            const auto beside = dry_top(world, at.x + dx, at.z + dz, box);
            level = beside && std::abs(*beside - *top) <= 1;
          }
        if (level) return VoxelPos{at.x, *top + 1, at.z};
      }
  return std::nullopt;
}

std::optional<Start> saved_start(const world::World& world) {
  const auto saved = world.metadata.find(kPlayerKey);
  if (saved == world.metadata.end()) return std::nullopt;
  Start s;
  int flies = 0;
  WorldPoint& p = s.foot;
  if (std::sscanf(saved->second.c_str(), "%d %d %d %lf %lf %lf %lf %lf %d", &p.voxel.x, &p.voxel.y, &p.voxel.z,
                  &p.fraction.x, &p.fraction.y, &p.fraction.z, &s.yaw, &s.pitch, &flies) != 9)
    return std::nullopt;
  for (int a = 0; a < 3; ++a)
    if (!(p.fraction[a] >= 0 && p.fraction[a] < 1)) return std::nullopt;
  if (!world::inside_world(p.voxel) || !std::isfinite(s.yaw) || !std::isfinite(s.pitch)) return std::nullopt;
  s.flies = flies != 0;
  return s;
}

}  // namespace

Start start_of(const world::World& world) {
  if (const auto saved = saved_start(world)) return *saved;
  Start s;
  const world::VoxelBox box = world.store.bounds();
  WorldPoint eye{{(box.min.x + box.max.x) / 2, box.max.y, (box.min.z + box.max.z) / 2}, world::Vec3d(0.5)};
  if (box.empty()) eye = {{0, 2, 0}, world::Vec3d(0.5)};
  if (world.cameras.empty())
    if (const auto clearing = clearing_of(world)) {
      s.foot = {*clearing, {0.5, 0, 0.5}};
      // Looks over the middle, slightly down: ground and what is built on it are seen at once.
      const VoxelPos way = eye.voxel - *clearing;
      s.yaw = way.x == 0 && way.z == 0 ? 0 : std::atan2(way.x, -way.z), s.pitch = -0.15;
      return s;
    }
  if (!world.cameras.empty()) {
    // One that stands on the ground, where there is one.
    const world::CameraPlacement* camera = &world.cameras.front();
    for (const world::CameraPlacement& c : world.cameras)
      if (c.name == "ground") camera = &c;
    eye = camera->position;
    s.yaw = std::atan2(camera->forward.x, -camera->forward.z);
    s.pitch = std::asin(std::clamp(camera->forward.y, -1.0, 1.0));
  }
  s.foot = eye + world::Vec3d(0, -kEyeHeight, 0);
  // On the ground below, or beside that where something stands there; a camera that hangs high begins a flight.
  constexpr int kLower = 4, kBeside = 3;
  const int lower = world.cameras.empty() ? kMostDrop : kLower;
  for (int apart = 0; apart <= kBeside; ++apart)
    for (int dx = -apart; dx <= apart; ++dx)
      for (int dz = -apart; dz <= apart; ++dz) {
        if (std::max(std::abs(dx), std::abs(dz)) != apart) continue;
        const VoxelPos from = eye.voxel + VoxelPos{dx, 0, dz};
        const auto ground = ground_below(world, from);
        if (!ground || from.y - ground->y >= lower || !is_open(world, *ground + VoxelPos{0, 1, 0}) ||
            !is_open(world, *ground + VoxelPos{0, 2, 0}))
          continue;
        s.foot = {*ground + VoxelPos{0, 1, 0}, {0.5, 0, 0.5}};
        return s;
      }
  s.flies = true;
  return s;
}

world::Result<std::unique_ptr<PlaySimulation>> PlaySimulation::make(world::World& world) {
  std::unique_ptr<PlaySimulation> made(new PlaySimulation(world));
  TRY(made->options_, sim::matter_options(world, world::Accuracy::usual));
  uint64_t tick = 0;
  if (const auto saved = world.metadata.find(kTickKey); saved != world.metadata.end())
    tick = std::strtoull(saved->second.c_str(), nullptr, 10);
  TRY_STATUS(made->make_matter(tick));
  const Start start = start_of(world);
  TRY(made->walker_, Walker::make(world.store, start.foot));
  made->walker_->set_flying(start.flies);
  made->simulate_around(made->walker_->state().foot.voxel);
  made->matter_->save_state();
  made->history_ = std::make_unique<History>(world);
  made->history_->begin(tick, std::nullopt, made->around_);
  return made;
}

world::Status PlaySimulation::make_matter(uint64_t tick) {
  // Rain goes on where it is.
  std::unique_ptr<sim::Particles> particles = matter_ ? matter_->release_particles() : nullptr;
  matter_.reset();
  left_behind_.insert(left_behind_.end(), of_matter_.begin(), of_matter_.end());
  of_matter_.clear();
  options_.tick = tick;
  const int before = world_.store.subscribe();
  matter_ = std::make_unique<sim::Matter>(world_, options_);
  const world::Status begun = matter_->begin();
  const int after = world_.store.subscribe();
  left_behind_.insert(left_behind_.end(), {before, after});
  for (int id = before + 1; id < after; ++id) of_matter_.push_back(id);
  if (particles && matter_->particles()) {
    std::erase(left_behind_, particles->subscriber());
    of_matter_.push_back(particles->subscriber());
    const int made_anew = matter_->particles()->subscriber();
    std::erase(of_matter_, made_anew);
    left_behind_.push_back(made_anew);
    matter_->adopt_particles(std::move(particles));
  }
  return begun;
}

void PlaySimulation::simulate_around(VoxelPos around) {
  around_ = around;
  const std::vector<world::RegionPos> regions = world_.store.regions();
  for (const world::RegionPos& r : regions) {
    const VoxelPos low = world::voxel_from_region(r);
    int64_t distance = 0;  // of the region's box, along the axis on which it is furthest
    for (int a = 0; a < 3; ++a)
      distance =
          std::max({distance, int64_t{low[a]} - around[a], int64_t{around[a]} - low[a] - world::kRegionSize + 1});
    matter_->set_unloaded(r, regions.size() > kMostSimulated && distance > kSimulatedM);
  }
}

void PlaySimulation::walk(const WalkInput& input) {
  walker_->step(input);
  // Who fell out of the world flies: there is nothing to stand on.
  if (!walker_->state().flies && walker_->state().velocity.y < -90) walker_->set_flying(true);
}

void PlaySimulation::keep_moment(uint64_t tick) {
  matter_->save_state();
  history_->begin(tick, std::nullopt, around_);
  for (const int id : left_behind_) (void)world_.store.take_dirty(id);
}

void PlaySimulation::step_matter() {
  const VoxelPos at = walker_->state().foot.voxel;
  bool far = false;
  for (int a = 0; a < 3; ++a) far |= std::abs(int64_t{at[a]} - around_[a]) > kAroundM;
  if (far) {
    // Ticks between two moments are all simulated around one place, so that they can be done again.
    simulate_around(at);
    keep_moment(tick());
  }
  const bool rests = matter_->settled();
  const auto start = std::chrono::steady_clock::now();
  matter_->step();
  matter_->flush();
  if (rests) return;
  matter_ms_ = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  if (tick() % kTicksKept == 0) keep_moment(tick());
}

world::Result<world::EditReport> PlaySimulation::edit(const world::EditBatch& batch) {
  for (const world::EditBatch::Op& op : batch.ops())
    if (op.block >= world_.palette->size())
      return world::usage_error("an edit names a block that the world doesn't have");
  matter_->save_state();
  history_->begin(tick(), batch, around_);
  edited_ = true;
  return world_.store.apply(batch);
}

/// The world is put back already: matter is made anew, and goes on to the tick that is wanted.
bool PlaySimulation::take(const std::optional<History::Restored>& restored, uint64_t to_tick) {
  if (!restored) return false;
  CHECK(make_matter(restored->tick).ok());  // it has been made of this before
  simulate_around(restored->around);
  if (restored->edit) CHECK(world_.store.apply(*restored->edit).ok());
  while (tick() < to_tick) matter_->step();
  matter_->flush();
  edited_ = true;
  return true;
}

bool PlaySimulation::undo() {
  matter_->save_state();
  const auto restored = history_->undo(tick(), around_);
  return take(restored, restored ? restored->tick : 0);
}

bool PlaySimulation::redo() {
  matter_->save_state();
  const auto restored = history_->redo();
  return take(restored, restored ? restored->tick : 0);
}

bool PlaySimulation::step_back() {
  const uint64_t now = tick();
  if (now == 0) return false;
  matter_->save_state();
  return take(history_->back_to(now - 1, now, around_), now - 1);
}

void PlaySimulation::set_mode(bool flies, bool passes) {
  walker_->set_flying(flies || passes);
  walker_->set_passing(passes);
}

void PlaySimulation::teleport(const WorldPoint& foot) {
  if (world::inside_world(foot.voxel)) walker_->teleport(foot);
}

void PlaySimulation::keep_knob(const std::string& name, const std::string& value) {
  world_.knobs[name] = value;
  edited_ = true;
}

uint64_t PlaySimulation::hash() { return world::hash_combine(matter_->state_hash(), walker_->hash()); }

void PlaySimulation::prepare_save(double yaw, double pitch) {
  matter_->save_state();
  world_.metadata[kTickKey] = std::to_string(tick());
  const WalkState s = walker_->state();
  const WorldPoint& p = s.foot;
  world_.metadata[kPlayerKey] = fmt::format("{} {} {} {} {} {} {} {} {}", p.voxel.x, p.voxel.y, p.voxel.z, p.fraction.x,
                                            p.fraction.y, p.fraction.z, yaw, pitch, s.flies ? 1 : 0);
}

}  // namespace tools
