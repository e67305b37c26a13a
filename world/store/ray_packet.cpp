/// RayStream::first_set_coherent: up to 64 rays that run much the same way walk together, slab by slab.
///
/// The packet's main axis is that of its first ray's largest component. Along it each ray is a line u(k), v(k) in the
/// two other axes with slopes of at most 1, so from plane k to k + 1 it meets at most three voxels. All rays of a
/// packet need the same few bits: those of a slice of 16 x 16 voxels, four words of four leaves, which stay in
/// registers, with no gather anywhere. Slabs of 128 to 8 voxels that the packet's bounds don't touch anything in are
/// passed in one step. Decisions closer than the rounding of u and v send the ray to the exact walk; a packet that has
/// grown wider than a slice goes on lane by lane from its last plane.
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <new>

#include "world/store/leaf_slices.h"
#include "world/store/ray_stream.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "world/store/ray_packet.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "world/base/wide_vectors-inl.h"
#include "world/store/ray_lanes-inl.h"

#ifndef LOAM_RAY_PACKET_ONCE
#define LOAM_RAY_PACKET_ONCE

namespace world {

constexpr size_t kPacket = 64;
constexpr size_t kGroup = 8;  // packets that pass what is empty for all of them together

/// Bounds of a packet: u(k) - 1/2 lies in [low_y + k low_slope, high_y + k high_slope] for k >= 0.
struct PacketBounds {
  static constexpr float kFar = std::numeric_limits<float>::max();
  float low_y[2] = {kFar, kFar}, high_y[2] = {-kFar, -kFar}, low_slope[2] = {kFar, kFar},
        high_slope[2] = {-kFar, -kFar};
  void include(const PacketBounds& o) {
    for (int i = 0; i < 2; ++i) {
      low_y[i] = std::min(low_y[i], o.low_y[i]), high_y[i] = std::max(high_y[i], o.high_y[i]);
      low_slope[i] = std::min(low_slope[i], o.low_slope[i]), high_slope[i] = std::max(high_slope[i], o.high_slope[i]);
    }
  }
};

/// One packet. Cells are relative to `corner`; k counts along the main axis in the direction of the rays (mirrored
/// where they go down), u and v along the others as they are.
struct alignas(64) Packet {
  // As given, by axis (main, u, v): fraction of the start voxel, direction.
  float fraction[3][kPacket], direction[3][kPacket], t_max[kPacket];
  float y_u[kPacket], y_v[kPacket], slope_u[kPacket], slope_v[kPacket];  // u(k) - 1/2 = y_u + k slope_u
  int32_t start_k[kPacket], start_u[kPacket], start_v[kPacket];
  // Where a ray has come to: hit cell, and by which axis it was entered: 0 main, 1 u, 2 v, -1 its start.
  int32_t hit_k[kPacket], hit_u[kPacket], hit_v[kPacket], hit_axis[kPacket];
  // Of what was hit: voxel x, y, z, the face and the exact t. Only where the rays are given in floats.
  int32_t voxel[3][kPacket], face[kPacket];
  double t[kPacket];
  uint64_t alive = 0, hit = 0, unsure = 0;
  uint64_t odd = 0;  // unsure from the start
  float range = 0;   // |u|, |v|, |k| of all starts are at most this
  // Its frame.
  int main, u, v;
  int32_t flip;       // of the main axis: -1 where the rays go down
  int32_t corner[3];  // main (mirrored), u, v, from the corner of the bounds
  PacketBounds bounds;
  static constexpr int32_t kOutside = -1;
  int32_t begin_k;  // they meet nothing before this plane; kOutside: they start beyond the volume's bounds
  int32_t k[4];     // of each 16 rays: all before this plane is walked
};

/// Slices of leaves that were cut lately: neighbouring packets need the same ones.
struct SliceCache {
  static constexpr size_t kSize = 128;
  LeafPos leaf[kSize];
  int8_t axis[kSize];
  alignas(64) uint64_t slices[kSize][8];
  SliceCache() { std::fill(axis, axis + kSize, int8_t{-1}); }
};

/// One slice: rows are u, columns v, from the corner (row, column) on.
struct Slice {
  uint64_t word[4];  // (rows 0..7, columns 0..7), (rows 8..15, columns 0..7), (0..7, 8..15), (8..15, 8..15)
  int32_t row, column, k;
};

}  // namespace world
#endif

