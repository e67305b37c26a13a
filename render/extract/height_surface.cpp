#include "render/extract/height_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace render {

namespace {

constexpr int kSide = kChunkSize;
constexpr int kSixteenths = 16;
constexpr int kNone = std::numeric_limits<int>::min();
/// What a grid of the next level, or faces of it, may lie lower, in cells: its own half cell, and as much of this one.
constexpr int kBelowSkirt = 2;
constexpr int kMostCells = 0xffff / kSixteenths - 2 * kSide;

struct Column {
  int top = kNone, low = std::numeric_limits<int>::max();
  int outside = std::numeric_limits<int>::max();  // lowest end of faces that look out of the chunk
  uint16_t block = 0;
};
using Columns = std::vector<Column>;

/// In cells of the level; below all where there is none.
int lowest_looking_down(std::span<const ExtractedChunk* const> chunks) {
  int lowest = std::numeric_limits<int>::max();
  for (const ExtractedChunk* chunk : chunks)
    for (const FaceRecord& r : chunk->of_direction(world::kFaceNegY))
      lowest = std::min(lowest, chunk->origin.y + static_cast<int>(face_voxel(r.word0).y));
  return lowest == std::numeric_limits<int>::max() ? std::numeric_limits<int>::min() : lowest;
}

/// False where a face is none of a cube.
bool add_faces(const ExtractedChunk& chunk, int base, int floor, Columns& columns) {
  for (const FaceRecord& r : chunk.records) {
    if (face_is_part(r.word0)) return false;
    const int direction = static_cast<int>(face_direction(r.word1));
    const int axis = world::face_axis(direction);
    const glm::ivec3 low(face_voxel(r.word0));
    glm::ivec3 size(1);
    size[axis == 2 ? 1 : 2] = static_cast<int>(face_width(r.word0));
    size[axis == 0 ? 1 : 0] = static_cast<int>(face_height(r.word0));
    if (direction == world::kFaceNegY && chunk.origin.y + low.y == floor) continue;
    const int y = chunk.origin.y - base + low.y;
    const bool is_top = direction == world::kFacePosY;
    const bool looks_out = axis != 1 && low[axis] == (world::face_sign(direction) > 0 ? kSide - 1 : 0);
    const int from = is_top ? y + 1 : y;
    for (int x = low.x; x < low.x + size.x; ++x)
      for (int z = low.z; z < low.z + size.z; ++z) {
        Column& c = columns[static_cast<size_t>(x * kSide + z)];
        (looks_out ? c.outside : c.low) = std::min(looks_out ? c.outside : c.low, from);
        if (!is_top || from <= c.top) continue;
        c.top = from;
        c.block = static_cast<uint16_t>(face_block(r.word1));
      }
  }
  return true;
}

/// A grid of vertices; heights in sixteenths.
struct Grid {
  int step, side;
  std::vector<int> height;

