/// A picture: linear radiance in W/(m^2 sr), three bands, rows from the top.
#pragma once

#include <cstddef>
#include <vector>

#include "world/base/unset.h"
#include "world/units/quantity.h"

namespace render {

using Rgb = world::Radiance3;
static_assert(sizeof(Rgb) == 12);

struct Image {
  int width = 0, height = 0;
  std::vector<Rgb, world::UnsetAllocator<Rgb>> pixels;  // width * height

  Image() = default;
  /// Black.
  Image(int w, int h) : width(w), height(h), pixels(static_cast<size_t>(w) * static_cast<size_t>(h), Rgb{}) {}
  /// To be written whole: what its pixels hold is anything.
  static Image unset(int w, int h) {
    Image image;
    image.width = w, image.height = h;
    image.pixels.resize(static_cast<size_t>(w) * static_cast<size_t>(h));
    return image;
  }
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
