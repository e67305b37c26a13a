#include "sim/matter/fire_kernel.h"

#include <cstring>

#include "world/space/coords.h"
#include "world/store/leaf_shifts.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sim/matter/fire_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace sim {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using world::LeafMask;
using Ids = hn::CappedTag<uint16_t, 32>;
using Units = hn::CappedTag<int32_t, 16>;
using Words = hn::CappedTag<uint64_t, 8>;
constexpr Ids kIds;
constexpr Units kUnits;
constexpr Words kWords;

/// A vector's lanes of a leaf's mask, from voxel i on.
template <class D>
HWY_INLINE hn::Mask<D> lanes_of(D d, const LeafMask& mask, int i) {
  uint64_t bits = mask.word[i >> 6] >> (i & 63);
  uint8_t bytes[8];
  std::memcpy(bytes, &bits, sizeof bits);
  return hn::LoadMaskBits(d, bytes);
}
/// Calls holds(i) for each vector of a leaf; what it returns are the lanes of a mask.
template <class D, class Holds>
HWY_INLINE LeafMask mask_where(D d, Holds holds) {
  constexpr int kLanes = static_cast<int>(hn::MaxLanes(D()));
  LeafMask mask;
  for (int x = 0; x < 8; ++x) {
    uint64_t word = 0;
    for (int k = 0; k < 64; k += kLanes) {
      uint8_t bytes[8] = {};
      hn::StoreMaskBits(d, holds(x * 64 + k), bytes);
      uint64_t bits;
      std::memcpy(&bits, bytes, sizeof bits);
      word |= bits << k;
    }
    mask.word[x] = word;
  }
  return mask;
}

LeafMask VoxelsOf(const uint16_t* ids, uint16_t id) {
  const auto wanted = hn::Set(kIds, id);
  return mask_where(kIds, [&](int i) HWY_ATTR { return hn::Eq(hn::LoadU(kIds, ids + i), wanted); });
}

LeafMask VoxelsFrom(const int32_t* heats, int32_t least) {
  const auto limit = hn::Set(kUnits, least);
  return mask_where(kUnits, [&](int i) HWY_ATTR { return hn::Not(hn::Lt(hn::LoadU(kUnits, heats + i), limit)); });
}

int AddTimes(const TimesMasks& times, int32_t units, int32_t* heats) {
  for (int i = 0; i < world::kLeafVoxels; i += static_cast<int>(hn::MaxLanes(kUnits))) {
    auto sum = hn::LoadU(kUnits, heats + i);
    for (int k = 0; k < 4; ++k)
      sum = hn::Add(sum, hn::IfThenElseZero(lanes_of(kUnits, times.times[k], i), hn::Set(kUnits, units << k)));
    hn::StoreU(sum, kUnits, heats + i);
  }
  auto count = hn::Zero(kWords);
  for (int x = 0; x < 8; x += static_cast<int>(hn::MaxLanes(kWords)))
    for (int k = 0; k < 4; ++k)
      count = hn::Add(count, hn::ShiftLeftSame(hn::PopulationCount(hn::LoadU(kWords, times.times[k].word + x)), k));
  return static_cast<int>(hn::GetLane(hn::SumOfLanes(kWords, count)));
}

LeafMask Spend(const LeafMask& which, uint16_t part, uint16_t* spent) {
  return mask_where(kIds, [&](int i) HWY_ATTR {
    const auto before = hn::LoadU(kIds, spent + i);
    const auto more = hn::IfThenElseZero(lanes_of(kIds, which, i), hn::Set(kIds, part));
    const auto sum = hn::Add(before, more);
    const auto all = hn::Ne(sum, hn::SaturatedAdd(before, more));
    hn::StoreU(hn::IfThenZeroElse(all, sum), kIds, spent + i);
    return all;
  });
}

void KeepOnly(const LeafMask& which, uint16_t* values) {
  for (int i = 0; i < world::kLeafVoxels; i += static_cast<int>(hn::MaxLanes(kIds)))
    hn::StoreU(hn::IfThenElseZero(lanes_of(kIds, which, i), hn::LoadU(kIds, values + i)), kIds, values + i);
}

}  // namespace HWY_NAMESPACE
}  // namespace sim
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sim {

using world::LeafMask;

HWY_EXPORT(VoxelsOf);
HWY_EXPORT(VoxelsFrom);
HWY_EXPORT(AddTimes);
HWY_EXPORT(Spend);
HWY_EXPORT(KeepOnly);

LeafMask voxels_of(const world::BlockId* ids, world::BlockId id) { return HWY_DYNAMIC_DISPATCH(VoxelsOf)(ids, id); }
LeafMask voxels_from(const int32_t* heats, int32_t least) { return HWY_DYNAMIC_DISPATCH(VoxelsFrom)(heats, least); }
int add_times(const TimesMasks& times, int32_t units, int32_t* heats) {
  return HWY_DYNAMIC_DISPATCH(AddTimes)(times, units, heats);
}
LeafMask spend(const LeafMask& which, uint16_t part, uint16_t* spent) {
  return HWY_DYNAMIC_DISPATCH(Spend)(which, part, spent);
}
void keep_only(const LeafMask& which, uint16_t* values) { HWY_DYNAMIC_DISPATCH(KeepOnly)(which, values); }

TimesMasks count_burning(const LeafMask& burns, const LeafMask* const* beyond, const LeafMask& takes) {
  LeafMask from[6];
  from[world::kFaceNegX] = world::across(burns, *beyond[world::kFaceNegX], world::kFaceNegX);
  from[world::kFacePosX] = world::across(burns, *beyond[world::kFacePosX], world::kFacePosX);
  from[world::kFaceNegY] = world::across(burns, *beyond[world::kFaceNegY], world::kFaceNegY);
  from[world::kFacePosY] = world::across(burns, *beyond[world::kFacePosY], world::kFacePosY);
  from[world::kFaceNegZ] = world::across(burns, *beyond[world::kFaceNegZ], world::kFaceNegZ);
  from[world::kFacePosZ] = world::across(burns, *beyond[world::kFacePosZ], world::kFacePosZ);
  TimesMasks result;
  for (int x = 0; x < 8; ++x) {
    // Two sums of three bits, then of what they carry and what burns below.
    const uint64_t own = burns.word[x], a = from[world::kFaceNegX].word[x], b = from[world::kFacePosX].word[x];
    const uint64_t c = from[world::kFacePosY].word[x], d = from[world::kFaceNegZ].word[x];
    const uint64_t e = from[world::kFacePosZ].word[x], below = from[world::kFaceNegY].word[x];
    const uint64_t one = own ^ a ^ b, one_carried = (own & a) | (b & (own ^ a));
    const uint64_t other = c ^ d ^ e, other_carried = (c & d) | (e & (c ^ d));
    const uint64_t both = one & other, two = one_carried ^ other_carried ^ both;
    const uint64_t two_carried = (one_carried & other_carried) | (both & (one_carried ^ other_carried));
    const uint64_t more_carried = two & below, in = takes.word[x];
    result.times[0].word[x] = (one ^ other) & in;
    result.times[1].word[x] = (two ^ below) & in;
    result.times[2].word[x] = (two_carried ^ more_carried) & in;
    result.times[3].word[x] = (two_carried & more_carried) & in;
  }
  return result;
}

}  // namespace sim
#endif