HWY_BEFORE_NAMESPACE();
namespace world {
namespace HWY_NAMESPACE {

/// Of the live rays among [begin, end), at least one; both are multiples of 16.
HWY_INLINE void bound_packet(const Packet& p, size_t begin, size_t end, PacketBounds& bounds) {
  const Floats df;
  const Ints di;
  const size_t width = hn::Lanes(df);
  const F far = hn::Set(df, std::numeric_limits<float>::max());
  const float* y[2] = {p.y_u, p.y_v};
  const float* slope[2] = {p.slope_u, p.slope_v};
  for (int i = 0; i < 2; ++i) {
    F low_y = far, high_y = hn::Neg(far), low_s = far, high_s = hn::Neg(far);
    for (size_t at = begin; at < end; at += width) {
      const F value = hn::Load(df, y[i] + at), s = hn::Load(df, slope[i] + at);
      const auto live =
          hn::RebindMask(df, hn::TestBit(hn::Set(di, static_cast<int32_t>(p.alive >> at)), hn::Load(di, kLaneBits)));
      low_y = hn::Min(low_y, hn::IfThenElse(live, value, far)),
      high_y = hn::Max(high_y, hn::IfThenElse(live, value, hn::Neg(far)));
      low_s = hn::Min(low_s, hn::IfThenElse(live, s, far)),
      high_s = hn::Max(high_s, hn::IfThenElse(live, s, hn::Neg(far)));
    }
    bounds.low_y[i] = hn::GetLane(hn::MinOfLanes(df, low_y));
    bounds.high_y[i] = hn::GetLane(hn::MaxOfLanes(df, high_y));
    bounds.low_slope[i] = hn::GetLane(hn::MinOfLanes(df, low_s));
    bounds.high_slope[i] = hn::GetLane(hn::MaxOfLanes(df, high_s));
  }
}

/// All live rays of the packet through one slice.
HWY_INLINE void walk_slice(Packet& p, const Slice& slice, size_t begin, size_t end) {
  const Floats df;
  const Ints di;
  const size_t width = hn::Lanes(df);
  // Is the voxel (row, column) set: bit 0 of each lane.
#if HWY_TARGET == HWY_SCALAR
  const auto test = [&](I row, I column) {
    const int32_t r = hn::GetLane(row), c = hn::GetLane(column);
    const bool held = r >= 0 && r < 16 && c >= 0 && c < 16;
    return hn::Set(di, held ? int32_t(slice.word[(r >> 3 & 1) | (c >> 3 & 1) << 1] >> ((r & 7) * 8 + (c & 7)) & 1) : 0);
  };
#else
  const hn::RebindToUnsigned<Ints> du;
  const hn::Repartition<uint8_t, Ints> db;
  const hn::Repartition<uint64_t, Ints> dw;
  alignas(16) const uint64_t first[2] = {slice.word[0], slice.word[1]}, second[2] = {slice.word[2], slice.word[3]};
  const auto low_table = hn::BitCast(db, hn::LoadDup128(dw, first));
  const auto high_table = hn::BitCast(db, hn::LoadDup128(dw, second));
  const I low_index = hn::Set(di, static_cast<int32_t>(0x80808000u)),
          high_index = hn::Set(di, static_cast<int32_t>(0x80800080u));
  const auto test = [&](I row, I column) {
    const auto low = hn::BitCast(du, hn::TableLookupBytesOr0(low_table, hn::BitCast(db, hn::Or(row, low_index))));
    const auto high = hn::BitCast(
        du, hn::TableLookupBytesOr0(high_table, hn::BitCast(db, hn::Or(hn::ShiftLeft<8>(row), high_index))));
    return hn::BitCast(di, hn::Shr(hn::Or(low, high), hn::BitCast(du, column)));
  };
#endif
  const float k = static_cast<float>(slice.k);
  const float error = (k + p.range) * 0x1p-22f;
  const F k_in = hn::Set(df, k), k_out = hn::Set(df, k + 1), half_less = hn::Set(df, 0.5f - error);
  const F tie = hn::Set(df, 2 * error);
  const I row = hn::Set(di, slice.row), column = hn::Set(di, slice.column), now = hn::Set(di, slice.k);
  for (size_t at = begin; at < end; at += width) {
    const uint64_t lanes = width == 64 ? ~0ull : (1ull << width) - 1;
    if (!(p.alive >> at & lanes)) continue;
    const F slope_u = hn::Load(df, p.slope_u + at), slope_v = hn::Load(df, p.slope_v + at);
    const F y_u = hn::Load(df, p.y_u + at), y_v = hn::Load(df, p.y_v + at);
    const F u_in = hn::MulAdd(k_in, slope_u, y_u), u_out = hn::MulAdd(k_out, slope_u, y_u);
    const F v_in = hn::MulAdd(k_in, slope_v, y_v), v_out = hn::MulAdd(k_out, slope_v, y_v);
    I iu = nearest_within(u_in), iv = nearest_within(v_in);
    const I ju = nearest_within(u_out), jv = nearest_within(v_out);
    const F fu_in = hn::ConvertTo(df, iu), fv_in = hn::ConvertTo(df, iv);
    const F fu_out = hn::ConvertTo(df, ju), fv_out = hn::ConvertTo(df, jv);
    const I start_k = hn::Load(di, p.start_k + at);
    const auto starting = hn::Eq(start_k, now);
    const auto starting_f = hn::RebindMask(df, starting);
    // A ray that starts in this slab is in its own voxel, not where its line enters the slab.
    F off = hn::IfThenZeroElse(starting_f, hn::Max(hn::Abs(hn::Sub(u_in, fu_in)), hn::Abs(hn::Sub(v_in, fv_in))));
    off = hn::Max(off, hn::Max(hn::Abs(hn::Sub(u_out, fu_out)), hn::Abs(hn::Sub(v_out, fv_out))));
    iu = hn::IfThenElse(starting, hn::Load(di, p.start_u + at), iu);
    iv = hn::IfThenElse(starting, hn::Load(di, p.start_v + at), iv);
    const auto same_u = hn::Eq(iu, ju), same_v = hn::Eq(iv, jv);
    // Which of two crossings comes first: by (plane - u) / slope_u against the same of v, without dividing. Planes lie
    // between the two cells: their larger number, less the half that u is off by.
    const F plane_u = hn::Sub(hn::ConvertTo(df, hn::Max(iu, ju)), hn::Set(df, 0.5f));
    const F plane_v = hn::Sub(hn::ConvertTo(df, hn::Max(iv, jv)), hn::Set(df, 0.5f));
    const F to_u = hn::Mul(hn::Abs(hn::Sub(plane_u, u_in)), hn::Abs(slope_v));
    const F to_v = hn::Mul(hn::Abs(hn::Sub(plane_v, v_in)), hn::Abs(slope_u));
    const auto both = hn::Not(hn::Or(same_u, same_v));
    const auto u_sooner = hn::RebindMask(di, hn::Lt(to_u, to_v));
    const auto close = hn::And(both, hn::RebindMask(di, hn::Not(hn::Gt(hn::Abs(hn::Sub(to_u, to_v)), tie))));
    const auto u_first = hn::AndNot(same_u, hn::Or(same_v, u_sooner));
    const I bu = hn::IfThenElse(u_first, ju, iu), bv = hn::IfThenElse(u_first, iv, jv);
    const auto unsure = hn::Or(close, hn::RebindMask(di, hn::Not(hn::Lt(off, half_less))));
    const auto in = hn::Not(hn::Lt(now, start_k));

    const I a = test(hn::Sub(iu, row), hn::Sub(iv, column)), b = test(hn::Sub(bu, row), hn::Sub(bv, column)),
            c = test(hn::Sub(ju, row), hn::Sub(jv, column));
    const I one = hn::Set(di, 1);
    const auto any = hn::And(in, hn::TestBit(hn::Or(a, hn::Or(b, c)), one));
    const uint64_t here = p.alive >> at & lanes;
    const uint64_t unsure_bits = bits_of(di, hn::And(in, unsure)) & here;
    const uint64_t hit_bits = bits_of(di, any) & here & ~unsure_bits;
    if (hit_bits | unsure_bits) {
      p.unsure |= unsure_bits << at;
      p.hit |= hit_bits << at;
      p.alive &= ~((hit_bits | unsure_bits) << at);
      const auto fresh = hn::And(hn::AndNot(unsure, any), hn::Eq(hn::Load(di, p.hit_axis + at), hn::Set(di, -2)));
      const auto on_a = hn::TestBit(a, one), on_b = hn::TestBit(b, one);
      const auto pick = [&](I of_a, I of_b, I of_c) {
        return hn::IfThenElse(on_a, of_a, hn::IfThenElse(on_b, of_b, of_c));
      };
      const auto put = [&](int32_t* to, I value) {
        hn::Store(hn::IfThenElse(fresh, value, hn::Load(di, to + at)), di, to + at);
      };
      const I two = hn::Set(di, 2);
      put(p.hit_u, pick(iu, bu, ju));
      put(p.hit_v, pick(iv, bv, jv));
      // The unsure too: the exact walk begins here.
      const auto either =
          hn::And(hn::And(in, hn::Or(unsure, any)), hn::Eq(hn::Load(di, p.hit_k + at), hn::Set(di, INT32_MIN)));
      hn::Store(hn::IfThenElse(either, now, hn::Load(di, p.hit_k + at)), di, p.hit_k + at);
      put(p.hit_axis, pick(hn::IfThenElseZero(starting, hn::Set(di, -1)), hn::IfThenElse(u_first, one, two),
                           hn::IfThenElse(u_first, two, one)));
    }
  }
}

/// What is given of rays [0, count), in the packet's axes; those after them repeat the last. `low`: corner of the
/// bounds.
template <class Ray>
HWY_INLINE void load_packet(Packet& p, const Ray* rays, size_t count, const VoxelPos& low) {
  const Floats df;
  const Ints di;
  const int axes[3] = {p.main, p.u, p.v};
  int32_t* starts[3] = {p.start_k, p.start_u, p.start_v};
  const int32_t corner[3] = {low[p.main], low[p.u] + p.corner[1], low[p.v] + p.corner[2]};
  size_t at = 0;
  if constexpr (std::is_same_v<Ray, StreamRay>) {
    static_assert(sizeof(StreamRay) == 40);  // voxel, fraction, direction, t_max
    for (const size_t width = hn::Lanes(di); at + width <= count; at += width) {
      I begin[8], end[8];  // words 0 to 7, words 2 to 9
      load_transposed(rays + at, 0, begin), load_transposed(rays + at, 2, end);
      for (int i = 0; i < 3; ++i) {
        hn::Store(hn::Sub(begin[axes[i]], hn::Set(di, corner[i])), di, starts[i] + at);
        hn::Store(hn::BitCast(df, begin[3 + axes[i]]), df, p.fraction[i] + at);
        hn::Store(hn::BitCast(df, end[4 + axes[i]]), df, p.direction[i] + at);
      }
      hn::Store(hn::BitCast(df, end[7]), df, p.t_max + at);
    }
  }
  for (; at < kPacket; ++at) {
    const Ray& ray = rays[std::min(at, count - 1)];
    for (int i = 0; i < 3; ++i) {
      starts[i][at] = (&ray.voxel.x)[axes[i]] - corner[i];
      p.fraction[i][at] = static_cast<float>((&ray.fraction.x)[axes[i]]);
      p.direction[i][at] = static_cast<float>((&ray.direction.x)[axes[i]]);
    }
    p.t_max[at] = static_cast<float>(ray.t_max);
  }
  // k counts in the direction of the rays, from the first of all starts.
  I first = hn::Set(di, INT32_MAX);
  const I flip = hn::Set(di, p.flip);
  for (at = 0; at < kPacket; at += hn::Lanes(di)) {
    const I k = hn::Xor(hn::Load(di, p.start_k + at), flip);
    first = hn::Min(first, k);
    hn::Store(k, di, p.start_k + at);
  }
  first = hn::MinOfLanes(di, first);
  p.corner[0] = hn::GetLane(first);
  for (at = 0; at < kPacket; at += hn::Lanes(di))
    hn::Store(hn::Sub(hn::Load(di, p.start_k + at), first), di, p.start_k + at);
}

/// Voxel, face and t of what was hit, as FlatWalk computes them, where fraction and direction are the floats given.
HWY_INLINE void finish_packet(Packet& p, const VoxelPos& low) {
  const hn::CappedTag<double, 8> dd;
  const hn::Rebind<int32_t, decltype(dd)> di;
  const hn::Rebind<float, decltype(dd)> df;
  const auto zero = hn::Zero(di), flip = hn::Set(di, p.flip);
  const int32_t corner[3] = {p.corner[0], p.corner[1] + low[p.u], p.corner[2] + low[p.v]};
  for (size_t at = 0; at < kPacket; at += hn::Lanes(dd)) {
    if (!(p.hit >> at & ((uint64_t{1} << hn::Lanes(dd)) - 1))) continue;
    const auto entered = hn::Load(di, p.hit_axis + at);
    const auto on_u = hn::Eq(entered, hn::Set(di, 1)), on_v = hn::Eq(entered, hn::Set(di, 2));
    const auto started = hn::Lt(entered, zero);
    const auto select = [&](auto main, auto u, auto v) HWY_ATTR {
      const hn::DFromV<decltype(main)> d;
      return hn::IfThenElse(hn::RebindMask(d, on_u), u, hn::IfThenElse(hn::RebindMask(d, on_v), v, main));
    };
    const auto k = hn::Load(di, p.hit_k + at), u = hn::Load(di, p.hit_u + at), v = hn::Load(di, p.hit_v + at);
    const auto walked = hn::Sub(k, hn::Load(di, p.start_k + at));
    const auto to_voxel = select(hn::Sub(hn::Xor(walked, flip), flip), hn::Sub(u, hn::Load(di, p.start_u + at)),
                                 hn::Sub(v, hn::Load(di, p.start_v + at)));
    const auto direction =
        select(hn::Load(df, p.direction[0] + at), hn::Load(df, p.direction[1] + at), hn::Load(df, p.direction[2] + at));
    const auto fraction =
        select(hn::Load(df, p.fraction[0] + at), hn::Load(df, p.fraction[1] + at), hn::Load(df, p.fraction[2] + at));
    const auto down = hn::IfThenElseZero(hn::RebindMask(di, hn::Lt(direction, hn::Zero(df))), hn::Set(di, 1));
    // Of a ray that starts in what it hits: (0 - 0) / 1.
    const auto started_f = hn::RebindMask(df, started);
    const auto plane = hn::PromoteTo(dd, hn::IfThenZeroElse(started, hn::Add(to_voxel, down)));
    const auto from = hn::PromoteTo(dd, hn::IfThenZeroElse(started_f, fraction));
    const auto along = hn::PromoteTo(dd, hn::IfThenElse(started_f, hn::Set(df, 1.0f), direction));
    hn::Store(hn::Mul(hn::Sub(plane, from), hn::Div(hn::Set(dd, 1.0), along)), dd, p.t + at);
    const auto face = hn::Add(select(hn::Set(di, 2 * p.main), hn::Set(di, 2 * p.u), hn::Set(di, 2 * p.v)), down);
    hn::Store(hn::IfThenElse(started, hn::Set(di, kNoFace), face), di, p.face + at);
    hn::Store(hn::Add(hn::Xor(hn::Add(k, hn::Set(di, corner[0])), flip), hn::Set(di, low[p.main])), di,
              p.voxel[p.main] + at);
    hn::Store(hn::Add(u, hn::Set(di, corner[1])), di, p.voxel[p.u] + at);
    hn::Store(hn::Add(v, hn::Set(di, corner[2])), di, p.voxel[p.v] + at);
  }
}

/// Slopes, offsets and bounds of rays [0, count) of the packet; those after them repeat the last.
HWY_INLINE void prepare_packet(Packet& p, size_t count) {
  const Floats df;
  const Ints di;
  const F one = hn::Set(df, 1.0f), zero = hn::Zero(df);
  const auto down = hn::RebindMask(df, hn::Ne(hn::Set(di, p.flip), hn::Zero(di)));
  F range = one;
  for (size_t at = 0; at < kPacket; at += hn::Lanes(df)) {
    const F given = hn::Load(df, p.direction[0] + at), f = hn::Load(df, p.fraction[0] + at);
    const F d = hn::IfThenElse(down, hn::Neg(given), given);
    const F su = hn::Div(hn::Load(df, p.direction[1] + at), d), sv = hn::Div(hn::Load(df, p.direction[2] + at), d);
    const F along = hn::Add(hn::ConvertTo(df, hn::Load(di, p.start_k + at)), hn::IfThenElse(down, hn::Sub(one, f), f));
    const auto offset = [&](const int32_t* cell, const float* fraction, F slope) {
      const F start =
          hn::Add(hn::ConvertTo(df, hn::Load(di, cell + at)), hn::Sub(hn::Load(df, fraction + at), hn::Set(df, 0.5f)));
      return hn::Sub(start, hn::Mul(slope, along));
    };
    const F yu = offset(p.start_u, p.fraction[1], su), yv = offset(p.start_v, p.fraction[2], sv);
    const F reach = hn::Max(hn::Max(hn::Abs(yu), hn::Abs(yv)), along);
    auto fine = hn::And(hn::Gt(d, zero), hn::And(hn::Le(hn::Abs(su), one), hn::Le(hn::Abs(sv), one)));
    // Each by itself: the larger of a number and NaN may be the number.
    const auto within = [&](F x) HWY_ATTR { return hn::Lt(hn::Abs(x), hn::Set(df, 4096.0f)); };
    fine = hn::And(fine, hn::And(hn::And(within(yu), within(yv)), hn::And(within(along), hn::Ge(along, zero))));
    range = hn::Max(range, hn::IfThenElseZero(fine, reach));
    hn::Store(hn::IfThenElseZero(fine, su), df, p.slope_u + at);
    hn::Store(hn::IfThenElseZero(fine, sv), df, p.slope_v + at);
    hn::Store(hn::IfThenElseZero(fine, yu), df, p.y_u + at);
    hn::Store(hn::IfThenElseZero(fine, yv), df, p.y_v + at);
    hn::Store(hn::Set(di, -2), di, p.hit_axis + at);
    hn::Store(hn::Set(di, INT32_MIN), di, p.hit_k + at);
    p.alive |= uint64_t{bits_of(di, hn::RebindMask(di, fine))} << at;
  }
  const uint64_t given = count == 64 ? ~0ull : (1ull << count) - 1;
  p.odd = p.unsure = ~p.alive & given;
  p.alive &= given;
  p.range = hn::GetLane(hn::MaxOfLanes(df, range)) + 2;
}

/// What lies between the bounds of a packet, or of several in one frame.
class Beam {
 public:
  /// Cells of u and v that it may touch between two planes, from the corner of the volume's bounds: low u, high u, low
  /// v, high v.
  struct Extent {
    alignas(16) int32_t cell[4];
  };

