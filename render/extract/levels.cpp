#include "render/extract/levels.h"

#include <algorithm>
#include <array>
#include <bit>
#include <mutex>

#include "render/extract/proxies.h"
#include "world/base/jobs.h"
#include "world/store/leaf_copy.h"
#include "world/store/snapshot.h"

namespace render {

using namespace world;

struct CoarseLevels::Level {
  explicit Level(const BlockPalette& palette) : cells(palette) {}
  World cells;
  Extractor faces;
};

namespace {

/// The eight leaves that a leaf of the next level covers, by x*4 + y*2 + z.
struct Children {
  LeafBlocks blocks[8];
  const LeafMask* occupied[8];
};

/// The block of a cell whose first voxel is `voxel`; `low`, `high`: occupied voxels at it and a step of x on, by y*8 +
/// z from it. The most frequent of the topmost of its four columns; the first of them where none leads.
BlockId choose(const BlockId* blocks, int voxel, uint64_t low, uint64_t high) {
  BlockId top[4];
  int count = 0;
  for (int column = 0; column < 4; ++column) {
    const int dx = column >> 1, dz = column & 1;
    const uint64_t there = (dx != 0 ? high : low) >> dz;
    if (there & 0x100)
      top[count++] = blocks[voxel + dx * 64 + 8 + dz];
    else if (there & 1)
      top[count++] = blocks[voxel + dx * 64 + dz];
  }
  int best = 0, most = 0;
  for (int i = 0; i < count && most * 2 < count; ++i) {
    int same = 0;
    for (int j = i; j < count; ++j) same += top[j] == top[i];
    if (same > most) best = i, most = same;
  }
  return top[best];
}

/// At bits of even y and z: whether four or more of the cell's eight voxels are there; of two planes of x.
uint64_t half_full(uint64_t low, uint64_t high) {
  // Sums in bit planes: over x, then z, then y.
  const uint64_t x1 = low ^ high, x2 = low & high;
  const uint64_t carry = x1 & x1 >> 1, z1 = x1 ^ x1 >> 1;
  const uint64_t z2 = x2 ^ x2 >> 1 ^ carry, z4 = (x2 & x2 >> 1) | (carry & (x2 | x2 >> 1));
  const uint64_t y2 = z1 & z1 >> 8;
  const uint64_t four = z4 | z4 >> 8 | (z2 & z2 >> 8) | (y2 & (z2 | z2 >> 8));
  constexpr uint64_t kEven = 0x0055005500550055;
  return four & kEven;
}

/// False where all of the leaf is air.
bool coarse_leaf(const Children& c, std::array<BlockId, kLeafVoxels>& out) {
  out.fill(kAir);
  bool any = false;
  for (int child = 0; child < 8; ++child) {
    const LeafMask& mask = *c.occupied[child];
    const LeafBlocks& blocks = c.blocks[child];
    BlockId* const octant = out.data() + (child >> 2) * 256 + (child >> 1 & 1) * 32 + (child & 1) * 4;
    for (int x = 0; x < 4; ++x) {
      const uint64_t low = mask.word[x * 2], high = mask.word[x * 2 + 1];
      for (uint64_t cells = half_full(low, high); cells != 0; cells &= cells - 1) {
        const int at = __builtin_ctzll(cells);
        any = true;
        octant[x * 64 + (at >> 4) * 8 + (at >> 1 & 3)] =
            blocks.values ? choose(blocks.values, x * 128 + at, low >> at, high >> at) : blocks.uniform;
      }
    }
  }
  return any;
}

/// Leaf `l` of the next level. False where it is air; `uniform` where one block fills it.
struct CoarseLeaf {
  bool any = false, uniform = false;
  std::array<BlockId, kLeafVoxels> blocks;
};

void make_leaf(LeafCopies& reader, const MaskVolume& occupied, LeafPos l, CoarseLeaf& out) {
  Children c;
  bool same = true, any = false;
  for (int i = 0; i < 8; ++i) {
    const LeafPos child{l.x * 2 + (i >> 2), l.y * 2 + (i >> 1 & 1), l.z * 2 + (i & 1)};
    c.occupied[i] = &occupied.leaf(child);
    any |= c.occupied[i] != &kNoneMask;
    same &= c.occupied[i] == &kAllMask;
  }
  out.any = out.uniform = false;
  if (!any) return;
  std::array<BlockId, kLeafVoxels> room[8];
  for (int i = 0; i < 8; ++i) {
    c.blocks[i] = reader.leaf({l.x * 2 + (i >> 2), l.y * 2 + (i >> 1 & 1), l.z * 2 + (i & 1)}, room[i]);
    same &= !c.blocks[i].values && c.blocks[i].uniform == c.blocks[0].uniform;
  }
  if (same) {
    out.any = out.uniform = true;
    out.blocks.fill(c.blocks[0].uniform);
    return;
  }
  out.any = coarse_leaf(c, out.blocks);
}

}  // namespace

CoarseLevels::CoarseLevels() = default;
CoarseLevels::~CoarseLevels() = default;

const Extractor& CoarseLevels::level(int k) const { return levels_[static_cast<size_t>(k - 1)]->faces; }

void CoarseLevels::rebuild(const WorldView& view, const ShapeExtractor* shapes, int count, const ExtractKnobs& knobs,
                           const RangeOf& range_of) {
  levels_.clear();
  shapes_ = shapes;
  for (int k = 1; k <= count; ++k) {
    auto made = std::make_unique<Level>(view.palette());
    const auto build = [&](const Store& store, const MaskVolume& occupied) {
      std::vector<RegionPos> regions;
      for (const MaskRegion* r : occupied.regions()) regions.push_back({r->pos.x >> 1, r->pos.y >> 1, r->pos.z >> 1});
      std::sort(regions.begin(), regions.end());
      regions.erase(std::unique(regions.begin(), regions.end()), regions.end());
      for (const MaskKind kind : {MaskKind::occupied, MaskKind::opaque}) made->cells.store.masks(kind);
      const unsigned kinds = made->cells.store.mask_kinds();
      // Each is packed as soon as it is made, so that those of a large world are never all open.
      std::mutex installing;
      parallel_ranges(regions.size(), 1, [&](size_t begin, size_t end) {
        LeafCopies reader(store);
        CoarseLeaf leaf;
        for (size_t i = begin; i < end; ++i) {
          RegionBuilder built(regions[i]);
          for (int l = 0; l < kLeavesPerRegion; ++l) {
            make_leaf(reader, occupied, leaf_from_region(regions[i]) + leaf_offset_in_region(l), leaf);
            if (!leaf.any) continue;
            if (leaf.uniform)
              built.set_uniform(l, leaf.blocks[0]);
            else
              built.set_leaf(l, leaf.blocks);
          }
          PreparedRegion packed(built, view.palette(), kinds);
          const std::lock_guard lock(installing);
          made->cells.store.install(std::move(packed));
        }
      });
    };
    if (k == 1) {
      build(view.store(), shapes ? shapes->cubes_occupied(view) : view.masks(MaskKind::occupied));
    } else {
      const Store& below = levels_.back()->cells.store;
      build(below, below.masks(MaskKind::occupied));
    }
    made->faces.rebuild(WorldView(made->cells), knobs, range_of(k));
    levels_.push_back(std::move(made));
  }
}

void CoarseLevels::follow(const RangeOf& range_of) {
  for (int k = 1; k <= count(); ++k) {
    Level& level = *levels_[static_cast<size_t>(k - 1)];
    level.faces.follow(WorldView(level.cells), range_of(k));
  }
}

void CoarseLevels::update(const WorldView& view, std::span<const LeafPos> dirty) {
  std::vector<LeafPos> leaves(dirty.begin(), dirty.end());
  for (size_t k = 0; k < levels_.size() && !leaves.empty(); ++k) {
    for (LeafPos& l : leaves) l = {l.x >> 1, l.y >> 1, l.z >> 1};
    std::sort(leaves.begin(), leaves.end());
    leaves.erase(std::unique(leaves.begin(), leaves.end()), leaves.end());
    const Store& below = k == 0 ? view.store() : levels_[k - 1]->cells.store;
    const MaskVolume& occupied = k > 0     ? below.masks(MaskKind::occupied)
                                 : shapes_ ? shapes_->cubes_occupied(view)
                                           : view.masks(MaskKind::occupied);
    Level& level = *levels_[k];
    LeafCopies reader(below);
    std::vector<CoarseLeaf> made(leaves.size());
    std::vector<LeafWrite> writes;
    for (size_t i = 0; i < leaves.size(); ++i) {
      make_leaf(reader, occupied, leaves[i], made[i]);
      if (!made[i].any) made[i].blocks.fill(kAir);
      writes.push_back({leaves[i], made[i].blocks.data()});
    }
    const auto written = level.cells.store.write_leaves(writes);
    CHECK(written.ok());  // the blocks are the world's own
    level.faces.update(WorldView(level.cells), leaves);
  }
}

size_t CoarseLevels::bytes() const {
  size_t total = 0;
  for (const auto& level : levels_) {
    total += level->faces.bytes();
    for (const RegionPos r : level->cells.store.regions()) total += level->cells.store.region_bytes(r);
  }
  return total;
}

}  // namespace render
