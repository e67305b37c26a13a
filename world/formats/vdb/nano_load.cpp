// Loading .nvdb files. NanoVDB's grids are memory images full of offsets that its own code follows unseen; here each is
// checked against the image before it is followed, and each node is visited at most as often as fits in the image.
//
// A file is a row of segments:
//   header    magic (8 bytes), version (4), grids (2), codec (2)
//   a table   176 bytes a grid, and its name
//   grids     each as: the image; zip: its packed size (8), a zlib stream; Blosc: chunks of 1 GiB of the image, each as
//             packed size (8) and a Blosc frame
//
// source NanoVDB.h and util/IO.h of NanoVDB 32.4
#include "world/formats/vdb/nvdb.h"

#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <new>
#include <utility>

#include <blosc.h>
#include <fmt/format.h>
#include <nanovdb/NanoVDB.h>
#include <zlib.h>

#include "world/formats/bytes.h"
#include "world/formats/vdb/grids.h"
#include "world/formats/vdb/nano.h"

namespace world {
namespace vdb {
namespace {

// Files have the first or the last; images the first or the second.
constexpr std::array<uint64_t, 3> kMagic{0x304244566f6e614eull, 0x314244566f6e614eull, 0x324244566f6e614eull};
constexpr uint32_t kMajorVersion = 32;
constexpr size_t kTableRow = 176, kImageAlignment = 64;
constexpr uint64_t kChunk = uint64_t{1} << 30;  // of Blosc

bool is_magic(uint64_t magic) { return std::find(kMagic.begin(), kMagic.end(), magic) != kMagic.end(); }

/// Of the 16 bytes for each byte of the file and 256 MiB that an import may take, what the image of a grid may: the
/// OpenVDB grid made of it, and the world made of that, take the rest.
constexpr uint64_t most_image_bytes(uint64_t file_bytes) { return (uint64_t{96} << 20) + 6 * file_bytes; }

const char* const kTypes[] = {"Unknown", "Float",   "Double", "Int16",  "Int32",   "Int64", "Vec3f",
                              "Vec3d",   "Mask",    "Half",   "UInt32", "Boolean", "RGBA8", "Float4",
                              "Float8",  "Float16", "FloatN", "Vec4f",  "Vec4d",   "Index"};
const char* const kClasses[] = {"Unknown",   "LevelSet", "FogVolume",   "Staggered", "PointIndex",
                                "PointData", "Topology", "VoxelVolume", "IndexGrid", "TensorGrid"};

template <size_t N>
std::string name_of(const char* const (&names)[N], uint32_t index) {
  return index < N ? names[index] : fmt::format("unknown ({})", index);
}

struct Entry {
  NvdbGridFacts facts;
  uint32_t codec = 0;
  uint64_t at = 0, packed = 0;  // in the file
};
struct Directory {
  NvdbFacts facts;
  std::vector<Entry> entries;
};

template <class T>
T number(ByteReader& in) {
  T value{};
  const auto bytes = in.bytes(sizeof(T));
  if (!bytes.empty()) std::memcpy(&value, bytes.data(), sizeof(T));
  return value;
}

Vec3d vector(ByteReader& in) {
  Vec3d v;
  for (int a = 0; a < 3; ++a) v[a] = number<double>(in);
  return v;
}
VoxelPos index(ByteReader& in) {
  const int32_t x = in.i32_le(), y = in.i32_le(), z = in.i32_le();
  return {x, y, z};
}

std::string printable(std::span<const uint8_t> bytes) {
  std::string clean;
  for (const uint8_t c : bytes.first(std::min<size_t>(bytes.size(), 64))) {
    if (c == 0) break;
    clean += c >= 32 && c < 127 ? static_cast<char>(c) : '?';
  }
  return clean;
}

Result<Directory> read_directory(std::span<const uint8_t> bytes, std::string_view name) {
  ByteReader in(bytes, name);
  Directory directory;
  while (in.remaining() > 0) {
    const uint64_t start = in.offset(), magic = number<uint64_t>(in);
    const uint32_t version = in.u32_le();
    const uint16_t grids = in.u16_le(), codec = in.u16_le();
    if (in.failed() || !is_magic(magic))
      return byte_error(name, start, "expected the magic number of NanoVDB; this is no .nvdb file, or it is damaged");
    if (version >> 21 != kMajorVersion)
      return byte_error(name, start + 8,
                        fmt::format("the file has NanoVDB's version {}; expected {}: convert it with nanovdb_convert",
                                    version >> 21, kMajorVersion));
    if (codec > 2)
      return byte_error(name, start + 14, fmt::format("the codec {} is not known; expected 0, 1 or 2", codec));
    if (directory.facts.version.empty()) {
      directory.facts.version = fmt::format("{}.{}.{}", version >> 21, version >> 10 & 0x7ff, version & 0x3ff);
      const char* const codecs[] = {"NONE", "ZIP", "BLOSC"};
      directory.facts.codec = codecs[codec];
    }
    if (size_t{grids} * kTableRow > in.remaining())
      return in.error("the segment has more grids than the file can hold");
    const size_t first = directory.entries.size();
    for (uint16_t g = 0; g < grids; ++g) {
      Entry entry;
      NvdbGridFacts& facts = entry.facts;
      facts.bytes = number<uint64_t>(in);
      entry.packed = number<uint64_t>(in);
      in.bytes(8);  // hash of the name
      facts.active_voxels = number<uint64_t>(in);
      facts.type = name_of(kTypes, in.u32_le());
      facts.grid_class = name_of(kClasses, in.u32_le());
      facts.world_min = vector(in), facts.world_max = vector(in);
      facts.bounds.min = index(in), facts.bounds.max = index(in);
      facts.voxel_size = vector(in);
      const uint32_t name_bytes = in.u32_le();
      facts.leaf_nodes = in.u32_le(), facts.lower_nodes = in.u32_le(), facts.upper_nodes = in.u32_le();
      facts.root_nodes = in.u32_le();
      for (uint32_t& tiles : facts.active_tiles) tiles = in.u32_le();
      entry.codec = in.u16_le();
      in.bytes(2 + 4);  // padding, version
      facts.name = printable(in.bytes(name_bytes));
      if (in.failed()) return in.end_error("the table of grids");
      if (entry.codec > 2) return in.error(fmt::format("the codec {} is not known; expected 0, 1 or 2", entry.codec));
      directory.entries.push_back(std::move(entry));
    }
    for (size_t e = first; e < directory.entries.size(); ++e) {
      Entry& entry = directory.entries[e];
      entry.at = in.offset();
      if (entry.packed > in.remaining())
        return byte_error(name, entry.at,
                          fmt::format("the grid '{}' has {} bytes, and {} follow; the file is damaged or cut off",
                                      entry.facts.name, entry.packed, in.remaining()));
      in.bytes(static_cast<size_t>(entry.packed));
    }
    if (grids == 0) break;  // nothing would move on
  }
  if (directory.entries.empty()) return byte_error(name, bytes.size(), "the file holds no grid");
  for (const Entry& entry : directory.entries) directory.facts.grids.push_back(entry.facts);
  return directory;
}

/// The memory image of a grid, aligned as its nodes want it.
class Image {
 public:
  explicit Image(size_t size)
      : size_(size), bytes_(static_cast<uint8_t*>(::operator new(size, std::align_val_t(kImageAlignment)))) {}
  ~Image() { ::operator delete(bytes_, std::align_val_t(kImageAlignment)); }
  Image(const Image&) = delete;
  Image& operator=(const Image&) = delete;
  std::span<uint8_t> bytes() { return {bytes_, size_}; }

