#include "world/store/ray_stream.h"

#include <algorithm>
#include <atomic>
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

constexpr size_t kChunk = 64;  // rays made ready at a time

/// What kernels read of a BrickVolume.
struct BrickView {
  const int32_t *codes, *words;
  int32_t leaves_y, leaves_z;
  int32_t first[3], last[3];  // voxels that may hold anything, from the corner of the bounds
  int32_t size[3];            // voxels of the bounds
  VoxelPos low;               // corner of the bounds
};

/// What is kept of a walking ray, 32 bits each: rows of ReadyRays and of Lanes. Each ray is in a space mirrored so that
/// it runs upwards on each axis: there a cell c is c ^ flip. Cells count from the low corner of the bounds. Directions
/// are scaled so that their largest component is 1. Three rows in a row are x, y, z.
enum RayRow : int {
  kOrigin = 0,   // fraction of the start voxel, from its middle
  kAlong = 3,    // direction
  kInverse = 6,  // 1 / along
  kBeyond = 9,   // how much of the start voxel lies ahead, times inverse
  kBase = 12,    // start voxel
  kFlip = 15,    // 0 or -1
  kLimit = 18,   // t at which it ends, or leaves what may hold anything
  kRay = 19,     // index; -1 for a lane without a ray, which stands in the first cell and misses at each step
  kRayRows = 20
};

/// Rays made ready to walk, in [begin, end) of each row. What lies behind may be read and overwritten, up to a vector.
struct alignas(64) ReadyRays {
  static constexpr size_t kSize = kChunk + 3 * 16;
  int32_t rows[kRayRows][kSize];
  size_t begin = 0, end = 0;
};

/// By which axis a cell was entered: 2 less than the axis, or that none was.
constexpr int32_t kByNone = 1;

/// Rays that met a voxel: theirs, and by which axis it was entered.
struct alignas(64) HitRays {
  static constexpr size_t kSize = 64;
  int32_t ray[kSize + 16], voxel[3][kSize + 16], by[kSize + 16];
  size_t count = 0;
};

}  // namespace world
#endif

