#include "world/formats/hgt/elevation.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numbers>

#include "world/formats/archive/zip.h"
#include "world/formats/bytes.h"

namespace world {
namespace {

constexpr int kSides[] = {1201, 3601};
constexpr uint64_t file_bytes(int side) {
  return uint64_t{2} * static_cast<uint64_t>(side) * static_cast<uint64_t>(side);
}
constexpr int kRelaxations = 64;

/// The part of a path after the last slash of either kind: names in archives may have both.
std::string_view last_part(std::string_view path) {
  const size_t slash = path.find_last_of("/\\");
  return slash == std::string_view::npos ? path : path.substr(slash + 1);
}

bool ends_without_case(std::string_view text, std::string_view end) {
  return text.size() >= end.size() &&
         std::equal(end.begin(), end.end(), text.end() - static_cast<std::ptrdiff_t>(end.size()),
                    [](unsigned char a, unsigned char b) { return std::tolower(a) == std::tolower(b); });
}

struct Corner {
  int south, west;
};

/// "N42E001..." -> 42, 1
std::optional<Corner> corner_from_name(std::string_view name) {
  if (name.size() < 7) return std::nullopt;
  const auto upper = [&](size_t i) { return std::toupper(static_cast<unsigned char>(name[i])); };
  const auto digits = [&](size_t first, size_t count) {
    int value = 0;
    for (size_t i = first; i < first + count; ++i) {
      if (!std::isdigit(static_cast<unsigned char>(name[i]))) return -1;
      value = 10 * value + (name[i] - '0');
    }
    return value;
  };
  const int latitude = digits(1, 2), longitude = digits(4, 3);
  if ((upper(0) != 'N' && upper(0) != 'S') || (upper(3) != 'E' && upper(3) != 'W')) return std::nullopt;
  if (latitude < 0 || latitude > 90 || longitude < 0 || longitude > 180) return std::nullopt;
  return Corner{upper(0) == 'N' ? latitude : -latitude, upper(3) == 'E' ? longitude : -longitude};
}

}  // namespace

Result<Elevation> parse_hgt(std::span<const uint8_t> bytes, std::string_view name) {
  Elevation elevation;
  for (const int side : kSides) {
    if (bytes.size() == file_bytes(side)) elevation.posts = side;
  }
  if (elevation.posts == 0) {
    return byte_error(
        name, bytes.size(),
        fmt::format("the file ends here; an elevation tile has {} bytes (1201 x 1201 posts) or {} (3601 x 3601)",
                    file_bytes(kSides[0]), file_bytes(kSides[1])));
  }
  const auto corner = corner_from_name(last_part(name));
  if (!corner) {
    return input_error(fmt::format(
        "{}: the name does not say which tile it is; expected one like N42E001.hgt, the south-west corner in degrees",
        name));
  }
  elevation.south = corner->south;
  elevation.west = corner->west;
  elevation.heights.resize(bytes.size() / 2);
  for (size_t i = 0; i < elevation.heights.size(); ++i) {
    elevation.heights[i] = static_cast<int16_t>(static_cast<uint16_t>(bytes[2 * i] << 8 | bytes[2 * i + 1]));
  }
  return elevation;
}

Result<Elevation> parse_hgt_zip(std::span<const uint8_t> bytes, std::string_view name) {
  TRY(const std::vector<ZipEntry> entries, list_zip(bytes, name));
  const ZipEntry* tile = nullptr;
  for (const ZipEntry& entry : entries) {
    if (!ends_without_case(entry.name, ".hgt")) continue;
    if (tile) return byte_error(name, entry.header_offset, "the archive holds more than one .hgt file; expected one");
    tile = &entry;
  }
  if (!tile)
    return byte_error(name, bytes.size(),
                      fmt::format("the archive holds no .hgt file among its {} entries", entries.size()));
  if (std::none_of(std::begin(kSides), std::end(kSides), [&](int side) { return tile->size == file_bytes(side); })) {
    return byte_error(name, tile->header_offset,
                      fmt::format("the tile in the archive claims {} bytes; expected {} or {}", tile->size,
                                  file_bytes(kSides[0]), file_bytes(kSides[1])));
  }
  TRY(const std::vector<uint8_t> content, extract_zip(bytes, *tile, file_bytes(kSides[1]), name));
  // The name inside says which tile it is, and where that is no such name, the archive's own.
  const bool inner = corner_from_name(last_part(tile->name)).has_value();
  return parse_hgt(content, inner ? tile->name : name);
}

ElevationFacts facts_of(const Elevation& elevation) {
  ElevationFacts facts;
  for (const int16_t h : elevation.heights) {
    if (h == Elevation::kVoid) {
      ++facts.voids;
      continue;
    }
    facts.min = facts.known ? std::min<int>(facts.min, h) : h;
    facts.max = facts.known ? std::max<int>(facts.max, h) : h;
    facts.sum += h;
    facts.zeros += h == 0;
    facts.negative += h < 0;
    ++facts.known;
  }
  return facts;
}

int16_t Elevation::nearest_post(double latitude, double longitude) const {
  const int last = posts - 1;
  const auto index = [&](double degrees) {
    return static_cast<int>(std::lround(std::clamp(degrees * last, 0.0, double(last))));
  };
  return at(last - index(latitude - south), index(longitude - west));
}

std::optional<double> Elevation::bilinear(double latitude, double longitude) const {
  const int last = posts - 1;
  const double row = std::clamp((south + 1 - latitude) * last, 0.0, double(last));
  const double column = std::clamp((longitude - west) * last, 0.0, double(last));
  const int r = std::min(static_cast<int>(row), last - 1), c = std::min(static_cast<int>(column), last - 1);
  const double v = row - r, u = column - c;
  const int16_t corners[4] = {at(r, c), at(r, c + 1), at(r + 1, c), at(r + 1, c + 1)};
  if (std::find(std::begin(corners), std::end(corners), kVoid) != std::end(corners)) return std::nullopt;
  return (corners[0] * (1 - u) + corners[1] * u) * (1 - v) + (corners[2] * (1 - u) + corners[3] * u) * v;
}

int16_t Elevation::cell_post(double latitude, double longitude) const {
  const auto index = [&](double degrees) {
    return std::clamp(static_cast<int>(std::floor(posts * degrees)), 0, posts - 1);
  };
  return at(posts - 1 - index(latitude - south), index(longitude - west));
}

Result<uint64_t> fill_voids(Elevation& elevation, std::string_view name) {
  const int n = elevation.posts;
  const auto index = [&](int row, int column) {
    return static_cast<size_t>(row) * static_cast<size_t>(n) + static_cast<size_t>(column);
  };
  std::vector<size_t> voids;
  for (size_t i = 0; i < elevation.heights.size(); ++i) {
    if (elevation.heights[i] == Elevation::kVoid) voids.push_back(i);
  }
  if (voids.empty()) return uint64_t{0};
  if (voids.size() == elevation.heights.size())
    return input_error(fmt::format("{}: all posts are void; there is no height to start from", name));

  // Rings: all posts that touch a known one get their height from those known before the ring.
  std::vector<float> height(elevation.heights.begin(), elevation.heights.end());
  std::vector<uint8_t> known(height.size());
  for (size_t i = 0; i < height.size(); ++i) known[i] = elevation.heights[i] != Elevation::kVoid;
  std::vector<size_t> open = voids, rest;
  std::vector<std::pair<size_t, float>> ring;
  while (!open.empty()) {
    ring.clear();
    rest.clear();
    for (const size_t i : open) {
      const int row = static_cast<int>(i / static_cast<size_t>(n)),
                column = static_cast<int>(i % static_cast<size_t>(n));
      float sum = 0, weights = 0;
      for (int dr = -1; dr <= 1; ++dr) {
        for (int dc = -1; dc <= 1; ++dc) {
          if (row + dr < 0 || row + dr >= n || column + dc < 0 || column + dc >= n) continue;
          const size_t neighbour = index(row + dr, column + dc);
          if (!known[neighbour]) continue;
          const float weight = dr != 0 && dc != 0 ? static_cast<float>(1 / std::numbers::sqrt2) : 1.0f;
          sum += weight * height[neighbour];
          weights += weight;
        }
      }
      if (weights > 0) {
        ring.emplace_back(i, sum / weights);
      } else {
        rest.push_back(i);
      }
    }
    for (const auto& [i, h] : ring) height[i] = h, known[i] = 1;
    open.swap(rest);
  }

  // Relax: each void post towards the mean of its four neighbours, all from the same state.
  std::vector<float> next(voids.size());
  for (int pass = 0; pass < kRelaxations; ++pass) {
    for (size_t k = 0; k < voids.size(); ++k) {
      const int row = static_cast<int>(voids[k] / static_cast<size_t>(n)),
                column = static_cast<int>(voids[k] % static_cast<size_t>(n));
      float sum = 0;
      int count = 0;
      const auto add = [&](int r, int c) {
        if (r >= 0 && r < n && c >= 0 && c < n) sum += height[index(r, c)], ++count;
      };
      add(row - 1, column), add(row + 1, column), add(row, column - 1), add(row, column + 1);
      next[k] = sum / static_cast<float>(count);
    }
    for (size_t k = 0; k < voids.size(); ++k) height[voids[k]] = next[k];
  }
  for (const size_t i : voids) elevation.heights[i] = static_cast<int16_t>(std::lround(height[i]));
  return static_cast<uint64_t>(voids.size());
}

}  // namespace world
