/// Counter-based random numbers: a number is a function of (seed, position, tick, stream), never of call order.
#pragma once

#include <cstdint>

namespace world {

/// Mixes 64 bits so that each input bit changes each output bit with probability near 1/2.
/// source: Sebastiano Vigna, finaliser "mix13" of David Stafford, as in SplitMix64 (Steele, Lea, Flood. Fast
///         Splittable Pseudorandom Number Generators. 2014)
constexpr uint64_t mix64(uint64_t h) {
  h = (h ^ (h >> 30)) * 0xbf58476d1ce4e5b9ull;
  h = (h ^ (h >> 27)) * 0x94d049bb133111ebull;
  return h ^ (h >> 31);
}

/// Not symmetric, and not a function of h + value: seed 2 at x = 2 has nothing to do with seed 1 at x = 3.
constexpr uint64_t hash_combine(uint64_t h, uint64_t value) { return mix64((h + 1) * 0x9e3779b97f4a7c15ull + value); }

constexpr uint64_t random_bits(uint64_t seed, int64_t x, int64_t y, int64_t z, uint64_t tick = 0, uint64_t stream = 0) {
  uint64_t h = hash_combine(seed, static_cast<uint64_t>(x));
  h = hash_combine(h, static_cast<uint64_t>(y));
  h = hash_combine(h, static_cast<uint64_t>(z));
  return hash_combine(hash_combine(h, tick), stream);
}

/// In [0, 1), never 1: the top 24 bits, so the largest is 1 - 2^-24.
constexpr float uniform01(uint64_t bits) { return static_cast<float>(bits >> 40) * 0x1p-24f; }
/// In [0, 1): the top 53 bits.
constexpr double uniform01_double(uint64_t bits) { return static_cast<double>(bits >> 11) * 0x1p-53; }

}  // namespace world