  /// The thing at an offset from the start, or null where it does not lie wholly inside, or not on 32 bytes.
  template <class T>
  const T* at(uint64_t offset) const {
    const bool inside = offset <= size_ && sizeof(T) <= size_ - offset && offset % NANOVDB_DATA_ALIGNMENT == 0;
    return inside ? reinterpret_cast<const T*>(bytes_ + offset) : nullptr;
  }
  uint64_t offset_of(const void* thing) const {
    return static_cast<uint64_t>(static_cast<const uint8_t*>(thing) - bytes_);
  }
  size_t size() const { return size_; }

 private:
  size_t size_;
  uint8_t* bytes_;
};

Status unpack(std::span<const uint8_t> bytes, const Entry& entry, std::string_view name, Image& image) {
  const auto packed = bytes.subspan(entry.at, entry.packed);
  const std::span<uint8_t> out = image.bytes();
  const auto damaged = [&] {
    return byte_error(
        name, entry.at,
        fmt::format("the compressed data of the grid '{}' are damaged, or don't have the size that the file "
                    "says",
                    entry.facts.name));
  };
  if (entry.codec == 0) {
    if (packed.size() != out.size()) return damaged();
    std::memcpy(out.data(), packed.data(), out.size());
    return {};
  }
  ByteReader in(packed, name, entry.at);
  if (entry.codec == 1) {
    const uint64_t size = number<uint64_t>(in);
    if (in.failed() || size > in.remaining()) return damaged();
    uLongf got = out.size();
    const auto data = in.bytes(static_cast<size_t>(size));
    if (uncompress(out.data(), &got, data.data(), static_cast<uLong>(data.size())) != Z_OK || got != out.size())
      return damaged();
    return {};
  }
  for (size_t done = 0; done < out.size();) {
    const size_t chunk = static_cast<size_t>(std::min<uint64_t>(kChunk, out.size() - done));
    const uint64_t size = number<uint64_t>(in);
    if (in.failed() || size > in.remaining()) return damaged();
    const auto data = in.bytes(static_cast<size_t>(size));
    size_t says = 0;
    // The frame must be sound in itself before Blosc may follow its offsets.
    if (blosc_cbuffer_validate(data.data(), data.size(), &says) != 0 || says != chunk ||
        blosc_decompress_ctx(data.data(), out.data() + done, chunk, 1) != static_cast<int>(chunk))
      return damaged();
    done += chunk;
  }
  return {};
}

/// Copies a NanoVDB tree of the build type B into an OpenVDB tree.
template <class B, class Tree>
class TreeCopy {
 public:
  using Value = typename Tree::ValueType;
  using Leaf = nanovdb::LeafData<B, nanovdb::Coord, nanovdb::Mask, 3>;
  using Lower = nanovdb::InternalData<nanovdb::NanoLeaf<B>, 4>;
  using Upper = nanovdb::InternalData<nanovdb::NanoLower<B>, 5>;
  using Root = nanovdb::RootData<nanovdb::NanoUpper<B>>;

