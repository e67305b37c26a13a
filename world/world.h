/// A world: its palette, its store, its surroundings, and what is known of where it came from.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "world/blocks/block.h"
#include "world/luminaires/luminaire.h"
#include "world/media/medium.h"
#include "world/meshes/mesh.h"
#include "world/scenes/camera.h"
#include "world/scenes/environment.h"
#include "world/scenes/simulation_request.h"
#include "world/store/store.h"

namespace world {

struct World {
  World() : palette(std::make_unique<BlockPalette>()), store(*palette) {}
  /// Starts with the given palette, for instance standard_blocks().
  explicit World(const BlockPalette& start) : palette(std::make_unique<BlockPalette>(start)), store(*palette) {}

  std::unique_ptr<BlockPalette> palette;  // on the heap, so that moving a world keeps the store's reference
  Store store;
  Environment environment;
  std::vector<Luminaire> luminaires;
  std::vector<Medium> media;
  std::vector<MeshInstance> meshes;
  std::vector<CameraPlacement> cameras;      // the first is meant where none is named
  std::map<std::string, std::string> knobs;  // of pictures of it: name -> value, below those of the command line
  SimulationRequest simulation;
  std::map<std::string, std::string> metadata;  // source, seed, voxel_size_m, ...
};

/// Read access for a picture or a step: while one lives, the store refuses edits.
class WorldView {
 public:
  explicit WorldView(const World& world) : world_(&world) { world.store.begin_view(); }
  ~WorldView() {
    if (world_) world_->store.end_view();
  }
  WorldView(const WorldView&) = delete;
  WorldView& operator=(const WorldView&) = delete;
  const World& world() const { return *world_; }
  const Store& store() const { return world_->store; }
  const BlockPalette& palette() const { return *world_->palette; }
  const Environment& environment() const { return world_->environment; }
  const MaskVolume& masks(MaskKind kind) const { return world_->store.masks(kind); }

 private:
  const World* world_;
};

}  // namespace world
