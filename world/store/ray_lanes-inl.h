// Per SIMD target: what the ray casters' kernels share. Included once for each target, between HWY_BEFORE_NAMESPACE and
// HWY_AFTER_NAMESPACE users; see <hwy/foreach_target.h>.
#if defined(LOAM_RAY_LANES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef LOAM_RAY_LANES_INL
#undef LOAM_RAY_LANES_INL
#else
#define LOAM_RAY_LANES_INL
#endif

#include <cstring>

#include <hwy/highway.h>

#include "world/store/brick_volume.h"

#ifndef LOAM_RAY_LANES_ONCE
#define LOAM_RAY_LANES_ONCE
namespace world {
/// For each set of 8 lanes: the lanes in it, in ascending order, a byte each.
struct LaneOrders {
  uint64_t of[256] = {};
  constexpr LaneOrders() {
    for (int set = 0; set < 256; ++set)
      for (int lane = 0, at = 0; lane < 8; ++lane)
        if (set >> lane & 1) of[set] |= static_cast<uint64_t>(lane) << (8 * at++);
  }
};
inline constexpr LaneOrders kOrders;

/// For each set of 8 lanes, a byte a lane: how many lanes before it are in the set; 0 for lanes outside.
struct LaneRanks {
  uint64_t of[256] = {};
  constexpr LaneRanks() {
    for (int set = 0; set < 256; ++set)
      for (int lane = 0, rank = 0; lane < 8; ++lane)
        if (set >> lane & 1) of[set] |= static_cast<uint64_t>(rank++) << (8 * lane);
  }
};
inline constexpr LaneRanks kRanks;

/// Rays that must be walked in double, and from where: where they cross a plane of an axis, before which they meet
/// nothing, or from their start where the axis is -1. Lists end before a vector's room, which may be overwritten.
struct UnsureRays {
  static constexpr size_t kMost = 4096;
  size_t count = 0;
  alignas(64) int32_t ray[kMost + 16], axis[kMost + 16], plane[kMost + 16];
};

/// Asks for the bytes of `count` records, which may lie beyond what there is.
template <class Record>
inline void prefetch_records(const Record* begin, size_t count) {
  const char* bytes = reinterpret_cast<const char*>(begin);
  for (size_t at = 0; at < count * sizeof(Record); at += 64) __builtin_prefetch(bytes + at);
}
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
alignas(64) constexpr int32_t kLaneBits[16] = {1,      1 << 1, 1 << 2,  1 << 3,  1 << 4,  1 << 5,  1 << 6,  1 << 7,
                                               1 << 8, 1 << 9, 1 << 10, 1 << 11, 1 << 12, 1 << 13, 1 << 14, 1 << 15};

/// A bit a lane.
HWY_INLINE uint32_t bits_of(Ints d, hn::Mask<Ints> mask) {
  uint8_t bytes[8] = {};
  hn::StoreMaskBits(d, mask, bytes);
  return static_cast<uint32_t>(bytes[0]) | static_cast<uint32_t>(bytes[1]) << 8;
}

/// The lanes of which the bits are set.
HWY_INLINE hn::Mask<Ints> mask_of(uint32_t bits) {
  const Ints di;
  return hn::TestBit(hn::Set(di, static_cast<int32_t>(bits)), hn::Load(di, kLaneBits));
}

/// The nearest whole numbers of what lies within +-2^30, without the care that others need.
HWY_INLINE I nearest_within(F value) {
#if HWY_TARGET == HWY_AVX2
  return I{_mm256_cvtps_epi32(value.raw)};
#elif HWY_TARGET <= HWY_AVX3 && HWY_ARCH_X86
  return I{_mm512_cvtps_epi32(value.raw)};
#else
  return hn::NearestInt(value);
#endif
}

/// from[at[lane]] for each lane. `at` lies in memory, aligned; none is negative.
HWY_INLINE I gather(const int32_t* from, const int32_t* at) {
#if HWY_TARGET == HWY_AVX2
  // Faster than the instruction on several processors, and never much slower. Unsigned indices need no extension.
  const auto value = [&](int lane) { return from[static_cast<uint32_t>(at[lane])]; };
  const __m128i low = _mm_set_epi32(value(3), value(2), value(1), value(0));
  const __m128i high = _mm_set_epi32(value(7), value(6), value(5), value(4));
  return I{_mm256_set_m128i(high, low)};
#else
  return hn::GatherIndex(Ints(), from, hn::Load(Ints(), at));
#endif
}

/// Of a leaf's code and the word within it; of an empty leaf the first word of all, which is not to be looked at.
HWY_INLINE I word_index(I code, I word_in_leaf) {
  const Ints di;
  const I first = hn::And(code, hn::Set(di, static_cast<int32_t>(BrickVolume::kFirstWord)));
  return hn::And(hn::Or(first, word_in_leaf), hn::BroadcastSignBit(code));
}

/// Eight words of 32 bits of each record, from word `from` on, transposed: to[word - from][lane] of record `lane`.
template <class Record>
HWY_INLINE void load_transposed(const Record* records, int from, I to[8]) {
#if HWY_TARGET == HWY_AVX2
  __m256 row[8], pair[8];
  for (int i = 0; i < 4; ++i) {
    const auto half = [&](int record, int word) {
      return _mm_loadu_ps(reinterpret_cast<const float*>(records + record) + from + word);
    };
    // Rows i and i + 4 side by side: words 0..3, then words 4..7.
    row[i] = _mm256_insertf128_ps(_mm256_castps128_ps256(half(i, 0)), half(i + 4, 0), 1);
    row[i + 4] = _mm256_insertf128_ps(_mm256_castps128_ps256(half(i, 4)), half(i + 4, 4), 1);
  }
  for (int i = 0; i < 8; i += 4) {
    pair[i] = _mm256_unpacklo_ps(row[i], row[i + 1]), pair[i + 1] = _mm256_unpackhi_ps(row[i], row[i + 1]);
    pair[i + 2] = _mm256_unpacklo_ps(row[i + 2], row[i + 3]), pair[i + 3] = _mm256_unpackhi_ps(row[i + 2], row[i + 3]);
    to[i] = I{_mm256_castps_si256(_mm256_shuffle_ps(pair[i], pair[i + 2], 0x44))};
    to[i + 1] = I{_mm256_castps_si256(_mm256_shuffle_ps(pair[i], pair[i + 2], 0xee))};
    to[i + 2] = I{_mm256_castps_si256(_mm256_shuffle_ps(pair[i + 1], pair[i + 3], 0x44))};
    to[i + 3] = I{_mm256_castps_si256(_mm256_shuffle_ps(pair[i + 1], pair[i + 3], 0xee))};
  }
#else
  const Ints di;
  alignas(64) int32_t words[8][kMostLanes];
  for (size_t lane = 0; lane < hn::Lanes(di); ++lane) {
    int32_t record[8];
    std::memcpy(record, reinterpret_cast<const char*>(records + lane) + 4 * from, sizeof record);
    for (int word = 0; word < 8; ++word) words[word][lane] = record[word];
  }
  for (int word = 0; word < 8; ++word) to[word] = hn::Load(di, words[word]);
#endif
}

/// Stores the lanes of a mask side by side, in order, and whatever behind them: up to a whole vector is written.
class Compressor {
 public:
#if HWY_TARGET == HWY_AVX2
  // Highway 1.0 copies its table of orders to the stack at each call.
  explicit Compressor(hn::Mask<Ints> mask) : Compressor(bits_of(Ints(), mask)) {}
  explicit Compressor(uint32_t bits) {
    order_ = _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(static_cast<int64_t>(kOrders.of[bits])));
    count_ = hwy::PopCount(bits);
  }
  size_t count() const { return count_; }
  void store(I values, int32_t* to) const {
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), _mm256_permutevar8x32_epi32(values.raw, order_));
  }
  void store(F values, float* to) const { _mm256_storeu_ps(to, _mm256_permutevar8x32_ps(values.raw, order_)); }

 private:
  __m256i order_;
  size_t count_;
