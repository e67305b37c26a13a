#include "world/store/region_grid.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include <blosc.h>

namespace world {
namespace {

constexpr uint64_t kMagic = 0x56444220;
constexpr uint32_t kOldestVersion = 222;    // since then nodes are packed by their masks
constexpr uint32_t kMasks = 2, kBlosc = 4;  // of the compression; 1 is zip, which we never wrote
constexpr size_t kHeadBytes = 8 + 4 + 8 + 1 + 36, kOffsets = 24;
constexpr int kUpperLog2 = 5, kLowerLog2 = 4;  // children along a side of a node, as powers of two
constexpr size_t kUpper = size_t{1} << 3 * kUpperLog2, kLower = size_t{1} << 3 * kLowerLog2;

template <class T>
constexpr std::string_view kType = std::is_same_v<T, float> ? "Tree_float_5_4_3" : "Tree_int32_5_4_3";

Error damaged(const char* what) {
  return input_error(std::string("the region's stream is damaged, or not one that Loam wrote: ") + what);
}

bool is_on(const std::vector<uint64_t>& mask, size_t n) { return mask[n / 64] >> n % 64 & 1; }

template <class T>
class Reader {
 public:
  Reader(std::span<const char> bytes, RegionPos region, const GridVisitor<T>& visitor)
      : bytes_(bytes), origin_(voxel_from_region(region)), visitor_(visitor) {}

  Status read() {
    TRY_STATUS(read_head());
    TRY_STATUS(read_root());
    for (const LeafPos l : leaves_) {
      TRY_STATUS(take_mask(kLeafVoxels, active_));
      TRY_STATUS(unpack(kLeafVoxels, active_));
      TRY_STATUS(visitor_.leaf(l, std::span<const T, kLeafVoxels>(values_.data(), kLeafVoxels),
                               std::span<const uint64_t, 8>(active_.data(), 8)));
    }
    return {};
  }

 private:
  static Error cut_off() { return damaged("it ends too early"); }

  template <class N>
  Status take(N& out) {
    if (bytes_.size() < sizeof out) return cut_off();
    std::memcpy(&out, bytes_.data(), sizeof out);
    bytes_ = bytes_.subspan(sizeof out);
    return {};
  }
  Status skip(size_t count) {
    if (bytes_.size() < count) return cut_off();
    bytes_ = bytes_.subspan(count);
    return {};
  }
  Status take_text(std::string_view& out) {
    uint32_t size = 0;
    TRY_STATUS(take(size));
    if (bytes_.size() < size) return cut_off();
    out = {bytes_.data(), size};
    return skip(size);
  }
  Status skip_metadata() {
    uint32_t count = 0;
    TRY_STATUS(take(count));
    for (uint32_t i = 0; i < count; ++i) {  // each takes 12 bytes at least
      std::string_view name, type, value;
      TRY_STATUS(take_text(name));
      TRY_STATUS(take_text(type));
      TRY_STATUS(take_text(value));
    }
    return {};
  }
  Status take_mask(size_t bits, std::vector<uint64_t>& out) {
    if (bytes_.size() < bits / 8) return cut_off();
    out.resize(bits / 64);
    std::memcpy(out.data(), bytes_.data(), bits / 8);
    return skip(bits / 8);
  }

  Status read_head() {
    const std::span<const char> head = bytes_;
    TRY_STATUS(skip(kHeadBytes));
    uint64_t magic = 0;
    uint32_t version = 0, grids = 0;
    std::memcpy(&magic, head.data(), sizeof magic);
    std::memcpy(&version, head.data() + sizeof magic, sizeof version);
    if (magic != kMagic || version < kOldestVersion) return damaged("it does not begin like one of OpenVDB");
    TRY_STATUS(skip_metadata());
    TRY_STATUS(take(grids));
    std::string_view name, type, parent, map;
    if (grids == 1) {
      TRY_STATUS(take_text(name));
      TRY_STATUS(take_text(type));
    }
    if (type != kType<T>)
      return input_error(std::string("the region's stream does not hold exactly one grid of ") +
                         (std::is_same_v<T, float> ? "floats" : "32-bit integers"));
    TRY_STATUS(take_text(parent));
    TRY_STATUS(skip(kOffsets));
    TRY_STATUS(take(compression_));
    if (compression_ & ~(kMasks | kBlosc)) return damaged("its compression is not known");
    TRY_STATUS(skip_metadata());
    TRY_STATUS(take_text(map));
    if (map != "UniformScaleMap") return damaged("its grid is moved or turned");
    return skip(5 * 3 * sizeof(double));
  }

  Status read_root() {
    uint32_t buffers = 0, tiles = 0, children = 0;
    T background{};
    TRY_STATUS(take(buffers));
    TRY_STATUS(take(background));
    TRY_STATUS(take(tiles));
    TRY_STATUS(take(children));
    if (buffers != 1) return damaged("its tree has several buffers");
    if (background != 0) return input_error("the background of the region's grid is not 0");
    if (tiles != 0 || children > 1) return outside();
    if (children == 0) return {};
    VoxelPos origin;
    TRY_STATUS(take(origin.x));
    TRY_STATUS(take(origin.y));
    TRY_STATUS(take(origin.z));
    constexpr int32_t kUpperSize = kRegionSize << kUpperLog2;
    const auto start = [](int32_t c) { return c & ~(kUpperSize - 1); };
    if (origin != VoxelPos{start(origin_.x), start(origin_.y), start(origin_.z)}) return outside();
    return read_upper();
  }