HWY_BEFORE_NAMESPACE();
namespace world {
namespace HWY_NAMESPACE {

/// Where a crossing at t leads along one axis: the cell, and how far from the middle of it. Origin: from the middle of
/// the start voxel.
HWY_INLINE I cell_at(F t, F origin, F along, I base, F& off_middle) {
  const Floats df;
  const F position = hn::MulAdd(t, along, origin);
  const I whole = nearest_within(position);
  off_middle = hn::Abs(hn::Sub(position, hn::ConvertTo(df, whole)));
  return hn::Add(base, whole);
}

/// How far off the middle is still sure after a crossing at t. With u = 2^-24, rays given in double: a direction is
/// wrong by 2 u of itself (made a float, scaled), its inverse by 3 u, what lies ahead in the start voxel by u, so both
/// parts of t by at most 5 u of them and their sum by 6 u t. A position is by that, its direction (2 u t), the product
/// and the sum (2 u t, fused or not), and the start (2 u): 10 u t + 2 u. These are 12 u and 4 u.
HWY_INLINE F sure_distance(F t) {
  const Floats df;
  return hn::MulAdd(t, hn::Set(df, -0x1.8p-21f), hn::Set(df, 0.5f - 0x1p-22f));
}

/// What is given of a vector of rays: start voxels from the corner of the bounds, fractions and what they leave of 1,
/// each exact but for its rounding, directions.
struct GivenRays {
  I voxel[3];
  F fraction[3], rest[3], direction[3], t_max;
};

/// Of rays [0, count), at most a vector; lanes after them repeat the last.
template <class Ray>
HWY_INLINE GivenRays load_rays(const BrickView& bricks, const Ray* rays, size_t count) {
  const Floats df;
  const Ints di;
  GivenRays given;
  if constexpr (std::is_same_v<Ray, StreamRay>) {
    static_assert(sizeof(StreamRay) == 40);  // voxel, fraction, direction, t_max
    if (count == hn::Lanes(di)) {
      I low[8], high[8];  // words 0 to 7, words 2 to 9
      load_transposed(rays, 0, low), load_transposed(rays, 2, high);
      for (int a = 0; a < 3; ++a) {
        given.voxel[a] = hn::Sub(low[a], hn::Set(di, (&bricks.low.x)[a]));
        given.fraction[a] = hn::BitCast(df, low[3 + a]);
        given.rest[a] = hn::Sub(hn::Set(df, 1.0f), given.fraction[a]);
        given.direction[a] = hn::BitCast(df, high[4 + a]);
      }
      given.t_max = hn::BitCast(df, high[7]);
      return given;
    }
  }
  alignas(64) int32_t voxel[3][kMostLanes];
  alignas(64) float fraction[3][kMostLanes], rest[3][kMostLanes], direction[3][kMostLanes], t_max[kMostLanes];
  for (size_t lane = 0; lane < hn::Lanes(di); ++lane) {
    const Ray& ray = rays[std::min(lane, count - 1)];
    for (int a = 0; a < 3; ++a) {
      fraction[a][lane] = static_cast<float>((&ray.fraction.x)[a]);
      rest[a][lane] = static_cast<float>(1 - (&ray.fraction.x)[a]);
      direction[a][lane] = static_cast<float>((&ray.direction.x)[a]);
      voxel[a][lane] = (&ray.voxel.x)[a] - (&bricks.low.x)[a];
    }
    t_max[lane] = static_cast<float>(ray.t_max);
  }
  for (int a = 0; a < 3; ++a) {
    given.voxel[a] = hn::Load(di, voxel[a]);
    given.fraction[a] = hn::Load(df, fraction[a]), given.rest[a] = hn::Load(df, rest[a]);
    given.direction[a] = hn::Load(df, direction[a]);
  }
  given.t_max = hn::Load(df, t_max);
  return given;
}

/// Mirrors, scales and inverts a vector of rays, of which the first is `first` and `count` are given, and adds those
/// that walk to `ready`. Those that must be walked in double go to `unsure`; the others meet nothing.
HWY_INLINE void prepare(const BrickView& bricks, const GivenRays& rays, uint32_t first, size_t count, ReadyRays& ready,
                        UnsureRays& unsure) {
  const Floats df;
  const Ints di;
  const F zero = hn::Zero(df), one = hn::Set(df, 1.0f);
  const F largest =
      hn::Max(hn::Max(hn::Abs(rays.direction[0]), hn::Abs(rays.direction[1])), hn::Abs(rays.direction[2]));
  const F scale = hn::Div(one, largest);
  // Directions beyond what a float holds well, NaN among them, are for the exact walk.
  auto fine = hn::And(hn::Gt(largest, hn::Set(df, 0x1p-60f)), hn::Lt(largest, hn::Set(df, 0x1p60f)));
  fine = hn::And(fine, hn::Ge(rays.t_max, zero));
  auto none = hn::Lt(zero, zero);
  // A little more than t_max: what is met beyond it is taken back in double.
  F limit = hn::MulAdd(hn::Mul(rays.t_max, largest), hn::Set(df, 1 + 0x1p-18f), hn::Set(df, 0x1p-18f));
  limit = hn::Min(limit, hn::Set(df, 0x1p100f));
  I made[kRayRows];
  for (int a = 0; a < 3; ++a) {
    const auto down = hn::Lt(rays.direction[a], zero);
    const I flip = hn::IfThenElseZero(hn::RebindMask(di, down), hn::Set(di, -1));
    const F origin = hn::IfThenElse(down, rays.rest[a], rays.fraction[a]);
    const F left = hn::IfThenElse(down, rays.fraction[a], rays.rest[a]);
    const F along = hn::Mul(hn::Abs(rays.direction[a]), scale);
    const auto steps = hn::Gt(along, hn::Set(df, 0x1p-40f));
    const F inverse = hn::IfThenElseZero(steps, hn::Div(one, along));
    const I base = hn::Xor(rays.voxel[a], flip);
    const I last =
        hn::IfThenElse(hn::RebindMask(di, down), hn::Not(hn::Set(di, bricks.first[a])), hn::Set(di, bricks.last[a]));
    // A tiny component that isn't zero, and a start on the far plane of an axis that never steps.
    fine = hn::And(fine, hn::Or(steps, hn::And(hn::Eq(along, zero), hn::Gt(left, hn::Set(df, 0x1p-20f)))));
    fine = hn::And(fine, hn::And(hn::Ge(origin, zero), hn::Le(origin, one)));
    // Codes cover the bounds and no more.
    const auto outside =
        hn::Or(hn::Lt(rays.voxel[a], hn::Zero(di)), hn::Not(hn::Lt(rays.voxel[a], hn::Set(di, bricks.size[a]))));
    fine = hn::And(fine, hn::Not(hn::RebindMask(df, outside)));
    none = hn::Or(none, hn::RebindMask(df, hn::Gt(base, last)));
    const F beyond = hn::IfThenElse(steps, hn::Mul(left, inverse), hn::Set(df, 0x1p120f));
    // A step computes the t of a plane in the same way, so that no plane beyond the last cell is crossed before this.
    limit = hn::Min(limit, hn::MulAdd(hn::ConvertTo(df, hn::Sub(last, base)), inverse, beyond));
    made[kOrigin + a] = hn::BitCast(di, hn::Sub(origin, hn::Set(df, 0.5f)));
    made[kAlong + a] = hn::BitCast(di, along), made[kInverse + a] = hn::BitCast(di, inverse);
    made[kBeyond + a] = hn::BitCast(di, beyond);
    made[kBase + a] = base, made[kFlip + a] = flip;
  }
  made[kLimit] = hn::BitCast(di, limit);
  made[kRay] = hn::Add(hn::Iota(di, 0), hn::Set(di, static_cast<int32_t>(first)));

  const auto given = hn::FirstN(di, count);
  const auto walks = hn::And(given, hn::RebindMask(di, hn::AndNot(none, fine)));
  const Compressor compress(walks);
  const size_t end = ready.end;
#pragma GCC unroll 20
  for (int row = 0; row < kRayRows; ++row) compress.store(made[row], ready.rows[row] + end);
  ready.end = end + compress.count();
  const auto bad = hn::And(given, hn::RebindMask(di, hn::Not(fine)));
  if (!hn::AllFalse(di, bad)) {
    const Compressor compress_bad(bad);
    compress_bad.store(made[kRay], unsure.ray + unsure.count);
    compress_bad.store(hn::Set(di, -1), unsure.axis + unsure.count);
    unsure.count += compress_bad.count();
  }
}

/// The state of one vector of lanes. In memory: there are more values than registers.
struct alignas(64) Lanes {
  int32_t rows[kRayRows][kMostLanes];
  // Where they stand: the cell, by which axis it was entered; the cell not mirrored, the place of its leaf's code, the
  // code, the place of its word.
  int32_t cell[3][kMostLanes], by[kMostLanes];
  int32_t grid[3][kMostLanes], leaf[kMostLanes], code[kMostLanes], word[kMostLanes];
};

/// Where the lanes come to, and, a bit each, which end where they stand.
struct Stepped {
  I cell[3], by;
  uint32_t any, hit, missed;
};

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
  for (size_t lane = 0; lane < hn::Lanes(di); ++lane)
    __builtin_prefetch(bricks.words + static_cast<uint32_t>(lanes.word[lane]));
}

/// Leaves of the bounds along y and z, in every lane.
struct LeavesAlong {
  I y, z;
};

/// Puts the lanes where they have come to, and asks for the codes of their cells.
HWY_INLINE void arrive(const BrickView& bricks, const LeavesAlong& leaves, const I cell[3], I by, Lanes& lanes) {
  const Ints di;
  I at[3];
  for (int a = 0; a < 3; ++a) {
    at[a] = hn::Xor(cell[a], hn::Load(di, lanes.rows[kFlip + a]));
    hn::Store(cell[a], di, lanes.cell[a]), hn::Store(at[a], di, lanes.grid[a]);
  }
  hn::Store(by, di, lanes.by);
  const I column = hn::Add(hn::Mul(hn::ShiftRight<3>(at[0]), leaves.z), hn::ShiftRight<3>(at[2]));
  hn::Store(hn::Add(hn::Mul(column, leaves.y), hn::ShiftRight<3>(at[1])), di, lanes.leaf);
#pragma GCC unroll 16
  for (size_t lane = 0; lane < hn::Lanes(di); ++lane)
    __builtin_prefetch(bricks.codes + static_cast<uint32_t>(lanes.leaf[lane]));
}

/// One step of every lane.
HWY_INLINE Stepped step(const BrickView& bricks, const Lanes& lanes) {
  const Floats df;
  const Ints di;
  const hn::RebindToUnsigned<Ints> du;
  const I one = hn::Set(di, 1), three = hn::Set(di, 3);
  const auto row = [&](int i) HWY_ATTR { return hn::Load(di, lanes.rows[i]); };
  const auto number = [&](int i) HWY_ATTR { return hn::BitCast(df, hn::Load(di, lanes.rows[i])); };
  const I cx = hn::Load(di, lanes.cell[0]), cy = hn::Load(di, lanes.cell[1]), cz = hn::Load(di, lanes.cell[2]);
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
  const I downwards = row(kFlip + 1), seven = hn::Set(di, 7);
  const I cap = hn::Xor(hn::And(hn::AndNot(downwards, code), hn::Set(di, int32_t(BrickVolume::kCap))),
                        hn::Set(di, int32_t(BrickVolume::kCapped)));
  const auto minus = [&](auto m) { return hn::VecFromMask(di, hn::RebindMask(di, m)); };
  const I above_cap = hn::AndNot(minus(hn::Lt(hn::And(gy, seven), cap)), seven);
  const I column =
      hn::IfThenElse(mixed, above_cap, hn::AndNot(downwards, hn::ShiftRight<BrickVolume::kColumnShift>(code)));
  // A row of 4x1x4 goes further than a cube of 2^3: terrain lies flat.
  const auto flat = hn::Eq(hn::And(shifted(hn::And(bit, hn::Set(di, 4))), hn::Set(di, 0x0f0f0f0f)), hn::Zero(di));
  const I my = hn::IfThenElse(mixed, hn::IfThenElse(flat, half, pair), side);
  const I mxz = hn::Max(hn::IfThenElse(mixed, hn::Or(pair, hn::IfThenElseZero(flat, three)), side), column);
  const I lx = hn::Or(cx, mxz), lz = hn::Or(cz, mxz);
  const I ly = hn::IfThenElse(hn::Gt(column, hn::Zero(di)), hn::Set(di, bricks.last[1]), hn::Or(cy, my));

  // Its far planes, and which is crossed first.
  const I bx = row(kBase), by = row(kBase + 1), bz = row(kBase + 2);
  const F ix = number(kInverse), iy = number(kInverse + 1), iz = number(kInverse + 2);
  const F tx = hn::MulAdd(hn::ConvertTo(df, hn::Sub(lx, bx)), ix, number(kBeyond));
  const F ty = hn::MulAdd(hn::ConvertTo(df, hn::Sub(ly, by)), iy, number(kBeyond + 1));
  const F tz = hn::MulAdd(hn::ConvertTo(df, hn::Sub(lz, bz)), iz, number(kBeyond + 2));
  const F t = hn::Min(hn::Min(tx, ty), tz);
  const auto on_x = hn::Eq(tx, t);
  const auto on_y = hn::AndNot(on_x, hn::Eq(ty, t));
  const auto on_xy = hn::Or(on_x, on_y);

  // Where that is on the other axes, and whether it is sure.
  F off_x, off_y, off_z;
  const I wx = cell_at(t, number(kOrigin), number(kAlong), bx, off_x);
  const I wy = cell_at(t, number(kOrigin + 1), number(kAlong + 1), by, off_y);
  const I wz = cell_at(t, number(kOrigin + 2), number(kAlong + 2), bz, off_z);
  const F off = hn::Max(hn::Max(hn::IfThenZeroElse(on_x, off_x), hn::IfThenZeroElse(on_y, off_y)),
                        hn::IfThenElseZero(on_xy, off_z));
  const auto unsure = hn::Ge(off, sure_distance(t));
  // On the axis of the plane the nearest whole number may be the cell before it, never less.
  const I nx = hn::Sub(hn::Min(wx, lx), minus(on_x)), ny = hn::Sub(hn::Min(wy, ly), minus(on_y)),
          nz = hn::Add(hn::Add(hn::Min(wz, lz), one), minus(on_xy));
  // Who stands beyond the last cell before the limit is unsure: so near that cell's far plane lies the crossing.
  const auto missed = hn::Ge(t, number(kLimit));

  Stepped stepped{{nx, ny, nz}, hn::Add(minus(on_x), minus(on_xy)), 0, 0, 0};
  stepped.hit = bits_of(di, hit);
  stepped.missed = bits_of(di, hn::RebindMask(di, hn::AndNot(unsure, missed)));
  stepped.any = stepped.hit | bits_of(di, hn::RebindMask(di, hn::Or(unsure, missed)));
  return stepped;
}

/// Writes down what was hit.
template <class Ray>
void finish(const BrickView& bricks, const Ray* rays, GridHit* hits, HitRays& ended) {
  for (size_t i = 0; i < ended.count; ++i) {
    const size_t r = static_cast<size_t>(ended.ray[i]);
    const Ray& ray = rays[r];
    const bool started = ended.by[i] == kByNone;
    const int axis = started ? 0 : ended.by[i] + 2;
    const VoxelPos voxel = VoxelPos{ended.voxel[0][i], ended.voxel[1][i], ended.voxel[2][i]} + bricks.low;
    // The exact t of the plane that was crossed.
    const double direction = (&ray.direction.x)[axis];
    const bool upwards = !(direction < 0);
    const double plane = static_cast<double>((&voxel.x)[axis] + !upwards - (&ray.voxel.x)[axis]);
    const double t = started ? 0 : (plane - (&ray.fraction.x)[axis]) * (1 / direction);
    if (t <= ray.t_max) hits[r] = {WalkEnd::hit, voxel, started ? kNoFace : entered_face(axis, upwards), t};
  }
  ended.count = 0;
}

/// Walks all rays to their ends, and says which must be walked in double: unsure[0..returned), with room for a vector
/// behind.
template <class Ray>
void walk(const BrickView& bricks, const Ray* rays, GridHit* hits, size_t count, UnsureRays& unsure, uint64_t& steps) {
  constexpr int kGroups = 4;
  const Ints di;
  const size_t width = hn::Lanes(di);
  const I none = hn::Set(di, -1);
  const GridHit miss{WalkEnd::t_max, {}, kNoFace, 0};
  const LeavesAlong leaves{hn::Set(di, bricks.leaves_y), hn::Set(di, bricks.leaves_z)};
  Lanes group[kGroups];
  ReadyRays ready;
  HitRays ended;
  size_t next = 0, active = 0;
  // So that `ready` holds a vector at least.
  const auto make_ready = [&]() HWY_ATTR {
    for (auto& row : ready.rows) hn::StoreU(hn::LoadU(di, row + ready.begin), di, row);
    ready.end -= ready.begin, ready.begin = 0;
    while (ready.end < width && next < count) {
      const size_t chunk_end = std::min(next + kChunk, count), had = ready.end;
      for (size_t i = next; i < chunk_end; ++i) hits[i] = miss, hits[i].t = rays[i].t_max;
      for (; next < chunk_end; next += width) {
        const size_t given = std::min(width, chunk_end - next);
        prepare(bricks, load_rays(bricks, rays + next, given), static_cast<uint32_t>(next), given, ready, unsure);
      }
      next = chunk_end;
      active += ready.end - had;
    }
    if (ready.end < width) {
      for (auto& row : ready.rows) hn::StoreU(hn::Zero(di), di, row + ready.end);
      hn::StoreU(none, di, ready.rows[kRay] + ready.end);
      hn::StoreU(hn::BitCast(di, hn::Set(Floats(), -std::numeric_limits<float>::infinity())), di,
                 ready.rows[kLimit] + ready.end);
      ready.end += width;
    }
  };
  // New rays for the lanes of `bits`.
  const auto refill = [&](Lanes& lanes, uint32_t bits, I cell[3], I& by) HWY_ATTR {
    if (ready.end - ready.begin < width) make_ready();
    const Expander expand(bits);
#pragma GCC unroll 20
    for (int row = 0; row < kRayRows; ++row)
      hn::Store(expand.load(ready.rows[row] + ready.begin, hn::Load(di, lanes.rows[row])), di, lanes.rows[row]);
    for (int a = 0; a < 3; ++a) cell[a] = hn::IfThenElse(expand.mask(), hn::Load(di, lanes.rows[kBase + a]), cell[a]);
    by = hn::IfThenElse(expand.mask(), hn::Set(di, kByNone), by);
    ready.begin += expand.count();
    // The rays of the next chunk come in as those of this one leave.
    prefetch_records(rays + next + ready.begin, 2);
  };
  for (Lanes& lanes : group) {
    I cell[3] = {none, none, none}, by = none;
    for (auto& row : lanes.rows) hn::Store(none, di, row);
    refill(lanes, (1u << width) - 1, cell, by);
    arrive(bricks, leaves, cell, by, lanes);
  }
  while (active) {
    for (Lanes& lanes : group) look_up(bricks, lanes);
    for (Lanes& lanes : group) {
      Stepped to = step(bricks, lanes);
      if (to.any) {
        // Else g++ keeps what the step has read for the refill: a store and a load more for each row, at each step.
        std::atomic_signal_fence(std::memory_order_seq_cst);
        const I ray = hn::Load(di, lanes.rows[kRay]);
        const uint32_t real = to.any & ~bits_of(di, hn::Lt(ray, hn::Zero(di)));
        active -= hwy::PopCount(real);
        // Without a branch on whether there are any, which would often be foreseen wrongly.
        const Compressor compress(to.hit & real);
        compress.store(ray, ended.ray + ended.count);
        for (int a = 0; a < 3; ++a) compress.store(hn::Load(di, lanes.grid[a]), ended.voxel[a] + ended.count);
        compress.store(hn::Load(di, lanes.by), ended.by + ended.count);
        ended.count += compress.count();
        if (ended.count >= HitRays::kSize) finish(bricks, rays, hits, ended);
        if (const uint32_t left = real & ~(to.hit | to.missed)) {
          // From the plane by which they entered the cell that they stand in.
          const I by = hn::Load(di, lanes.by);
          const I axis = hn::IfThenElse(hn::Eq(by, hn::Set(di, kByNone)), none, hn::Add(by, hn::Set(di, 2)));
          const auto on_x = hn::Eq(axis, hn::Zero(di)), on_y = hn::Eq(axis, hn::Set(di, 1));
          const auto plane_of = [&](int a, int32_t low) HWY_ATTR {
            return hn::Add(hn::Sub(hn::Load(di, lanes.grid[a]), hn::Load(di, lanes.rows[kFlip + a])), hn::Set(di, low));
          };
          const I plane = hn::IfThenElse(on_x, plane_of(0, bricks.low.x),
                                         hn::IfThenElse(on_y, plane_of(1, bricks.low.y), plane_of(2, bricks.low.z)));
          const Compressor compress_left(left);
          compress_left.store(ray, unsure.ray + unsure.count);
          compress_left.store(axis, unsure.axis + unsure.count);
          compress_left.store(plane, unsure.plane + unsure.count);
          unsure.count += compress_left.count();
        }
        refill(lanes, to.any, to.cell, to.by);
      }
      arrive(bricks, leaves, to.cell, to.by, lanes);
    }
    steps += kGroups;
  }
  finish(bricks, rays, hits, ended);
}

void walk_grid_rays(const BrickView& bricks, const GridRay* rays, GridHit* hits, size_t count, UnsureRays& unsure,
                    uint64_t& steps) {
  walk(bricks, rays, hits, count, unsure, steps);
}
void walk_stream_rays(const BrickView& bricks, const StreamRay* rays, GridHit* hits, size_t count, UnsureRays& unsure,
                      uint64_t& steps) {
  walk(bricks, rays, hits, count, unsure, steps);
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
void RayStream::walk_lanes(std::span<const Ray> rays, GridHit* hits, UnsureRays& unsure, StreamReport& report) const {
  unsure.count = 0;
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
    HWY_DYNAMIC_DISPATCH(walk_grid_rays)(view, rays.data(), hits, rays.size(), unsure, report.steps);
  else
    HWY_DYNAMIC_DISPATCH(walk_stream_rays)(view, rays.data(), hits, rays.size(), unsure, report.steps);
}

template void RayStream::walk_lanes(std::span<const GridRay>, GridHit*, UnsureRays&, StreamReport&) const;

template <class Ray>
void RayStream::walk_all(std::span<const Ray> rays, std::span<GridHit> hits, StreamReport* report) const {
  StreamReport done;
  done.rays = rays.size();
  if (!bricks_.walkable()) {
    for (size_t i = 0; i < rays.size(); ++i) hits[i] = walker_.first_set(rays[i]);
    done.exact = rays.size();
  } else {
    UnsureRays unsure;
    for (size_t begin = 0; begin < rays.size(); begin += UnsureRays::kMost) {
      const size_t count = std::min(UnsureRays::kMost, rays.size() - begin);
      walk_lanes(rays.subspan(begin, count), hits.data() + begin, unsure, done);
      for (size_t i = 0; i < unsure.count; ++i) {
        const size_t at = begin + static_cast<size_t>(unsure.ray[i]);
        hits[at] = unsure.axis[i] < 0 ? walker_.first_set(rays[at])
                                      : first_set_from(rays[at], unsure.axis[i], unsure.plane[i]);
      }
      done.exact += unsure.count;
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
