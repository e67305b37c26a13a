#include "sim/bodies/particles.h"

#include <algorithm>
#include <cmath>

#include "world/base/jobs.h"
#include "world/base/random.h"

namespace sim {

using world::Vec3d;
using world::VoxelPos;

struct Particles::Air {
  const world::MaskVolume* mask = nullptr;
  world::BrickVolume bricks;
};

namespace {

constexpr double kParticleOne = 1 << kParticleFixedLog2;
constexpr int kBlocksATask = 4;

uint16_t ticks_of(double seconds, TickLength tick) {
  const double ticks = seconds * tick.denominator / tick.numerator + 0.5;
  return static_cast<uint16_t>(std::clamp(ticks, 1.0, 65535.0));
}

/// In [-1, 1).
double signed_unit(uint64_t bits) { return 2 * world::uniform01_double(bits) - 1; }

world::MaskKind mask_of(ParticleMeets meets) {
  return meets == ParticleMeets::solid ? world::MaskKind::solid : world::MaskKind::occupied;
}

}  // namespace

Particles::Particles(const world::Store& store, std::span<const ParticleKind> kinds, size_t limit, uint64_t seed)
    : store_(store), subscriber_(store.subscribe()), kinds_(kinds), limit_(limit), seed_(seed) {
  CHECK_LE(size_t{1}, limit);
  CHECK_LE(limit, size_t{1} << 26);
  CHECK_LE(kinds.size(), kMostParticleKinds);
  // Neighbours in a list hold more than one block's worth together (see join_blocks); one more is being filled.
  block_count_ = 2 * limit / ParticleBlock::kSize + 3 * kinds.size() + 1;
  // new[] of this type writes only its counts: a page is the process's when it is used.
  blocks_.reset(new ParticleBlock[block_count_]);
  free_.reserve(block_count_), jobs_.reserve(block_count_);
  for (size_t i = block_count_; i-- > 0;) free_.push_back(static_cast<uint32_t>(i));
  lists_.resize(kinds.size()), motions_.resize(kinds.size());
  for (auto& list : lists_) list.reserve(block_count_);
}

Particles::~Particles() = default;

size_t Particles::bytes() const {
  size_t bytes = block_count_ * sizeof(ParticleBlock) + jobs_.capacity() * sizeof(Job);
  for (const auto& list : lists_) bytes += list.capacity() * sizeof(uint32_t);
  for (const auto& air : air_) bytes += air ? air->bricks.bytes() : 0;
  return bytes + free_.capacity() * sizeof(uint32_t);
}

size_t Particles::size(int kind) const {
  size_t count = 0;
  for (const uint32_t b : blocks(kind)) count += static_cast<size_t>(blocks_[b].count);
  return count;
}

void Particles::clear() {
  for (auto& list : lists_) {
    free_.insert(free_.end(), list.rbegin(), list.rend());
    list.clear();
  }
  size_ = 0;
}

// ---- coming and going ----

ParticleBlock& Particles::block_with_room(int kind) {
  std::vector<uint32_t>& list = lists_[static_cast<size_t>(kind)];
  if (list.empty() || blocks_[list.back()].count == ParticleBlock::kSize) {
    CHECK(!free_.empty());
    ParticleBlock& fresh = blocks_[free_.back()];
    // Vectors are read whole: what lies behind the last particle must be some number.
    for (int a = 0; a < 3; ++a)
      std::fill_n(fresh.at[a], ParticleBlock::kSize, 0), std::fill_n(fresh.velocity[a], ParticleBlock::kSize, 0.0f);
    fresh.count = fresh.deaths = 0, fresh.deaths_forgotten = 0;
    list.push_back(free_.back());
    free_.pop_back();
  }
  return blocks_[list.back()];
}

void Particles::remove_at(ParticleBlock& block, int i) {
  const int last = --block.count;
  for (int a = 0; a < 3; ++a) block.at[a][i] = block.at[a][last], block.velocity[a][i] = block.velocity[a][last];
  block.ticks_left[i] = block.ticks_left[last];
}

/// At the limit; false where the newcomer is the one to go.
bool Particles::make_room(int kind) {
  int least = -1;
  for (size_t k = 0; k < kinds_.size(); ++k)
    if (!lists_[k].empty() && (least < 0 || kinds_[k].priority < kinds_[static_cast<size_t>(least)].priority))
      least = static_cast<int>(k);
  if (kinds_[static_cast<size_t>(kind)].priority < kinds_[static_cast<size_t>(least)].priority) {
    ++report_.refused;
    return false;
  }
  std::vector<uint32_t>& list = lists_[static_cast<size_t>(least)];
  remove_at(blocks_[list.front()], 0);
  if (blocks_[list.front()].count == 0) {
    free_.push_back(list.front());
    list.erase(list.begin());
  }
  --size_, ++report_.dropped;
  return true;
}

bool Particles::add(int kind, const int32_t at[3], Vec3d velocity, const ParticleSettings& settings) {
  if (size_ == limit_ && !make_room(kind)) return false;
  const ParticleKind& k = kinds_[static_cast<size_t>(kind)];
  ParticleBlock& block = block_with_room(kind);
  const int i = block.count++;
  ++size_;
  for (int a = 0; a < 3; ++a) {
    block.at[a][i] = at[a];
    block.velocity[a][i] = std::isfinite(velocity[a]) ? static_cast<float>(std::clamp(velocity[a], -1e4, 1e4)) : 0.0f;
  }
  const double age = world::uniform01_double(world::hash_combine(world::hash_combine(seed_, serial_++), 0));
  block.ticks_left[i] = ticks_of(k.lifetime_s[0] + age * (k.lifetime_s[1] - k.lifetime_s[0]), settings.tick);
  return true;
}

bool Particles::spawn(int kind, const world::WorldPoint& at, Vec3d velocity, const ParticleSettings& settings) {
  int32_t from_origin[3];
  for (int a = 0; a < 3; ++a) {
    const int64_t voxel = int64_t{at.voxel[a]} - origin_[a];
    if (voxel > kParticleDomain || voxel < -kParticleDomain) return false;
    from_origin[a] =
        static_cast<int32_t>(voxel * (1 << kParticleFixedLog2)) + static_cast<int32_t>(at.fraction[a] * kParticleOne);
  }
  return add(kind, from_origin, velocity, settings);
}

void Particles::spawn_in(int kind, const world::VoxelBox& box, int count, Vec3d velocity, double spread,
                         const ParticleSettings& settings) {
  for (int i = 0; i < count; ++i) {
    const uint64_t lot = world::hash_combine(world::hash_combine(seed_, serial_), 1);
    world::WorldPoint at;
    Vec3d v = velocity;
    for (int a = 0; a < 3; ++a) {
      const double side = double(box.max[a]) - box.min[a] + 1;
      const double along = side * world::uniform01_double(world::hash_combine(lot, static_cast<uint64_t>(a)));
      const int32_t voxel = std::min(static_cast<int32_t>(along), box.max[a] - box.min[a]);
      at.voxel[a] = box.min[a] + voxel;
      at.fraction[a] = along - voxel;
      v[a] += spread * signed_unit(world::hash_combine(lot, static_cast<uint64_t>(3 + a)));
    }
    spawn(kind, at, v, settings);
  }
}

void Particles::set_origin(VoxelPos origin) {
  const VoxelPos old = origin_;
  origin_ = origin;
  for (auto& list : lists_)
    for (const uint32_t b : list) {
      ParticleBlock& block = blocks_[b];
      for (int i = block.count; i-- > 0;)
        for (int a = 0; a < 3; ++a) {
          const int64_t voxel = int64_t{old[a]} - origin[a] + (block.at[a][i] >> kParticleFixedLog2);
          if (voxel > kParticleDomain || voxel < -kParticleDomain) {
            remove_at(block, i);
            --size_;
            break;
          }
          block.at[a][i] = static_cast<int32_t>(voxel << kParticleFixedLog2 | (block.at[a][i] & 0xffff));
        }
    }
  for (auto& list : lists_) join_blocks(list);
}

// ---- the step ----

/// Each integrator is linear here: its numbers come from two steps of its own.
void Particles::find_motions(const ParticleSettings& s) {
  for (size_t k = 0; k < kinds_.size(); ++k) {
    const ParticleKind& kind = kinds_[k];
    Motion& m = motions_[k];
    m.parts = stable_substeps(kind.drag_per_s, s.tick.seconds(), s.substeps);
    const double dt = s.tick.seconds() / m.parts;
    for (int a = 0; a < 3; ++a) {
      const double constant = (a == 1 ? -s.gravity * kind.gravity : 0) + kind.drag_per_s * s.wind[a];
      const auto force = [&](double, double v) { return constant - kind.drag_per_s * v; };
      const auto from_rest = integrate(s.integrator, ::sim::Motion<double>{0, 0}, dt, force);
      const auto from_one = integrate(s.integrator, ::sim::Motion<double>{0, 1}, dt, force);
      m.motion.way[a] = static_cast<float>(from_rest.position * kParticleOne);
      m.motion.gained[a] = static_cast<float>(from_rest.velocity);
      m.motion.way_by_velocity = static_cast<float>((from_one.position - from_rest.position) * kParticleOne);
      m.motion.kept = static_cast<float>(from_one.velocity - from_rest.velocity);
    }
    m.motion.on_hit = kind.on_hit, m.motion.restitution = kind.restitution, m.motion.friction = kind.friction;
  }
}

/// Bricks of the masks that particles there meet; built when first met, kept up to date by edits.
void Particles::follow_terrain() {
  const std::vector<world::LeafPos> dirty = store_.take_dirty(subscriber_);
  for (const ParticleMeets meets : {ParticleMeets::solid, ParticleMeets::occupied}) {
    std::unique_ptr<Air>& air = air_[static_cast<size_t>(meets)];
    if (air) {
      air->mask = &store_.masks(mask_of(meets));
      for (const world::LeafPos& leaf : dirty) air->bricks.update(*air->mask, leaf);
      continue;
    }
    for (size_t k = 0; k < kinds_.size() && !air; ++k)
      if (kinds_[k].meets == meets && !lists_[k].empty()) {
        const world::MaskVolume& mask = store_.masks(mask_of(meets));
        air = std::make_unique<Air>(Air{&mask, world::BrickVolume(mask)});
      }
  }
}

void Particles::step_block(uint32_t index, int kind, const ParticleSettings& settings) {
  ParticleBlock& block = blocks_[index];
  const Motion& m = motions_[static_cast<size_t>(kind)];
  const Air& air = *air_[static_cast<size_t>(kinds_[static_cast<size_t>(kind)].meets)];
  const ParticleTerrain terrain{air.mask, air.bricks.walkable() ? &air.bricks : nullptr, origin_};
  block.deaths = 0, block.deaths_forgotten = 0;
  for (int i = 0; i < m.parts; ++i)
    settings.plain ? move_particles_plain(block, m.motion, terrain) : move_particles(block, m.motion, terrain);
  if (!age_particles(block)) return;
  for (int i = block.count; i-- > 0;)
    if (block.ticks_left[i] == 0) remove_at(block, i);
}

ParticleReport Particles::step(const ParticleSettings& settings) {
  find_motions(settings);
  follow_terrain();
  report_.moved = size_;
  jobs_.clear();
  for (size_t k = 0; k < kinds_.size(); ++k)
    for (const uint32_t b : lists_[k]) jobs_.push_back({b, static_cast<int>(k)});
  world::parallel_ranges(jobs_.size(), kBlocksATask, [this, &settings](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) step_block(jobs_[i].block, jobs_[i].kind, settings);
  });
  size_ = 0;
  for (const Job& job : jobs_) size_ += static_cast<size_t>(blocks_[job.block].count);
  report_.ended = report_.moved - size_;
  leave_behind(settings);
  for (auto& list : lists_) join_blocks(list);
  ++tick_;
  const ParticleReport done = report_;
  report_ = {};
  return done;
}