  TreeCopy(const Image& image, Tree& tree) : image_(image), tree_(tree) {}

  Status copy() {
    const auto* head = image_.at<nanovdb::TreeData<3>>(sizeof(nanovdb::GridData));
    if (!head) return outside("tree");
    const uint64_t root_at = sizeof(nanovdb::GridData) + head->mNodeOffset[3];
    const Root* root = image_.at<Root>(root_at);
    if (!root) return outside("root");
    using Tile = typename Root::Tile;
    if (root->mTableSize > (image_.size() - root_at - sizeof(Root)) / sizeof(Tile)) return outside("root's table");
    tree_.root().setBackground(convert(root->mBackground), /*updateChildNodes=*/false);
    for (uint32_t i = 0; i < root->mTableSize; ++i) {
      const Tile* tile = image_.at<Tile>(root_at + sizeof(Root) + i * sizeof(Tile));
      if (!tile) return outside("tile");
      const auto origin = tile->origin();
      const openvdb::Coord at(origin[0], origin[1], origin[2]);
      if (!inside_world(at) || !inside_world(at.offsetBy(4095)))
        return input_error("a tile lies outside of the world's border");
      if (tile->child == 0) {
        TRY_STATUS(add_tile(3, at, tile->value, tile->state != 0));
      } else {
        TRY_STATUS(copy_upper(root_at + static_cast<uint64_t>(tile->child), at));
      }
    }
    return {};
  }

