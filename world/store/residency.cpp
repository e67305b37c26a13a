#include "world/store/residency.h"

#include "world/store/tree.h"

namespace world {

uint64_t region_edits(const Store& store, RegionPos r) {
  const auto found = store.nodes().regions.find(r);
  return found == store.nodes().regions.end() ? 0 : found->second.edits;
}

size_t region_thaw_bytes(const Store& store, RegionPos r) {
  const auto found = store.nodes().regions.find(r);
  return found == store.nodes().regions.end() || !found->second.packed ? 0 : found->second.packed->thaw_bytes();
}

}  // namespace world
