/// Memory for many records of one size, side by side on huge pages where the system has them: what walks through them
/// misses the table of translations less often. For records that come and go by the thousand, as a class's operator
/// new; from several threads at once.
///
///   slab   2 MiB, on as much; its first record is its head: which records are free
///
/// A slab in which nothing is left goes back to the system, but for one.
/// cost   a lock and a few lines of the head
#pragma once

#include <cstddef>
#include <mutex>

namespace world {

class HugePageRecords {
 public:
  static constexpr size_t kSlabBytes = size_t{2} << 20;

  /// `bytes` of each: a multiple of 64, at most 1/4 of a slab.
  explicit HugePageRecords(size_t bytes);
  HugePageRecords(const HugePageRecords&) = delete;
  /// Everything must be back.
  ~HugePageRecords();

  /// On 64 bytes. Ends the program where there is no memory.
  void* take();
  void give_back(void* record);
  size_t slabs() const;

 private:
  struct Slab;
  void unlink(Slab* slab);
  void link(Slab* slab);

  const size_t bytes_, count_;  // of records in a slab
  mutable std::mutex mutex_;
  Slab* with_room_ = nullptr;  // list of those that aren't full
  size_t slabs_ = 0;
};

}  // namespace world
