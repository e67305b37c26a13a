#include "tools/play/brush.h"

#include <algorithm>
#include <cmath>
#include <unordered_set>

#include "world/space/grid_walk.h"

namespace tools {

using world::BlockId;
using world::EditBatch;
using world::VoxelBox;
using world::VoxelPos;

namespace {

VoxelBox between(VoxelPos a, VoxelPos b) {
  VoxelBox box;
  box.include(a), box.include(b);
  return box;
}

/// Calls row(y, z, half width) for the rows along x of a sphere about 0.
template <class Row>
void rows_of_sphere(int radius, Row row) {
  const double most = (radius + 0.5) * (radius + 0.5);
  for (int y = -radius; y <= radius; ++y)
    for (int z = -radius; z <= radius; ++z) {
      const double left = most - y * y - z * z;
      if (left >= 0) row(y, z, static_cast<int>(std::sqrt(left)));
    }
}

}  // namespace

EditBatch box_of(VoxelPos a, VoxelPos b, BlockId block) {
  EditBatch batch;
  batch.fill(between(a, b), block);
  return batch;
}

EditBatch sphere_of(VoxelPos c, int radius, BlockId block) {
  EditBatch batch;
  rows_of_sphere(radius, [&](int y, int z, int half) {
    batch.fill({{c.x - half, c.y + y, c.z + z}, {c.x + half, c.y + y, c.z + z}}, block);
  });
  return batch;
}

EditBatch line_of(VoxelPos a, VoxelPos b, BlockId block) {
  EditBatch batch;
  const world::WorldPoint from{a, world::Vec3d(0.5)}, to{b, world::Vec3d(0.5)};
  for (auto walk = world::FlatWalk::segment(from, to); walk.inside(); walk.step()) {
    batch.set(walk.voxel(), block);
    if (walk.voxel() == b) break;
  }
  return batch;
}

std::optional<EditBatch> fill_of(const world::Store& store, VoxelPos start, BlockId block) {
  const BlockId of = store.get(start);
  if (of == block) return EditBatch{};
  std::unordered_set<VoxelPos, world::PosHash> seen{start};
  std::vector<VoxelPos> all{start};
  for (size_t n = 0; n < all.size(); ++n)
    for (int face = 0; face < world::kFaces; ++face) {
      const VoxelPos next = all[n] + world::face_step(face);
      if (next.y > start.y || !world::inside_world(next) || store.get(next) != of) continue;
      if (!seen.insert(next).second) continue;
      all.push_back(next);
      if (all.size() > kMostFill) return std::nullopt;
    }
  std::sort(all.begin(), all.end(),
            [](VoxelPos a, VoxelPos b) { return std::tie(a.y, a.z, a.x) < std::tie(b.y, b.z, b.x); });
  EditBatch batch;
  for (size_t n = 0; n < all.size();) {
    size_t end = n + 1;
    while (end < all.size() && all[end] == all[end - 1] + VoxelPos{1, 0, 0}) ++end;
    batch.fill({all[n], all[end - 1]}, block);
    n = end;
  }
  return batch;
}

EditBatch replace_of(const world::Store& store, VoxelPos c, int radius, BlockId from, BlockId to) {
  EditBatch batch;
  rows_of_sphere(radius, [&](int y, int z, int half) {
    for (int x = -half; x <= half; ++x)
      if (const VoxelPos v{c.x + x, c.y + y, c.z + z}; world::inside_world(v) && store.get(v) == from) batch.set(v, to);
  });
  return batch;
}

std::optional<Clipboard> copy_box(const world::Store& store, VoxelPos a, VoxelPos b) {
  const VoxelBox box = between(a, b);
  if (box.volume() > kMostCopied) return std::nullopt;
  Clipboard copy;
  copy.size = box.max - box.min + VoxelPos{1, 1, 1};
  VoxelPos v;
  for (v.x = box.min.x; v.x <= box.max.x; ++v.x)
    for (v.y = box.min.y; v.y <= box.max.y; ++v.y)
      for (v.z = box.min.z; v.z <= box.max.z; ++v.z) copy.blocks.push_back(store.get(v));
  return copy;
}

namespace {

template <class Source>
Clipboard rearranged(const Clipboard& from, VoxelPos size, const std::vector<BlockId>& forms, Source source) {
  Clipboard to{size, {}};
  for (int x = 0; x < size.x; ++x)
    for (int y = 0; y < size.y; ++y)
      for (int z = 0; z < size.z; ++z) {
        const VoxelPos s = source(VoxelPos{x, y, z});
        to.blocks.push_back(forms[from.blocks[static_cast<size_t>((s.x * from.size.y + s.y) * from.size.z + s.z)]]);
      }
  return to;
}

}  // namespace

Clipboard turned(const Clipboard& c, const TurnedForms& forms) {
  return rearranged(c, {c.size.z, c.size.y, c.size.x}, forms.turned, [&](VoxelPos v) {
    return VoxelPos{v.z, v.y, c.size.z - 1 - v.x};
  });
}

Clipboard flipped(const Clipboard& c, int axis, const TurnedForms& forms) {
  return rearranged(c, c.size, forms.flipped[static_cast<size_t>(axis)], [&](VoxelPos v) {
    v[axis] = c.size[axis] - 1 - v[axis];
    return v;
  });
}

EditBatch paste_of(const Clipboard& clipboard, VoxelPos low) {
  EditBatch batch;
  size_t i = 0;
  for (int x = 0; x < clipboard.size.x; ++x)
    for (int y = 0; y < clipboard.size.y; ++y)
      for (int z = 0; z < clipboard.size.z; ++i, ++z)
        if (clipboard.blocks[i] != world::kAir) batch.set(low + VoxelPos{x, y, z}, clipboard.blocks[i]);
  return batch;
}

EditBatch mirrored(const EditBatch& batch, int axis, int32_t at, const TurnedForms& forms) {
  EditBatch both = batch;
  for (const EditBatch::Op& op : batch.ops()) {
    VoxelBox box = op.box;
    if (box.min[axis] == at && box.max[axis] == at) continue;
    box.min[axis] = 2 * at - op.box.max[axis], box.max[axis] = 2 * at - op.box.min[axis];
    both.fill(box, forms.flipped[static_cast<size_t>(axis)][op.block]);
  }
  return both;
}

}  // namespace tools
