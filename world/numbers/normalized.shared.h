/* Normalized integers: N bits for [0, 1] (Unorm) or [-1, 1] (Snorm), N <= 16.
 *
 *   Unorm<N>   code c means c / (2^N - 1): 0 and 1 are exact.
 *   Snorm<N>   code c, signed, means max(c / (2^(N-1) - 1), -1): -1, 0 and 1 are exact, and the two lowest codes both
 *              mean -1. (Of 2^N equal steps over [-1, 1] none would fall on 0.)
 *
 * error   rounding to nearest: at most half a step, 0.5/(2^N - 1) or 0.5/(2^(N-1) - 1), plus 2^-23 for float's own
 *         rounding. Every code comes back unchanged, save Snorm's lowest, which comes back as the one above it.
 * fails   never: what lies outside the range is clamped to it, NaN becomes 0.
 * source  Hughes and others. Computer Graphics: Principles and Practice, 3rd edition. 2013, section 14.3.1;
 *         Vulkan specification, "Fixed-Point Data Conversions" */
#ifndef LOAM_NORMALIZED_SHARED_H
#define LOAM_NORMALIZED_SHARED_H
#include "world/base/shared.h"

SHARED_NAMESPACE(world)

/* 0 where x is NaN: a comparison with NaN is false. GLSL's min and clamp leave it open. */
SHARED float clamp_unit(float x) { return x > 0.0f ? (x < 1.0f ? x : 1.0f) : 0.0f; }

SHARED uint unorm_from_float(float x, uint bits) {
  float top = float((1u << bits) - 1u);
  return uint(floor(clamp_unit(x) * top + 0.5f));
}
SHARED float float_from_unorm(uint code, uint bits) { return float(code) / float((1u << bits) - 1u); }

/* Symmetric: the code of -x is minus the code of x. */
SHARED int snorm_from_float(float x, uint bits) {
  float top = float((1u << (bits - 1u)) - 1u);
  int code = int(floor(clamp_unit(x < 0.0f ? -x : x) * top + 0.5f));
  return x < 0.0f ? -code : code;
}
SHARED float float_from_snorm(int code, uint bits) {
  float x = float(code) / float((1u << (bits - 1u)) - 1u);
  return x > -1.0f ? x : -1.0f;
}

SHARED_NAMESPACE_END

#ifdef __cplusplus
#include <type_traits>

namespace world {

/// N bits of [0, 1], as small as the machine stores them.
template <int N>
struct Unorm {
  static_assert(N >= 1 && N <= 16);
  using Code = std::conditional_t<(N <= 8), uint8_t, uint16_t>;
  static constexpr uint32_t kTop = (1u << N) - 1;
  Code code = 0;
  static Unorm from(float x) { return {static_cast<Code>(shared::unorm_from_float(x, N))}; }
  float value() const { return shared::float_from_unorm(code, N); }
  friend constexpr auto operator<=>(Unorm, Unorm) = default;
};

/// N bits of [-1, 1].
template <int N>
struct Snorm {
  static_assert(N >= 2 && N <= 16);
  using Code = std::conditional_t<(N <= 8), int8_t, int16_t>;
  static constexpr int kTop = (1 << (N - 1)) - 1;
  Code code = 0;
  static Snorm from(float x) { return {static_cast<Code>(shared::snorm_from_float(x, N))}; }
  float value() const { return shared::float_from_snorm(code, N); }
  friend constexpr bool operator==(Snorm a, Snorm b) { return a.code == b.code; }
};

}  // namespace world
#endif
#endif
