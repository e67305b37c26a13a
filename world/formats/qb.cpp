// Qubicle's models (.qb): matrices of coloured voxels.
//
//   version, colour format (0 RGBA, 1 BGRA), axes (0 left-handed, 1 right-handed), compressed, visibility masks,
//   matrices; then of each matrix: its name, size x y z, position x y z, and colours by z, y, x; compressed: run
//   lengths by slice z, where 2, n, colour is n times a colour, and 6 ends the slice. All numbers take 32 bits, lowest
//   byte first.
// Of a colour, the fourth byte says whether the voxel is there: 0 is air. With visibility masks it says which sides can
// be seen; sides are ours to find, so any of them means a voxel.
// y is up. Right-handed files have our axes; of left-handed ones z is turned round, (x, y, z) -> (x, y, -z - 1).
// A colour becomes a block "qb:RRGGBB" of that albedo, matte. Where matrices overlap, the later one wins.
// source  getqubicle.com, Qubicle Binary File Format
#include <algorithm>
#include <unordered_set>

#include <fmt/format.h>

#include "world/formats/bytes.h"
#include "world/formats/collector.h"
#include "world/formats/format.h"
#include "world/formats/surfaces/colours.h"
#include "world/formats/translation/translation.h"

namespace world {
namespace {

constexpr uint64_t kMostFileBytes = uint64_t{1} << 31;
constexpr uint32_t kRun = 2, kNextSlice = 6;
constexpr uint32_t kMostSide = 1 << 16;
constexpr uint64_t kMostVoxels = uint64_t{1} << 25;  // of all matrices: beyond it, runs would take seconds
constexpr int32_t kReach = 1 << 29;
constexpr size_t kMostBlocks = 60000;  // of colours; then those are rounded
struct Header {
  uint32_t version = 0, colour_format = 0, axes = 0, compressed = 0, masks = 0, matrices = 0;
};

struct Matrix {
  std::string name;
  uint32_t size[3] = {};
  int32_t pos[3] = {};
  uint64_t voxels = 0;
};

/// Reads all matrices and hands over runs of voxels along x: visit(matrix, x, y, z, count, colour), z y x in the file's
/// axes relative to the matrix; never more than one row a call.
class QbReader {
 public:
  QbReader(std::span<const uint8_t> bytes, std::string_view name) : in_(bytes, name) {}
  Header header;
  std::vector<Matrix> matrices;

  template <class Visit>
  Status read(Visit visit) {
    for (uint32_t* field :
         {&header.version, &header.colour_format, &header.axes, &header.compressed, &header.masks, &header.matrices})
      *field = in_.u32_le();
    if (in_.failed()) return in_.end_error("its header");
    if (header.colour_format > 1 || header.axes > 1 || header.compressed > 1 || header.masks > 1)
      return byte_error(in_.file(), 4, "its header says what no .qb says; it is of another kind, or damaged");
    if (header.version == 0 || header.matrices == 0)
      return byte_error(in_.file(), 0, "its header has no version or no matrices; it is no .qb, or damaged");
    if (header.matrices > in_.remaining() / 25) {
      return in_.error(
          fmt::format("{} matrices were announced, but the file has {} bytes left", header.matrices, in_.remaining()));
    }
    for (uint32_t m = 0; m < header.matrices; ++m) TRY_STATUS(read_matrix(visit));
    return {};
  }

 private:
  template <class Visit>
  Status read_matrix(Visit& visit) {
    Matrix matrix;
    const auto name = in_.bytes(in_.u8());
    matrix.name = plain_name({reinterpret_cast<const char*>(name.data()), name.size()});
    for (uint32_t& s : matrix.size) s = in_.u32_le();
    for (int32_t& p : matrix.pos) p = in_.i32_le();
    if (in_.failed()) return in_.end_error("the head of a matrix");
    const uint64_t slice = uint64_t{matrix.size[0]} * matrix.size[1];
    if (*std::max_element(matrix.size, matrix.size + 3) > kMostSide)
      return in_.error(fmt::format("the matrix '{}' of {} x {} x {} is too large; each side may be {}", matrix.name,
                                   matrix.size[0], matrix.size[1], matrix.size[2], kMostSide));
    for (const int32_t p : matrix.pos)
      if (p > kReach || p < -kReach)
        return in_.error(fmt::format("the matrix '{}' lies at {}, outside of the world", matrix.name, p));
    if (!header.compressed && slice * matrix.size[2] > in_.remaining() / 4) {
      return in_.error(fmt::format("the matrix '{}' of {} x {} x {} was announced, but the file has {} bytes left",
                                   matrix.name, matrix.size[0], matrix.size[1], matrix.size[2], in_.remaining()));
    }
    for (uint32_t z = 0; z < matrix.size[2]; ++z) {
      uint64_t at = 0;  // y * size x + x
      while (header.compressed || at < slice) {
        uint32_t colour = in_.u32_le(), count = 1;
        if (in_.failed()) return in_.end_error("the voxels of a matrix");
        if (header.compressed && colour == kNextSlice) break;
        if (header.compressed && colour == kRun) {
          count = in_.u32_le();
          colour = in_.u32_le();
          if (in_.failed()) return in_.end_error("the voxels of a matrix");
        }
        if (count > slice - at) {
          return in_.error(
              fmt::format("a run of {} voxels goes beyond the slice {} of the matrix '{}'", count, z, matrix.name));
        }
        if (colour >> 24 != 0) TRY_STATUS(visit_run(visit, matrix, at, z, count, colour));
        at += count;
      }
    }
    matrices.push_back(std::move(matrix));
    return {};
  }

