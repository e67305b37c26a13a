/// What tests of pictures that stand for what is far ask of a frame.
#pragma once

#include <algorithm>
#include <cmath>
#include <string_view>

#include "render/backend.h"

namespace render {

inline bool has_row(const Frame& drawn, std::string_view pass) {
  return std::any_of(drawn.report.passes.begin(), drawn.report.passes.end(),
                     [&](const PassReport& p) { return p.name == pass; });
}

/// Of the picture's pixels those for which no point of the exact picture, three times as large, within `radius` pixels
/// has their colour.
inline size_t misplaced(const Image& drawn, const Image& exact, double radius) {
  const int reach = static_cast<int>(std::ceil(3 * radius));
  size_t count = 0;
  for (int y = 0; y < drawn.height; ++y)
    for (int x = 0; x < drawn.width; ++x) {
      bool found = false;
      for (int dy = -reach; dy <= reach && !found; ++dy)
        for (int dx = -reach; dx <= reach && !found; ++dx)
          found = exact.at(std::clamp(3 * x + 1 + dx, 0, 3 * drawn.width - 1),
                           std::clamp(3 * y + 1 + dy, 0, 3 * drawn.height - 1)) == drawn.at(x, y);
      count += !found;
    }
  return count;
}

/// Pixels that show the ground's radiance, as holes do, where faces show none within `reach` pixels.
inline size_t holes(const world::Radiance3& ground, const Image& drawn, const Image& faces, int reach) {
  const auto nothing = [&](const Image& image, int x, int y) {
    return image.at(std::clamp(x, 0, image.width - 1), std::clamp(y, 0, image.height - 1)) == ground;
  };
  size_t count = 0;
  for (int y = 0; y < drawn.height; ++y)
    for (int x = 0; x < drawn.width; ++x) {
      bool covered = true;
      for (int dx = -reach; dx <= reach; ++dx)
        for (int dy = -reach; dy <= reach; ++dy) covered &= !nothing(faces, x + dx, y + dy);
      count += covered && nothing(drawn, x, y);
    }
  return count;
}

}  // namespace render
