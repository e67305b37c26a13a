#include "render/image/blend.h"

#include <algorithm>

namespace render {

namespace {

/// Factor of one channel: of a colour channel with the values s, d and the constant c of that channel, or of alpha,
/// where all of them are alphas.
float factor_of(BlendFactor factor, float s, float d, float c, const Colour4& source, const Colour4& destination,
                const Colour4& constant, bool of_alpha) {
  switch (factor) {
    case BlendFactor::zero:
      return 0;
    case BlendFactor::one:
      return 1;
    case BlendFactor::src_color:
      return s;
    case BlendFactor::one_minus_src_color:
      return 1 - s;
    case BlendFactor::dst_color:
      return d;
    case BlendFactor::one_minus_dst_color:
      return 1 - d;
    case BlendFactor::src_alpha:
      return source.a;
    case BlendFactor::one_minus_src_alpha:
      return 1 - source.a;
    case BlendFactor::dst_alpha:
      return destination.a;
    case BlendFactor::one_minus_dst_alpha:
      return 1 - destination.a;
    case BlendFactor::constant_color:
      return c;
    case BlendFactor::one_minus_constant_color:
      return 1 - c;
    case BlendFactor::constant_alpha:
      return constant.a;
    case BlendFactor::one_minus_constant_alpha:
      return 1 - constant.a;
    case BlendFactor::src_alpha_saturate:
      return of_alpha ? 1 : std::min(source.a, 1 - destination.a);
    case BlendFactor::count:
      break;
  }
  return 0;
}

float combine(BlendEquation equation, float source, float destination, float source_factor, float destination_factor) {
  // A factor of 0 takes a value out, also one that isn't finite.
  const auto term = [](float factor, float value) { return factor == 0 ? 0 : factor * value; };
  switch (equation) {
    case BlendEquation::add:
      return term(source_factor, source) + term(destination_factor, destination);
    case BlendEquation::subtract:
      return term(source_factor, source) - term(destination_factor, destination);
    case BlendEquation::reverse_subtract:
      return term(destination_factor, destination) - term(source_factor, source);
    case BlendEquation::min:
      return std::min(source, destination);
    case BlendEquation::max:
    case BlendEquation::count:
      break;
  }
  return std::max(source, destination);
}

}  // namespace

Colour4 blend(const BlendState& state, const Colour4& s, const Colour4& d) {
  Colour4 result = d;
  const auto colour = [&](float& out, float source, float destination, float constant) {
    const auto of = [&](BlendFactor f) {
      return factor_of(f, source, destination, constant, s, d, state.constant, false);
    };
    out = combine(state.equation, source, destination, of(state.source), of(state.destination));
  };
  if (state.mask & kMaskRed) colour(result.r, s.r, d.r, state.constant.r);
  if (state.mask & kMaskGreen) colour(result.g, s.g, d.g, state.constant.g);
  if (state.mask & kMaskBlue) colour(result.b, s.b, d.b, state.constant.b);
  if (state.mask & kMaskAlpha) {
    const auto of = [&](BlendFactor f) { return factor_of(f, s.a, d.a, state.constant.a, s, d, state.constant, true); };
    result.a = combine(state.equation_alpha, s.a, d.a, of(state.source_alpha), of(state.destination_alpha));
  }
  return result;
}

Colour4Unorm8 over_unorm8(Colour4Unorm8 s, Colour4Unorm8 d) {
  const uint8_t left = static_cast<uint8_t>(255 - s.a);
  const auto channel = [&](uint8_t source, uint8_t destination) {
    return static_cast<uint8_t>(std::min(255, source + multiply_unorm8(left, destination)));
  };
  return {channel(s.r, d.r), channel(s.g, d.g), channel(s.b, d.b), channel(s.a, d.a)};
}

}  // namespace render
