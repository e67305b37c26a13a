/// A packed NBT tree whose large arrays stay packed: the tree is held in memory with those arrays cut out, and each can
/// be inflated again, a piece at a time. So a schematic of any size takes memory by what it builds, not by its indices.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "world/formats/archive/inflate.h"
#include "world/formats/nbt/nbt.h"

namespace world::nbt {

/// Arrays of more bytes than this are cut out.
constexpr size_t kLargeArrayBytes = 1 << 20;

class ElidedFile {
 public:
  static Result<ElidedFile> open(const std::filesystem::path& path);

  /// The tree; a large array stands in it with a count of 0.
  std::span<const uint8_t> tree() const { return tree_; }
  MemoryBudget& budget() const { return *budget_; }

  struct LargeArray {
    size_t tree_offset = 0;      // behind its count
    uint64_t stream_offset = 0;  // of its content among the inflated bytes
    uint64_t bytes = 0;
  };
  /// The array whose (empty) content a Reader of tree() has just read, standing at `offset`; null where it was empty.
  const LargeArray* large_array_at(size_t offset) const;

 private:
  friend class ArrayStream;
  std::vector<uint8_t> packed_, tree_;
  std::vector<LargeArray> large_;
  std::unique_ptr<MemoryBudget> budget_;
};

/// Walks the bytes of an array, which lies in the tree or is inflated as it is read.
class ArrayStream {
 public:
  explicit ArrayStream(std::span<const uint8_t> bytes);
  ArrayStream(const ElidedFile& file, const ElidedFile::LargeArray& array);
  ~ArrayStream();
  ArrayStream(ArrayStream&&) noexcept;

  /// The next bytes, some at a time; empty at the end of the array.
  std::span<const uint8_t> next();

 private:
  struct Source;
  std::span<const uint8_t> piece_;
  std::unique_ptr<Source> source_;
};

}  // namespace world::nbt
