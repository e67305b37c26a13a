#include "world/formats/nbt/large_arrays.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>
#include <zlib.h>

#include "world/base/file.h"
#include "world/formats/bytes.h"

namespace world::nbt {
namespace {

constexpr uint64_t kMostFileBytes = uint64_t{1} << 31;
constexpr size_t kPiece = 64 << 10;
/// A tree without its large arrays: what chests hold, and names. Walking over it takes 5 ns a byte at worst.
constexpr uint64_t kMostTree = uint64_t{64} << 20, kMostTreeRatio = 8;
constexpr size_t kMostInput = size_t{1} << 30;  // zlib counts in 32 bits

/// The bytes of a file as they come out of gzip or zlib, or as they lie there.
class Inflating {
 public:
  explicit Inflating(std::span<const uint8_t> packed) : packed_(packed) {
    if (!looks_like_gzip(packed) && !looks_like_zlib(packed)) return;
    plain_ = false;
    good_ = inflateInit2(&z_, MAX_WBITS + 32) == Z_OK;
  }
  ~Inflating() {
    if (!plain_) inflateEnd(&z_);
  }
  Inflating(const Inflating&) = delete;
  Inflating& operator=(const Inflating&) = delete;

  /// Bytes that were there, at most out.size(); fewer only at the end, or where the data is damaged.
  size_t read(std::span<uint8_t> out) {
    if (plain_) {
      const size_t n = std::min(out.size(), packed_.size() - taken_);
      std::copy_n(packed_.begin() + static_cast<std::ptrdiff_t>(taken_), n, out.begin());
      taken_ += n;
      return n;
    }
    size_t done = 0;
    while (good_ && done < out.size()) {
      const size_t in = std::min(packed_.size() - taken_, kMostInput), room = std::min(out.size() - done, kMostInput);
      z_.next_in = const_cast<Bytef*>(packed_.data() + taken_);
      z_.avail_in = static_cast<uInt>(in);
      z_.next_out = out.data() + done;
      z_.avail_out = static_cast<uInt>(room);
      const int code = inflate(&z_, Z_NO_FLUSH);
      taken_ += in - z_.avail_in;
      done += room - z_.avail_out;
      if (code != Z_OK) good_ = false;  // the end, or damage: what is missing will be missed
    }
    return done;
  }

 private:
  std::span<const uint8_t> packed_;
  size_t taken_ = 0;
  bool plain_ = true, good_ = true;
  z_stream z_{};
};

/// Copies a tree from a stream, but for the content of large arrays.
class Copier {
 public:
  Copier(std::span<const uint8_t> packed, MemoryBudget& budget, std::vector<uint8_t>& tree,
         std::vector<ElidedFile::LargeArray>& large)
      : in_(packed),
        budget_(budget),
        most_tree_(kMostTree + kMostTreeRatio * packed.size()),
        tree_(tree),
        large_(large),
        buffer_(kPiece) {}

  /// What is wrong, or nothing.
  std::string copy_root() {
    const auto type = static_cast<Type>(number(1));
    if (type != Type::compound && !failed_) return "expected a compound at the root; it is no NBT";
    bytes(number(2));
    value(type);
    return problem_;
  }

 private:
  struct Level {
    Type element;  // of a list
    bool in_compound;
    uint32_t left;
  };

  void value(Type type) {
    std::vector<Level> levels;
    while (!failed_) {
      switch (type) {
        case Type::byte_number:
          bytes(1);
          break;
        case Type::short_number:
          bytes(2);
          break;
        case Type::int_number:
        case Type::float_number:
          bytes(4);
          break;
        case Type::long_number:
        case Type::double_number:
          bytes(8);
          break;
        case Type::text:
          bytes(number(2));
          break;
        case Type::byte_array:
          array(1);
          break;
        case Type::int_array:
          array(4);
          break;
        case Type::long_array:
          array(8);
          break;
        case Type::list: {
          const auto element = static_cast<Type>(number(1));
          const auto count = static_cast<int32_t>(number(4));
          if (element >= Type::count || (element == Type::end && count > 0))
            return fail("a list of an impossible type");
          if (count <= 0) break;
          if (const uint64_t size = number_bytes(element))
            bytes(size * static_cast<uint64_t>(count));
          else
            levels.push_back({element, false, static_cast<uint32_t>(count)});
          break;
        }
        case Type::compound:
          levels.push_back({Type::end, true, 0});
          break;
        default:
          return fail("a tag of an impossible type");
      }
      if (levels.size() > static_cast<size_t>(kMaxDepth)) return fail("more than 512 levels of nesting");
      // Find the next value.
      for (;;) {
        if (levels.empty() || failed_) return;
        Level& top = levels.back();
        if (top.in_compound) {
          type = static_cast<Type>(number(1));
          if (failed_) return;
          if (type != Type::end) {
            bytes(number(2));  // its name
            break;
          }
        } else if (top.left > 0) {
          --top.left;
          type = top.element;
          break;
        }
        levels.pop_back();
      }
    }
  }

  static uint64_t number_bytes(Type type) {
    constexpr uint64_t kBytes[] = {1, 2, 4, 8, 4, 8};
    return type >= Type::byte_number && type <= Type::double_number ? kBytes[static_cast<int>(type) - 1] : 0;
  }

