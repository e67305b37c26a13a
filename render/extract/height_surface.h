/// The faces of chunks that stand on each other as a surface of heights: a plane for each column of cells, and grids of
/// vertices, a step of cells apart, that show it. See render/raster/heightfields.h for how they are drawn.
///
///   words  [column: block << 16 | plane][vertex of step 2: skirt << 16 | height] ... [vertex of step 32]
/// x * side + z each. Planes are cells from `base`, heights and ends of skirts sixteenths of a cell.
///
/// error  of a step, in cells: no point of a face lies farther from the grid, along y, nor the grid from the highest
///        face of its column. All faces of a column count, those of trunks, undersides and caves too, so that what is
///        no surface of heights has an error as large as it is deep. Faces that look out of the chunks are shown by
///        skirts, in their own plane. The lowest of all that look down, as a world's bottom, don't count: see `floor`.
///        Skirts of faces between chunks that stand on each other count too, by up to 3 cells.
/// Along the sides of the chunk the grid lies nowhere below the faces, and its skirt ends below them: whatever is drawn
/// beside it, faces or a grid of any step, there is no gap.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "render/extract/extractor.h"

namespace render {

struct HeightSurface {
  static constexpr int kSteps = 5;  // 2, 4, ... 32 cells
  static constexpr int step(int number) { return 2 << number; }
  /// Of a side, in vertices.
  static constexpr int side(int number) { return kChunkSize / step(number) + 1; }
  static constexpr uint32_t kColumns = kChunkSize * kChunkSize;
  /// The place of a step's vertices in `words`.
  static constexpr uint32_t first_vertex(int number) {
    uint32_t first = kColumns;
    for (int n = 0; n < number; ++n) first += static_cast<uint32_t>(side(n) * side(n));
    return first;
  }

  int32_t base = 0;   // y of the lowest chunk, in cells
  int32_t floor = 0;  // plane of the lowest faces that look down, in cells: none of them is seen from above it
  std::array<float, kSteps> error{};
  std::vector<uint32_t> words;  // kHeightWords
};
constexpr uint32_t kHeightWords = HeightSurface::first_vertex(HeightSurface::kSteps);

/// Of chunks of equal x and z, from low to high. None where a column has no top, or a liquid ends within its cell.
std::optional<HeightSurface> height_surface(std::span<const ExtractedChunk* const> chunks);

}  // namespace render
