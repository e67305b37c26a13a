#include "world/store/ray_stream.h"

#include <algorithm>
#include <limits>

#include "world/store/parallel_rays.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "world/store/ray_stream.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "world/store/ray_lanes-inl.h"

#ifndef LOAM_RAY_STREAM_ONCE
#define LOAM_RAY_STREAM_ONCE

namespace world {

constexpr size_t kChunk = 64;    // rays made ready at a time
constexpr size_t kSlice = 4096;  // rays between two looks at what must be walked in double

/// What kernels read of a BrickVolume.
struct BrickView {
  const int32_t *codes, *words;
  int32_t leaves_y, leaves_z;
  int32_t first[3], last[3];  // voxels that may hold anything, from the corner of the bounds
  int32_t size[3];            // voxels of the bounds
  VoxelPos low;               // corner of the bounds
};

/// A few rays made ready, each in a space mirrored so that it runs upwards on each axis: there a cell c is c ^ flip.
/// Cells count from the low corner of the bounds. Directions are scaled so that their largest component is 1.
struct alignas(64) StreamRays {
  // As given: fraction, direction, largest t in lengths of the direction, start voxel.
  float fraction[3][kChunk], direction[3][kChunk], t_max[kChunk];
  int32_t voxel[3][kChunk];
  // Made of it; `beyond` is (1 - origin) * inverse.
  float origin[3][kChunk], along[3][kChunk], inverse[3][kChunk], beyond[3][kChunk], t_limit[kChunk];
  int32_t base[3][kChunk], flip[3][kChunk], last[3][kChunk];
  uint64_t walks, unsure;  // a bit a ray; what is neither meets nothing
};

}  // namespace world
#endif

HWY_BEFORE_NAMESPACE();
namespace world {
namespace HWY_NAMESPACE {

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

/// What is given of rays [0, count), at most kChunk; those after them repeat the last.
template <class Ray>
HWY_INLINE void load_chunk(const BrickView& bricks, const Ray* rays, size_t count, StreamRays& to) {
  const Ints di;
  size_t at = 0;
  if constexpr (std::is_same_v<Ray, StreamRay>) {
    static_assert(sizeof(StreamRay) == 40);  // voxel, fraction, direction, t_max
    for (const size_t width = hn::Lanes(di); at + width <= count; at += width) {
      I low[8], high[8];
      load_transposed(rays + at, 0, low), load_transposed(rays + at, 2, high);
      for (int a = 0; a < 3; ++a) {
        hn::Store(hn::Sub(low[a], hn::Set(di, (&bricks.low.x)[a])), di, to.voxel[a] + at);
        hn::Store(hn::BitCast(Floats(), low[3 + a]), Floats(), to.fraction[a] + at);
        hn::Store(hn::BitCast(Floats(), high[4 + a]), Floats(), to.direction[a] + at);
      }
      hn::Store(hn::BitCast(Floats(), high[7]), Floats(), to.t_max + at);
    }
  }
  for (; at < kChunk; ++at) {
    const Ray& ray = rays[std::min(at, count - 1)];
    for (int a = 0; a < 3; ++a) {
      to.fraction[a][at] = static_cast<float>((&ray.fraction.x)[a]);
      to.direction[a][at] = static_cast<float>((&ray.direction.x)[a]);
      to.voxel[a][at] = (&ray.voxel.x)[a] - (&bricks.low.x)[a];
    }
    to.t_max[at] = static_cast<float>(ray.t_max);
  }
}

/// Mirrors, scales and inverts rays [0, count); sorts out those that must be walked in double and those that meet
/// nothing.
HWY_INLINE void prepare(const BrickView& bricks, StreamRays& rays, size_t count) {
  rays.walks = rays.unsure = 0;
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
      hn::Store(flip, di, rays.flip[a] + at);
      hn::Store(last, di, rays.last[a] + at);
    }
    // A little more than t_max: what is met beyond it is taken back in double.
    const F t_limit = hn::MulAdd(hn::Mul(t_max, largest), hn::Set(df, 1 + 0x1p-18f), hn::Set(df, 0x1p-18f));
    hn::Store(hn::Min(t_limit, hn::Set(df, 0x1p100f)), df, rays.t_limit + at);
    // Codes cover the bounds and no more.
    for (int a = 0; a < 3; ++a) {
      const I cell = hn::Xor(hn::Load(di, rays.base[a] + at), hn::Load(di, rays.flip[a] + at));
      const auto outside = hn::Or(hn::Lt(cell, hn::Zero(di)), hn::Not(hn::Lt(cell, hn::Set(di, bricks.size[a]))));
      fine = hn::And(fine, hn::Not(hn::RebindMask(df, outside)));
    }
    rays.walks |= uint64_t{bits_of(di, hn::RebindMask(di, hn::AndNot(none, fine)))} << at;
    rays.unsure |= uint64_t{bits_of(di, hn::RebindMask(di, hn::Not(fine)))} << at;
  }
  const uint64_t given = count == 64 ? ~0ull : (1ull << count) - 1;
  rays.walks &= given, rays.unsure &= given;
}

