/// What a function of a foreach_target file that is called from others begins with: WideVectors wide;
///
/// Its end clears the upper halves of vectors. Left as they are, each change between such instructions and SSE's costs
/// some 170 cycles (measured on a Xeon, 2026: a third of a page's conduction of heat). Compilers see to that, but g++
/// 12 doesn't where a call comes shortly before the return.
#if defined(WORLD_BASE_WIDE_VECTORS_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef WORLD_BASE_WIDE_VECTORS_INL_H
#undef WORLD_BASE_WIDE_VECTORS_INL_H
#else
#define WORLD_BASE_WIDE_VECTORS_INL_H
#endif

#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace world {
namespace HWY_NAMESPACE {

struct WideVectors {
  HWY_INLINE ~WideVectors() {
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX2
    _mm256_zeroupper();
#endif
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace world
HWY_AFTER_NAMESPACE();

#endif
