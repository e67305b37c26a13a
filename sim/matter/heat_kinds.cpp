#include "sim/matter/heat_kinds.h"

#include <algorithm>

#include <xxhash.h>

#include "world/base/huge_pages.h"

namespace sim {

namespace {

uint64_t hash_of(const ThermalKinds& kinds) {
  return XXH3_64bits_withSeed(kinds.all.data(), kinds.all.size() * sizeof(ThermalVoxel),
                              XXH3_64bits(kinds.kind, sizeof kinds.kind));
}

bool say_the_same(const ThermalKinds& a, const ThermalKinds& b) {
  return a.all == b.all && std::ranges::equal(a.kind, b.kind);
}

}  // namespace

// Never taken down, as that of heats.
world::HugePageRecords& SharedKinds::memory() {
  static auto& memory = *new world::HugePageRecords(sizeof(Entry));
  return memory;
}
void* SharedKinds::Entry::operator new(size_t) { return memory().take(); }
void SharedKinds::Entry::operator delete(void* entry) { memory().give_back(entry); }

const ThermalKinds* SharedKinds::share(const ThermalKinds& made) {
  const uint64_t hash = hash_of(made);
  const std::lock_guard lock(mutex_);
  const auto [begin, end] = entries_.equal_range(hash);
  for (auto it = begin; it != end; ++it)
    if (say_the_same(*it->second, made)) {
      ++it->second->users;
      return it->second.get();
    }
  const auto& entry = entries_.emplace(hash, std::make_unique<Entry>(made))->second;
  entry->hash = hash, entry->users = 1;
  bytes_ += entry->bytes();
  return entry.get();
}

void SharedKinds::give_back(const ThermalKinds* kinds) {
  if (!kinds) return;
  const std::lock_guard lock(mutex_);
  const auto [begin, end] = entries_.equal_range(static_cast<const Entry*>(kinds)->hash);
  const auto it = std::find_if(begin, end, [&](const auto& entry) { return entry.second.get() == kinds; });
  if (--it->second->users > 0) return;
  bytes_ -= it->second->bytes();
  entries_.erase(it);
}

}  // namespace sim