  static Error outside() { return input_error("the region's grid holds something outside of the region"); }

  /// Of its 32^3 entries one is the region.
  Status read_upper() {
    const auto step = [](int32_t c) { return static_cast<size_t>(c >> kRegionLog2 & ((1 << kUpperLog2) - 1)); };
    const size_t own = (step(origin_.x) << kUpperLog2 | step(origin_.y)) << kUpperLog2 | step(origin_.z);
    std::vector<uint64_t> children;
    TRY_STATUS(take_mask(kUpper, children));
    TRY_STATUS(take_mask(kUpper, active_));
    TRY_STATUS(unpack(kUpper, active_));
    for (size_t n = 0; n < kUpper; ++n)
      if (n != own && (is_on(children, n) || is_on(active_, n) || values_[n] != 0)) return outside();
    if (is_on(children, own)) return read_lower();
    return visitor_.tile(origin_, kRegionSize, values_[own], is_on(active_, own));
  }

  /// Remembers where leaves are: their values follow after all of them.
  Status read_lower() {
    std::vector<uint64_t> children;
    TRY_STATUS(take_mask(kLower, children));
    TRY_STATUS(take_mask(kLower, active_));
    TRY_STATUS(unpack(kLower, active_));
    const LeafPos first = leaf_from_voxel(origin_);
    for (size_t n = 0; n < kLower; ++n) {
      const LeafPos l = first + leaf_offset_in_region(static_cast<int>(n));
      if (is_on(children, n)) {
        leaves_.push_back(l);
        TRY_STATUS(skip(kLeafVoxels / 8));  // which are active; it comes again with the values
      } else {
        TRY_STATUS(visitor_.tile(voxel_from_leaf(l), kLeafSize, values_[n], is_on(active_, n)));
      }
    }
    return {};
  }

  /// `count` values of a node to values_. In front of them a byte says what those that are not active are:
  ///   0, 1   all 0 (plus or minus the background)
  ///   2      all the one value that follows
  ///   3..5   one of two, as a mask says: 3 both 0; 4 a value that follows and 0; 5 both follow
  ///   6      anything: all values are there
  Status unpack(size_t count, const std::vector<uint64_t>& active) {
    uint8_t kind = 0;
    TRY_STATUS(take(kind));
    if (kind > 6) return damaged("a node's values are packed in a way that is not known");
    T off = 0, on = 0;  // of values that are not active, by their bit in the mask
    std::vector<uint64_t> mask;
    if (kind == 2 || kind == 4 || kind == 5) TRY_STATUS(take(off));
    if (kind == 5) TRY_STATUS(take(on));
    if (kind >= 3 && kind <= 5) TRY_STATUS(take_mask(count, mask));
    const bool all = kind == 6 || !(compression_ & kMasks);
    size_t stored = count;
    if (!all) {
      stored = 0;
      for (const uint64_t word : active) stored += static_cast<size_t>(std::popcount(word));
    }
    values_.resize(std::max(count, values_.size()));
    packed_.resize(std::max(count, packed_.size()));
    TRY_STATUS(take_data(std::span(all ? values_ : packed_).first(stored)));
    if (all) return {};
    const T* next = packed_.data();
    for (size_t n = 0; n < count; ++n)
      values_[n] = is_on(active, n) ? *next++ : !mask.empty() && is_on(mask, n) ? on : off;
    return {};
  }

  Status take_data(std::span<T> out) {
    const size_t size = out.size_bytes();
    if (compression_ & kBlosc) {
      int64_t packed = 0;  // negative: as many bytes as they are
      TRY_STATUS(take(packed));
      if (packed > 0) {
        if (bytes_.size() < static_cast<uint64_t>(packed)) return cut_off();
        const std::span<const char> frame = bytes_.first(static_cast<size_t>(packed));
        size_t says = 0;
        // The frame must be sound in itself before Blosc may follow its offsets.
        if (blosc_cbuffer_validate(frame.data(), frame.size(), &says) != 0 || says != size ||
            blosc_decompress_ctx(frame.data(), out.data(), size, 1) != static_cast<int>(size))
          return damaged("a node's Blosc frame is broken");
        return skip(frame.size());
      }
      if (packed != -static_cast<int64_t>(size)) return damaged("a node has another number of values than it says");
    }
    if (bytes_.size() < size) return cut_off();
    if (size > 0) std::memcpy(out.data(), bytes_.data(), size);
    return skip(size);
  }

  std::span<const char> bytes_;  // what is left
  VoxelPos origin_;
  const GridVisitor<T>& visitor_;
  uint32_t compression_ = 0;
  std::vector<LeafPos> leaves_;
  std::vector<uint64_t> active_;
  std::vector<T> values_, packed_;
};

}  // namespace

template <class T>
Status read_region_grid(std::span<const char> bytes, RegionPos region, const GridVisitor<T>& visitor) {
  return Reader<T>(bytes, region, visitor).read();
}
template Status read_region_grid(std::span<const char>, RegionPos, const GridVisitor<int32_t>&);
template Status read_region_grid(std::span<const char>, RegionPos, const GridVisitor<float>&);

}  // namespace world
