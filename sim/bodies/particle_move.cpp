// The particles of a block, a vector at a time: most stay in their voxel or come into an empty leaf, which a load from
// the bricks' codes tells; those that change one coordinate of their voxel are decided by a bit of a word; what is left
// - hits, corners, the end of the domain - goes one by one.
#include <cstdlib>

#include "sim/bodies/particle_contacts.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sim/bodies/particle_move.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace sim {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, 16>;
using Ints = hn::RebindToSigned<Floats>;
using F = hn::Vec<Floats>;
using I = hn::Vec<Ints>;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(Floats()));

HWY_INLINE I rounded(F way) {
  const Floats d;
  way = hn::Min(hn::Max(way, hn::Set(d, -kMostParticleWay)), hn::Set(d, kMostParticleWay));
  const F magic = hn::Set(d, kRoundingMagic);
  return hn::Sub(hn::BitCast(Ints(), hn::Add(way, magic)), hn::BitCast(Ints(), magic));
}

HWY_INLINE uint32_t bits_of(hn::Mask<Ints> mask) {
  uint8_t bytes[8] = {};
  hn::StoreMaskBits(Ints(), mask, bytes);
  return static_cast<uint32_t>(bytes[0]) | static_cast<uint32_t>(bytes[1]) << 8;
}

/// All lanes where the mask is set.
HWY_INLINE I as_lanes(hn::Mask<Ints> mask) { return hn::VecFromMask(Ints(), mask); }

/// The bricks from the particles' origin.
struct Bricks {
  const int32_t *codes, *words;
  int32_t offset[3];  // from the bricks' corner to the origin
  int32_t size[3];    // leaves
};

/// Of voxels as seen from the origin: those that are solid, among `asked`.
HWY_INLINE hn::Mask<Ints> solid(const Bricks& b, I x, I y, I z, hn::Mask<Ints> asked) {
  const Ints di;
  x = hn::Add(x, hn::Set(di, b.offset[0])), y = hn::Add(y, hn::Set(di, b.offset[1]));
  z = hn::Add(z, hn::Set(di, b.offset[2]));
  const I zero = hn::Zero(di);
  const I lx = hn::ShiftRight<3>(x), ly = hn::ShiftRight<3>(y), lz = hn::ShiftRight<3>(z);
  const auto within = [&](I leaf, int32_t size) {
    return hn::And(hn::Gt(leaf, hn::Set(di, -1)), hn::Lt(leaf, hn::Set(di, size)));
  };
  const auto inside =
      hn::And(hn::And(asked, within(lx, b.size[0])), hn::And(within(ly, b.size[1]), within(lz, b.size[2])));
  const I leaf = hn::Add(hn::Mul(hn::Add(hn::Mul(lx, hn::Set(di, b.size[2])), lz), hn::Set(di, b.size[1])), ly);
  const I code = hn::And(hn::GatherIndex(di, b.codes, hn::And(leaf, as_lanes(inside))), as_lanes(inside));
  const auto mixed = hn::Lt(code, zero);
  if (hn::AllFalse(di, mixed)) return mixed;
  const auto part = [&](I v, int32_t bits) { return hn::And(v, hn::Set(di, bits)); };
  const I word = hn::Or(hn::Or(hn::ShiftLeft<1>(part(x, 4)), part(y, 6)), hn::ShiftRight<2>(part(z, 4)));
  const I first = hn::And(code, hn::Set(di, static_cast<int32_t>(world::BrickVolume::kFirstWord)));
  const I found = hn::GatherIndex(di, b.words, hn::And(hn::Or(first, word), as_lanes(mixed)));
  const I bit = hn::Or(hn::Or(hn::ShiftLeft<3>(part(x, 3)), hn::ShiftLeft<2>(part(y, 1))), part(z, 3));
  return hn::And(mixed, hn::TestBit(found, hn::Shl(hn::Set(di, 1), bit)));
}