 private:
  static Error outside(const char* what) {
    return input_error(fmt::format("its {} does not lie within the grid's bytes; the file is damaged", what));
  }
  static Error repeated() { return input_error("its nodes are used more than once; the file is damaged"); }
  template <class From>
  static Value convert(const From& value) {
    if constexpr (std::is_same_v<From, nanovdb::Vec3f>) {
      return Value(std::isfinite(value[0] + value[1] + value[2]) ? 1 : 0);
    } else if constexpr (std::is_integral_v<Value> && sizeof(From) >= sizeof(Value)) {
      using Limits = std::numeric_limits<Value>;
      return std::cmp_less(value, Limits::min())      ? Limits::min()
             : std::cmp_greater(value, Limits::max()) ? Limits::max()
                                                      : static_cast<Value>(value);
    } else {
      return static_cast<Value>(value);
    }
  }
  template <class From>
  Status add_tile(openvdb::Index level, const openvdb::Coord& at, const From& from, bool active) {
    const Value value = convert(from);
    if (active || value != tree_.background()) tree_.addTile(level, at, value, active);
    return {};
  }
  static openvdb::Coord child_origin(const openvdb::Coord& parent, uint32_t n, int log2_children, int log2_size) {
    const uint32_t mask = (1u << log2_children) - 1;
    return parent.offsetBy(static_cast<int>(n >> (2 * log2_children)) << log2_size,
                           static_cast<int>(n >> log2_children & mask) << log2_size,
                           static_cast<int>(n & mask) << log2_size);
  }
  Status copy_upper(uint64_t offset, const openvdb::Coord& origin) {
    const Upper* node = image_.at<Upper>(offset);
    if (!node) return outside("upper node");
    if (++uppers_ > image_.size() / sizeof(Upper)) return repeated();
    for (uint32_t n = 0; n < 32768; ++n) {
      const openvdb::Coord at = child_origin(origin, n, 5, 7);
      if (node->mChildMask.isOn(n)) {
        TRY_STATUS(copy_lower(offset + static_cast<uint64_t>(node->mTable[n].child), at));
      } else {
        TRY_STATUS(add_tile(2, at, node->mTable[n].value, node->mValueMask.isOn(n)));
      }
    }
    return {};
  }
  Status copy_lower(uint64_t offset, const openvdb::Coord& origin) {
    const Lower* node = image_.at<Lower>(offset);
    if (!node) return outside("lower node");
    if (++lowers_ > image_.size() / sizeof(Lower)) return repeated();
    for (uint32_t n = 0; n < 4096; ++n) {
      const openvdb::Coord at = child_origin(origin, n, 4, 3);
      if (node->mChildMask.isOn(n)) {
        TRY_STATUS(copy_leaf(offset + static_cast<uint64_t>(node->mTable[n].child), at));
      } else {
        TRY_STATUS(add_tile(1, at, node->mTable[n].value, node->mValueMask.isOn(n)));
      }
    }
    return {};
  }
  Status copy_leaf(uint64_t offset, const openvdb::Coord& origin) {
    const Leaf* node = image_.at<Leaf>(offset);
    if (!node) return outside("leaf");
    if (++leaves_ > image_.size() / sizeof(Leaf)) return repeated();
    if constexpr (std::is_same_v<B, nanovdb::FpN>) {
      // 64 bytes for each bit of a value follow; as many as its flags say.
      if (node->mFlags >> 5 > 4 || offset + node->memUsage() > image_.size()) return outside("leaf");
    }
    auto leaf = std::make_unique<typename Tree::LeafNodeType>(origin, tree_.background(), false);
    for (uint32_t n = 0; n < 512; ++n) {
      const Value value = convert(node->getValue(n));
      if (node->mValueMask.isOn(n))
        leaf->setValueOn(n, value);
      else
        leaf->setValueOnly(n, value);
    }
    tree_.addLeaf(leaf.release());
    return {};
  }

