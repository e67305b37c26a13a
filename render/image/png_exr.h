/// Pictures as files: PNG for the display (sRGB, 8 bits), EXR for measuring (linear radiance, float or half).
///
/// Both carry what made the picture as text: keys such as scene, camera, knobs, commit, world_hash; in a PNG in its
/// text chunks, in an EXR as string attributes. Files are written beside the target and renamed over it. Files read are
/// not trusted: memory follows from the size of the file, at most kMaxPicturePixels pixels. No exception and no longjmp
/// leaves this module.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "render/image/image.h"
#include "world/base/errors.h"

namespace render {

/// UTF-8. For PNG, keys have 1..79 printable ASCII characters; for EXR 1..255, and not the name of a standard
/// attribute.
using PictureText = std::map<std::string, std::string>;

constexpr int64_t kMaxPicturePixels = int64_t{1} << 27;

// ---- PNG ----

world::Status write_png(const std::filesystem::path& path, const Image8& image, const PictureText& text = {});

/// Samples as the file has them; palettes become RGB, fewer than 8 bits are scaled to 8.
struct PngFile {
  int width = 0, height = 0;
  int channels = 0;               // 1 gray, 2 gray + alpha, 3 RGB, 4 RGB + alpha
  int bits = 8;                   // 8: 0..255, or 16: 0..65535
  std::vector<uint16_t> samples;  // width * height * channels, rows from the top
  PictureText text;
};
world::Result<PngFile> read_png(const std::filesystem::path& path);
/// The same from memory; `name` is for messages.
world::Result<PngFile> decode_png(const std::string& name, const std::vector<uint8_t>& bytes);
/// Gray repeated, 16 bits rounded to 8, alpha left out.
Image8 image8_from_png(const PngFile& file);

// ---- EXR ----

enum class ExrPrecision {
  full,  // float: exact
  half   // half the size; relative error at most 2^-11 in [6.2e-5, 65504], absolute at most 2^-25 below, finite values
         // beyond are clamped to +-65504
};
/// ZIP compression. Infinities and NaN are kept.
world::Status write_exr(const std::filesystem::path& path, const Image& image, const PictureText& text = {},
                        ExrPrecision precision = ExrPrecision::full);

struct ExrFile {
  Image image;  // the data window
  PictureText text;
};
/// Reads channels R, G, B (half, float or uint; scan lines or tiles; the first part) or Y alone as gray.
world::Result<ExrFile> read_exr(const std::filesystem::path& path);
world::Result<ExrFile> decode_exr(const std::string& name, const std::vector<uint8_t>& bytes);

}  // namespace render
