#include "tools/bench/rivals/openvdb_rival.h"

#include <openvdb/tree/LeafManager.h>

#include "world/store/tree.h"

namespace tools {

using world::BlockTree;
using world::coord;

struct OpenVdbRival::Impl {
  BlockTree tree;
  std::unique_ptr<openvdb::tree::LeafManager<BlockTree>> leaves;
};

OpenVdbRival::OpenVdbRival(const world::Store& store) : impl_(new Impl{store.nodes().tree, nullptr}) {
  impl_->leaves = std::make_unique<openvdb::tree::LeafManager<BlockTree>>(impl_->tree);
}
OpenVdbRival::~OpenVdbRival() = default;

uint64_t OpenVdbRival::sum(std::span<const world::VoxelPos> positions) const {
  const openvdb::tree::ValueAccessor<const BlockTree> accessor(impl_->tree);
  uint64_t total = 0;
  for (const world::VoxelPos& v : positions) total += accessor.getValue(coord(v));
  return total;
}

uint64_t OpenVdbRival::sum_of_leaves() const {
  uint64_t total = 0;
  for (size_t i = 0; i < impl_->leaves->leafCount(); ++i) {
    const world::BlockId* values = impl_->leaves->leaf(i).buffer().data();
    for (int n = 0; n < world::kLeafVoxels; ++n) total += values[n];
  }
  return total;
}

void OpenVdbRival::set(std::span<const world::VoxelPos> positions, world::BlockId block) {
  openvdb::tree::ValueAccessor<BlockTree> accessor(impl_->tree);
  for (const world::VoxelPos& v : positions) {
    if (block == world::kAir)
      accessor.setValueOff(coord(v), block);
    else
      accessor.setValueOn(coord(v), block);
  }
}

void OpenVdbRival::fill(std::span<const world::VoxelBox> boxes, world::BlockId block) {
  for (const world::VoxelBox& box : boxes)
    impl_->tree.fill(openvdb::CoordBBox(coord(box.min), coord(box.max)), block, block != world::kAir);
}

}  // namespace tools
