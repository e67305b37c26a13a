/// A scene says where its world comes from, its cameras, its surroundings and its knobs. One TOML file a scene in
/// world/scenes/, compiled in; or a file given on the command line; or a saved world or any readable file by itself.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "world/base/errors.h"
#include "world/formats/format.h"
#include "world/scenes/camera.h"
#include "world/sources/source.h"
#include "world/space/world_point.h"
#include "world/world.h"

namespace world {

struct Scene {
  std::string name;
  std::string what;  // one line
  // Where the world comes from: a generator ...
  std::string generator;
  uint64_t seed = 1;
  VoxelBox box;
  std::map<std::string, double> parameters;
  // ... or a file ...
  std::filesystem::path file;
  ImportOptions import_options;
  // ... or nothing but sources; those are sampled over what there is: each [[source]], see world/sources/source.h ...
  std::vector<SourceInstance> sources;
  // ... and boxes written afterwards: each [[fill]], then rows of voxels whose centres lie in each
  //   [[prism]] corners = [x, z, x, z, x, z, x, z] of a convex quadrilateral in order, y = [lowest, highest] voxel
  //   [[cone]]  centre = [x, z], y = [from, to], radius = [at from, at to]: a cylinder, cone or frustum
  struct Fill {
    VoxelBox box;
    std::string block;
  };
  std::vector<Fill> fills;
  VoxelPos offset;  // added to every position of the world and its cameras
  std::vector<CameraPlacement> cameras;
  Environment environment;
  std::vector<Block> blocks;  // [block.NAME]: of this scene alone
  std::vector<Luminaire> luminaires;
  std::vector<Medium> media;
  std::vector<MeshInstance> meshes;
  std::map<std::string, std::string> knobs;  // name -> value, applied below the command line
  SimulationRequest simulation;  // [simulation]; each [[body]] and [[particles]]: world/scenes/simulation_tables.h
};

/// A scene's name, the path of a scene TOML, or the path of anything that formats() reads.
Result<Scene> load_scene(const std::string& name_or_path);
std::vector<std::string> scene_names();
/// Makes the world of a scene. Where it comes from a file that holds luminaires, media, meshes and knobs, the scene's
/// are added to them, and so are the effects and knobs of the simulation; its cameras stand in the place of the file's,
/// and so does a seed of the simulation that isn't the usual one.
Result<World> build_world(const Scene& scene, ImportReport& report);
/// The world's camera of that name, or its first; where it has none, one that sees the whole world from the south-east.
Result<CameraPlacement> camera_of(const World& world, const std::string& name);

}  // namespace world
