#include "world/store/ray_stream.h"

#include <algorithm>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "world/store/ray_stream.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#ifndef LOAM_RAY_STREAM_ONCE
#define LOAM_RAY_STREAM_ONCE

namespace world {

constexpr size_t kBatch = 128;

/// What kernels read of a BrickVolume.
struct BrickView {
  const int32_t *codes, *words;
  int32_t leaves_y, leaves_z;
  int32_t first[3], last[3];  // voxels that may hold anything, from the corner of the bounds
};

/// Rays made ready, each in a space mirrored so that it runs upwards on each axis: there a cell c is c ^ flip. Cells
/// count from the low corner of the bounds. Directions are scaled so that their largest component is 1.
struct alignas(64) StreamRays {
  // As given: fraction, direction, largest t in lengths of the direction, start voxel.
  float fraction[3][kBatch], direction[3][kBatch], t_max[kBatch];
  int32_t voxel[3][kBatch];
  // Made of it; `beyond` is (1 - origin) * inverse.
  float origin[3][kBatch], along[3][kBatch], inverse[3][kBatch], beyond[3][kBatch], t_limit[kBatch];
  int32_t base[3][kBatch], cell[3][kBatch], flip[3][kBatch], last[3][kBatch], axis[kBatch];
  uint8_t state[kBatch];  // a RayState
};

enum RayState : uint8_t { kWalks = 0, kHit = 1, kMissed = 2, kUnsure = 3 };

}  // namespace world
#endif

