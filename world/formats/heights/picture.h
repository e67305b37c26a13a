/// Pictures through libpng: of heights, .png of 8 or 16 bits, whole samples, nothing converted; and of colours. No
/// libpng header here.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "world/base/errors.h"

namespace world {

struct HeightPicture {
  uint32_t width = 0, height = 0;
  int channels = 1;               // 1 grey, 2 grey and alpha, 3 RGB, 4 RGBA
  int bits = 16;                  // 8 or 16
  std::vector<uint16_t> samples;  // [row][column][channel]
  std::map<std::string, std::string> texts;

  uint16_t at(uint32_t row, uint32_t column, int channel = 0) const {
    return samples[(size_t{row} * width + column) * static_cast<size_t>(channels) + static_cast<size_t>(channel)];
  }
};

/// Refuses palettes and fewer than 8 bits, which hold no heights, and pictures that would unpack to more memory than a
/// file of that size may take.
Result<HeightPicture> read_height_png(std::span<const uint8_t> bytes, std::string_view name);
/// 16 bits of grey, with its texts. The bytes of the file.
Result<std::string> write_height_png(const HeightPicture& picture, std::string_view name);

/// A picture of colours, sRGB.
struct ColourPicture {
  uint32_t width = 0, height = 0;
  std::vector<uint32_t> pixels;  // [row][column] 0xRRGGBB
};
/// Any .png: palettes, greys and 16 bits become 8 bits a band; what is transparent keeps its colour.
Result<ColourPicture> read_colour_png(std::span<const uint8_t> bytes, std::string_view name);

}  // namespace world
