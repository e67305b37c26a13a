/// Blending: how the value of a pixel is updated by a new one, as graphics interfaces name it.
///
///   destination' = equation(source_factor * source, destination_factor * destination), by channel, where the mask lets
///
/// The enumerants are those of OpenGL's glBlendFunc, glBlendEquation, glBlendColor and glColorMask (Vulkan has the
/// same). The chapter's table prints d_c for ONE_MINUS_DST_COLOR; it is 1 - d_c here, as its name says.
/// source  McGuire, Hughes et al. Computer Graphics: Principles and Practice, 3rd edition. 2013, sections 14.10.1 to
///         14.10.4; Thomas Porter, Tom Duff. Compositing Digital Images. 1984 (over, premultiplied alpha)
#pragma once

#include <cstdint>

namespace render {

/// Radiance or a share by band, and coverage in [0, 1].
struct Colour4 {
  float r = 0, g = 0, b = 0, a = 0;
  friend bool operator==(const Colour4&, const Colour4&) = default;
};

enum class BlendFactor : uint8_t {
  zero,
  one,
  src_color,
  one_minus_src_color,
  dst_color,
  one_minus_dst_color,
  src_alpha,
  one_minus_src_alpha,
  dst_alpha,
  one_minus_dst_alpha,
  constant_color,
  one_minus_constant_color,
  constant_alpha,
  one_minus_constant_alpha,
  src_alpha_saturate,  // min(s.a, 1 - d.a) for colour, 1 for alpha
  count
};
enum class BlendEquation : uint8_t {
  add,
  subtract,          // source - destination
  reverse_subtract,  // destination - source
  min,               // of the two values; the factors have no effect
  max,
  count
};
enum ColourMask : uint8_t { kMaskRed = 1, kMaskGreen = 2, kMaskBlue = 4, kMaskAlpha = 8, kMaskAll = 15 };

/// Of colour and of alpha apart.
struct BlendState {
  BlendFactor source = BlendFactor::one, destination = BlendFactor::zero;
  BlendEquation equation = BlendEquation::add;
  BlendFactor source_alpha = BlendFactor::one, destination_alpha = BlendFactor::zero;
  BlendEquation equation_alpha = BlendEquation::add;
  uint8_t mask = kMaskAll;
  Colour4 constant{};
  friend bool operator==(const BlendState&, const BlendState&) = default;
};

/// The chapter's BlendFunc(source, destination): the same for colour and alpha, added, all channels written.
constexpr BlendState blend_func(BlendFactor source, BlendFactor destination) {
  return {source, destination, BlendEquation::add, source, destination, BlendEquation::add, kMaskAll, {}};
}
/// What the chapter uses, by name.
constexpr BlendState kBlendReplace = blend_func(BlendFactor::one, BlendFactor::zero);
constexpr BlendState kBlendKeep = blend_func(BlendFactor::zero, BlendFactor::one);
constexpr BlendState kBlendOver = blend_func(BlendFactor::src_alpha, BlendFactor::one_minus_src_alpha);
constexpr BlendState kBlendOverPremultiplied = blend_func(BlendFactor::one, BlendFactor::one_minus_src_alpha);
constexpr BlendState kBlendTransmit = blend_func(BlendFactor::zero, BlendFactor::src_color);  // first of two passes
constexpr BlendState kBlendCovered = blend_func(BlendFactor::src_alpha, BlendFactor::one);    // the second
constexpr BlendState kBlendAdd = blend_func(BlendFactor::one, BlendFactor::one);

/// What a float target holds afterwards. error: 2 ulp of the largest term of each channel.
Colour4 blend(const BlendState& state, const Colour4& source, const Colour4& destination);

/// a * b of numbers in [0, 1] stored as k / 255, rounded to nearest: exact for all 65,536 pairs (hard case A8).
constexpr uint8_t multiply_unorm8(uint8_t a, uint8_t b) {
  const uint32_t x = uint32_t{a} * b + 128;
  return static_cast<uint8_t>((x + (x >> 8)) >> 8);
}
struct Colour4Unorm8 {
  uint8_t r = 0, g = 0, b = 0, a = 0;
  friend bool operator==(const Colour4Unorm8&, const Colour4Unorm8&) = default;
};
/// Premultiplied source over destination in 8 bits; what is additive beyond 1 is clamped. Alpha 0 with no colour leaves
/// the destination's bits, alpha 255 the source's (hard case A9).
Colour4Unorm8 over_unorm8(Colour4Unorm8 source, Colour4Unorm8 destination);

}  // namespace render
