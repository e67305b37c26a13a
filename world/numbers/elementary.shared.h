/* Logarithm and exponential next to 1, where the plain ones lose their digits, from sums and products alone: so they
 * are the same on a GPU, whose own log may be off by 2^-21 there (Vulkan's bound).
 *
 * error   log_one_minus: 2 ulp. exp_minus_one: 2 ulp for |x| <= 1/2, else that of exp. Measured for all arguments of 16
 *         leading bits in tests/world/numbers/elementary_test.cpp.
 */
#ifndef LOAM_WORLD_NUMBERS_ELEMENTARY_SHARED_H
#define LOAM_WORLD_NUMBERS_ELEMENTARY_SHARED_H
#include "world/base/shared.h"

SHARED_NAMESPACE(world)

/* log(1 - x), x in [0, 1). */
SHARED float log_one_minus(float x) {
  if (x > 0.5f) return log(1.0f - x); /* 1 - x is exact, and log well away from its zero */
  /* 1 - x = (1 - z) / (1 + z); -2 artanh(z) as a series: the first term left out is z^14 / 15 < 2^-25 of the sum. */
  float z = x / (2.0f - x), y = z * z;
  float tail = 0.2f + y * (0.142857143f + y * (0.111111111f + y * (0.0909090909f + y * 0.0769230769f)));
  return -2.0f * (z + z * y * (0.333333333f + y * tail));
}

/* e^x - 1. */
SHARED float exp_minus_one(float x) {
  if (abs(x) > 0.5f) return exp(x) - 1.0f;
  /* Taylor's series: the first term left out is x^9 / 9!. */
  float tail = 4.16666667e-2f + x * (8.33333333e-3f + x * (1.38888889e-3f + x * (1.98412698e-4f + x * 2.48015873e-5f)));
  return x + x * x * (0.5f + x * (0.166666667f + x * tail));
}

SHARED_NAMESPACE_END

#endif