  HWY_INLINE Beam(const BrickVolume& bricks, const Packet& frame, const PacketBounds& bounds)
      : bounds_(bounds),
        corner_u_(frame.corner[1]),
        corner_v_(frame.corner[2]),
        m_(frame.main),
        flip_(frame.flip),
        corner_k_(frame.corner[0]),
        codes_(bricks.codes()) {
    const int32_t* leaves = bricks.leaves_along();
    const size_t strides[3] = {size_t(leaves[1]) * size_t(leaves[2]), 1, size_t(leaves[1])};
    stride_m_ = strides[m_], stride_u_ = strides[frame.u], stride_v_ = strides[frame.v];
    last_u_ = leaves[frame.u] * kLeafSize - 1, last_v_ = leaves[frame.v] * kLeafSize - 1;
    const VoxelPos first = bricks.content().min - bricks.low(), last = bricks.content().max - bricks.low();
    end_k_ = (flip_ ? ~first[m_] : last[m_]) - corner_k_ + 1;
#if HWY_TARGET != HWY_SCALAR
    const hn::CappedTag<float, 4> d4;
    const hn::RebindToSigned<decltype(d4)> i4;
    alignas(16) const float offsets[4] = {-bounds.low_y[0], bounds.high_y[0], -bounds.low_y[1], bounds.high_y[1]};
    alignas(16) const float slopes[4] = {-bounds.low_slope[0], bounds.high_slope[0], -bounds.low_slope[1],
                                         bounds.high_slope[1]};
    alignas(16) const int32_t signs[4] = {-1, 0, -1, 0};
    alignas(16) const int32_t corners[4] = {corner_u_, corner_u_, corner_v_, corner_v_};
    // y is u - 1/2: the cell of the highest is the nearest whole number, that of the lowest too.
    offset4_ = hn::Add(hn::Load(d4, offsets), hn::Set(d4, 0x1p-6f)), slope4_ = hn::Load(d4, slopes);
    sign4_ = hn::Load(i4, signs), corner4_ = hn::Load(i4, corners);
#endif
  }

