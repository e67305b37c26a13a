/// A picture: linear radiance in W/(m^2 sr), three bands, rows from the top.
#pragma once

#include <cstddef>
#include <vector>

#include "world/units/quantity.h"

namespace render {

using Rgb = world::Radiance3;
static_assert(sizeof(Rgb) == 12);

struct Image {
  int width = 0, height = 0;
  std::vector<Rgb> pixels;  // width * height

  Image() = default;
  Image(int w, int h) : width(w), height(h), pixels(static_cast<size_t>(w) * static_cast<size_t>(h)) {}
  Rgb& at(int x, int y) { return pixels[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)]; }
  const Rgb& at(int x, int y) const {
    return pixels[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)];
  }
};

/// A picture for the display: sRGB, 8 bits, 3 bytes a pixel, rows from the top.
struct Image8 {
  int width = 0, height = 0;
  std::vector<unsigned char> pixels;  // width * height * 3
};

}  // namespace render
