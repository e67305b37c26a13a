/// Which solids stand, and which of them have lost what they stood on.
///
/// Solids that touch by a face are one structure. It stands where it reaches down to the ground, where it is so large
/// that the search is given up, or where grains lie under it that lead down to the ground, to a structure that stands,
/// or to one that isn't asked about: what is asked about are only structures from which something was taken away, so
/// that what always floated goes on floating.
///
///   standing  bit planes of all solids but those that fall at the moment
///   bearing   grains that solids lay on at the start, came to lie on, or were found to stand on: where they go,
///             something may fall. Grains that run in under what floats bear nothing
///
/// cost   a search of one structure: about 60 ns a leaf of it, downwards first, so that in a mountain it soon ends at
///        the ground; a copy of the solids' bits, 64 bytes a mixed leaf
/// error  a structure of more than `reach` voxels without any ground stays in the air; solids that touch by an edge or
///        a corner don't hold each other; weight breaks nothing
#pragma once

#include <unordered_map>
#include <vector>

#include "sim/matter/traits.h"
#include "world/base/function_ref.h"
#include "world/store/leaf_flood.h"
#include "world/store/store.h"

namespace sim {

/// Voxels of one leaf; a set of voxels is those of its leaves, sorted, none of them empty.
struct LeafPart {
  world::LeafPos leaf;
  world::LeafMask mask;
};
using VoxelSet = std::vector<LeafPart>;

size_t voxel_count(const VoxelSet& voxels);
world::LeafMask part_of(const VoxelSet& voxels, world::LeafPos leaf);
/// In any order, leaves more than once: sorted, each once.
VoxelSet joined(std::vector<LeafPart> parts);
/// The parts of it that touch by faces, in the order of their first voxels.
std::vector<VoxelSet> touching_parts(const VoxelSet& voxels);

/// What lies in a voxel, for the walk from a structure down through grains.
enum class Below : uint8_t { open, grain, solid, ground };

class Structures {
 public:
  /// Reads the solids and grains of a store. Voxels at ground_y and below are ground.
  void build(const world::Store& store, const MatterTraits& traits, int32_t ground_y);

  const world::LeafMask& standing(world::LeafPos l) const { return standing_.leaf(l); }
  void set_standing(world::LeafPos l, const world::LeafMask& mask) {
    if (!(standing_.leaf(l) == mask)) standing_.set_leaf(l, mask);
  }
  /// Takes in the grains of a leaf. Returns those that bore something and are neither grains nor `solid` any more.
  world::LeafMask take_grains(world::LeafPos l, const world::LeafMask& grain, const world::LeafMask& solid);
  /// Notes that solids of a leaf lie on some of these grains, of the leaf itself and of the one below.
  void rest(world::LeafPos l, const world::LeafMask& solids, const world::LeafMask& grain,
            const world::LeafMask& grain_below);
  int32_t ground_y() const { return ground_y_; }
  void set_ground_y(int32_t y) { ground_y_ = y; }

  struct Search {
    std::vector<VoxelSet> fallen;  // structures that don't stand, in the order of their first voxels
    uint64_t leaves = 0;           // looked at
    uint64_t given_up = 0;         // searches that came to more than `reach` voxels
  };
  /// Of the structures that hold one of these voxels. `below` is asked about grains and what lies under them.
  Search find_fallen(const VoxelSet& suspects, uint64_t reach, world::FunctionRef<Below(world::VoxelPos)> below);
  size_t bytes() const;

 private:
  struct Node {
    world::LeafPos leaf;
    world::LeafMask left;   // standing, and of no structure so far that doesn't stand
    world::LeafMask stood;  // of left: of a structure that was found to stand
  };
  size_t node_at(world::LeafPos l);
  bool flood(size_t start, const world::LeafMask& seed, uint64_t reach, Search& search);
  bool is_borne(const VoxelSet& structure, const std::vector<VoxelSet>& hanging, std::vector<size_t>& leans_on,
                world::FunctionRef<Below(world::VoxelPos)> below);

  world::MaskVolume standing_, bearing_;
  int32_t ground_y_ = 0;
  // Of a search.
  std::vector<Node> nodes_;
  std::unordered_map<world::LeafPos, size_t, world::PosHash> node_of_;
  world::LeafFront front_;
  std::vector<std::pair<size_t, world::LeafMask>> found_;
};

}  // namespace sim
