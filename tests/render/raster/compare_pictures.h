/// Pictures of tests: drawn, and told from each other.
#pragma once

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <string_view>

#include <gtest/gtest.h>

#include "render/backend.h"
#include "render/image/display.h"

namespace render {

/// A failure where none comes; the picture is black then.
inline Frame draw(Backend& backend, const world::World& w, const Camera& camera, const RenderKnobs& knobs, int width,
                  int height) {
  auto drawn = backend.render(world::WorldView(w), camera, knobs, width, height);
  EXPECT_TRUE(drawn.ok()) << (drawn.ok() ? "" : drawn.error().message);
  return drawn.ok() ? std::move(*drawn) : Frame{Image(width, height), {}};
}

/// What the frame's report counts under this name; 0 where it doesn't.
inline uint64_t work(const Frame& drawn, std::string_view name) {
  for (const EffectWork& w : drawn.report.work)
    if (w.name == name) return w.work;
  return 0;
}

/// Bit for bit.
inline bool same(const Image& a, const Image& b) {
  return std::memcmp(a.pixels.data(), b.pixels.data(), a.pixels.size() * sizeof(Rgb)) == 0;
}

/// Part of the pixels that differ by at most so many levels of a display in each band.
inline double share_within(const Image& a, const Image& b, int levels) {
  const Image8 x = display_image(a, 0), y = display_image(b, 0);
  size_t within = 0;
  for (size_t i = 0; i < x.pixels.size(); i += 3) {
    int worst = 0;
    for (size_t c = 0; c < 3; ++c) worst = std::max(worst, std::abs(x.pixels[i + c] - y.pixels[i + c]));
    within += worst <= levels;
  }
  return 3.0 * static_cast<double>(within) / static_cast<double>(x.pixels.size());
}

/// Part of the pixels whose green differs by more than a twentieth.
inline double differing(const Image& a, const Image& b) {
  double count = 0;
  for (size_t i = 0; i < a.pixels.size(); ++i)
    count += std::abs(a.pixels[i].g - b.pixels[i].g) > 0.05f * std::max(a.pixels[i].g, b.pixels[i].g);
  return count / static_cast<double>(a.pixels.size());
}

}  // namespace render