#else
  explicit Compressor(hn::Mask<Ints> mask) : mask_(mask) {}
  explicit Compressor(uint32_t bits) : mask_(mask_of(bits)) {}
  size_t count() const { return hn::CountTrue(Ints(), mask_); }
  // In a register first: some processors (AMD's of family 25) take a hundred times as long to do so to memory.
  void store(I values, int32_t* to) const { hn::StoreU(hn::Compress(values, mask_), Ints(), to); }
  void store(F values, float* to) const {
    hn::StoreU(hn::Compress(values, hn::RebindMask(Floats(), mask_)), Floats(), to);
  }

 private:
  hn::Mask<Ints> mask_;
#endif
};

/// The inverse: the lanes of a mask take values that lie side by side, in order.
class Expander {
 public:
  explicit Expander(uint32_t bits) : mask_(mask_of(bits)), count_(hwy::PopCount(bits)), indices_(indices(bits)) {}
  size_t count() const { return count_; }
  hn::Mask<Ints> mask() const { return mask_; }
  /// Up to a whole vector is read. Other lanes keep what they have.
  I load(const int32_t* from, I others) const {
    const Ints di;
    return hn::IfThenElse(mask_, hn::TableLookupLanes(hn::LoadU(di, from), indices_), others);
  }

 private:
  using Indices = decltype(hn::IndicesFromVec(Ints(), I()));
  static Indices indices(uint32_t bits) {
    const Ints di;
    const hn::Rebind<uint8_t, Ints> d8;
    alignas(16) uint64_t ranks[2] = {kRanks.of[bits & 0xff], 0};
    if (hn::Lanes(di) > 8) ranks[1] = kRanks.of[bits >> 8 & 0xff] + hwy::PopCount(bits & 0xff) * 0x0101010101010101ull;
    return hn::IndicesFromVec(di, hn::PromoteTo(di, hn::Load(d8, reinterpret_cast<const uint8_t*>(ranks))));
  }
  hn::Mask<Ints> mask_;
  size_t count_;
  Indices indices_;
};

}  // namespace HWY_NAMESPACE
}  // namespace world
HWY_AFTER_NAMESPACE();
#endif
