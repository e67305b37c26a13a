/// Radiance pictures (.hdr, .pic): red, green and blue mantissas with a shared exponent, linear.
///
///   value = mantissa * 2^(exponent - 136) / EXPOSURE,   0 where the exponent is 0
/// Files are not trusted: memory follows from the size of the file, at most kMaxPicturePixels pixels, and every run
/// must lie inside its row. source  Greg Ward. Real Pixels. Graphics Gems II, 1991; the Radiance reference manual,
/// "Picture File Format"
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "render/image/image.h"
#include "world/base/errors.h"

namespace render {

/// Rows with runs (both kinds) or without; rows from the top or from below, columns from either side. XYZ pictures and
/// those turned by 90 degrees are refused.
world::Result<Image> read_hdr(const std::filesystem::path& path);
world::Result<Image> decode_hdr(const std::string& name, const std::vector<uint8_t>& bytes);

}  // namespace render