  template <class Visit>
  Status visit_run(Visit& visit, Matrix& matrix, uint64_t at, uint32_t z, uint32_t count, uint32_t colour) {
    matrix.voxels += count;
    if ((total_ += count) > kMostVoxels)
      return in_.error(fmt::format("the file holds more than {} voxels; so many are not read", kMostVoxels));
    if (header.colour_format == 0)  // R is the lowest byte: turned to 0xRRGGBB
      colour = (colour & 255) << 16 | (colour & 0xff00) | (colour >> 16 & 255);
    colour &= 0xffffff;
    while (count > 0) {
      const auto x = static_cast<uint32_t>(at % matrix.size[0]), y = static_cast<uint32_t>(at / matrix.size[0]);
      const uint32_t here = std::min(count, matrix.size[0] - x);
      if (!visit(matrix, x, y, z, here, colour))
        return input_error(
            fmt::format("{}: its voxels take more memory than a file of this size ever needs", in_.file()));
      at += here;
      count -= here;
    }
    return {};
  }

  ByteReader in_;
  uint64_t total_ = 0;
};

Result<World> read_qb(const std::filesystem::path& path, const ImportOptions&, ImportReport& report) {
  const std::string name = path.string();
  TRY(const std::vector<uint8_t> bytes, read_file(path, kMostFileBytes));
  MemoryBudget budget(bytes.size());

  // First the colours, then the voxels.
  std::unordered_set<uint32_t> used;
  uint32_t last_colour = UINT32_MAX;
  QbReader first(bytes, name);
  TRY_STATUS(first.read([&](const Matrix&, uint32_t, uint32_t, uint32_t, uint32_t, uint32_t colour) {
    if (colour != last_colour) used.insert(last_colour = colour);
    return true;
  }));
  World world;
  TRY(const ColourBlocks block_of, ColourBlocks::make({used.begin(), used.end()}, "qb", kMostBlocks, *world.palette));
  if (!block_of.approximated().empty()) report.warnings.push_back(block_of.approximated());

  VoxelCollector collector(&budget);
  QbReader second(bytes, name);
  last_colour = UINT32_MAX;
  BlockId last_block = kAir;
  TRY_STATUS(second.read([&](const Matrix& m, uint32_t x, uint32_t y, uint32_t z, uint32_t count, uint32_t colour) {
    if (colour != last_colour) last_block = block_of[last_colour = colour];
    const int32_t file_z = m.pos[2] + static_cast<int32_t>(z);
    VoxelPos v{m.pos[0] + static_cast<int32_t>(x), m.pos[1] + static_cast<int32_t>(y),
               second.header.axes == 1 ? file_z : -file_z - 1};
    for (; count > 0; --count, ++v.x)
      if (!collector.set(v, last_block)) return false;
    return true;
  }));

  const uint32_t v = second.header.version;
  report.fact("version", fmt::format("{}.{}.{}.{}", v & 255, v >> 8 & 255, v >> 16 & 255, v >> 24));
  report.fact("axes", second.header.axes ? "right-handed" : "left-handed");
  report.fact("compressed", second.header.compressed ? "yes" : "no");
  report.fact("visibility masks", second.header.masks ? "yes" : "no");
  report.fact("matrices", std::to_string(second.matrices.size()));
  uint64_t voxels = 0;
  for (const Matrix& m : second.matrices) voxels += m.voxels;
  report.fact("voxels in matrices", std::to_string(voxels));
  report.fact("colours used", std::to_string(used.size()));
  for (size_t i = 0; i < std::min<size_t>(second.matrices.size(), 32); ++i) {
    const Matrix& m = second.matrices[i];
    report.fact("matrix " + m.name, fmt::format("{} x {} x {} at {} {} {}, {} voxels", m.size[0], m.size[1], m.size[2],
                                                m.pos[0], m.pos[1], m.pos[2], m.voxels));
  }
  collector.move_into(world.store);
  set_origin(world, "qb", path);
  return world;
}

}  // namespace

const Format& qb_format() {
  static const Format format = {
      .name = "qb",
      .extensions = {".qb"},
      .what = "Qubicle models of several matrices",
      .recognizes = nullptr,
      .read = read_qb,
      .write = nullptr,
  };
  return format;
}

}  // namespace world