  /// Of a leaf within the bounds, by its place along main, u and v.
  HWY_INLINE uint32_t code(int32_t layer, int32_t leaf_u, int32_t leaf_v) const {
    return codes_[stride_m_ * static_cast<size_t>(layer) + stride_u_ * static_cast<size_t>(leaf_u) +
                  stride_v_ * static_cast<size_t>(leaf_v)];
  }
  /// Beyond this plane there is nothing.
  int32_t end_k() const { return end_k_; }

  // Lows are computed as negative highs, and what rounds to the nearest is wider than what floors.
  HWY_INLINE Extent extent(int32_t from, int32_t to) const {
    Extent e;
#if HWY_TARGET == HWY_SCALAR
    const float a = static_cast<float>(from), b = static_cast<float>(to);
    for (int i = 0; i < 2; ++i) {
      const float lowest = bounds_.low_y[i] + std::min(a * bounds_.low_slope[i], b * bounds_.low_slope[i]);
      const float highest = bounds_.high_y[i] + std::max(a * bounds_.high_slope[i], b * bounds_.high_slope[i]);
      const int32_t corner = i == 0 ? corner_u_ : corner_v_;
      e.cell[2 * i] = corner + static_cast<int32_t>(std::floor(lowest + (0.5f - 0x1p-6f)));
      e.cell[2 * i + 1] = corner + static_cast<int32_t>(std::floor(highest + (0.5f + 0x1p-6f)));
    }
#else
    const hn::CappedTag<float, 4> d4;
    const hn::RebindToSigned<decltype(d4)> i4;
    const auto a = hn::Mul(slope4_, hn::Set(d4, static_cast<float>(from)));
    const auto b = hn::Mul(slope4_, hn::Set(d4, static_cast<float>(to)));
    const auto cell = hn::NearestInt(hn::Add(offset4_, hn::Max(a, b)));
    hn::Store(hn::Add(hn::Sub(hn::Xor(cell, sign4_), sign4_), corner4_), i4, e.cell);
#endif
    return e;
  }

