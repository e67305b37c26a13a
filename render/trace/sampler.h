/// The random numbers of a picture: each a pure function of (seed, pixel, sample, dimension), never of call order. So
/// pictures don't depend on threads, and a picture that goes on after a stop is the one that never stopped.
///
///   random  independent numbers. Errors fall as 1/sqrt(samples), and variances over samples say how large they are.
///   sobol   each pair of dimensions is a (0, 2)-sequence in base 2, nested-uniformly ("Owen") scrambled, its order
///           too, all by hashes of (seed, pixel, pair): any 2^k samples that begin at a multiple of 2^k are stratified
///           in every elementary interval of area 2^-k. Errors fall faster where the integrand is smooth; variances
///           over samples then overstate them.
/// error   numbers are multiples of 2^-24 in [0, 1)
/// source  Art Owen. Randomly Permuted (t,m,s)-Nets and (t,s)-Sequences. 1995; Brent Burley. Practical Hash-based Owen
///         Scrambling. 2020 (pairs padded by shuffled indices); the hash is that of Samuli Laine, Tero Karras.
///         Stratified Sampling for Stochastic Transparency. 2011, with the constants of Nathan Vegdahl. Building a
///         Better LK Hash. 2021
#pragma once

#include <cstdint>

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "render/knobs.h"
#include "world/base/random.h"

namespace render {

namespace sequence {

constexpr uint32_t reversed_bits(uint32_t v) {
  v = (v >> 16) | (v << 16);
  v = (v & 0xff00ff00u) >> 8 | (v & 0x00ff00ffu) << 8;
  v = (v & 0xf0f0f0f0u) >> 4 | (v & 0x0f0f0f0fu) << 4;
  v = (v & 0xccccccccu) >> 2 | (v & 0x33333333u) << 2;
  return (v & 0xaaaaaaaau) >> 1 | (v & 0x55555555u) << 1;
}

/// Each bit is flipped by a hash of the bits above it, as nested uniform scrambling needs.
constexpr uint32_t owen_scrambled(uint32_t v, uint32_t seed) {
  v = reversed_bits(v);
  v ^= v * 0x3d20adeau;
  v += seed;
  v *= (seed >> 16) | 1u;
  v ^= v * 0x05526c56u;
  v ^= v * 0x53a22864u;
  return reversed_bits(v);
}

/// The first two dimensions of Sobol's sequence, as fractions of 2^32.
constexpr uint32_t sobol_0(uint32_t index) { return reversed_bits(index); }
constexpr uint32_t sobol_1(uint32_t index) {
  uint32_t result = 0;
  for (uint32_t direction = 0x80000000u; index != 0; index >>= 1, direction ^= direction >> 1)
    if (index & 1) result ^= direction;
  return result;
}

constexpr float unit_float(uint32_t fraction) { return static_cast<float>(fraction >> 8) * 0x1p-24f; }

}  // namespace sequence

/// Numbers of which nobody knows how many are needed: free paths in media, Russian roulette.
class RandomStream {
 public:
  explicit RandomStream(uint64_t key) : key_(key) {}
  float next() { return world::uniform01(world::hash_combine(key_, count_++)); }
  double next_double() { return world::uniform01_double(world::hash_combine(key_, count_++)); }
  /// Numbers that have nothing to do with those of this one.
  RandomStream split() { return RandomStream(world::hash_combine(key_, count_++)); }
  /// The i-th of many such, of those drawn so far.
  RandomStream part(uint64_t i) const { return RandomStream(world::hash_combine(key_, ~i)); }

 private:
  uint64_t key_, count_ = 0;
};

class Sampler {
 public:
  Sampler(SampleSequence sequence, uint64_t seed, uint32_t pixel_x, uint32_t pixel_y, uint32_t sample)
      : key_(world::hash_combine(world::hash_combine(seed, uint64_t{pixel_y} << 32 | pixel_x), 0x10a3)),
        sample_(sample),
        sequence_(sequence) {}

  float one(uint32_t dimension) const {
    if (sequence_ == SampleSequence::random) return independent(dimension);
    const uint64_t hash = world::hash_combine(key_, dimension);
    const uint32_t index = sequence::owen_scrambled(sample_, static_cast<uint32_t>(hash));
    return sequence::unit_float(sequence::owen_scrambled(sequence::sobol_0(index), static_cast<uint32_t>(hash >> 32)));
  }
  /// Uses up dimension and dimension + 1.
  glm::vec2 two(uint32_t dimension) const {
    if (sequence_ == SampleSequence::random) return {independent(dimension), independent(dimension + 1)};
    const uint64_t hash = world::hash_combine(key_, dimension), more = world::mix64(hash + 1);
    const uint32_t index = sequence::owen_scrambled(sample_, static_cast<uint32_t>(hash));
    return {sequence::unit_float(sequence::owen_scrambled(sequence::sobol_0(index), static_cast<uint32_t>(hash >> 32))),
            sequence::unit_float(sequence::owen_scrambled(sequence::sobol_1(index), static_cast<uint32_t>(more)))};
  }
  /// Uses up dimension to dimension + 2; x and y are stratified together, for a direction, z apart, for a choice.
  glm::vec3 three(uint32_t dimension) const { return {two(dimension), one(dimension + 2)}; }
  RandomStream stream(uint32_t dimension) const {
    return RandomStream(world::hash_combine(world::hash_combine(key_, sample_), uint64_t{1} << 32 | dimension));
  }
  uint32_t sample() const { return sample_; }
  /// The same pixel's i-th of n parts of this sample: for several samples of one light.
  Sampler part(uint32_t i, uint32_t n) const {
    Sampler s = *this;
    s.sample_ = sample_ * n + i;
    return s;
  }

 private:
  float independent(uint32_t dimension) const {
    return world::uniform01(world::hash_combine(world::hash_combine(key_, sample_), dimension));
  }
  uint64_t key_;
  uint32_t sample_;
  SampleSequence sequence_;
};

}  // namespace render