void Move(ParticleBlock& block, const ParticleMotion& motion, const ParticleTerrain& terrain) {
  const Floats d;
  const Ints di;
  // Where nothing is solid no leaf is inside, and what gathers read is never used.
  const int32_t nothing[1] = {};
  Bricks bricks{nothing, nothing, {}, {}};
  if (const world::BrickVolume* volume = terrain.bricks) {
    bricks.codes = reinterpret_cast<const int32_t*>(volume->codes());
    bricks.words = reinterpret_cast<const int32_t*>(volume->words());
    for (int a = 0; a < 3; ++a)
      bricks.offset[a] = terrain.origin[a] - volume->low()[a], bricks.size[a] = volume->leaves_along()[a];
  }
  ParticleProbe probe(terrain);
  const F by_velocity = hn::Set(d, motion.way_by_velocity), kept = hn::Set(d, motion.kept);
  const I furthest = hn::Set(di, kParticleDomain);
  for (int i = 0; i < block.count; i += kLanes) {
    I from[3], to[3], voxel[3];
    hn::Mask<Ints> crosses[3];
    for (int a = 0; a < 3; ++a) {
      const F v = hn::Load(d, block.velocity[a] + i);
      const I way = rounded(hn::Add(hn::Mul(by_velocity, v), hn::Set(d, motion.way[a])));
      hn::Store(hn::Add(hn::Mul(kept, v), hn::Set(d, motion.gained[a])), d, block.velocity[a] + i);
      from[a] = hn::Load(di, block.at[a] + i), to[a] = hn::Add(from[a], way);
      voxel[a] = hn::ShiftRight<kParticleFixedLog2>(to[a]);
      crosses[a] = hn::Ne(voxel[a], hn::ShiftRight<kParticleFixedLog2>(from[a]));
    }
    const auto any = hn::Or(crosses[0], hn::Or(crosses[1], crosses[2]));
    uint32_t alone = 0;
    if (!hn::AllFalse(di, any)) {
      // Look at the new voxel; let corners, hits and what leaves the domain go by axes.
      auto slow = hn::Or(hn::And(crosses[0], crosses[1]), hn::And(hn::Or(crosses[0], crosses[1]), crosses[2]));
      for (int a = 0; a < 3; ++a) slow = hn::Or(slow, hn::And(any, hn::Gt(hn::Abs(voxel[a]), furthest)));
      slow = hn::Or(slow, solid(bricks, voxel[0], voxel[1], voxel[2], hn::AndNot(slow, any)));
      alone = bits_of(slow);
    }
    if (alone == 0) {
      for (int a = 0; a < 3; ++a) hn::Store(to[a], di, block.at[a] + i);
      continue;
    }
    alignas(64) int32_t ways[3][kLanes], starts[3][kLanes];
    for (int a = 0; a < 3; ++a) {
      hn::Store(to[a], di, block.at[a] + i);
      hn::Store(from[a], di, starts[a]);
      hn::Store(hn::Sub(to[a], from[a]), di, ways[a]);
    }
    for (; alone != 0; alone &= alone - 1) {
      const int lane = __builtin_ctz(alone);
      if (i + lane >= block.count) break;
      const int32_t way[3] = {ways[0][lane], ways[1][lane], ways[2][lane]};
      for (int a = 0; a < 3; ++a) block.at[a][i + lane] = starts[a][lane];
      go_by_axes(block, i + lane, way, motion, probe);
    }
  }
}

bool Age(ParticleBlock& block) {
  const hn::CappedTag<uint16_t, 32> d;
  const auto one = hn::Set(d, static_cast<uint16_t>(1));
  auto fewest = hn::Set(d, static_cast<uint16_t>(0xffff));
  int i = 0;
  const int lanes = static_cast<int>(hn::Lanes(d));
  for (; i + lanes <= block.count; i += lanes) {
    const auto left = hn::SaturatedSub(hn::Load(d, block.ticks_left + i), one);
    hn::Store(left, d, block.ticks_left + i);
    fewest = hn::Min(fewest, left);
  }
  bool ended = !hn::AllFalse(d, hn::Eq(fewest, hn::Zero(d)));
  for (; i < block.count; ++i) {
    block.ticks_left[i] = static_cast<uint16_t>(block.ticks_left[i] - (block.ticks_left[i] > 0 ? 1 : 0));
    ended |= block.ticks_left[i] == 0;
  }
  return ended;
}

}  // namespace HWY_NAMESPACE
}  // namespace sim
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sim {

namespace {
HWY_EXPORT(Move);
HWY_EXPORT(Age);
}  // namespace

void move_particles(ParticleBlock& block, const ParticleMotion& motion, const ParticleTerrain& terrain) {
  // Far from the bricks their offsets would overflow; wide worlds have none.
  bool near = terrain.bricks || terrain.mask->empty();
  if (terrain.bricks)
    for (int a = 0; a < 3; ++a)
      near = near && std::abs(int64_t{terrain.origin[a]} - terrain.bricks->low()[a]) < (int64_t{1} << 30);
  if (!near) return move_particles_plain(block, motion, terrain);
  HWY_DYNAMIC_DISPATCH(Move)(block, motion, terrain);
}

bool age_particles(ParticleBlock& block) { return HWY_DYNAMIC_DISPATCH(Age)(block); }

}  // namespace sim
#endif
