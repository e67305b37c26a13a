#include <bit>
#include <cmath>
#include <cstring>

#include <fmt/format.h>

#include "world/base/file.h"
#include "world/media/brick_field.h"

namespace world {

namespace {

constexpr size_t kHeaderBytes = 48;
constexpr int32_t kMostVoxelsAlong = 4096;

}  // namespace

Result<std::shared_ptr<const BrickField>> read_vol_file(const std::filesystem::path& path, FieldSampling sampling,
                                                        int extend) {
  TRY(const std::vector<uint8_t> bytes, read_file(path, uint64_t{1} << 34));
  const auto wrong = [&](size_t at, const std::string& what) {
    return input_error(fmt::format("{}: byte {}: {}", path.string(), at, what));
  };
  static_assert(std::endian::native == std::endian::little);
  if (bytes.size() < kHeaderBytes) return wrong(bytes.size(), "the file ends inside its header of 48 bytes");
  if (std::memcmp(bytes.data(), "VOL\x03", 4) != 0) return wrong(0, "is no .vol file of version 3");
  int32_t header[5];  // encoding, size along x, y, z, channels
  std::memcpy(header, bytes.data() + 4, sizeof header);
  if (header[0] != 1) return wrong(4, fmt::format("the encoding is {}, but must be 1 (32 bit floats)", header[0]));
  for (int a = 0; a < 3; ++a)
    if (header[1 + a] < 1 || header[1 + a] > kMostVoxelsAlong)
      return wrong(8 + 4 * static_cast<size_t>(a), fmt::format("a size is {}, but must be in 1..4096", header[1 + a]));
  if (header[4] != 1) return wrong(20, fmt::format("it has {} channels, but a density has 1", header[4]));
  const int64_t nx = header[1], ny = header[2], nz = header[3];
  const uint64_t expected = kHeaderBytes + static_cast<uint64_t>(nx * ny * nz) * 4;
  if (bytes.size() != expected)
    return wrong(bytes.size(), fmt::format("the file should end at byte {}; it is damaged or cut off", expected));

  const auto value = [&](int64_t x, int64_t y, int64_t z) {
    const int64_t at = (std::clamp<int64_t>(z, 0, nz - 1) * ny + std::clamp<int64_t>(y, 0, ny - 1)) * nx +
                       std::clamp<int64_t>(x, 0, nx - 1);
    float v;
    std::memcpy(&v, bytes.data() + kHeaderBytes + 4 * static_cast<size_t>(at), 4);
    return v;
  };
  std::vector<FieldLeaf> leaves;
  const auto leaf_of = [](int64_t v) { return static_cast<int32_t>(v >> kLeafLog2); };
  for (int32_t x = leaf_of(-extend); x <= leaf_of(nx - 1 + extend); ++x)
    for (int32_t y = leaf_of(-extend); y <= leaf_of(ny - 1 + extend); ++y)
      for (int32_t z = leaf_of(-extend); z <= leaf_of(nz - 1 + extend); ++z) {
        FieldLeaf leaf{{x, y, z}, {}};
        for (int i = 0; i < kLeafVoxels; ++i) {
          const VoxelPos v = voxel_from_leaf(leaf.leaf) + offset_in_leaf(i);
          if (v.x < -extend || v.y < -extend || v.z < -extend || v.x >= nx + extend || v.y >= ny + extend ||
              v.z >= nz + extend)
            continue;
          leaf.values[static_cast<size_t>(i)] = value(v.x, v.y, v.z);
        }
        leaves.push_back(leaf);
      }
  return BrickField::make(std::move(leaves), sampling, path.string());
}

}  // namespace world