/// The state of one vector of lanes. In memory: there are more values than registers, and refilling writes single
/// lanes. Cells have two places, of which a step reads one and writes the other, so that the last cell of a ray that
/// ended is still there.
struct alignas(64) Lanes {
  float origin[3][kMostLanes], along[3][kMostLanes], inverse[3][kMostLanes], beyond[3][kMostLanes];
  int32_t base[3][kMostLanes], flip[3][kMostLanes], last[3][kMostLanes];
  int32_t upwards[kMostLanes];  // the bits of a column's side where the ray doesn't go down, else 0
  float t_limit[kMostLanes];
  int32_t cell[2][3][kMostLanes], axis[2][kMostLanes];
  // Of the cells to step from: the same not mirrored, the place of its leaf's code, the code, the place of its word.
  int32_t grid[3][kMostLanes], leaf[kMostLanes], code[kMostLanes], word[kMostLanes];
  uint32_t ray[kMostLanes];
};

struct Ended {
  uint32_t any, hit, missed;
};

constexpr uint32_t kNoRay = 0xffffffffu;

/// The codes of all lanes, and where their words lie: asked for now, needed when the other groups have had their turn.
HWY_INLINE void look_up(const BrickView& bricks, Lanes& lanes) {
  const Ints di;
  const I gx = hn::Load(di, lanes.grid[0]), gy = hn::Load(di, lanes.grid[1]), gz = hn::Load(di, lanes.grid[2]);
  const I code = gather(bricks.codes, lanes.leaf);
  const I word_in_leaf = hn::Or(hn::ShiftLeft<1>(hn::And(gx, hn::Set(di, 4))),
                                hn::Or(hn::And(gy, hn::Set(di, 6)), hn::ShiftRight<2>(hn::And(gz, hn::Set(di, 4)))));
  hn::Store(code, di, lanes.code);
  hn::Store(word_index(code, word_in_leaf), di, lanes.word);
#pragma GCC unroll 16
  for (size_t lane = 0; lane < hn::Lanes(di); ++lane) __builtin_prefetch(bricks.words + lanes.word[lane]);
}

/// Where the codes of the lanes' cells lie.
HWY_INLINE void find_leaves(const BrickView& bricks, Lanes& lanes, int from) {
  const Ints di;
  const I gx = hn::Xor(hn::Load(di, lanes.cell[from][0]), hn::Load(di, lanes.flip[0]));
  const I gy = hn::Xor(hn::Load(di, lanes.cell[from][1]), hn::Load(di, lanes.flip[1]));
  const I gz = hn::Xor(hn::Load(di, lanes.cell[from][2]), hn::Load(di, lanes.flip[2]));
  hn::Store(gx, di, lanes.grid[0]), hn::Store(gy, di, lanes.grid[1]), hn::Store(gz, di, lanes.grid[2]);
  const I column = hn::Add(hn::Mul(hn::ShiftRight<3>(gx), hn::Set(di, bricks.leaves_z)), hn::ShiftRight<3>(gz));
  hn::Store(hn::Add(hn::Mul(column, hn::Set(di, bricks.leaves_y)), hn::ShiftRight<3>(gy)), di, lanes.leaf);
#pragma GCC unroll 16
  for (size_t lane = 0; lane < hn::Lanes(di); ++lane) __builtin_prefetch(bricks.codes + lanes.leaf[lane]);
}