HWY_BEFORE_NAMESPACE();
namespace world {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, 16>;
using Ints = hn::RebindToSigned<Floats>;
using F = hn::Vec<Floats>;
using I = hn::Vec<Ints>;

constexpr size_t kMostLanes = 16;

HWY_INLINE uint32_t bits_of(Ints d, hn::Mask<Ints> mask) {
  uint8_t bytes[8] = {};
  hn::StoreMaskBits(d, mask, bytes);
  return static_cast<uint32_t>(bytes[0]) | static_cast<uint32_t>(bytes[1]) << 8;
}

/// Where a crossing at t leads along one axis: the cell, and how far from the middle of it.
HWY_INLINE I cell_at(F t, F origin, F along, I base, F& off_middle) {
  const Floats df;
  const F position = hn::MulAdd(t, along, hn::Sub(origin, hn::Set(df, 0.5f)));
  const I whole = hn::NearestInt(position);
  off_middle = hn::Abs(hn::Sub(position, hn::ConvertTo(df, whole)));
  return hn::Add(base, whole);
}

/// How far off the middle is still sure after a crossing at t of a plane of an axis with this inverse direction.
HWY_INLINE F sure_distance(F t, F inverse) {
  const Floats df;
  return hn::MulAdd(t, hn::Set(df, -0x1p-20f),
                    hn::MulAdd(inverse, hn::Set(df, -0x1p-23f), hn::Set(df, 0.5f - 0x1p-21f)));
}

/// Mirrors, scales and inverts rays [0, count); sorts out those that must be walked in double and those that meet
/// nothing. Where start_axis >= 0, moves them to where they cross that plane (counted from the corner of the bounds).
void prepare(const BrickView& bricks, StreamRays& rays, size_t count, int start_axis, int32_t start_plane) {
  const Floats df;
  const Ints di;
  const size_t width = hn::Lanes(df);
  const F zero = hn::Zero(df), one = hn::Set(df, 1.0f);
  for (size_t at = 0; at < count; at += width) {
    F d[3];
    for (int a = 0; a < 3; ++a) d[a] = hn::Load(df, rays.direction[a] + at);
    const F largest = hn::Max(hn::Max(hn::Abs(d[0]), hn::Abs(d[1])), hn::Abs(d[2]));
    const F scale = hn::Div(one, largest);
    const F t_max = hn::Load(df, rays.t_max + at);
    // Directions beyond what a float holds well, NaN among them, are for the exact walk.
    auto fine = hn::And(hn::Gt(largest, hn::Set(df, 0x1p-60f)), hn::Lt(largest, hn::Set(df, 0x1p60f)));
    fine = hn::And(fine, hn::Ge(t_max, zero));
    auto none = hn::Lt(zero, zero);
    for (int a = 0; a < 3; ++a) {
      const auto down = hn::Lt(d[a], zero);
      const I flip = hn::IfThenElseZero(hn::RebindMask(di, down), hn::Set(di, -1));
      const F fraction = hn::Load(df, rays.fraction[a] + at);
      const F origin = hn::IfThenElse(down, hn::Sub(one, fraction), fraction);
      const F along = hn::Mul(hn::Abs(d[a]), scale);
      const auto steps = hn::Gt(along, hn::Set(df, 0x1p-40f));
      const F inverse = hn::IfThenElseZero(steps, hn::Div(one, along));
      const F left = hn::Sub(one, origin);
      const I voxel = hn::Load(di, rays.voxel[a] + at);
      const I base = hn::Xor(voxel, flip);
      const I last =
          hn::IfThenElse(hn::RebindMask(di, down), hn::Not(hn::Set(di, bricks.first[a])), hn::Set(di, bricks.last[a]));
      // A tiny component that isn't zero, and a start on the far plane of an axis that never steps.
      fine = hn::And(fine, hn::Or(steps, hn::And(hn::Eq(along, zero), hn::Gt(left, hn::Set(df, 0x1p-20f)))));
      fine = hn::And(fine, hn::And(hn::Ge(origin, zero), hn::Le(origin, one)));
      none = hn::Or(none, hn::RebindMask(df, hn::Gt(base, last)));
      hn::Store(origin, df, rays.origin[a] + at);
      hn::Store(along, df, rays.along[a] + at);
      hn::Store(inverse, df, rays.inverse[a] + at);
      hn::Store(hn::IfThenElse(steps, hn::Mul(left, inverse), hn::Set(df, 0x1p120f)), df, rays.beyond[a] + at);
      hn::Store(base, di, rays.base[a] + at);
      hn::Store(base, di, rays.cell[a] + at);
      hn::Store(flip, di, rays.flip[a] + at);
      hn::Store(last, di, rays.last[a] + at);
    }
    // A little more than t_max: what is met beyond it is taken back in double.
    const F t_limit = hn::MulAdd(hn::Mul(t_max, largest), hn::Set(df, 1 + 0x1p-18f), hn::Set(df, 0x1p-18f));
    hn::Store(hn::Min(t_limit, hn::Set(df, 0x1p100f)), df, rays.t_limit + at);
    I axis = hn::Set(di, -1);
    if (start_axis >= 0) {
      const int a = start_axis, b = a == 0 ? 1 : 0, c = a == 2 ? 1 : 2;
      const I flip = hn::Load(di, rays.flip[a] + at), base = hn::Load(di, rays.base[a] + at);
      // The last cell before the plane.
      const I before = hn::Xor(hn::Sub(hn::Set(di, start_plane), hn::Add(hn::Set(di, 1), flip)), flip);
      const F inverse = hn::Load(df, rays.inverse[a] + at);
      const F t = hn::MulAdd(hn::ConvertTo(df, hn::Sub(before, base)), inverse, hn::Load(df, rays.beyond[a] + at));
      const auto ahead = hn::AndNot(hn::Lt(before, base), hn::RebindMask(di, hn::Gt(inverse, zero)));
      F off[2];
      const int other[2] = {b, c};
      for (int k = 0; k < 2; ++k) {
        const int o = other[k];
        const I moved = cell_at(t, hn::Load(df, rays.origin[o] + at), hn::Load(df, rays.along[o] + at),
                                hn::Load(di, rays.base[o] + at), off[k]);
        const I cell = hn::IfThenElse(ahead, moved, hn::Load(di, rays.cell[o] + at));
        none = hn::Or(none, hn::RebindMask(df, hn::Gt(cell, hn::Load(di, rays.last[o] + at))));
        hn::Store(cell, di, rays.cell[o] + at);
      }
      const I cell = hn::IfThenElse(ahead, hn::Add(before, hn::Set(di, 1)), base);
      none = hn::Or(none, hn::RebindMask(df, hn::Gt(cell, hn::Load(di, rays.last[a] + at))));
      none = hn::Or(none, hn::And(hn::RebindMask(df, ahead), hn::Ge(t, hn::Load(df, rays.t_limit + at))));
      hn::Store(cell, di, rays.cell[a] + at);
      axis = hn::IfThenElse(ahead, hn::Set(di, a), axis);
      const auto sure = hn::Lt(hn::Max(off[0], off[1]), sure_distance(t, inverse));
      fine = hn::And(fine, hn::Or(sure, hn::Not(hn::RebindMask(df, ahead))));
    }
    hn::Store(axis, di, rays.axis + at);
    const uint32_t fine_bits = bits_of(di, hn::RebindMask(di, fine)), none_bits = bits_of(di, hn::RebindMask(di, none));
    for (size_t lane = 0; lane < width; ++lane) {
      const bool is_fine = fine_bits >> lane & 1, is_none = none_bits >> lane & 1;
      rays.state[at + lane] = !is_fine ? kUnsure : is_none ? kMissed : kWalks;
    }
  }
}

/// The state of one vector of lanes. In memory: there are more values than registers, and refilling writes single
/// lanes. Cells have two places, of which a step reads one and writes the other, so that the last cell of a ray that
/// ended is still there.
struct alignas(64) Lanes {
  float origin[3][kMostLanes], along[3][kMostLanes], inverse[3][kMostLanes], beyond[3][kMostLanes];
  int32_t base[3][kMostLanes], flip[3][kMostLanes], last[3][kMostLanes];
  float t_limit[kMostLanes];
  int32_t cell[2][3][kMostLanes], axis[2][kMostLanes];
  uint32_t ray[kMostLanes];
};

struct Ended {
  uint32_t any, hit, missed;
};

constexpr uint32_t kNoRay = 0xffffffffu;

HWY_INLINE I gather(const int32_t* from, I index) {
  const Ints di;
#if HWY_TARGET == HWY_AVX2
  // Faster than the instruction on several processors, and never much slower.
  alignas(32) int32_t at[8];
  hn::Store(index, di, at);
  const __m128i low = _mm_set_epi32(from[at[3]], from[at[2]], from[at[1]], from[at[0]]);
  const __m128i high = _mm_set_epi32(from[at[7]], from[at[6]], from[at[5]], from[at[4]]);
  return I{_mm256_set_m128i(high, low)};
#else
  return hn::GatherIndex(di, from, index);
#endif
}

/// One step of every lane, from cell[from] to cell[1 - from].
HWY_INLINE Ended step(const BrickView& bricks, Lanes& lanes, int from) {
  const Floats df;
  const Ints di;
  const hn::RebindToUnsigned<Ints> du;
  const I one = hn::Set(di, 1), three = hn::Set(di, 3);
  const I cx = hn::Load(di, lanes.cell[from][0]), cy = hn::Load(di, lanes.cell[from][1]),
          cz = hn::Load(di, lanes.cell[from][2]);
  const I gx = hn::Xor(cx, hn::Load(di, lanes.flip[0])), gy = hn::Xor(cy, hn::Load(di, lanes.flip[1])),
          gz = hn::Xor(cz, hn::Load(di, lanes.flip[2]));

  const I leaf =
      hn::Add(hn::Mul(hn::Add(hn::Mul(hn::ShiftRight<3>(gx), hn::Set(di, bricks.leaves_z)), hn::ShiftRight<3>(gz)),
                      hn::Set(di, bricks.leaves_y)),
              hn::ShiftRight<3>(gy));
  const I code = gather(bricks.codes, leaf);
  // Of an empty leaf too: its code is the index of some word, whose bits are not looked at.
  const I word_in_leaf = hn::Or(hn::ShiftLeft<1>(hn::And(gx, hn::Set(di, 4))),
                                hn::Or(hn::And(gy, hn::Set(di, 6)), hn::ShiftRight<2>(hn::And(gz, hn::Set(di, 4)))));
  const I word =
      gather(bricks.words, hn::Or(hn::And(code, hn::Set(di, int32_t(BrickVolume::kFirstWord))), word_in_leaf));
  const I bit =
      hn::Or(hn::ShiftLeft<3>(hn::And(gx, three)), hn::Or(hn::ShiftLeft<2>(hn::And(gy, one)), hn::And(gz, three)));
  const auto shifted = [&](I by) { return hn::BitCast(di, hn::Shr(hn::BitCast(du, word), hn::BitCast(du, by))); };
  const auto mixed = hn::Lt(code, hn::Zero(di));
  const auto hit = hn::Lt(hn::And(hn::ShiftLeft<31>(shifted(bit)), code), hn::Zero(di));

  // One less than the sides of the empty block around: powers of two.
  const I pair = hn::IfThenElseZero(
      hn::Eq(hn::And(shifted(hn::And(bit, hn::Set(di, 18))), hn::Set(di, 0x3333)), hn::Zero(di)), one);
  const I half = hn::IfThenElseZero(hn::Eq(word, hn::Zero(di)), three);
  const I my = hn::IfThenElse(mixed, pair, code), mxz = hn::IfThenElse(mixed, hn::Or(pair, half), code);
  const I lx = hn::Or(cx, mxz), ly = hn::Or(cy, my), lz = hn::Or(cz, mxz);

  // Its far planes, and which is crossed first.
  const I bx = hn::Load(di, lanes.base[0]), by = hn::Load(di, lanes.base[1]), bz = hn::Load(di, lanes.base[2]);
  const F ix = hn::Load(df, lanes.inverse[0]), iy = hn::Load(df, lanes.inverse[1]), iz = hn::Load(df, lanes.inverse[2]);
  const F tx = hn::MulAdd(hn::ConvertTo(df, hn::Sub(lx, bx)), ix, hn::Load(df, lanes.beyond[0]));
  const F ty = hn::MulAdd(hn::ConvertTo(df, hn::Sub(ly, by)), iy, hn::Load(df, lanes.beyond[1]));
  const F tz = hn::MulAdd(hn::ConvertTo(df, hn::Sub(lz, bz)), iz, hn::Load(df, lanes.beyond[2]));
  const F t = hn::Min(hn::Min(tx, ty), tz);
  const auto on_x = hn::Eq(tx, t);
  const auto on_y = hn::AndNot(on_x, hn::Eq(ty, t));
  const auto on_xy = hn::Or(on_x, on_y);

  // Where that is on the other axes, and whether it is sure.
  const F inverse = hn::IfThenElse(on_x, ix, hn::IfThenElse(on_y, iy, iz));
  F off_x, off_y, off_z;
  const I wx = cell_at(t, hn::Load(df, lanes.origin[0]), hn::Load(df, lanes.along[0]), bx, off_x);
  const I wy = cell_at(t, hn::Load(df, lanes.origin[1]), hn::Load(df, lanes.along[1]), by, off_y);
  const I wz = cell_at(t, hn::Load(df, lanes.origin[2]), hn::Load(df, lanes.along[2]), bz, off_z);
  const F off = hn::Max(hn::Max(hn::IfThenZeroElse(on_x, off_x), hn::IfThenZeroElse(on_y, off_y)),
                        hn::IfThenElseZero(on_xy, off_z));
  const auto unsure = hn::Not(hn::Lt(off, sure_distance(t, inverse)));
  // On the axis of the plane the nearest whole number may be the cell before it, never less.
  const auto minus = [&](hn::Mask<Floats> m) { return hn::VecFromMask(di, hn::RebindMask(di, m)); };
  const I nx = hn::Sub(hn::Min(wx, lx), minus(on_x)), ny = hn::Sub(hn::Min(wy, ly), minus(on_y)),
          nz = hn::Sub(hn::Min(wz, lz), hn::Not(minus(on_xy)));
  const auto left = hn::Or(hn::Gt(nx, hn::Load(di, lanes.last[0])),
                           hn::Or(hn::Gt(ny, hn::Load(di, lanes.last[1])), hn::Gt(nz, hn::Load(di, lanes.last[2]))));
  const auto missed = hn::Or(left, hn::RebindMask(di, hn::Ge(t, hn::Load(df, lanes.t_limit))));

  hn::Store(nx, di, lanes.cell[1 - from][0]);
  hn::Store(ny, di, lanes.cell[1 - from][1]);
  hn::Store(nz, di, lanes.cell[1 - from][2]);
  hn::Store(hn::AndNot(minus(on_x), hn::Add(hn::Set(di, 2), minus(on_y))), di, lanes.axis[1 - from]);
  Ended ended;
  ended.hit = bits_of(di, hit);
  ended.missed = bits_of(di, missed);
  ended.any = ended.hit | ended.missed | bits_of(di, hn::RebindMask(di, unsure));
  return ended;
}

/// Walks all rays whose state is kWalks to their ends: state, cell and axis are what they come to.
uint64_t walk(const BrickView& bricks, StreamRays& rays, size_t count) {
  const size_t width = hn::Lanes(Ints());
  Lanes group[2];
  size_t next = 0, active = 0;
  const auto next_ray = [&] {
    while (next < count && rays.state[next] != kWalks) ++next;
    return next < count ? static_cast<uint32_t>(next++) : kNoRay;
  };
  const auto put = [&](Lanes& lanes, size_t lane, int to, uint32_t ray) {
    lanes.ray[lane] = ray;
    for (int a = 0; a < 3; ++a) {
      lanes.origin[a][lane] = rays.origin[a][ray];
      lanes.along[a][lane] = rays.along[a][ray];
      lanes.inverse[a][lane] = rays.inverse[a][ray];
      lanes.beyond[a][lane] = rays.beyond[a][ray];
      lanes.base[a][lane] = rays.base[a][ray];
      lanes.flip[a][lane] = rays.flip[a][ray];
      lanes.last[a][lane] = rays.last[a][ray];
      lanes.cell[to][a][lane] = rays.cell[a][ray];
    }
    lanes.t_limit[lane] = rays.t_limit[ray];
    lanes.axis[to][lane] = rays.axis[ray];
  };
  // A lane without a ray stands in the first cell and misses at each step.
  const auto rest = [&](Lanes& lanes, size_t lane, int to) {
    for (int a = 0; a < 3; ++a) lanes.cell[to][a][lane] = 0, lanes.flip[a][lane] = 0;
    lanes.t_limit[lane] = -std::numeric_limits<float>::infinity();
    lanes.ray[lane] = kNoRay;
  };
  for (Lanes& lanes : group)
    for (size_t lane = 0; lane < width; ++lane) {
      const uint32_t ray = next_ray();
      for (int a = 0; a < 3; ++a) {
        lanes.origin[a][lane] = lanes.along[a][lane] = lanes.inverse[a][lane] = lanes.beyond[a][lane] = 0;
        lanes.base[a][lane] = lanes.last[a][lane] = 0;
      }
      if (ray == kNoRay)
        rest(lanes, lane, 0);
      else
        put(lanes, lane, 0, ray), ++active;
    }
  uint64_t steps = 0;
  int from = 0;
  const auto refill = [&](Lanes& lanes, const Ended& ended) {
    for (uint32_t left = ended.any; left; left &= left - 1) {
      const size_t lane = static_cast<size_t>(std::countr_zero(left));
      const uint32_t ray = lanes.ray[lane];
      if (ray != kNoRay) {
        for (int a = 0; a < 3; ++a) rays.cell[a][ray] = lanes.cell[from][a][lane];
        rays.axis[ray] = lanes.axis[from][lane];
        rays.state[ray] = ended.hit >> lane & 1 ? kHit : ended.missed >> lane & 1 ? kMissed : kUnsure;
        const uint32_t fresh = next_ray();
        if (fresh != kNoRay) {
          put(lanes, lane, 1 - from, fresh);
          continue;
        }
        --active;
      }
      rest(lanes, lane, 1 - from);
    }
  };
  while (active) {
    const Ended first = step(bricks, group[0], from);
    const Ended second = step(bricks, group[1], from);
    steps += 2;
    if (first.any) refill(group[0], first);
    if (second.any) refill(group[1], second);
    from = 1 - from;
  }
  return steps;
}

}  // namespace HWY_NAMESPACE
}  // namespace world
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace world {

namespace {

HWY_EXPORT(prepare);
HWY_EXPORT(walk);

}  // namespace

RayStream::RayStream(const MaskVolume& volume) : volume_(&volume), bricks_(volume), walker_(volume) {}

void RayStream::update(std::span<const LeafPos> dirty) {
  for (const LeafPos& leaf : dirty) bricks_.update(*volume_, leaf);
  walker_ = MaskWalker(*volume_);
}

void RayStream::first_set(std::span<const GridRay> rays, std::span<GridHit> hits, StreamStart start,
                          StreamReport* report) const {
  StreamReport done;
  done.rays = rays.size();
  if (!bricks_.walkable()) {
    for (size_t i = 0; i < rays.size(); ++i) hits[i] = walker_.first_set(rays[i]);
    done.exact = rays.size();
    if (report) report->add(done);
    return;
  }
  const VoxelPos low = bricks_.low();
  BrickView view{reinterpret_cast<const int32_t*>(bricks_.codes()),
                 reinterpret_cast<const int32_t*>(bricks_.words()),
                 bricks_.leaves_along()[1],
                 bricks_.leaves_along()[2],
                 {},
                 {}};
  for (int a = 0; a < 3; ++a) {
    view.first[a] = bricks_.content().min[a] - low[a];
    view.last[a] = bricks_.content().max[a] - low[a];
  }
  StreamRays batch;
  for (size_t begin = 0; begin < rays.size(); begin += kBatch) {
    const size_t count = std::min(kBatch, rays.size() - begin);
    for (size_t i = 0; i < count; ++i) {
      const GridRay& ray = rays[begin + i];
      for (int a = 0; a < 3; ++a) {
        batch.fraction[a][i] = static_cast<float>(ray.fraction[a]);
        batch.direction[a][i] = static_cast<float>(ray.direction[a]);
        batch.voxel[a][i] = ray.voxel[a] - low[a];
      }
      batch.t_max[i] = static_cast<float>(ray.t_max);
    }
    for (size_t i = count; i < ((count + 15) & ~size_t{15}); ++i)
      for (int a = 0; a < 3; ++a)
        batch.fraction[a][i] = batch.direction[a][i] = 0, batch.voxel[a][i] = 0, batch.t_max[i] = 0;
    HWY_DYNAMIC_DISPATCH(prepare)(view, batch, count, start.axis, start.axis < 0 ? 0 : start.plane - low[start.axis]);
    for (size_t i = 0; i < count; ++i)
      for (int a = 0; a < 3; ++a)
        if (static_cast<uint32_t>(batch.cell[a][i] ^ batch.flip[a][i]) >=
            static_cast<uint32_t>(bricks_.leaves_along()[a] * kLeafSize))
          batch.state[i] = kUnsure;
    done.steps += HWY_DYNAMIC_DISPATCH(walk)(view, batch, count);
    for (size_t i = 0; i < count; ++i) {
      const GridRay& ray = rays[begin + i];
      GridHit& hit = hits[begin + i];
      if (batch.state[i] == kHit) {
        const int axis = batch.axis[i];
        const VoxelPos v = VoxelPos{batch.cell[0][i] ^ batch.flip[0][i], batch.cell[1][i] ^ batch.flip[1][i],
                                    batch.cell[2][i] ^ batch.flip[2][i]} +
                           low;
        if (axis < 0) {
          hit = {WalkEnd::hit, v, kNoFace, 0};
          continue;
        }
        const bool up = batch.flip[axis][i] == 0;
        const int32_t plane = v[axis] + (up ? 0 : 1);
        const double t =
            (static_cast<double>(plane - ray.voxel[axis]) - ray.fraction[axis]) * (1 / ray.direction[axis]);
        if (t <= ray.t_max)
          hit = {WalkEnd::hit, v, entered_face(axis, up), t};
        else
          hit = {WalkEnd::t_max, {}, kNoFace, ray.t_max};
      } else if (batch.state[i] == kMissed) {
        hit = {WalkEnd::t_max, {}, kNoFace, ray.t_max};
      } else {
        hit = walker_.first_set(ray);
        ++done.exact;
      }
    }
  }
  if (report) report->add(done);
}

void RayStream::any_set(std::span<const GridRay> rays, std::span<uint8_t> blocked, StreamReport* report) const {
  GridHit hits[kBatch];
  for (size_t begin = 0; begin < rays.size(); begin += kBatch) {
    const size_t count = std::min(kBatch, rays.size() - begin);
    first_set(rays.subspan(begin, count), std::span(hits, count), {}, report);
    for (size_t i = 0; i < count; ++i) blocked[begin + i] = hits[i].hit();
  }
}

}  // namespace world
#endif
