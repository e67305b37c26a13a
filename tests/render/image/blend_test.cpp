/// Laws of blending, the chapter's examples, and hard cases A8 to A11 of 8-bit and float targets.
#include "render/image/blend.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "world/base/random.h"

namespace render {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

class Numbers {
 public:
  float unit() { return static_cast<float>(world::mix64(++n_) >> 40) / 16777216.0f; }
  Colour4 colour() { return {4 * unit(), 4 * unit(), 4 * unit(), unit()}; }
  /// Premultiplied.
  Colour4 covered() {
    const float a = unit();
    return {a * 4 * unit(), a * 4 * unit(), a * 4 * unit(), a};
  }

 private:
  uint64_t n_ = 20261126;
};

void expect_near(const Colour4& a, const Colour4& b, float tolerance) {
  EXPECT_NEAR(a.r, b.r, tolerance);
  EXPECT_NEAR(a.g, b.g, tolerance);
  EXPECT_NEAR(a.b, b.b, tolerance);
  EXPECT_NEAR(a.a, b.a, tolerance);
}

TEST(Blend, EachFactorIsWhatItsNameSays) {
  const Colour4 s{0.25f, 0.5f, 2, 0.75f}, d{1.5f, 0.125f, 0.5f, 0.5f};
  BlendState state;
  state.constant = {0.1f, 0.2f, 0.3f, 0.4f};
  // By factor, of the green channel and of alpha.
  const struct {
    BlendFactor factor;
    float green, alpha;
  } rows[] = {{BlendFactor::zero, 0, 0},
              {BlendFactor::one, 1, 1},
              {BlendFactor::src_color, 0.5f, 0.75f},
              {BlendFactor::one_minus_src_color, 0.5f, 0.25f},
              {BlendFactor::dst_color, 0.125f, 0.5f},
              {BlendFactor::one_minus_dst_color, 0.875f, 0.5f},
              {BlendFactor::src_alpha, 0.75f, 0.75f},
              {BlendFactor::one_minus_src_alpha, 0.25f, 0.25f},
              {BlendFactor::dst_alpha, 0.5f, 0.5f},
              {BlendFactor::one_minus_dst_alpha, 0.5f, 0.5f},
              {BlendFactor::constant_color, 0.2f, 0.4f},
              {BlendFactor::one_minus_constant_color, 0.8f, 0.6f},
              {BlendFactor::constant_alpha, 0.4f, 0.4f},
              {BlendFactor::one_minus_constant_alpha, 0.6f, 0.6f},
              {BlendFactor::src_alpha_saturate, 0.5f, 1}};
  ASSERT_EQ(std::size(rows), static_cast<size_t>(BlendFactor::count));
  for (const auto& row : rows) {
    state.source = state.source_alpha = row.factor;
    state.destination = state.destination_alpha = BlendFactor::zero;
    EXPECT_FLOAT_EQ(blend(state, s, d).g, row.green * s.g);
    EXPECT_FLOAT_EQ(blend(state, s, d).a, row.alpha * s.a);
    std::swap(state.source, state.destination);
    std::swap(state.source_alpha, state.destination_alpha);
    EXPECT_FLOAT_EQ(blend(state, s, d).g, row.green * d.g);
    EXPECT_FLOAT_EQ(blend(state, s, d).a, row.alpha * d.a);
  }
}

TEST(Blend, EquationsAndMasksActByChannel) {
  const Colour4 s{1, 2, 3, 0.5f}, d{4, 1, 7, 0.25f};
  BlendState state = blend_func(BlendFactor::one, BlendFactor::one);
  state.equation = state.equation_alpha = BlendEquation::subtract;
  EXPECT_EQ(blend(state, s, d), (Colour4{-3, 1, -4, 0.25f}));
  state.equation = state.equation_alpha = BlendEquation::reverse_subtract;
  EXPECT_EQ(blend(state, s, d), (Colour4{3, -1, 4, -0.25f}));
  // Factors have no effect on these two.
  state = blend_func(BlendFactor::zero, BlendFactor::zero);
  state.equation = BlendEquation::min, state.equation_alpha = BlendEquation::max;
  EXPECT_EQ(blend(state, s, d), (Colour4{1, 1, 3, 0.5f}));
  state = kBlendReplace;
  state.mask = kMaskRed | kMaskAlpha;
  EXPECT_EQ(blend(state, s, d), (Colour4{1, 1, 7, 0.5f}));
  state.mask = 0;
  EXPECT_EQ(blend(state, s, d), d);
}

TEST(Blend, OverIsAssociativeInPremultipliedAlphaAndOnlyThere) {
  Numbers numbers;
  float worst_straight = 0;
  for (int i = 0; i < 10000; ++i) {
    const Colour4 a = numbers.covered(), b = numbers.covered(), c = numbers.covered();
    const auto over = [](const Colour4& s, const Colour4& d) { return blend(kBlendOverPremultiplied, s, d); };
    expect_near(over(a, over(b, c)), over(over(a, b), c), 4e-6f);
    const auto straight = [](const Colour4& s, const Colour4& d) { return blend(kBlendOver, s, d); };
    worst_straight = std::max(worst_straight, std::abs(straight(a, straight(b, c)).r - straight(straight(a, b), c).r));
  }
  EXPECT_GT(worst_straight, 0.1f);
}

TEST(Blend, WhatCoversNothingOrAllIsTheIdentityOfOver) {
  Numbers numbers;
  for (int i = 0; i < 1000; ++i) {
    const Colour4 d = numbers.colour();
    EXPECT_EQ(blend(kBlendOverPremultiplied, {}, d), d);
    EXPECT_EQ(blend(kBlendKeep, numbers.colour(), d), d);
    Colour4 s = numbers.colour();
    EXPECT_EQ(blend(kBlendReplace, s, d), s);
    s.a = 1;
    EXPECT_EQ(blend(kBlendOverPremultiplied, s, d), s);
  }
}

TEST(Blend, TwoScreenDoorsLetASquareThrough) {
  // Equation 14.23: with coverage a of radiance s before a wall d, twice: d' = a s + (1 - a) (a s + (1 - a) d).
  const float a = 0.3f;
  const Colour4 s{0.2f, 0.4f, 0.8f, a}, wall{1, 0.1f, 0.05f, 1};
  const Colour4 twice = blend(kBlendOver, s, blend(kBlendOver, s, wall));
  EXPECT_NEAR(twice.r, a * s.r + (1 - a) * (a * s.r + (1 - a) * wall.r), 1e-6);
  EXPECT_NEAR(twice.b, a * s.b + (1 - a) * (a * s.b + (1 - a) * wall.b), 1e-6);
}

TEST(Blend, TwoPassesAreTheChaptersTransmission) {
  // 14.10.3: first t a + (1 - a) holds out the background by band, then a s is added.
  Numbers numbers;
  for (int i = 0; i < 1000; ++i) {
    const Colour4 s = numbers.colour(), d = numbers.colour();
    const float t[3] = {numbers.unit(), numbers.unit(), numbers.unit()};
    const auto held = [&](float share) { return share * s.a + (1 - s.a); };
    Colour4 seen = blend(kBlendTransmit, {held(t[0]), held(t[1]), held(t[2]), 1}, d);
    seen = blend(kBlendCovered, s, seen);
    EXPECT_NEAR(seen.r, s.r * s.a + d.r * held(t[0]), 4e-6);
    EXPECT_NEAR(seen.g, s.g * s.a + d.g * held(t[1]), 4e-6);
    EXPECT_NEAR(seen.b, s.b * s.a + d.b * held(t[2]), 4e-6);
  }
}

TEST(Blend, AFactorOfZeroTakesOutWhatIsNotFinite) {
  const Colour4 d{kInfinity, std::nanf(""), 1, 1}, s{0.5f, 0.25f, 0.125f, 1};
  EXPECT_EQ(blend(kBlendReplace, s, d), s);
  EXPECT_EQ(blend(kBlendOverPremultiplied, s, d), s);
}

TEST(HardCaseA8, EightBitProductsAreRoundedRightAndWhiteStaysWhite) {
  for (int a = 0; a < 256; ++a)
    for (int b = 0; b < 256; ++b)
      ASSERT_EQ(multiply_unorm8(static_cast<uint8_t>(a), static_cast<uint8_t>(b)),
                static_cast<int>(std::floor(a * b / 255.0 + 0.5)));
  for (int alpha = 0; alpha < 256; ++alpha) {
    const uint8_t a = static_cast<uint8_t>(alpha);
    Colour4Unorm8 white{255, 255, 255, 255};
    for (int layer = 0; layer < 100; ++layer) white = over_unorm8({a, a, a, a}, white);
    EXPECT_EQ(white, (Colour4Unorm8{255, 255, 255, 255})) << alpha;
  }
}

TEST(HardCaseA9, AlphaOfNoneAndAllKeepBits) {
  for (int v = 0; v < 256; ++v) {
    const uint8_t c = static_cast<uint8_t>(v);
    const Colour4Unorm8 any{c, static_cast<uint8_t>(255 - v), 17, static_cast<uint8_t>(v ^ 85)};
    EXPECT_EQ(over_unorm8({}, any), any);
    EXPECT_EQ(over_unorm8({c, 3, 200, 255}, any), (Colour4Unorm8{c, 3, 200, 255}));
  }
}

TEST(HardCaseA10, HalfwayBetweenWhiteAndNothingIsHalfOfWhiteAndAddedLightIsKept) {
  // Premultiplied, the mean of (1,1,1,1) and (0,0,0,0) over any ground is half white, half ground: no dark fringe.
  const Colour4 edge{0.5f, 0.5f, 0.5f, 0.5f}, ground{0.25f, 0.5f, 0.75f, 1};
  EXPECT_EQ(blend(kBlendOverPremultiplied, edge, ground), (Colour4{0.625f, 0.75f, 0.875f, 1}));
  // Colour without coverage is emission: it is added.
  EXPECT_EQ(blend(kBlendOverPremultiplied, {1, 0.5f, 0, 0}, ground), (Colour4{1.25f, 1, 0.75f, 1}));
}

TEST(HardCaseA11, ThirtyTwoLayersOfHalfKeepTheirShareInFloat) {
  Colour4 through{1, 1, 1, 1};
  for (int layer = 0; layer < 32; ++layer) through = blend(kBlendTransmit, {0.5f, 0.5f, 0.5f, 0.5f}, through);
  EXPECT_FLOAT_EQ(through.r, std::pow(0.5f, 32));
  // In 8 bits nothing is left from the ninth layer on: such a target is no place for what layers let through.
  Colour4Unorm8 left{255, 255, 255, 255};
  int layers = 0;
  for (; left.r > 0; ++layers) left.r = multiply_unorm8(127, left.r);
  EXPECT_LE(layers, 9);
}

}  // namespace
}  // namespace render