/// One step of every lane, from cell[from] to cell[1 - from].
HWY_INLINE Ended step(const BrickView& bricks, Lanes& lanes, int from) {
  const Floats df;
  const Ints di;
  const hn::RebindToUnsigned<Ints> du;
  const I one = hn::Set(di, 1), three = hn::Set(di, 3);
  const I cx = hn::Load(di, lanes.cell[from][0]), cy = hn::Load(di, lanes.cell[from][1]),
          cz = hn::Load(di, lanes.cell[from][2]);
  const I gx = hn::Load(di, lanes.grid[0]), gy = hn::Load(di, lanes.grid[1]), gz = hn::Load(di, lanes.grid[2]);
  const I code = hn::Load(di, lanes.code), word = gather(bricks.words, lanes.word);
  const I bit =
      hn::Or(hn::ShiftLeft<3>(hn::And(gx, three)), hn::Or(hn::ShiftLeft<2>(hn::And(gy, one)), hn::And(gz, three)));
  const auto shifted = [&](I by) { return hn::BitCast(di, hn::Shr(hn::BitCast(du, word), hn::BitCast(du, by))); };
  const auto mixed = hn::Lt(code, hn::Zero(di));
  const auto hit = hn::Lt(hn::And(hn::ShiftLeft<31>(shifted(bit)), code), hn::Zero(di));

  // One less than the sides of the empty block around: powers of two.
  const I pair = hn::IfThenElseZero(
      hn::Eq(hn::And(shifted(hn::And(bit, hn::Set(di, 18))), hn::Set(di, 0x3333)), hn::Zero(di)), one);
  const I half = hn::IfThenElseZero(hn::Eq(word, hn::Zero(di)), one);
  const I side = hn::And(code, hn::Set(di, int32_t(BrickVolume::kSide)));
  // Of rays upwards, the column of air around, if any; it has no far plane along y but the end of all. Bits of the
  // code that mean something else are no column: a mixed leaf's are negative, those of a cube no cap.
  const I upwards = hn::Load(di, lanes.upwards), seven = hn::Set(di, 7);
  const I cap = hn::Xor(hn::And(hn::And(code, upwards), hn::Set(di, int32_t(BrickVolume::kCap))),
                        hn::Set(di, int32_t(BrickVolume::kCapped)));
  const auto above_cap = hn::AndNot(hn::Lt(hn::And(gy, seven), cap), mixed);
  const I column = hn::IfThenElse(mixed, hn::IfThenElseZero(above_cap, seven),
                                  hn::And(hn::ShiftRight<BrickVolume::kColumnShift>(code), upwards));
  // A row of 4x1x4 goes further than a cube of 2^3: terrain lies flat.
  const auto row = hn::Eq(hn::And(shifted(hn::And(bit, hn::Set(di, 4))), hn::Set(di, 0x0f0f0f0f)), hn::Zero(di));
  const I my = hn::IfThenElse(mixed, hn::IfThenElse(row, half, pair), side);
  const I mxz = hn::Max(hn::IfThenElse(mixed, hn::Or(pair, hn::IfThenElseZero(row, three)), side), column);
  const I lx = hn::Or(cx, mxz), lz = hn::Or(cz, mxz);
  const I ly = hn::IfThenElse(hn::Gt(column, hn::Zero(di)), hn::Load(di, lanes.last[1]), hn::Or(cy, my));

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

/// Walks all rays to their ends, and says which must be walked in double: unsure[0..returned).
template <class Ray>
size_t walk(const BrickView& bricks, const Ray* rays, GridHit* hits, size_t count, uint32_t* unsure, uint64_t& steps) {
  constexpr int kGroups = 4;
  const size_t width = hn::Lanes(Ints());
  Lanes group[kGroups];
  StreamRays ready;
  ready.walks = 0;
  size_t chunk = 0, chunk_end = 0, active = 0, unsure_count = 0;  // chunk: first ray of those made ready
  const auto miss = [&](size_t i) { hits[i].end = WalkEnd::t_max, hits[i].face = kNoFace, hits[i].t = rays[i].t_max; };
  const auto next_ray = [&]() -> uint32_t {
    while (!ready.walks) {
      if (chunk_end == count) return kNoRay;
      chunk = chunk_end;
      chunk_end = std::min(chunk + kChunk, count);
      load_chunk(bricks, rays + chunk, chunk_end - chunk, ready);
      prefetch_records(rays + chunk_end, kChunk);
      const size_t given = chunk_end - chunk;
      prepare(bricks, ready, given);
      uint64_t none = ~(ready.walks | ready.unsure) & (given == 64 ? ~0ull : (1ull << given) - 1);
      for (; none; none &= none - 1) miss(chunk + static_cast<size_t>(std::countr_zero(none)));
      for (uint64_t left = ready.unsure; left; left &= left - 1)
        unsure[unsure_count++] = static_cast<uint32_t>(chunk + static_cast<size_t>(std::countr_zero(left)));
    }
    const uint32_t i = static_cast<uint32_t>(std::countr_zero(ready.walks));
    ready.walks &= ready.walks - 1;
    return i;
  };
  const auto put = [&](Lanes& lanes, size_t lane, int to, uint32_t i) {
    lanes.ray[lane] = static_cast<uint32_t>(chunk) + i;
    for (int a = 0; a < 3; ++a) {
      lanes.origin[a][lane] = ready.origin[a][i];
      lanes.along[a][lane] = ready.along[a][i];
      lanes.inverse[a][lane] = ready.inverse[a][i];
      lanes.beyond[a][lane] = ready.beyond[a][i];
      lanes.base[a][lane] = ready.base[a][i];
      lanes.flip[a][lane] = ready.flip[a][i];
      lanes.last[a][lane] = ready.last[a][i];
      lanes.cell[to][a][lane] = ready.base[a][i];
    }
    lanes.upwards[lane] = ~ready.flip[1][i] & static_cast<int32_t>(BrickVolume::kSide);
    lanes.t_limit[lane] = ready.t_limit[i];
    lanes.axis[to][lane] = -1;
  };
  // A lane without a ray stands in the first cell and misses at each step.
  const auto rest = [&](Lanes& lanes, size_t lane, int to) {
    for (int a = 0; a < 3; ++a) lanes.cell[to][a][lane] = 0, lanes.flip[a][lane] = 0;
    lanes.t_limit[lane] = -std::numeric_limits<float>::infinity();
    lanes.ray[lane] = kNoRay;
  };
  for (Lanes& lanes : group) {
    for (size_t lane = 0; lane < width; ++lane) {
      for (int a = 0; a < 3; ++a) {
        lanes.origin[a][lane] = lanes.along[a][lane] = lanes.inverse[a][lane] = lanes.beyond[a][lane] = 0;
        lanes.base[a][lane] = lanes.last[a][lane] = 0;
      }
      lanes.upwards[lane] = 0;
      const uint32_t ray = next_ray();
      if (ray == kNoRay)
        rest(lanes, lane, 0);
      else
        put(lanes, lane, 0, ray), ++active;
    }
    find_leaves(bricks, lanes, 0);
  }
  int from = 0;
  const auto refill = [&](Lanes& lanes, const Ended& ended) {
    for (uint32_t left = ended.any; left; left &= left - 1) {
      const size_t lane = static_cast<size_t>(std::countr_zero(left));
      const uint32_t i = lanes.ray[lane];
      if (i == kNoRay) {
        rest(lanes, lane, 1 - from);
        continue;
      }
      if (ended.hit >> lane & 1) {
        // The exact t of the plane that was crossed.
        const Ray& ray = rays[i];
        const int axis = lanes.axis[from][lane], along = axis < 0 ? 0 : axis;
        const int32_t flip = lanes.flip[along][lane];
        int32_t voxel[3];
        for (int a = 0; a < 3; ++a) voxel[a] = (lanes.cell[from][a][lane] ^ lanes.flip[a][lane]) + (&bricks.low.x)[a];
        const double plane = static_cast<double>(voxel[along] - flip - (&ray.voxel.x)[along]);
        const double direction = (&ray.direction.x)[along];
        const double t = axis < 0 ? 0 : (plane - (&ray.fraction.x)[along]) * (1 / direction);
        if (t <= ray.t_max)
          hits[i] = {
              WalkEnd::hit, {voxel[0], voxel[1], voxel[2]}, axis < 0 ? kNoFace : entered_face(along, flip == 0), t};
        else
          miss(i);
      } else if (ended.missed >> lane & 1) {
        miss(i);
      } else {
        unsure[unsure_count++] = i;
      }
      const uint32_t fresh = next_ray();
      if (fresh != kNoRay) {
        put(lanes, lane, 1 - from, fresh);
      } else {
        rest(lanes, lane, 1 - from);
        --active;
      }
    }
  };
  while (active) {
    for (Lanes& lanes : group) look_up(bricks, lanes);
    for (int g = 0; g < kGroups; ++g) {
      const Ended ended = step(bricks, group[g], from);
      if (ended.any) refill(group[g], ended);
      // A group later: single lanes that were just written can't be read as vectors before they are in the cache.
      if (g > 0) find_leaves(bricks, group[g - 1], 1 - from);
    }
    find_leaves(bricks, group[kGroups - 1], 1 - from);
    steps += kGroups;
    from = 1 - from;
  }
  return unsure_count;
}

size_t walk_grid_rays(const BrickView& bricks, const GridRay* rays, GridHit* hits, size_t count, uint32_t* unsure,
                      uint64_t& steps) {
  return walk(bricks, rays, hits, count, unsure, steps);
}
size_t walk_stream_rays(const BrickView& bricks, const StreamRay* rays, GridHit* hits, size_t count, uint32_t* unsure,
                        uint64_t& steps) {
  return walk(bricks, rays, hits, count, unsure, steps);
}

}  // namespace HWY_NAMESPACE
}  // namespace world
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace world {

namespace {
HWY_EXPORT(walk_grid_rays);
HWY_EXPORT(walk_stream_rays);
}  // namespace

RayStream::RayStream(const MaskVolume& volume) : volume_(&volume), bricks_(volume), walker_(volume) {}

void RayStream::update(std::span<const LeafPos> dirty) {
  for (const LeafPos& leaf : dirty) bricks_.update(*volume_, leaf);
  walker_ = MaskWalker(*volume_);
}

template <class Ray>
size_t RayStream::walk_lanes(std::span<const Ray> rays, GridHit* hits, uint32_t* unsure, StreamReport& report) const {
  const VoxelPos low = bricks_.low();
  BrickView view{reinterpret_cast<const int32_t*>(bricks_.codes()),
                 reinterpret_cast<const int32_t*>(bricks_.words()),
                 bricks_.leaves_along()[1],
                 bricks_.leaves_along()[2],
                 {},
                 {},
                 {},
                 low};
  for (int a = 0; a < 3; ++a) {
    view.first[a] = bricks_.content().min[a] - low[a];
    view.last[a] = bricks_.content().max[a] - low[a];
    view.size[a] = bricks_.leaves_along()[a] * kLeafSize;
  }
  if constexpr (std::is_same_v<Ray, GridRay>)
    return HWY_DYNAMIC_DISPATCH(walk_grid_rays)(view, rays.data(), hits, rays.size(), unsure, report.steps);
  else
    return HWY_DYNAMIC_DISPATCH(walk_stream_rays)(view, rays.data(), hits, rays.size(), unsure, report.steps);
}

template size_t RayStream::walk_lanes(std::span<const GridRay>, GridHit*, uint32_t*, StreamReport&) const;

template <class Ray>
void RayStream::walk_all(std::span<const Ray> rays, std::span<GridHit> hits, StreamReport* report) const {
  StreamReport done;
  done.rays = rays.size();
  if (!bricks_.walkable()) {
    for (size_t i = 0; i < rays.size(); ++i) hits[i] = walker_.first_set(rays[i]);
    done.exact = rays.size();
  } else {
    uint32_t unsure[kSlice];
    for (size_t begin = 0; begin < rays.size(); begin += kSlice) {
      const size_t count = std::min(kSlice, rays.size() - begin);
      const size_t again = walk_lanes(rays.subspan(begin, count), hits.data() + begin, unsure, done);
      for (size_t i = 0; i < again; ++i) hits[begin + unsure[i]] = walker_.first_set(rays[begin + unsure[i]]);
      done.exact += again;
    }
  }
  if (report) report->add(done);
}

void RayStream::first_set(std::span<const GridRay> rays, std::span<GridHit> hits, StreamReport* report) const {
  walk_all(rays, hits, report);
}

void RayStream::first_set(std::span<const StreamRay> rays, std::span<GridHit> hits, StreamReport* report) const {
  walk_all(rays, hits, report);
}

namespace {

template <class Ray, class Cast>
void set_flags(std::span<const Ray> rays, std::span<uint8_t> blocked, Cast cast) {
  constexpr size_t kPiece = 1024;
  GridHit hits[kPiece];
  for (size_t begin = 0; begin < rays.size(); begin += kPiece) {
    const size_t count = std::min(kPiece, rays.size() - begin);
    cast(rays.subspan(begin, count), std::span(hits, count));
    for (size_t i = 0; i < count; ++i) blocked[begin + i] = hits[i].hit();
  }
}

}  // namespace

void RayStream::any_set(std::span<const GridRay> rays, std::span<uint8_t> blocked, StreamReport* report) const {
  set_flags(rays, blocked, [&](auto some, auto hits) { first_set(some, hits, report); });
}

void RayStream::any_set_coherent(std::span<const GridRay> rays, std::span<uint8_t> blocked,
                                 StreamReport* report) const {
  set_flags(rays, blocked, [&](auto some, auto hits) { first_set_coherent(some, hits, report); });
}

void RayStream::any_set_coherent(std::span<const StreamRay> rays, std::span<uint8_t> blocked,
                                 StreamReport* report) const {
  set_flags(rays, blocked, [&](auto some, auto hits) { first_set_coherent(some, hits, report); });
}

StoreRays::StoreRays() = default;
StoreRays::~StoreRays() = default;

const RayStream& StoreRays::stream(const Store& store, MaskKind kind) {
  if (store_ != store.identity()) {
    for (auto& parallel : parallel_) parallel.reset();
    for (auto& stream : streams_) stream.reset();
    store_ = store.identity();
    subscriber_ = store.subscribe();
  }
  const std::vector<LeafPos> dirty = store.take_dirty(subscriber_);
  if (!dirty.empty()) {
    for (auto& stream : streams_)
      if (stream) stream->update(dirty);
    for (auto& parallel : parallel_)
      if (parallel) parallel->update(dirty);
  }
  auto& stream = streams_[static_cast<size_t>(kind)];
  if (!stream) stream = std::make_unique<RayStream>(store.masks(kind));
  return *stream;
}

const ParallelRays& StoreRays::parallel(const Store& store, MaskKind kind, const Vec3d& direction) {
  const RayStream& stream_of_kind = stream(store, kind);
  auto& parallel = parallel_[static_cast<size_t>(kind)];
  if (!parallel || parallel->direction() != direction)
    parallel = std::make_unique<ParallelRays>(stream_of_kind, direction);
  return *parallel;
}

size_t StoreRays::bytes() const {
  size_t total = 0;
  for (const auto& stream : streams_)
    if (stream) total += stream->bricks().bytes();
  for (const auto& parallel : parallel_)
    if (parallel) total += parallel->bytes();
  return total;
}

}  // namespace world
#endif