  const Image& image_;
  Tree& tree_;
  uint64_t uppers_ = 0, lowers_ = 0, leaves_ = 0;
};

template <class B, class Grid>
Result<openvdb::GridBase::Ptr> copied(const Image& image) {
  const auto grid = Grid::create();
  TreeCopy<B, typename Grid::TreeType> copy(image, grid->tree());
  TRY_STATUS(copy.copy());
  return openvdb::GridBase::Ptr(grid);
}

/// Null where the type is not read. Numbers become float or 32-bit integers, vectors only where they are: what a world
/// keeps of them. (Each type of OpenVDB's trees costs ten seconds to compile.)
Result<openvdb::GridBase::Ptr> grid_of_type(const Image& image, nanovdb::GridType type) {
  using nanovdb::GridType;
  using openvdb::FloatGrid, openvdb::Int32Grid;
  switch (type) {
    case GridType::Float:
      return copied<float, FloatGrid>(image);
    case GridType::Double:
      return copied<double, FloatGrid>(image);
    case GridType::Fp4:
      return copied<nanovdb::Fp4, FloatGrid>(image);
    case GridType::Fp8:
      return copied<nanovdb::Fp8, FloatGrid>(image);
    case GridType::Fp16:
      return copied<nanovdb::Fp16, FloatGrid>(image);
    case GridType::FpN:
      return copied<nanovdb::FpN, FloatGrid>(image);
    case GridType::Int16:
      return copied<int16_t, Int32Grid>(image);
    case GridType::Int32:
      return copied<int32_t, Int32Grid>(image);
    case GridType::UInt32:
      return copied<uint32_t, Int32Grid>(image);
    case GridType::Int64:
      return copied<int64_t, Int32Grid>(image);
    case GridType::Boolean:
      return copied<bool, Int32Grid>(image);
    case GridType::Vec3f:
      return copied<nanovdb::Vec3f, Int32Grid>(image);
    default:
      return openvdb::GridBase::Ptr();
  }
}

openvdb::GridClass class_of(const std::string& name) {
  if (name == "LevelSet") return openvdb::GRID_LEVEL_SET;
  if (name == "FogVolume") return openvdb::GRID_FOG_VOLUME;
  if (name == "Staggered") return openvdb::GRID_STAGGERED;
  return openvdb::GRID_UNKNOWN;
}

/// The map, and our own metadata from behind the tree.
Status finish(const Image& image, openvdb::GridBase& grid) {
  const nanovdb::GridData& head = *image.at<nanovdb::GridData>(0);
  openvdb::Mat4d matrix(openvdb::Mat4d::identity());
  for (int row = 0; row < 3; ++row) {
    // NanoVDB multiplies columns, OpenVDB rows.
    for (int column = 0; column < 3; ++column) matrix(row, column) = head.mMap.mMatD[3 * column + row];
    matrix(3, row) = head.mMap.mVecD[row];
  }
  const double volume = std::abs(matrix.det());
  if (!std::isfinite(volume) || !(volume > 0)) return input_error("its map to the world has no inverse");
  grid.setTransform(openvdb::math::Transform::createLinearTransform(matrix));
  for (uint32_t i = 0; i < std::min(head.mBlindMetadataCount, 16u); ++i) {
    const uint64_t at = static_cast<uint64_t>(head.mBlindMetadataOffset) + i * sizeof(nanovdb::GridBlindMetaData);
    const auto* blind = image.at<nanovdb::GridBlindMetaData>(at);
    if (!blind) return input_error("its blind data don't lie within the grid's bytes; the file is damaged");
    if (std::strncmp(blind->mName, kTextBlindData, sizeof blind->mName) != 0) continue;
    // The offset counts from the entry, as NanoVDB's code does, whatever its comment says.
    const uint64_t from = at + static_cast<uint64_t>(blind->mByteOffset);
    if (from > image.size() || blind->mElementCount > image.size() - from)
      return input_error("its blind data don't lie within the grid's bytes; the file is damaged");
    const char* text = reinterpret_cast<const char*>(image.at<nanovdb::GridData>(0)) + from;
    const std::string_view all(text, blind->mElementCount);
    for (size_t start = 0; start < all.size();) {
      const size_t middle = all.find('\0', start), end = middle == all.npos ? all.npos : all.find('\0', middle + 1);
      if (end == all.npos) return input_error("the text in its blind data is cut off");
      grid.insertMeta(std::string(all.substr(start, middle - start)),
                      openvdb::StringMetadata(std::string(all.substr(middle + 1, end - middle - 1))));
      start = end + 1;
    }
  }
  return {};
}

Result<Loaded> load_nano(std::span<const uint8_t> bytes, const std::string& name, ImportReport& report) {
  TRY(const Directory directory, read_directory(bytes, name));
  initialize_openvdb();
  Loaded loaded;
  loaded.file_bytes = bytes.size();
  uint64_t image_bytes = 0;
  for (const Entry& entry : directory.entries) {
    const auto bad = [&](const std::string& what) {
      return byte_error(name, entry.at, fmt::format("grid '{}': {}", entry.facts.name, what));
    };
    image_bytes += std::min(entry.facts.bytes, most_image_bytes(bytes.size()) + 1);
    if (image_bytes > most_image_bytes(bytes.size()))
      return bad(fmt::format("the grids claim to unpack to {} bytes, more than a file of {} may take", image_bytes,
                             bytes.size()));
    if (entry.facts.bytes < sizeof(nanovdb::GridData) + sizeof(nanovdb::TreeData<3>))
      return bad("it is too small for a grid; the file is damaged");
    Image image(entry.facts.bytes);
    TRY_STATUS(unpack(bytes, entry, name, image));
    const nanovdb::GridData& head = *image.at<nanovdb::GridData>(0);
    if (!is_magic(head.mMagic) || head.mGridSize > image.size())
      return bad("its bytes don't begin like a grid; the file is damaged");
    Result<openvdb::GridBase::Ptr> grid = grid_of_type(image, head.mGridType);
    if (!grid) return bad(grid.error().message);
    if (!*grid) {
      loaded.unknown.push_back(entry.facts.name + " (" + entry.facts.type + ")");
      continue;
    }
    (*grid)->setName(entry.facts.name);
    (*grid)->setGridClass(class_of(entry.facts.grid_class));
    if (const Status finished = finish(image, **grid); !finished) return bad(finished.error().message);
    VdbGridFacts facts;
    facts.name = entry.facts.name;
    facts.type = entry.facts.type;
    facts.grid_class = openvdb::GridBase::gridClassToString((*grid)->getGridClass());
    facts.map = (*grid)->transform().mapType();
    const openvdb::Vec3d size = (*grid)->voxelSize(), origin = (*grid)->indexToWorld(openvdb::Coord(0));
    facts.voxel_size = {size.x(), size.y(), size.z()};
    facts.origin = {origin.x(), origin.y(), origin.z()};
    const Result<bool> surveyed = survey_grid(**grid, facts);
    if (!surveyed) return bad(surveyed.error().message);
    loaded.facts.grids.push_back(std::move(facts));
    loaded.grids.push_back(std::move(*grid));
  }
  report.fact("NanoVDB version", directory.facts.version);
  report.fact("codec", directory.facts.codec);
  return loaded;
}

}  // namespace
}  // namespace vdb

Result<NvdbFacts> inspect_nvdb(std::span<const uint8_t> bytes, std::string_view name) {
  TRY(const vdb::Directory directory, vdb::read_directory(bytes, name));
  return directory.facts;
}

Result<World> world_from_nvdb(std::span<const uint8_t> bytes, const std::string& name, ImportReport& report,
                              const ImportOptions& options) {
  try {
    TRY(vdb::Loaded loaded, vdb::load_nano(bytes, name, report));
    return vdb::world_from_grids(std::move(loaded), "nvdb", name, options, report);
  } catch (const std::exception& e) {
    return input_error(fmt::format("{}: OpenVDB cannot hold it: {}", name, e.what()));
  }
}

}  // namespace world