/// What dies by a hit spawns, in the order of kinds and blocks.
void Particles::leave_behind(const ParticleSettings& settings) {
  for (const Job& job : jobs_) {
    const ParticleKind& kind = kinds_[static_cast<size_t>(job.kind)];
    if (kind.spawns < 0) continue;
    ParticleBlock& block = blocks_[job.block];
    report_.deaths_forgotten += block.deaths_forgotten;
    for (int i = 0; i < block.deaths; ++i)
      for (int n = 0; n < kind.spawn_count; ++n) {
        const uint64_t lot = world::hash_combine(world::hash_combine(seed_, serial_), 2);
        Vec3d v(0);
        for (int a = 0; a < 3; ++a)
          v[a] = kind.spread_mps * signed_unit(world::hash_combine(lot, static_cast<uint64_t>(a)));
        report_.born += add(kind.spawns, block.death[i].at, v, settings);
      }
  }
}

/// Neighbours that fit into one block become one; empty ones go. Each two that stay hold more than a block together.
void Particles::join_blocks(std::vector<uint32_t>& list) {
  size_t kept = 0;
  for (size_t i = 0; i < list.size(); ++i) {
    ParticleBlock& from = blocks_[list[i]];
    if (kept > 0 && blocks_[list[kept - 1]].count + from.count <= ParticleBlock::kSize) {
      ParticleBlock& to = blocks_[list[kept - 1]];
      for (int a = 0; a < 3; ++a) {
        std::copy_n(from.at[a], from.count, to.at[a] + to.count);
        std::copy_n(from.velocity[a], from.count, to.velocity[a] + to.count);
      }
      std::copy_n(from.ticks_left, from.count, to.ticks_left + to.count);
      to.count += from.count;
      free_.push_back(list[i]);
    } else if (from.count == 0) {
      free_.push_back(list[i]);
    } else {
      list[kept++] = list[i];
    }
  }
  list.resize(kept);
}

uint64_t Particles::content_hash() const {
  uint64_t hash = world::hash_combine(world::hash_combine(seed_, tick_), serial_);
  for (const auto& list : lists_)
    for (const uint32_t b : list) {
      const ParticleBlock& block = blocks_[b];
      for (int i = 0; i < block.count; ++i)
        for (int a = 0; a < 3; ++a) {
          const uint64_t velocity = std::bit_cast<uint32_t>(block.velocity[a][i]);
          hash = world::hash_combine(hash, velocity << 32 | static_cast<uint32_t>(block.at[a][i]));
          hash += block.ticks_left[i];
        }
    }
  return hash;
}

}  // namespace sim