  /// The same between each two of nine planes in a row.
  HWY_INLINE void extents(int32_t from, int32_t cells[4][kMostLanes]) const {
    const Floats df;
    const Ints di;
    for (int at = 0; at < 8; at += static_cast<int>(hn::Lanes(df))) {
      const F a = hn::ConvertTo(df, hn::Iota(di, from + at)), b = hn::Add(a, hn::Set(df, 1.0f));
      for (int i = 0; i < 2; ++i) {
        const F low = hn::Set(df, -bounds_.low_slope[i]), high = hn::Set(df, bounds_.high_slope[i]);
        const F low_y = hn::Set(df, 0x1p-6f - bounds_.low_y[i]), high_y = hn::Set(df, 0x1p-6f + bounds_.high_y[i]);
        const I corner = hn::Set(di, i == 0 ? corner_u_ : corner_v_);
        const I first = nearest_within(hn::Add(low_y, hn::Max(hn::Mul(a, low), hn::Mul(b, low))));
        const I last = nearest_within(hn::Add(high_y, hn::Max(hn::Mul(a, high), hn::Mul(b, high))));
        hn::Store(hn::Sub(corner, first), di, cells[2 * i] + at);
        hn::Store(hn::Add(corner, last), di, cells[2 * i + 1] + at);
      }
    }
  }

  /// From plane k on to the first in a layer of leaves of which one isn't empty near the beam, or to the end. `log2`:
  /// of the side of the cubes to be tried first, 3 to 7; of those to be tried next.
  HWY_INLINE int32_t pass_empty(int32_t k, int& log2) const {
    while (k < end_k_ && log2 >= 3) {
      const int32_t cell = corner_k_ + k;  // mirrored
      const int32_t size = 1 << log2, next = (cell | (size - 1)) + 1 - corner_k_;
      const Extent e = extent(k, next);
      const int32_t u0 = std::max(e.cell[0], 0) >> log2, u1 = std::min(e.cell[1], last_u_) >> log2;
      const int32_t v0 = std::max(e.cell[2], 0) >> log2, v1 = std::min(e.cell[3], last_v_) >> log2;
      bool clear = u1 - u0 <= 3 && v1 - v0 <= 3;
      const uint32_t least = static_cast<uint32_t>(size - 1);
      const int32_t layer = (cell ^ flip_) >> 3;
      for (int32_t a = u0; clear && a <= u1; ++a)
        for (int32_t b = v0; clear && b <= v1; ++b) {
          const uint32_t code = this->code(layer, a << (log2 - 3), b << (log2 - 3));
          clear = (code & BrickVolume::kSide) >= least && !(code & BrickVolume::kMixed);
        }
      if (!clear) {
        --log2;
      } else {
        k = next;
        // Larger cubes begin there only if it is a multiple of their side.
        if (((corner_k_ + next) & (2 * size - 1)) == 0) log2 = std::min(log2 + 1, 7);
      }
    }
    log2 = 3;
    return k;
  }

