#include "sim/light/flux_grid.h"

#include <algorithm>
#include <bit>

#include "world/base/jobs.h"
#include "world/store/leaf_shifts.h"

namespace sim {

using world::LeafMask;
using world::LeafPos;

namespace {

bool affects_light(const world::Block& b) { return b.absorption.max() > 0 || b.emission.max() > 0; }

}  // namespace

uint32_t FluxGrid::surface(world::VoxelPos voxel, int face) const {
  const LeafPos l = world::leaf_from_voxel(voxel), from{l.x - low.x, l.y - low.y, l.z - low.z};
  for (int a = 0; a < 3; ++a)
    if (from[a] < 0 || from[a] >= size[a]) return UINT32_MAX;
  const FluxLeaf& leaf = leaves[place(from)];
  const int index = world::index_in_leaf(voxel);
  if (!leaf.wall[face].test(index)) return UINT32_MAX;
  const uint64_t below = leaf.wall[face].word[index >> 6] & ((1ull << (index & 63)) - 1);
  return leaf.first[face][index >> 6] + static_cast<uint32_t>(std::popcount(below));
}

size_t FluxGrid::bytes() const {
  return leaves.capacity() * sizeof(FluxLeaf) + media.capacity() * sizeof(LeafMedia) +
         surfaces.capacity() * sizeof(Surface);
}

FluxGrid make_flux_grid(const world::Store& store, const world::VoxelBox& box) {
  FluxGrid grid;
  if (box.empty()) return grid;
  grid.low = world::leaf_from_voxel(box.min);
  const LeafPos high = world::leaf_from_voxel(box.max);
  for (int a = 0; a < 3; ++a) grid.size[a] = high[a] - grid.low[a] + 1;
  const size_t count = static_cast<size_t>(grid.size[0]) * grid.size[1] * grid.size[2];
  grid.leaves.resize(count);

  const world::BlockPalette& palette = store.palette();
  std::vector<uint16_t> kind_of(palette.size(), 0);  // 1 + kind, of clear blocks that affect light
  for (size_t id = 1; id < palette.size(); ++id) {
    const world::Block& b = palette[static_cast<world::BlockId>(id)];
    if (b.opaque || !affects_light(b)) continue;
    grid.kinds.push_back(
        {{b.absorption.r, b.absorption.g, b.absorption.b}, {b.emission.r, b.emission.g, b.emission.b}});
    kind_of[id] = static_cast<uint16_t>(grid.kinds.size());
  }

  // Find walls; from the masks alone.
  const world::MaskVolume& opaque = store.masks(world::MaskKind::opaque);
  const world::MaskVolume& occupied = store.masks(world::MaskKind::occupied);
  const auto position = [&](size_t i) {
    const int z = static_cast<int>(i % grid.size[2]), y = static_cast<int>(i / grid.size[2] % grid.size[1]),
              x = static_cast<int>(i / grid.size[2] / grid.size[1]);
    return LeafPos{x, y, z};
  };
  std::vector<uint32_t> walls(count, 0);
  std::vector<uint8_t> has_media(count, 0);
  world::parallel_ranges(count, 64, [&](size_t begin, size_t end) {
    world::StoreReader reader(store);
    for (size_t i = begin; i < end; ++i) {
      const LeafPos l = grid.low + position(i);
      FluxLeaf& leaf = grid.leaves[i];
      const LeafMask& solid = opaque.leaf(l);
      LeafMask any;
      for (int x = 0; x < 8; ++x) leaf.clear.word[x] = ~solid.word[x];
      for (int face = 0; face < world::kFaces; ++face) {
        const world::VoxelPos step = world::face_step(face);
        const LeafMask next = world::across(solid, opaque.leaf({l.x + step.x, l.y + step.y, l.z + step.z}), face);
        for (int x = 0; x < 8; ++x) {
          leaf.wall[face].word[x] = leaf.clear.word[x] & next.word[x];
          any.word[x] |= leaf.wall[face].word[x];
          walls[i] += static_cast<uint32_t>(std::popcount(leaf.wall[face].word[x]));
        }
      }
      // Voxels that hold something and are clear: media, where their blocks affect light.
      const LeafMask& held = occupied.leaf(l);
      leaf.busy = any;
      world::LeafBlocks blocks;
      bool read = false;
      for (int x = 0; x < 8; ++x) {
        for (uint64_t w = held.word[x] & leaf.clear.word[x]; w; w &= w - 1) {
          if (!read) blocks = reader.leaf(l), read = true;
          const int index = x * 64 + std::countr_zero(w);
          if (kind_of[blocks[index]] == 0) continue;
          leaf.busy.set(index);
          has_media[i] = 1;
        }
      }
      leaf.solid = leaf.clear.is_none();
      leaf.open = leaf.clear.is_all() && leaf.busy.is_none();
    }
  });

  // Number them.
  uint32_t next = 0, next_media = 0;
  std::vector<uint32_t> base(count);
  for (size_t i = 0; i < count; ++i) {
    base[i] = next;
    next += walls[i];
    grid.leaves[i].media = has_media[i] ? ++next_media : 0;
  }
  grid.surfaces.resize(next);
  grid.media.resize(next_media);
  world::parallel_ranges(count, 64, [&](size_t begin, size_t end) {
    world::StoreReader reader(store);
    for (size_t i = begin; i < end; ++i) {
      FluxLeaf& leaf = grid.leaves[i];
      const LeafPos l = grid.low + position(i);
      const world::VoxelPos corner = world::voxel_from_leaf(l);
      uint32_t number = base[i];
      for (int face = 0; face < world::kFaces; ++face) {
        const world::VoxelPos step = world::face_step(face);
        for (int x = 0; x < 8; ++x) {
          leaf.first[face][x] = number;
          for (uint64_t w = leaf.wall[face].word[x]; w; w &= w - 1) {
            const world::VoxelPos v = corner + world::offset_in_leaf(x * 64 + std::countr_zero(w));
            grid.surfaces[number++] = {v, face, reader.get(v + step)};
          }
        }
      }
      if (!leaf.media) continue;
      const world::LeafBlocks blocks = reader.leaf(l);
      LeafMedia& media = grid.media[leaf.media - 1];
      for (int v = 0; v < world::kLeafVoxels; ++v) media[v] = leaf.clear.test(v) ? kind_of[blocks[v]] : 0;
    }
  });

  // Count what the sky can enter, and what media emit.
  std::vector<uint64_t> voxels_of(grid.kinds.size() + 1, 0);
  for (size_t i = 0; i < count; ++i) {
    const FluxLeaf& leaf = grid.leaves[i];
    const LeafPos p = position(i);
    for (int face = 0; face < world::kFaces; ++face) {
      const int a = world::face_axis(face);
      if (p[a] != (world::face_sign(face) < 0 ? 0 : grid.size[a] - 1)) continue;
      const LeafMask side = world::side_of(face);
      for (int x = 0; x < 8; ++x)
        grid.open_faces[face] += std::popcount(leaf.clear.word[x] & ~leaf.wall[face].word[x] & side.word[x]);
    }
    if (leaf.media)
      for (const uint16_t kind : grid.media[leaf.media - 1]) ++voxels_of[kind];
  }
  for (size_t k = 0; k < grid.kinds.size(); ++k)
    for (int b = 0; b < 3; ++b) grid.medium_emission[b] += double(grid.kinds[k].emission[b]) * voxels_of[k + 1];
  return grid;
}

}  // namespace sim
