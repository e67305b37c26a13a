/// What pages that aren't of one material are to heat, kept once for all pages of one arrangement: layers of ground
/// and what is built repeat themselves, and what a step reads of it stays in the caches. Internal to sim/matter.
#pragma once

#include <memory>
#include <mutex>
#include <unordered_map>

#include "sim/matter/heat_kernel.h"

namespace world {
class HugePageRecords;
}

namespace sim {

class SharedKinds {
 public:
  /// One that says the same: there already, or a copy. To be given back as often. From several threads at once.
  const ThermalKinds* share(const ThermalKinds& made);
  void give_back(const ThermalKinds* kinds);
  size_t bytes() const { return bytes_; }

 private:
  struct Entry : ThermalKinds {
    explicit Entry(const ThermalKinds& kinds) : ThermalKinds(kinds) {}
    static void* operator new(size_t);  // on huge pages
    static void operator delete(void* entry);
    uint64_t hash = 0;
    size_t users = 0;
    size_t bytes() const { return sizeof(Entry) + all.capacity() * sizeof(ThermalVoxel); }
  };
  static world::HugePageRecords& memory();

  std::mutex mutex_;
  std::unordered_multimap<uint64_t, std::unique_ptr<Entry>> entries_;
  size_t bytes_ = 0;
};

}  // namespace sim
