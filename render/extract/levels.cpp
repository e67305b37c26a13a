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

BlockId block_of(const Children& c, int x, int y, int z) {
  return c.blocks[(x >> 3) * 4 + (y >> 3) * 2 + (z >> 3)][(x & 7) * 64 + (y & 7) * 8 + (z & 7)];
}

/// The block of a cell at twice (x, y, z); `bits`: which of its children are there, by x*4 + y*2 + z.
BlockId choose(const Children& c, int x, int y, int z, unsigned bits) {
  BlockId top[4];
  int count = 0;
  for (int column = 0; column < 4; ++column) {
    const int dx = column >> 1, dz = column & 1;
    for (int dy = 1; dy >= 0; --dy)
      if (bits >> (dx * 4 + dy * 2 + dz) & 1) {
        top[count++] = block_of(c, x + dx, y + dy, z + dz);
        break;
      }
  }
  int best = 0, most = 0;
  for (int i = 0; i < count; ++i) {
    const int same = static_cast<int>(std::count(top, top + count, top[i]));
    if (same > most) best = i, most = same;
  }
  return top[best];
}

/// False where all of the leaf is air.
bool coarse_leaf(const Children& c, std::array<BlockId, kLeafVoxels>& out) {
  out.fill(kAir);
  bool any = false;
  for (int x = 0; x < kLeafSize; ++x)
    for (int y = 0; y < kLeafSize; ++y)
      for (int z = 0; z < kLeafSize; ++z) {
        const LeafMask& mask = *c.occupied[(x >> 2) * 4 + (y >> 2) * 2 + (z >> 2)];
        const int shift = (y & 3) * 16 + (z & 3) * 2;
        const uint64_t low = mask.word[(x & 3) * 2] >> shift, high = mask.word[(x & 3) * 2 + 1] >> shift;
        constexpr uint64_t kSquare = 0x303;
        if (std::popcount(low & kSquare) + std::popcount(high & kSquare) < 4) continue;
        const auto four = [](uint64_t w) { return static_cast<unsigned>((w & 3) | (w >> 6 & 12)); };
        any = true;
        out[static_cast<size_t>(x * 64 + y * 8 + z)] = choose(c, x * 2, y * 2, z * 2, four(low) | four(high) << 4);
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