  void array(uint64_t element_bytes) {
    const size_t count_at = tree_.size();
    const auto count = static_cast<int32_t>(number(4));
    if (failed_) return;
    if (count < 0) return fail("an array of a negative length");
    const uint64_t size = static_cast<uint64_t>(count) * element_bytes;
    if (size <= kLargeArrayBytes) return bytes(size);
    std::fill(tree_.begin() + static_cast<std::ptrdiff_t>(count_at), tree_.end(), uint8_t{0});
    if (size > budget_.inflated_left()) {
      return fail(fmt::format(
          "inflates to more than {} bytes, which a file of this size never needs; it is damaged or made to harm",
          position_));
    }
    large_.push_back({tree_.size(), position_, size});
    for (uint64_t left = size; left > 0 && !failed_;) {
      if (!fill()) return fail("the data ends inside an array; it is damaged or cut off");
      const size_t n = static_cast<size_t>(std::min<uint64_t>(left, have_ - at_));
      at_ += n;
      position_ += n;
      left -= n;
      budget_.inflated(n);
    }
  }

  /// Copies a big-endian number and returns it.
  uint64_t number(int size) {
    uint64_t value = 0;
    for (int i = 0; i < size && !failed_; ++i) {
      if (!fill()) {
        fail("the data ends inside a tag; it is damaged or cut off");
        return 0;
      }
      value = value << 8 | buffer_[at_];
      keep(1);
    }
    return failed_ ? 0 : value;
  }

  void bytes(uint64_t count) {
    while (count > 0 && !failed_) {
      if (!fill()) return fail("the data ends inside a value; it is damaged or cut off");
      const size_t n = static_cast<size_t>(std::min<uint64_t>(count, have_ - at_));
      keep(n);
      count -= n;
    }
  }

  void keep(size_t n) {
    if (tree_.size() + n > most_tree_) return fail(too_much());
    if (tree_.size() + n > tree_.capacity()) {
      // Old and new lie side by side while a vector grows.
      const size_t wanted = std::max<size_t>(kPiece, tree_.capacity() * 2);
      if (!budget_.take(wanted + tree_.capacity())) {
        return fail(too_much());
      }
      const size_t before = tree_.capacity();
      tree_.reserve(wanted);
      budget_.give_back(2 * before);
    }
    tree_.insert(tree_.end(), buffer_.begin() + static_cast<std::ptrdiff_t>(at_),
                 buffer_.begin() + static_cast<std::ptrdiff_t>(at_ + n));
    at_ += n;
    position_ += n;
  }

  std::string too_much() const {
    return fmt::format(
        "inflates to more than {} bytes beside its arrays, which a file of this size never needs; it is damaged or "
        "made "
        "to harm",
        tree_.size());
  }
  bool fill() {
    if (at_ == have_) {
      at_ = 0;
      have_ = in_.read(buffer_);
    }
    return at_ < have_;
  }
  void fail(const std::string& what) {
    if (!failed_) problem_ = what;
    failed_ = true;
  }

  Inflating in_;
  MemoryBudget& budget_;
  uint64_t most_tree_;
  std::vector<uint8_t>& tree_;
  std::vector<ElidedFile::LargeArray>& large_;
  std::vector<uint8_t> buffer_;
  size_t at_ = 0, have_ = 0;
  uint64_t position_ = 0;  // of at_ among the inflated bytes
  bool failed_ = false;
  std::string problem_;
};

}  // namespace

Result<ElidedFile> ElidedFile::open(const std::filesystem::path& path) {
  ElidedFile file;
  TRY(file.packed_, read_file(path, kMostFileBytes));
  file.budget_ = std::make_unique<MemoryBudget>(file.packed_.size());
  const std::string problem = Copier(file.packed_, *file.budget_, file.tree_, file.large_).copy_root();
  if (!problem.empty()) return input_error(path.string() + ": " + problem);
  return file;
}

const ElidedFile::LargeArray* ElidedFile::large_array_at(size_t offset) const {
  const auto found =
      std::find_if(large_.begin(), large_.end(), [&](const LargeArray& a) { return a.tree_offset == offset; });
  return found == large_.end() ? nullptr : &*found;
}

struct ArrayStream::Source {
  explicit Source(std::span<const uint8_t> packed) : in(packed), buffer(kPiece) {}
  Inflating in;
  std::vector<uint8_t> buffer;
  uint64_t left = 0;
};

ArrayStream::ArrayStream(const ElidedFile& file, const ElidedFile::LargeArray& array)
    : source_(std::make_unique<Source>(file.packed_)) {
  source_->left = array.bytes;
  for (uint64_t skip = array.stream_offset; skip > 0;) {
    const size_t n = static_cast<size_t>(std::min<uint64_t>(skip, kPiece));
    if (source_->in.read(std::span(source_->buffer).first(n)) != n) {
      source_->left = 0;
      break;
    }
    skip -= n;
  }
}
ArrayStream::ArrayStream(std::span<const uint8_t> bytes) : piece_(bytes) {}
ArrayStream::~ArrayStream() = default;
ArrayStream::ArrayStream(ArrayStream&&) noexcept = default;

std::span<const uint8_t> ArrayStream::next() {
  if (!source_) return std::exchange(piece_, {});
  const size_t n = static_cast<size_t>(std::min<uint64_t>(source_->left, kPiece));
  const size_t got = source_->in.read(std::span(source_->buffer).first(n));
  source_->left = got == n ? source_->left - n : 0;
  return std::span<const uint8_t>(source_->buffer).first(got);
}

}  // namespace world::nbt