  Grid(int step, int side) : step(step), side(side), height(static_cast<size_t>(side * side)) {}
  int& at(int i, int j) { return height[static_cast<size_t>(i * side + j)]; }
  int at(int i, int j) const { return height[static_cast<size_t>(i * side + j)]; }
  /// At a corner of cells: on the triangle of its square's lower or upper half, which the diagonal from the low to the
  /// high corner divides.
  double between(int x, int z) const {
    const int i = std::min(x / step, side - 2), j = std::min(z / step, side - 2);
    const double u = double(x - i * step) / step, v = double(z - j * step) / step;
    const double low = at(i, j), high = at(i + 1, j + 1), aside = u > v ? at(i + 1, j) : at(i, j + 1);
    const double more = std::max(u, v), less = std::min(u, v);
    return low + more * (aside - low) + less * (high - aside);
  }
};

/// Corner n of a side of the chunk: 0, 1: x low, high; 2, 3: z.
glm::ivec2 on_side(int side, int n, int last) {
  const int across = side % 2 ? last : 0;
  return side < 2 ? glm::ivec2(across, n) : glm::ivec2(n, across);
}

Grid make_grid(const Columns& columns, int step) {
  Grid grid(step, kSide / step + 1);
  const auto top = [&](int x, int z) { return columns[static_cast<size_t>(x * kSide + z)].top; };
  for (int i = 0; i < grid.side; ++i)
    for (int j = 0; j < grid.side; ++j) {
      int sum = 0;
      for (const int dx : {-1, 0})
        for (const int dz : {-1, 0})
          sum += top(std::clamp(i * step + dx, 0, kSide - 1), std::clamp(j * step + dz, 0, kSide - 1));
      grid.at(i, j) = sum * (kSixteenths / 4);
    }
  // Lift each side of the chunk until no column beside it is higher.
  std::array<int, 4> lift{};
  for (int side = 0; side < 4; ++side)
    for (int n = 0; n < kSide; ++n) {
      const glm::ivec2 c = on_side(side, n, kSide - 1), a = on_side(side, n, kSide), b = on_side(side, n + 1, kSide);
      const double least = std::min(grid.between(a.x, a.y), grid.between(b.x, b.y));
      lift[static_cast<size_t>(side)] =
          std::max(lift[static_cast<size_t>(side)], static_cast<int>(std::ceil(top(c.x, c.y) * kSixteenths - least)));
    }
  const int last = grid.side - 1;
  for (int i = 0; i < grid.side; ++i)
    for (int j = 0; j < grid.side; ++j)
      grid.at(i, j) +=
          std::max({i == 0 ? lift[0] : 0, i == last ? lift[1] : 0, j == 0 ? lift[2] : 0, j == last ? lift[3] : 0});
  return grid;
}

float error_of(const Grid& grid, const Columns& columns) {
  std::vector<double> line[2];
  double error = 0;
  for (int x = 0; x <= kSide; ++x) {
    std::vector<double>& now = line[x % 2];
    now.resize(kSide + 1);
    for (int z = 0; z <= kSide; ++z) now[static_cast<size_t>(z)] = grid.between(x, z) / kSixteenths;
    if (x == 0) continue;
    const std::vector<double>& before = line[(x + 1) % 2];
    for (int z = 0; z < kSide; ++z) {
      const auto k = static_cast<size_t>(z);
      const Column& c = columns[static_cast<size_t>((x - 1) * kSide + z)];
      const auto [least, most] = std::minmax({before[k], before[k + 1], now[k], now[k + 1]});
      error = std::max({error, c.top - least, most - c.low});
    }
  }
  return static_cast<float>(error);
}

/// The end of the skirt of a vertex on the chunk's side, in sixteenths; 0 within it.
int skirt_end(const Columns& columns, const Grid& grid, int i, int j) {
  int lowest = std::numeric_limits<int>::max();
  for (int side = 0; side < 4; ++side) {
    const int n = side < 2 ? j : i;
    if (on_side(side, n, grid.side - 1) != glm::ivec2(i, j)) continue;
    for (int m = std::max(0, (n - 1) * grid.step); m < std::min(kSide, (n + 1) * grid.step); ++m) {
      const glm::ivec2 c = on_side(side, m, kSide - 1);
      const Column& column = columns[static_cast<size_t>(c.x * kSide + c.y)];
      lowest = std::min({lowest, column.top, column.outside});
    }
  }
  return lowest == std::numeric_limits<int>::max() ? 0 : std::max(0, (lowest - kBelowSkirt) * kSixteenths);
}

}  // namespace

std::optional<HeightSurface> height_surface(std::span<const ExtractedChunk* const> chunks) {
  HeightSurface made;
  made.base = chunks.front()->origin.y;
  if (chunks.back()->origin.y - made.base > kMostCells) return std::nullopt;
  made.floor = lowest_looking_down(chunks);
  Columns columns(HeightSurface::kColumns);
  for (const ExtractedChunk* chunk : chunks)
    if (!add_faces(*chunk, made.base, made.floor, columns)) return std::nullopt;
  made.words.reserve(kHeightWords);
  for (const Column& c : columns) {
    if (c.top == kNone) return std::nullopt;
    made.words.push_back(uint32_t{c.block} << 16 | static_cast<uint32_t>(c.top));
  }
  for (int number = 0; number < HeightSurface::kSteps; ++number) {
    const Grid grid = make_grid(columns, HeightSurface::step(number));
    made.error[static_cast<size_t>(number)] = error_of(grid, columns);
    for (int i = 0; i < grid.side; ++i)
      for (int j = 0; j < grid.side; ++j)
        made.words.push_back(static_cast<uint32_t>(skirt_end(columns, grid, i, j)) << 16 |
                             static_cast<uint32_t>(grid.at(i, j)));
  }
  return made;
}

}  // namespace render