 private:
  PacketBounds bounds_;
  int32_t corner_u_, corner_v_;
  int m_;
  int32_t flip_, corner_k_, end_k_, last_u_, last_v_;
  const uint32_t* codes_;
  size_t stride_m_, stride_u_, stride_v_;
#if HWY_TARGET != HWY_SCALAR
  hn::Vec<hn::CappedTag<float, 4>> offset4_, slope4_;
  hn::Vec<hn::CappedTag<int32_t, 4>> sign4_, corner4_;
#endif
};

/// The live rays among [begin, end), which lie between the bounds, from plane `k` to their ends. Returns the plane at
/// which they are too wide, or -1.
int32_t march(const BrickVolume& bricks, Packet& p, const PacketBounds& bounds, size_t begin, size_t end, int32_t k,
              SliceCache& cache) {
  const uint64_t mine = (end - begin == 64 ? ~0ull : (1ull << (end - begin)) - 1) << begin;
  const Beam beam(bricks, p, bounds);
  const int m = p.main, u = p.u, v = p.v;
  const int32_t flip = p.flip, corner_k = p.corner[0];
  const int32_t* leaves = bricks.leaves_along();
  int log2 = k == 0 ? 7 : 3;
  const uint64_t* slices[4] = {};
  int32_t loaded_layer = INT32_MIN, loaded_u = 0, loaded_v = 0;
  static constexpr uint64_t kNothing[8] = {};
  while (p.alive & mine) {
    k = beam.pass_empty(k, log2);
    if (k >= beam.end_k()) break;
    const int32_t cell = corner_k + k;  // mirrored
    // The slabs of this layer of leaves, one by one.
    const int32_t layer = (cell ^ flip) >> 3, last = (cell | 7) - corner_k;
    alignas(64) int32_t cells[4][kMostLanes];
    beam.extents(k, cells);
    for (const int32_t first_k = k; k <= last && p.alive & mine; ++k) {
      const int at = k - first_k;
      const int32_t u0 = cells[0][at], u1 = cells[1][at], v0 = cells[2][at], v1 = cells[3][at];
      const int32_t leaf_u = u0 >> 3, leaf_v = v0 >> 3;
      if (u1 - leaf_u * 8 > 15 || v1 - leaf_v * 8 > 15) return k;
      if (layer != loaded_layer || leaf_u != loaded_u || leaf_v != loaded_v) {
        loaded_layer = layer, loaded_u = leaf_u, loaded_v = leaf_v;
        for (int i = 0; i < 4; ++i) {
          LeafPos leaf;
          leaf[m] = layer, leaf[u] = leaf_u + (i & 1), leaf[v] = leaf_v + (i >> 1);
          const bool held = static_cast<uint32_t>(leaf[u]) < static_cast<uint32_t>(leaves[u]) &&
                            static_cast<uint32_t>(leaf[v]) < static_cast<uint32_t>(leaves[v]);
          const uint32_t code = held ? beam.code(layer, leaf[u], leaf[v]) : 0;
          if (!(code & BrickVolume::kMixed)) {
            slices[i] = kNothing;
            continue;
          }
          const size_t place = size_t(leaf.x & 3) << 5 | size_t(leaf.y & 7) << 2 | size_t(leaf.z & 3);
          if (cache.axis[place] != m || cache.leaf[place] != leaf) {
            cache.axis[place] = static_cast<int8_t>(m), cache.leaf[place] = leaf;
            slices_of_leaf(bricks.words() + (code & BrickVolume::kFirstWord), m, cache.slices[place]);
          }
          slices[i] = cache.slices[place];
        }
      }
      const int slab = ((corner_k + k) ^ flip) & 7;
      Slice slice;
      const int r0 = u0 - leaf_u * 8, r1 = u1 - leaf_u * 8, c0 = v0 - leaf_v * 8, c1 = v1 - leaf_v * 8;
      const uint32_t columns = (2u << c1) - (1u << c0);
      const uint64_t low_columns = (columns & 0xff) * 0x0101010101010101ull,
                     high_columns = (columns >> 8 & 0xff) * 0x0101010101010101ull;
      const uint64_t low_rows = ~0ull << (8 * r0) & (r1 >= 7 ? ~0ull : (1ull << (8 * r1 + 8)) - 1);
      const uint64_t high_rows = r1 < 8 ? 0 : r1 == 15 ? ~0ull : (1ull << (8 * r1 - 56)) - 1;
      slice.word[0] = slices[0][slab] & low_rows & low_columns,
      slice.word[1] = slices[1][slab] & high_rows & low_columns;
      slice.word[2] = slices[2][slab] & low_rows & high_columns,
      slice.word[3] = slices[3][slab] & high_rows & high_columns;
      if (!(slice.word[0] | slice.word[1] | slice.word[2] | slice.word[3])) continue;
      slice.row = leaf_u * 8 - p.corner[1], slice.column = leaf_v * 8 - p.corner[2], slice.k = k;
      walk_slice(p, slice, begin, end);
    }
  }
  p.alive &= ~mine;  // they meet nothing
  return -1;
}

/// Up to kGroup packets that are framed are filled with rays [0, count), and pass together what is empty for all.
template <class Ray>
HWY_INLINE void begin_packets(const BrickVolume& bricks, Packet* packets, const Ray* rays, size_t count) {
  bool alike = true;
  PacketBounds all;
  bool any = false;
  for (size_t n = 0; n * kPacket < count; ++n) {
    Packet& p = packets[n];
    const size_t in_packet = std::min(kPacket, count - n * kPacket);
    load_packet(p, rays + n * kPacket, in_packet, bricks.low());
    prepare_packet(p, in_packet);
    p.begin_k = 0;
    const int32_t cell = p.corner[0] ^ p.flip;
    if (static_cast<uint32_t>(cell) >= static_cast<uint32_t>(bricks.leaves_along()[p.main] * kLeafSize)) {
      p.begin_k = Packet::kOutside;
      alike = false;
      continue;
    }
    if (!p.alive) continue;
    bound_packet(p, 0, kPacket, p.bounds);
    const Packet& q = packets[0];
    alike &= q.alive && p.main == q.main && p.flip == q.flip && std::equal(p.corner, p.corner + 3, q.corner);
    all.include(p.bounds);
    any = true;
  }
  if (!any || !alike || count <= kPacket) return;
  int log2 = 7;
  const int32_t k = Beam(bricks, packets[0], all).pass_empty(0, log2);
  for (size_t n = 0; n * kPacket < count; ++n) packets[n].begin_k = k;
}

/// One of them to its end; where it is too wide for a slice, each 16 rays of it by themselves. What is still alive
/// after that must go on from its plane some other way.
HWY_INLINE void walk_packet(const BrickVolume& bricks, Packet& p, SliceCache& cache) {
  for (int32_t& k : p.k) k = 0;
  if (!p.alive || p.begin_k == Packet::kOutside) return;
  const int32_t wide = march(bricks, p, p.bounds, 0, kPacket, p.begin_k, cache);
  if (wide < 0) return;
  for (size_t quarter = 0; quarter < 4; ++quarter)
    if (p.alive >> (16 * quarter) & 0xffff) {
      PacketBounds bounds;
      bound_packet(p, 16 * quarter, 16 * quarter + 16, bounds);
      p.k[quarter] = march(bricks, p, bounds, 16 * quarter, 16 * quarter + 16, wide, cache);
    }
}

void begin_grid_packets(const BrickVolume& bricks, Packet* packets, const GridRay* rays, size_t count) {
  begin_packets(bricks, packets, rays, count);
}
void begin_stream_packets(const BrickVolume& bricks, Packet* packets, const StreamRay* rays, size_t count) {
  begin_packets(bricks, packets, rays, count);
}
void walk_grid_packet(const BrickVolume& bricks, Packet& p, SliceCache& cache) {
  const WideVectors wide;
  walk_packet(bricks, p, cache);
}
void walk_stream_packet(const BrickVolume& bricks, Packet& p, SliceCache& cache) {
  const WideVectors wide;
  walk_packet(bricks, p, cache);
  finish_packet(p, bricks.low());
}

}  // namespace HWY_NAMESPACE
}  // namespace world
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace world {

namespace {
HWY_EXPORT(begin_grid_packets);
HWY_EXPORT(begin_stream_packets);
HWY_EXPORT(walk_grid_packet);
HWY_EXPORT(walk_stream_packet);
}  // namespace

/// Rays that left their packet, to go on in lanes when there are enough of them: from where they cross a plane.
struct RestOfRays {
  static constexpr size_t kSize = 512;
  GridRay moved[kSize];
  GridHit hits[kSize];
  uint32_t index[kSize];
  UnsureRays unsure;
  int8_t face[kSize];  // through which the moved ray entered its start voxel
  size_t count = 0;
};

namespace {

/// False: the crossing lies so close to another plane that only the exact walk can say where it leads.
bool move_to_plane(const GridRay& ray, int axis, int32_t plane, GridRay& moved) {
  constexpr double kClose = 1e-9;
  moved = ray;
  const bool up = ray.direction[axis] > 0;
  const double t = (static_cast<double>(plane - ray.voxel[axis]) - ray.fraction[axis]) / ray.direction[axis];
  for (int a = 0; a < 3; ++a) {
    if (a == axis) continue;
    const double at = ray.fraction[a] + t * ray.direction[a], whole = std::floor(at);
    moved.voxel[a] = ray.voxel[a] + static_cast<int32_t>(whole);
    moved.fraction[a] = at - whole;
    if (moved.fraction[a] < kClose || moved.fraction[a] > 1 - kClose) return false;
  }
  moved.voxel[axis] = plane - !up;
  moved.fraction[axis] = up ? 0.0 : 1.0;
  moved.t_max = kInfinity;
  return true;
}

}  // namespace

template <class Ray>
void RayStream::walk_rest(RestOfRays& rest, std::span<const Ray> rays, std::span<GridHit> hits,
                          StreamReport& report) const {
  walk_lanes(std::span<const GridRay>(rest.moved, rest.count), rest.hits, rest.unsure, report);
  for (size_t i = 0; i < rest.unsure.count; ++i)
    rest.hits[static_cast<size_t>(rest.unsure.ray[i])].end = WalkEnd::rejected;
  for (size_t i = 0; i < rest.count; ++i) {
    const GridRay ray = rays[rest.index[i]];
    GridHit& hit = hits[rest.index[i]];
    const GridHit& found = rest.hits[i];
    hit = {WalkEnd::t_max, {}, kNoFace, ray.t_max};
    if (found.end == WalkEnd::rejected) {
      hit = walker_.first_set(ray);
      ++report.exact;
    } else if (found.hit()) {
      const int face = found.face == kNoFace ? rest.face[i] : found.face;
      if (face == kNoFace) {
        hit = {WalkEnd::hit, found.voxel, kNoFace, 0};  // it starts there
        continue;
      }
      const int axis = face_axis(face);
      const int32_t plane = found.voxel[axis] + (face & 1);
      const double t = (static_cast<double>(plane - ray.voxel[axis]) - ray.fraction[axis]) * (1 / ray.direction[axis]);
      if (t <= ray.t_max) hit = {WalkEnd::hit, found.voxel, face, t};
    }
  }
  rest.count = 0;
}

GridHit RayStream::first_set_from(const GridRay& ray, int axis, int32_t plane) const {
  if (!ray.valid()) return {};
  const GridAxes axes(ray);
  WalkPlace place{ray.voxel, 0, -1};
  double t_limit = ray.t_max;
  const GridHit miss{WalkEnd::t_max, {}, kNoFace, ray.t_max};
  if (!walker_.clip(axes, place, t_limit)) return miss;
  const double t = axes.t_at(axis, plane);
  if (!(t <= t_limit)) return miss;
  if (t > place.t) mask_walk::cross(axes, place, axis, t, plane);
  if (!walker_.find(axes, place, t_limit)) return miss;
  const int face = place.axis < 0 ? kNoFace : entered_face(place.axis, axes.upwards[place.axis] != 0);
  return {WalkEnd::hit, place.voxel, face, place.t};
}

template <class Ray>
void RayStream::walk_packets(std::span<const Ray> rays, std::span<GridHit> hits, StreamReport* report) const {
  if (!bricks_.walkable()) {
    for (size_t i = 0; i < rays.size(); ++i) hits[i] = walker_.first_set(rays[i]);
    if (report) report->add({rays.size(), rays.size(), 0});
    return;
  }
  SliceCache cache;
  Packet packets[kGroup];
  alignas(RestOfRays) unsigned char room[sizeof(RestOfRays)];  // its rays are written before they are read
  RestOfRays& rest = *new (room) RestOfRays;
  StreamReport done;
  done.rays = rays.size();
  for (size_t begin = 0; begin < rays.size(); begin += kPacket) {
    const size_t count = std::min(kPacket, rays.size() - begin), n = begin / kPacket % kGroup;
    if (n == 0) frame_packets(packets, rays.subspan(begin, std::min(kGroup * kPacket, rays.size() - begin)));
    // The rays of the packet in its place in the next group come into the cache while this one walks.
    if (const size_t next = begin + kGroup * kPacket; next < rays.size())
      prefetch_records(rays.data() + next, std::min(kPacket, rays.size() - next));
    Packet& packet = packets[n];
    if (const uint64_t left =
            first_set_packet(packet, cache, rays.subspan(begin, count), hits.subspan(begin, count), done)) {
      if (rest.count + kPacket > RestOfRays::kSize) walk_rest(rest, rays, hits, done);
      for (uint64_t some = left; some; some &= some - 1) {
        const size_t i = static_cast<size_t>(std::countr_zero(some));
        const int32_t k = packet.k[i / 16];
        const bool up = packet.flip == 0;
        GridRay& moved = rest.moved[rest.count];
        rest.face[rest.count] = kNoFace;
        if (k > packet.start_k[i]) {
          const int32_t plane = ((packet.corner[0] + k) ^ packet.flip) + !up + bricks_.low()[packet.main];
          if (!move_to_plane(rays[begin + i], packet.main, plane, moved)) {
            hits[begin + i] = walker_.first_set(rays[begin + i]);
            ++done.exact;
            continue;
          }
          rest.face[rest.count] = static_cast<int8_t>(entered_face(packet.main, up));
        } else {
          moved = rays[begin + i];
          moved.t_max = kInfinity;
        }
        rest.index[rest.count++] = static_cast<uint32_t>(begin + i);
      }
    }
  }
  if (rest.count) walk_rest(rest, rays, hits, done);
  if (report) report->add(done);
}

template <class Ray>
void RayStream::frame_packets(Packet* packets, std::span<const Ray> rays) const {
  const VoxelPos low = bricks_.low();
  for (size_t n = 0; n * kPacket < rays.size(); ++n) {
    const Ray& middle = rays[n * kPacket + std::min(kPacket, rays.size() - n * kPacket) / 2];
    const Vec3d lead(middle.direction);
    Packet& p = packets[n];
    p.main = std::abs(lead.x) >= std::abs(lead.y) ? 0 : 1;
    if (std::abs(lead.z) > std::abs(lead[p.main])) p.main = 2;
    p.u = p.main == 0 ? 1 : 0, p.v = p.main == 2 ? 1 : 2;
    p.flip = lead[p.main] > 0 ? 0 : -1;
    p.alive = p.hit = p.unsure = 0;
    p.corner[1] = middle.voxel[p.u] - low[p.u], p.corner[2] = middle.voxel[p.v] - low[p.v];
  }
  if constexpr (std::is_same_v<Ray, StreamRay>)
    HWY_DYNAMIC_DISPATCH(begin_stream_packets)(bricks_, packets, rays.data(), rays.size());
  else
    HWY_DYNAMIC_DISPATCH(begin_grid_packets)(bricks_, packets, rays.data(), rays.size());
}

template <class Ray>
uint64_t RayStream::first_set_packet(Packet& p, SliceCache& cache, std::span<const Ray> rays, std::span<GridHit> hits,
                                     StreamReport& report) const {
  constexpr bool kInFloats = std::is_same_v<Ray, StreamRay>;
  if constexpr (kInFloats)
    HWY_DYNAMIC_DISPATCH(walk_stream_packet)(bricks_, p, cache);
  else
    HWY_DYNAMIC_DISPATCH(walk_grid_packet)(bricks_, p, cache);

  const size_t count = rays.size();
  const int m = p.main, u = p.u, v = p.v;
  const VoxelPos low = bricks_.low();
  // Exact t of what was hit.
  const int axes[4] = {0, m, u, v};
  const int32_t corner_k = p.corner[0], corner_u = p.corner[1] + low[u], corner_v = p.corner[2] + low[v];
  for (size_t i = 0; i < count; ++i) {
    const Ray& ray = rays[i];
    GridHit& hit = hits[i];
    const uint64_t bit = 1ull << i;
    if (p.hit & bit && kInFloats) {
      if (p.t[i] <= ray.t_max)
        hit = {WalkEnd::hit, {p.voxel[0][i], p.voxel[1][i], p.voxel[2][i]}, p.face[i], p.t[i]};
      else
        hit = {WalkEnd::t_max, {}, kNoFace, ray.t_max};
    } else if (p.hit & bit) {
      int32_t voxel[3];
      voxel[m] = ((p.hit_k[i] + corner_k) ^ p.flip) + low[m];
      voxel[u] = p.hit_u[i] + corner_u;
      voxel[v] = p.hit_v[i] + corner_v;
      const int axis = axes[p.hit_axis[i] + 1];
      const double direction = (&ray.direction.x)[axis];
      const bool upwards = direction >= 0;
      const double plane = static_cast<double>(voxel[axis] + !upwards - (&ray.voxel.x)[axis]);
      const bool started = p.hit_axis[i] < 0;
      const double t = started ? 0 : (plane - (&ray.fraction.x)[axis]) * (1 / direction);
      if (t <= ray.t_max)
        hit = {WalkEnd::hit, {voxel[0], voxel[1], voxel[2]}, started ? kNoFace : entered_face(axis, upwards), t};
      else
        hit = {WalkEnd::t_max, {}, kNoFace, ray.t_max};
    } else if (p.unsure & bit) {
      const int32_t k = p.hit_k[i];
      hit = k > p.start_k[i] && !(p.odd & bit)
                ? first_set_from(ray, m, ((corner_k + k) ^ p.flip) + (p.flip ? 1 : 0) + low[m])
                : walker_.first_set(ray);
      ++report.exact;
    } else if (!(p.alive & bit)) {
      hit = {WalkEnd::t_max, {}, kNoFace, ray.t_max};
    }
  }
  return p.alive;
}

void RayStream::first_set_coherent(std::span<const GridRay> rays, std::span<GridHit> hits, StreamReport* report) const {
  walk_packets(rays, hits, report);
}

void RayStream::first_set_coherent(std::span<const StreamRay> rays, std::span<GridHit> hits,
                                   StreamReport* report) const {
  walk_packets(rays, hits, report);
}

}  // namespace world
#endif
