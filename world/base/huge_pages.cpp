#include "world/base/huge_pages.h"

#include <cstdint>
#include <cstdlib>
#include <new>

#include "world/base/errors.h"

#ifdef __linux__
#include <sys/mman.h>
#endif

namespace world {

struct HugePageRecords::Slab {
  Slab *before = nullptr, *next = nullptr;  // of those with room
  void* free = nullptr;                     // list of records that came back
  size_t fresh = 1;                         // number of the first record that was never taken
  size_t taken = 0;
};

HugePageRecords::HugePageRecords(size_t bytes) : bytes_(bytes), count_(kSlabBytes / bytes) {
  CHECK_EQ(bytes % 64, 0u);
  CHECK(bytes >= sizeof(Slab) && count_ >= 4);
}

HugePageRecords::~HugePageRecords() {
  while (with_room_) {
    Slab* slab = with_room_;
    CHECK_EQ(slab->taken, 0u);
    unlink(slab);
    std::free(slab);
    --slabs_;
  }
  CHECK_EQ(slabs_, 0u);
}

void HugePageRecords::link(Slab* slab) {
  slab->before = nullptr, slab->next = with_room_;
  if (with_room_) with_room_->before = slab;
  with_room_ = slab;
}

void HugePageRecords::unlink(Slab* slab) {
  (slab->before ? slab->before->next : with_room_) = slab->next;
  if (slab->next) slab->next->before = slab->before;
}

void* HugePageRecords::take() {
  const std::lock_guard lock(mutex_);
  if (!with_room_) {
    void* memory = std::aligned_alloc(kSlabBytes, kSlabBytes);
    CHECK(memory != nullptr);
#ifdef __linux__
    madvise(memory, kSlabBytes, MADV_HUGEPAGE);  // refused: pages are small
#endif
    link(new (memory) Slab);
    ++slabs_;
  }
  Slab* slab = with_room_;
  void* record = slab->free;
  if (record)
    slab->free = *static_cast<void**>(record);
  else
    record = reinterpret_cast<std::byte*>(slab) + bytes_ * slab->fresh++;
  if (++slab->taken == count_ - 1) unlink(slab);
  return record;
}

void HugePageRecords::give_back(void* record) {
  if (!record) return;
  auto* slab = reinterpret_cast<Slab*>(reinterpret_cast<uintptr_t>(record) & ~(kSlabBytes - 1));
  const std::lock_guard lock(mutex_);
  if (slab->taken-- == count_ - 1) link(slab);
  *static_cast<void**>(record) = slab->free;
  slab->free = record;
  if (slab->taken > 0 || (slab == with_room_ && !slab->next)) return;
  unlink(slab);
  std::free(slab);
  --slabs_;
}

size_t HugePageRecords::slabs() const {
  const std::lock_guard lock(mutex_);
  return slabs_;
}

}  // namespace world
