#include "sim/matter/structures.h"

#include <algorithm>
#include <bit>
#include <memory>

#include "world/base/jobs.h"

namespace sim {

using world::LeafMask;
using world::LeafPos;
using world::VoxelPos;

namespace {

constexpr LeafPos kDown{0, -1, 0};

LeafMask first_voxel(const LeafMask& mask) {
  LeafMask first;
  int x = 0;
  while (x < 7 && !mask.word[x]) ++x;
  first.word[x] = mask.word[x] & -mask.word[x];
  return first;
}

/// Voxels of a leaf at y and below.
LeafMask at_and_below(LeafPos l, int32_t y) {
  const int64_t rows = int64_t{y} - world::voxel_from_leaf(l).y + 1;
  if (rows <= 0) return {};
  if (rows >= world::kLeafSize) return world::kAllMask;
  LeafMask mask;
  for (uint64_t& word : mask.word) word = (uint64_t{1} << 8 * rows) - 1;
  return mask;
}

bool comes_first(const VoxelSet& a, const VoxelSet& b) {
  if (a[0].leaf != b[0].leaf) return a[0].leaf < b[0].leaf;
  for (int x = 0; x < 8; ++x) {
    const uint64_t of_a = a[0].mask.word[x], of_b = b[0].mask.word[x];
    if (of_a | of_b) return of_a && (!of_b || std::countr_zero(of_a) < std::countr_zero(of_b));
  }
  return false;
}

}  // namespace

size_t voxel_count(const VoxelSet& voxels) {
  size_t count = 0;
  for (const LeafPart& part : voxels) count += static_cast<size_t>(part.mask.count());
  return count;
}

LeafMask part_of(const VoxelSet& voxels, LeafPos leaf) {
  const auto at = std::lower_bound(voxels.begin(), voxels.end(), leaf,
                                   [](const LeafPart& part, LeafPos l) { return part.leaf < l; });
  return at != voxels.end() && at->leaf == leaf ? at->mask : world::kNoneMask;
}

VoxelSet joined(std::vector<LeafPart> parts) {
  std::sort(parts.begin(), parts.end(), [](const LeafPart& a, const LeafPart& b) { return a.leaf < b.leaf; });
  VoxelSet all;
  for (const LeafPart& part : parts) {
    if (part.mask.is_none()) continue;
    if (!all.empty() && all.back().leaf == part.leaf)
      all.back().mask = all.back().mask | part.mask;
    else
      all.push_back(part);
  }
  return all;
}

std::vector<VoxelSet> touching_parts(const VoxelSet& voxels) {
  VoxelSet left = voxels;
  std::vector<VoxelSet> all;
  world::LeafFront front;
  for (size_t start = 0; start < left.size(); ++start)
    while (!left[start].mask.is_none()) {
      std::vector<LeafPart> found;
      front.emplace_back(start, first_voxel(left[start].mask));
      world::flood_leaves(
          front, [&](size_t i) -> LeafMask& { return left[i].mask; },
          [&](size_t i, int face) {
            const VoxelPos step = world::face_step(face);
            const LeafPos next = left[i].leaf + LeafPos{step.x, step.y, step.z};
            const auto at = std::lower_bound(left.begin(), left.end(), next,
                                             [](const LeafPart& part, LeafPos l) { return part.leaf < l; });
            return at != left.end() && at->leaf == next ? static_cast<size_t>(at - left.begin()) : world::kNoLeaf;
          },
          [&](size_t i, const LeafMask& fresh) {
            found.push_back({left[i].leaf, fresh});
            return true;
          });
      all.push_back(joined(std::move(found)));
    }
  return all;
}

void Structures::build(const world::Store& store, const MatterTraits& traits, int32_t ground_y) {
  ground_y_ = ground_y;
  standing_ = {}, bearing_ = {};
  const std::vector<world::RegionPos> regions = store.regions();
  std::vector<std::unique_ptr<world::MaskRegion>> solids(regions.size()), grains(regions.size());
  world::parallel_for(regions.size(), [&](size_t n) {
    solids[n] = std::make_unique<world::MaskRegion>(), grains[n] = std::make_unique<world::MaskRegion>();
    world::StoreReader reader(store);
    for (int i = 0; i < world::kLeavesPerRegion; ++i) {
      const LeafPos l = world::leaf_from_region(regions[n]) + world::leaf_offset_in_region(i);
      const world::LeafBlocks blocks = reader.leaf(l);
      LeafMask solid, grain;
      if (!blocks.values) {
        const Content content = traits[blocks.uniform].content;
        if (content == Content::closed) solid = world::kAllMask;
        if (content == Content::grain) grain = world::kAllMask;
      } else {
        for (int v = 0; v < world::kLeafVoxels; ++v) {
          const Content content = traits[blocks.values[v]].content;
          if (content == Content::closed) solid.set(v);
          if (content == Content::grain) grain.set(v);
        }
      }
      if (!solid.is_none()) world::set_region_leaf(*solids[n], l, solid);
      if (!grain.is_none()) world::set_region_leaf(*grains[n], l, grain);
    }
  });
  world::MaskVolume all_grains;
  for (size_t n = 0; n < regions.size(); ++n) {
    standing_.put_region(regions[n], std::move(solids[n]));
    all_grains.put_region(regions[n], std::move(grains[n]));
  }
  standing_.finish();
  all_grains.finish();
  for (const world::MaskRegion* region : standing_.regions())
    for (int i = 0; i < world::kLeavesPerRegion; ++i) {
      const LeafPos l = world::leaf_from_region(region->pos) + world::leaf_offset_in_region(i);
      if (region->leaf_any(l)) rest(l, region->leaf(l), all_grains.leaf(l), all_grains.leaf(l + kDown));
    }
}

LeafMask Structures::take_grains(LeafPos l, const LeafMask& grain, const LeafMask& solid) {
  const LeafMask was = bearing_.leaf(l), left = was & grain;
  if (left == was) return {};
  bearing_.set_leaf(l, left);
  return without(without(was, grain), solid);
}

void Structures::rest(LeafPos l, const LeafMask& solids, const LeafMask& grain, const LeafMask& grain_below) {
  const LeafMask here = grain & world::across(solids, world::kNoneMask, world::kFacePosY);
  const LeafMask below = grain_below & world::across(world::kNoneMask, solids, world::kFacePosY);
  if (!here.is_none()) bearing_.set_leaf(l, bearing_.leaf(l) | here);
  if (!below.is_none()) bearing_.set_leaf(l + kDown, bearing_.leaf(l + kDown) | below);
}

size_t Structures::node_at(LeafPos l) {
  const auto [at, is_new] = node_of_.try_emplace(l, nodes_.size());
  if (is_new) nodes_.push_back({l, standing_.leaf(l), {}});
  return at->second;
}

/// Whether the structure stands by itself; found_: its voxels, or those looked at until that was known.
bool Structures::flood(size_t start, const LeafMask& seed, uint64_t reach, Search& search) {
  found_.clear();
  bool stands = false;
  uint64_t count = 0;
  front_.assign(1, {start, seed});
  world::flood_leaves(
      front_, [&](size_t n) -> LeafMask& { return nodes_[n].left; },
      [&](size_t n, int face) {
        const VoxelPos step = world::face_step(face);
        return node_at(nodes_[n].leaf + LeafPos{step.x, step.y, step.z});
      },
      [&](size_t n, const LeafMask& fresh) {
        found_.emplace_back(n, fresh);
        count += static_cast<uint64_t>(fresh.count());
        const Node& node = nodes_[n];
        stands = !(fresh & (node.stood | at_and_below(node.leaf, ground_y_))).is_none();
        if (!stands && count > reach) stands = true, ++search.given_up;
        return !stands;
      });
  if (stands)
    for (const auto& [n, fresh] : found_) {
      nodes_[n].left = nodes_[n].left | fresh;
      nodes_[n].stood = nodes_[n].stood | fresh;
    }
  return stands;
}

/// Whether grains under it lead to the ground or to something that isn't asked about; leans_on: of the structures that
/// hang, those that they lead to otherwise. Notes those grains.
bool Structures::is_borne(const VoxelSet& structure, const std::vector<VoxelSet>& hanging,
                          std::vector<size_t>& leans_on, world::FunctionRef<Below(VoxelPos)> below) {
  bool borne = false;
  for (const LeafPart& part : structure) {
    const LeafMask above_own = world::across(part.mask, part_of(structure, part.leaf + kDown), world::kFaceNegY);
    world::for_each_voxel(without(part.mask, above_own), [&](int i) {
      VoxelPos v = world::voxel_from_leaf(part.leaf) + world::offset_in_leaf(i) - VoxelPos{0, 1, 0};
      Below found = below(v);
      if (found != Below::grain) return;
      LeafMask grain = bearing_.leaf(world::leaf_from_voxel(v));
      grain.set(world::index_in_leaf(v));
      bearing_.set_leaf(world::leaf_from_voxel(v), grain);
      while (found == Below::grain) found = v.y <= ground_y_ ? Below::ground : (--v.y, below(v));
      borne |= found == Below::ground;
      if (found != Below::solid) return;
      for (size_t k = 0; k < hanging.size(); ++k)
        if (part_of(hanging[k], world::leaf_from_voxel(v)).test(v)) return leans_on.push_back(k);
      borne = true;
    });
  }
  return borne;
}

Structures::Search Structures::find_fallen(const VoxelSet& suspects, uint64_t reach,
                                           world::FunctionRef<Below(VoxelPos)> below) {
  Search search;
  nodes_.clear(), node_of_.clear();
  // Structures that reach no ground by themselves.
  std::vector<VoxelSet> hanging;
  for (const LeafPart& part : suspects) {
    const size_t n = node_at(part.leaf);
    for (;;) {
      const LeafMask left = without(part.mask & nodes_[n].left, nodes_[n].stood);
      if (left.is_none()) break;
      if (flood(n, first_voxel(left), reach, search)) continue;
      std::vector<LeafPart> parts;
      for (const auto& [node, fresh] : found_) parts.push_back({nodes_[node].leaf, fresh});
      hanging.push_back(joined(std::move(parts)));
    }
  }
  search.leaves = nodes_.size();
  // Of those, the ones that stand on grains; and then those that lean on these.
  std::vector<std::vector<size_t>> leans_on(hanging.size());
  std::vector<uint8_t> stands(hanging.size());
  for (size_t k = 0; k < hanging.size(); ++k) stands[k] = is_borne(hanging[k], hanging, leans_on[k], below);
  for (bool changed = true; changed;) {
    changed = false;
    for (size_t k = 0; k < hanging.size(); ++k)
      if (!stands[k] &&
          std::any_of(leans_on[k].begin(), leans_on[k].end(), [&](size_t other) { return stands[other] != 0; }))
        stands[k] = changed = true;
  }
  for (size_t k = 0; k < hanging.size(); ++k)
    if (!stands[k]) search.fallen.push_back(std::move(hanging[k]));
  std::sort(search.fallen.begin(), search.fallen.end(), comes_first);
  return search;
}

size_t Structures::bytes() const {
  return standing_.bytes() + bearing_.bytes() + nodes_.capacity() * sizeof(Node) +
         front_.capacity() * sizeof(front_[0]) + found_.capacity() * sizeof(found_[0]);
}

}  // namespace sim
