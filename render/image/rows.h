/// Pictures that are written a few rows at a time, so that one may be larger than memory. The file appears under its
/// name when the last row is there; a failure leaves what was there before.
#pragma once

#include <filesystem>
#include <functional>

#include "render/image/framebuffer.h"
#include "render/image/png_exr.h"

namespace render {

/// Gives the next rows, from the top: at least one, of the picture's width.
using NextRows = std::function<world::Result<Image>()>;

/// PNG, sRGB in 8 bits. Keeps a row of `next` at a time; width * height <= 2^30.
world::Status write_png_rows(const std::filesystem::path& path, int width, int height, float exposure_ev,
                             const PictureText& text, const NextRows& next);
/// EXR, radiance in floats.
world::Status write_exr_rows(const std::filesystem::path& path, int width, int height, const PictureText& text,
                             const NextRows& next);

/// A picture with what else is known of its pixels: Z (depth, floats), N.X N.Y N.Z (normals, floats), id (numbers).
world::Status write_exr_layers(const std::filesystem::path& path, const Image& image, const Framebuffer& layers,
                               const PictureText& text);

}  // namespace render
