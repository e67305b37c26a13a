#include "world/scenes/scene.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "scene_files.h"
#include "world/base/text.h"
#include "world/base/toml_reader.h"
#include "world/base/toml_text.h"
#include "world/gen/generator.h"
#include "world/scenes/cloud_limits.h"
#include "world/scenes/scene_reactions.h"
#include "world/scenes/simulation_tables.h"
#include "world/scenes/sky_light.h"
#include "world/store/copies.h"
#include "world/store/density_field.h"

namespace world {

namespace {

constexpr double kBorder = kWorldBorder - 1;
constexpr size_t kMostFills = size_t{1} << 20;  // rows of prisms and cones included; 64 MiB
constexpr const char* kTooManyFills = "the scene's prisms and cones have more than 2^20 rows of voxels";

VoxelPos voxel_of(const int32_t (&v)[3]) { return {v[0], v[1], v[2]}; }

void read_world_source(TomlTable table, Scene& scene) {
  std::string file;
  table.read("generator", scene.generator);
  table.read("file", file);
  scene.file = file;
  table.read("seed", scene.seed);
  int32_t min[3] = {0, 0, 0}, size[3] = {0, 0, 0}, offset[3] = {0, 0, 0};
  const NumberRange inside{-kBorder, kBorder};
  table.read("min", std::span<int32_t>(min), inside);
  const bool sized = table.read("size", std::span<int32_t>(size), {1, kBorder});
  table.read("offset", std::span<int32_t>(offset), inside);
  if (scene.generator.empty() == scene.file.empty())
    table.fail("generator", "a world comes either from generator = \"...\" or from file = \"...\"");
  if (!scene.generator.empty() && !sized) table.fail("size", "a generated world needs size = [x, y, z] in voxels");
  for (int a = 0; a < 3; ++a)
    if (offset[a] % kRegionSize != 0)
      table.fail("offset", "each offset must be a multiple of 128, the size of a region");
  scene.box = {voxel_of(min), {min[0] + size[0] - 1, min[1] + size[1] - 1, min[2] + size[2] - 1}};
  scene.offset = voxel_of(offset);
  for (TomlTable parameters : table.table("parameters"))
    for (const std::string& key : parameters.keys()) {
      double value = 0;
      if (parameters.read(key, value)) scene.parameters[key] = value;
    }
  ImportOptions& import = scene.import_options;
  table.read("metres_per_voxel", import.metres_per_voxel, {.min = 0, .open_min = true});
  table.read("vertical_scale", import.vertical_scale, {.min = 0, .open_min = true});
  int32_t window[4] = {0, 0, 0, 0};
  if (table.read("window", std::span<int32_t>(window), {0, 1e6}))
    import.window = {window[0], window[1], window[2], window[3]};
}

/// Adds a run of voxels for each row of one height in which centres lie in the convex quadrilateral. False where the
/// scene gets too many.
bool fill_prism(const double (&corners)[8], int32_t y0, int32_t y1, const std::string& block, Scene& scene) {
  double z_low = corners[1], z_high = corners[1];
  for (int i = 0; i < 4; ++i)
    z_low = std::min(z_low, corners[2 * i + 1]), z_high = std::max(z_high, corners[2 * i + 1]);
  for (int32_t z = static_cast<int32_t>(std::floor(z_low)); z <= z_high; ++z) {
    double x_low = kBorder, x_high = -kBorder;
    for (int i = 0; i < 4; ++i) {
      const double *a = corners + 2 * i, *b = corners + 2 * ((i + 1) % 4), at = z + 0.5;
      if ((a[1] > at) == (b[1] > at)) continue;
      const double x = a[0] + (b[0] - a[0]) * (at - a[1]) / (b[1] - a[1]);
      x_low = std::min(x_low, x), x_high = std::max(x_high, x);
    }
    const int32_t first = static_cast<int32_t>(std::ceil(x_low - 0.5)),
                  last = static_cast<int32_t>(std::ceil(x_high - 0.5)) - 1;
    if (!(x_low < x_high && first <= last)) continue;
    if (scene.fills.size() >= kMostFills) return false;
    scene.fills.push_back({{VoxelPos{first, y0, z} + scene.offset, VoxelPos{last, y1, z} + scene.offset}, block});
  }
  return true;
}

/// The same for a cone's frustum around a vertical axis, with radius[0] at y0 and radius[1] at y1.
bool fill_cone(const double (&centre)[2], const double (&y)[2], const double (&radius)[2], const std::string& block,
               Scene& scene) {
  for (int32_t row = static_cast<int32_t>(std::ceil(y[0] - 0.5)); row + 0.5 < y[1]; ++row) {
    const double r = radius[0] + (radius[1] - radius[0]) * (row + 0.5 - y[0]) / (y[1] - y[0]);
    for (int32_t z = static_cast<int32_t>(std::floor(centre[1] - r)); z <= centre[1] + r; ++z) {
      const double dz = z + 0.5 - centre[1], half = r * r - dz * dz;
      if (!(half > 0)) continue;
      const int32_t first = static_cast<int32_t>(std::ceil(centre[0] - std::sqrt(half) - 0.5)),
                    last = static_cast<int32_t>(std::ceil(centre[0] + std::sqrt(half) - 0.5)) - 1;
      if (first > last) continue;
      if (scene.fills.size() >= kMostFills) return false;
      scene.fills.push_back({{VoxelPos{first, row, z} + scene.offset, VoxelPos{last, row, z} + scene.offset}, block});
    }
  }
  return true;
}

void read_prism(TomlTable table, Scene& scene) {
  double corners[8];
  int32_t y[2] = {0, 0};
  std::string block;
  const bool placed = table.require("corners", std::span<double>(corners), NumberRange{-1e6, 1e6});
  const bool high = table.require("y", std::span<int32_t>(y), NumberRange{-kBorder, kBorder});
  table.require("block", block);
  if (placed && high && !fill_prism(corners, y[0], y[1], block, scene)) table.fail("corners", kTooManyFills);
}

void read_cone(TomlTable table, Scene& scene) {
  double centre[2], y[2], radius[2];
  std::string block;
  const bool placed = table.require("centre", std::span<double>(centre), NumberRange{-1e6, 1e6});
  bool sized = table.require("y", std::span<double>(y), NumberRange{-1e6, 1e6});
  sized &= table.require("radius", std::span<double>(radius), NumberRange{0, 1e4});
  table.require("block", block);
  if (sized && !(y[0] < y[1] && y[1] - y[0] < 1e4)) {
    table.fail("y", "y = [from, to] of a cone must rise, by less than 10000");
    return;
  }
  if (placed && sized && !fill_cone(centre, y, radius, block, scene)) table.fail("radius", kTooManyFills);
}

void read_camera(TomlTable table, Scene& scene) {
  CameraPlacement camera;
  double position[3] = {0, 0, 0}, target[3];
  table.require("name", camera.name);
  if (table.require("position", std::span<double>(position), NumberRange{-kBorder, kBorder}))
    camera.position = WorldPoint::from(position[0], position[1], position[2]);
  if (table.read("look_at", std::span<double>(target), NumberRange{-kBorder, kBorder})) {
    const Vec3d to = Vec3d(target[0], target[1], target[2]) - Vec3d(position[0], position[1], position[2]);
    if (glm::length(to) == 0)
      table.fail("look_at", "look_at must differ from position");
    else
      camera.forward = glm::normalize(to);
  } else {
    // Yaw from north (-z) clockwise seen from above, pitch up from the horizon.
    double yaw = 0, pitch = 0;
    table.read("yaw_deg", yaw);
    table.read("pitch_deg", pitch, {-90, 90});
    const double to_radians = 3.14159265358979323846 / 180, y = yaw * to_radians, p = pitch * to_radians;
    camera.forward = {std::sin(y) * std::cos(p), std::sin(p), -std::cos(y) * std::cos(p)};
  }
  table.read("fov_deg", camera.vertical_fov_deg, {0, 180, true, true});
  table.read("lens_radius_m", camera.lens_radius_m, {.min = 0, .max = 1e6});
  table.read("focus_distance_m", camera.focus_distance_m, {.min = 0, .max = 1e9, .open_min = true});
  camera.position.voxel = camera.position.voxel + scene.offset;
  scene.cameras.push_back(camera);
}

void read_bands(TomlTable& table, const char* key, auto& bands) {
  float v[3];
  if (table.read(key, std::span<float>(v), {.min = 0, .max = 1e9})) bands = {v[0], v[1], v[2]};
}

/// The sky of a time of day. Its setting goes to the knobs of pictures too, which show it itself.
void read_time_of_day(TomlTable& root, TomlTable table, Scene& scene) {
  SkySetting sky;
  const bool timed = table.read("time_of_day", sky.time_of_day_h, {.min = 0, .max = 24});
  table.read("latitude_deg", sky.latitude_deg, {.min = -90, .max = 90});
  table.read("day_of_year", sky.day_of_year, {.min = 1, .max = 366});
  table.read("turbidity", sky.turbidity, {.min = 2, .max = 10});
  table.read("moon", sky.moon);
  if (!timed) return table.fail("time_of_day", "an [environment] needs a time_of_day, in hours from 0 to 24");
  if (root.has("sun") || root.has("sky"))
    return table.fail("time_of_day", "time_of_day makes the sun and the sky: a scene has it, or [sun] and [sky]");
  set_sky(scene.environment, SkyLight(sky));
  scene.knobs.insert({{"time_of_day", fmt::format("{}", sky.time_of_day_h)},
                      {"latitude", fmt::format("{}", sky.latitude_deg)},
                      {"day_of_year", fmt::format("{}", sky.day_of_year)},
                      {"turbidity", fmt::format("{}", sky.turbidity)},
                      {"moon", sky.moon ? "true" : "false"}});
}

///   [clouds]
///   cover = 0.4               share of the sky that they take, 0 to 1
///   height_m = 900            y of their base
///   thickness_m = 250         of the layer
///   size_m = 700              of the largest lumps
///   extinction_per_m = 0.04   where they are densest
///   drift_mps = [9, 4]        along x and z
///   seed = 1                  another number, other clouds
void read_clouds(TomlTable table, Clouds& clouds) {
  table.require("cover", clouds.cover, NumberRange{.min = 0, .max = 1});
  table.read("height_m", clouds.height, {.min = -kMostCloudHeight, .max = kMostCloudHeight});
  table.read("thickness_m", clouds.thickness, {.min = kLeastCloudLength, .max = kMostCloudLength});
  table.read("size_m", clouds.size, {.min = kLeastCloudLength, .max = kMostCloudLength});
  table.read("extinction_per_m", clouds.extinction, {.min = 0, .max = kMostCloudExtinction});
  double drift[2] = {clouds.drift.x, clouds.drift.z};
  table.read("drift_mps", std::span<double>(drift), {.min = -kMostCloudDrift, .max = kMostCloudDrift});
  clouds.drift = {drift[0], 0, drift[1]};
  int64_t seed = clouds.seed;
  table.read("seed", seed, {.min = 0, .max = double{UINT32_MAX}});
  clouds.seed = static_cast<uint32_t>(seed);
}

void read_environment(TomlTable root, Environment& environment) {
  root.read("temperature_k", environment.temperature.value, {.min = 0, .max = kHighestTemperature, .open_min = true});
  for (TomlTable sun : root.table("sun")) {
    double d[3];
    if (sun.read("direction", std::span<double>(d), {-1e6, 1e6})) {
      const Vec3d direction(d[0], d[1], d[2]);
      if (glm::length(direction) == 0)
        sun.fail("direction", "the sun's direction must not be zero");
      else
        environment.sun_direction = glm::normalize(direction);
    }
    read_bands(sun, "irradiance", environment.sun_irradiance);
  }
  for (TomlTable sky : root.table("sky")) {
    read_bands(sky, "zenith", environment.sky_zenith);
    read_bands(sky, "horizon", environment.sky_horizon);
    read_bands(sky, "ground", environment.sky_ground);
  }
  for (const TomlTable& clouds : root.table("clouds")) read_clouds(clouds, environment.clouds);
}

void read_knobs(TomlTable table, std::map<std::string, std::string>& out) {
  for (const std::string& key : table.keys()) {
    std::string value;
    if (table.read(key, value)) out[key] = value;
  }
}

///   [simulation]        seed = 7, effects = ["rain"]: those that run though nothing in the world calls for them
///   [simulation.knobs]  name = "value"
void read_simulation(TomlTable table, SimulationRequest& request) {
  table.read("seed", request.seed);
  table.read("effects", request.effects);
  for (const TomlTable& knobs : table.table("knobs")) read_knobs(knobs, request.knobs);
}

/// Adds what a scene asks to what the file of its world asks.
void add_request(const SimulationRequest& from, SimulationRequest& to) {
  if (from.seed != SimulationRequest{}.seed) to.seed = from.seed;
  for (const std::string& effect : from.effects)
    if (std::find(to.effects.begin(), to.effects.end(), effect) == to.effects.end()) to.effects.push_back(effect);
  for (const auto& [knob, value] : from.knobs) to.knobs[knob] = value;
  to.bodies.insert(to.bodies.end(), from.bodies.begin(), from.bodies.end());
  to.particles.insert(to.particles.end(), from.particles.begin(), from.particles.end());
}

/// `folder`: where files that the scene names lie.
Result<Scene> parse_scene(std::string_view text, const std::string& name, const std::string& file_name,
                          const std::filesystem::path& folder) {
  TRY(TomlDocument document, TomlDocument::parse(text, file_name));
  Scene scene;
  scene.name = name;
  TomlTable root = document.root();
  root.read("what", scene.what);
  const auto origins = root.table("world");
  if (origins.empty() && !root.has("source"))
    root.fail("world", "a scene needs a [world] table that says where its world comes from, or a [[source]]");
  for (TomlTable origin : origins) read_world_source(origin, scene);
  for (TomlTable table : root.array_of_tables("source"))
    scene.sources.push_back(read_source(table, scene.offset, folder));
  for (TomlTable fill : root.array_of_tables("fill")) {
    int32_t min[3] = {}, max[3] = {};
    Scene::Fill f;
    fill.require("min", std::span<int32_t>(min), NumberRange{-kBorder, kBorder});
    fill.require("max", std::span<int32_t>(max), NumberRange{-kBorder, kBorder});
    fill.require("block", f.block);
    f.box = {voxel_of(min) + scene.offset, voxel_of(max) + scene.offset};
    scene.fills.push_back(f);
  }
  for (TomlTable prism : root.array_of_tables("prism")) read_prism(prism, scene);
  for (TomlTable cone : root.array_of_tables("cone")) read_cone(cone, scene);
  read_environment(root, scene.environment);
  if (scene.environment.clouds.cover > 0) scene.environment.clouds.height += static_cast<float>(scene.offset.y);
  for (TomlTable blocks : root.table("block"))
    for (auto& [block_name, table] : blocks.tables()) scene.blocks.push_back(read_block(block_name, table));
  const VoxelPos offset = scene.offset;
  for (TomlTable table : root.array_of_tables("luminaire"))
    scene.luminaires.push_back(read_luminaire(table, offset, folder));
  for (TomlTable table : root.array_of_tables("medium")) scene.media.push_back(read_medium(table, offset, folder));
  for (TomlTable table : root.array_of_tables("mesh")) scene.meshes.push_back(read_mesh(table, offset, folder));
  for (TomlTable camera : root.array_of_tables("camera")) read_camera(camera, scene);
  for (const TomlTable& knobs : root.table("knobs")) read_knobs(knobs, scene.knobs);
  for (const TomlTable& table : root.table("environment")) read_time_of_day(root, table, scene);
  for (const TomlTable& simulation : root.table("simulation")) read_simulation(simulation, scene.simulation);
  for (TomlTable table : root.array_of_tables("body")) scene.simulation.bodies.push_back(read_body(table, offset));
  for (TomlTable table : root.array_of_tables("particles"))
    scene.simulation.particles.push_back(read_particles(table, offset));
  text_of_tables(root, "reaction", text);  // known; add_scene_reactions() has them
  TRY_STATUS(document.finish());
  return scene;
}

Result<World> generated_world(const Scene& scene) {
  std::vector<std::string> names;
  for (const GeneratorInfo& info : generators()) {
    names.push_back(info.name);
    if (info.name != scene.generator) continue;
    World world(standard_blocks());
    TRY(const std::unique_ptr<Generator> generator, info.make(scene.seed, scene.parameters, *world.palette));
    TRY_STATUS(generate(world.store, *generator, scene.box));
    TRY_STATUS(hold_sides(world.store, *generator, scene.box));
    world.metadata["source"] = "generator " + scene.generator;
    world.metadata["seed"] = std::to_string(scene.seed);
    return world;
  }
  return input_error(fmt::format("scene {}: there is no generator \"{}\"; the generators are: {}", scene.name,
                                 scene.generator, fmt::join(names, ", ")));
}

/// Samples the scene's sources over what is there.
Status sample_sources(const Scene& scene, World& world) {
  for (const SourceInstance& source : scene.sources) {
    const auto block = world.palette->find(source.block);
    if (!block)
      return input_error(fmt::format("{}: there is no block \"{}\" (did you mean \"{}\"?)", source.where, source.block,
                                     world.palette->nearest_name(source.block)));
    const Result<SamplingReport> sampled = sample_shape(world.store, *source.shape, source.placement, source.sampling,
                                                        *block, source.clip ? &*source.clip : nullptr);
    if (!sampled) return Error{sampled.error().kind, source.where + ": " + sampled.error().message};
  }
  return {};
}

/// What a file holds beside voxels, moved as they are.
void move_surroundings(VoxelPos offset, World& world) {
  const auto move = [&](auto& all) {
    for (auto& one : all) one.position.voxel = one.position.voxel + offset;
  };
  move(world.cameras), move(world.luminaires), move(world.media), move(world.meshes), move(world.simulation.bodies);
  for (ParticleSource& source : world.simulation.particles)
    source.box = {source.box.min + offset, source.box.max + offset};
  // What the simulation held says where it was.
  if (offset != VoxelPos{}) world.simulation.state.clear();
}

}  // namespace

std::vector<std::string> scene_names() {
  std::vector<std::string> names;
  for (const EmbeddedText* file = scene_files; file->name; ++file)
    names.push_back(std::filesystem::path(file->name).stem().string());
  return names;
}

Result<Scene> load_scene(const std::string& name_or_path) {
  for (const EmbeddedText* file = scene_files; file->name; ++file)
    if (std::filesystem::path(file->name).stem() == name_or_path)
      return parse_scene(file->text, name_or_path, std::string("world/scenes/") + file->name, {});
  const std::filesystem::path path = name_or_path;
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) {
    const std::string nearest = nearest_text(name_or_path, scene_names());
    return input_error(fmt::format("{}: there is no such file, and no such scene{}; the scenes are: {}", name_or_path,
                                   nearest.empty() ? "" : " (did you mean \"" + nearest + "\"?)",
                                   fmt::join(scene_names(), ", ")));
  }
  if (path.extension() == ".toml") {
    TRY(const std::vector<uint8_t> bytes, read_file(path, 16 << 20));
    TRY(Scene scene, parse_scene({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, path.stem().string(),
                                 path.string(), path.parent_path()));
    // A file that a scene names lies beside the scene.
    if (!scene.file.empty() && scene.file.is_relative()) scene.file = path.parent_path() / scene.file;
    return scene;
  }
  Scene scene;
  scene.name = path.filename().string();
  scene.file = path;
  return scene;
}

Status add_scene_reactions(const std::string& name_or_path, World& world) {
  std::string text, file_name;
  for (const EmbeddedText* file = scene_files; file->name; ++file)
    if (std::filesystem::path(file->name).stem() == name_or_path)
      text = file->text, file_name = std::string("world/scenes/") + file->name;
  const std::filesystem::path path = name_or_path;
  if (text.empty() && path.extension() == ".toml") {
    TRY(const std::vector<uint8_t> bytes, read_file(path, 16 << 20));
    text.assign(bytes.begin(), bytes.end());
    file_name = path.string();
  }
  if (text.empty()) return {};
  TRY(TomlDocument document, TomlDocument::parse(text, file_name));
  const std::string reactions = text_of_tables(document.root(), "reaction", text);
  if (reactions.empty()) return {};
  world.metadata[kReactionsKey] = reactions;
  world.metadata[kReactionsFileKey] = file_name;
  return {};
}

Result<World> build_world(const Scene& scene, ImportReport& report) {
  const bool from_file = !scene.file.empty(), from_sources = !from_file && scene.generator.empty();
  TRY(World world, from_file      ? read_world(scene.file, scene.import_options, report)
                   : from_sources ? Result<World>(World(standard_blocks()))
                                  : generated_world(scene));
  if (from_sources) world.metadata["source"] = "scene " + scene.name;
  std::vector<Medium> media = scene.media;
  TRY_STATUS(fill_density_grids(world.store.find_layer(Layer::density), media));
  if (scene.offset != VoxelPos{}) {
    Store shifted = moved(world.store, scene.offset, *world.palette);
    world.store = std::move(shifted);
  }
  for (const Block& block : scene.blocks) {
    TRY([[maybe_unused]] const BlockId added, world.palette->add(block));
  }
  TRY_STATUS(sample_sources(scene, world));
  EditBatch fills;
  for (const Scene::Fill& fill : scene.fills) {
    const auto block = world.palette->find(fill.block);
    if (!block)
      return input_error(
          fmt::format("scene {}: a [[fill]] names the block \"{}\", which does not exist (did you mean \"{}\"?)",
                      scene.name, fill.block, world.palette->nearest_name(fill.block)));
    fills.fill(fill.box, *block);
  }
  if (!fills.empty()) {
    TRY([[maybe_unused]] const EditReport edits, world.store.apply(fills));
  }
  if (!from_file || !scene.cameras.empty()) world.environment = scene.environment;
  move_surroundings(scene.offset, world);
  if (!scene.cameras.empty()) world.cameras = scene.cameras;
  for (const auto& [knob, value] : scene.knobs) world.knobs[knob] = value;
  add_request(scene.simulation, world.simulation);
  world.luminaires.insert(world.luminaires.end(), scene.luminaires.begin(), scene.luminaires.end());
  world.media.insert(world.media.end(), media.begin(), media.end());
  world.meshes.insert(world.meshes.end(), scene.meshes.begin(), scene.meshes.end());
  for (MeshInstance& mesh : world.meshes) {
    for (const auto& [block_name, id] :
         {std::pair{&mesh.block, &mesh.block_id}, {&mesh.checker_block, &mesh.checker_id}}) {
      if (block_name->empty()) continue;
      const auto block = world.palette->find(*block_name);
      if (!block)
        return input_error(fmt::format("{}: there is no block \"{}\" (did you mean \"{}\"?)", mesh.where, *block_name,
                                       world.palette->nearest_name(*block_name)));
      *id = *block;
    }
    std::vector<std::string> names;
    for (const Medium& medium : world.media) names.push_back(medium.name);
    if (!mesh.interior_medium.empty() && std::find(names.begin(), names.end(), mesh.interior_medium) == names.end()) {
      const std::string nearest = nearest_text(mesh.interior_medium, names);
      return input_error(fmt::format("{}: there is no medium \"{}\"{}", mesh.where, mesh.interior_medium,
                                     nearest.empty() ? "" : " (did you mean \"" + nearest + "\"?)"));
    }
  }
  return world;
}

Result<CameraPlacement> camera_of(const World& world, const std::string& name) {
  std::vector<std::string> names;
  for (const CameraPlacement& camera : world.cameras) {
    if (name.empty() || camera.name == name) return camera;
    names.push_back(camera.name);
  }
  if (!name.empty() && name != "overview")
    return usage_error(fmt::format("there is no camera \"{}\"; the cameras are: {}", name,
                                   names.empty() ? "overview" : fmt::format("{}", fmt::join(names, ", "))));
  VoxelBox box = world.store.bounds();
  const FloatLayer* const density = world.store.find_layer(Layer::density);
  if (box.empty() && density) box = density->bounds();
  CameraPlacement camera;
  camera.name = "overview";
  if (box.empty()) return camera;
  const WorldPoint corner{box.min, Vec3d(0.0)};
  const Vec3d size = WorldPoint{box.max, Vec3d(1.0)} - corner;
  const double widest = std::max(size.x, size.z);
  if (size.y < 0.15 * widest) {
    // A landscape: stand over its southern part, low enough that hills are seen against each other.
    camera.vertical_fov_deg = 45;
    const Vec3d above(0.5 * size.x + 0.16 * widest, size.y + 0.07 * widest, 0.5 * size.z + 0.34 * widest);
    camera.position = corner + above;
    camera.forward = glm::normalize(Vec3d(0.5 * size.x, 0.3 * size.y, 0.5 * size.z) - above);
    return camera;
  }
  // A thing: from the south-east, as near as a picture of 16:9 still holds all eight corners of its box.
  camera.vertical_fov_deg = 40;
  camera.forward = glm::normalize(Vec3d(-0.62, -0.46, -0.78));
  const Vec3d right = glm::normalize(glm::cross(camera.forward, Vec3d(0, 1, 0))),
              up = glm::cross(right, camera.forward);
  const double tan_y = std::tan(camera.vertical_fov_deg / 2 * 3.14159265358979323846 / 180) * 0.94,
               tan_x = tan_y * 16 / 9;
  double distance = 0;
  for (int i = 0; i < 8; ++i) {
    const Vec3d c = Vec3d((i & 1) - 0.5, (i >> 1 & 1) - 0.5, (i >> 2) - 0.5) * size;
    const double depth = glm::dot(c, camera.forward);
    distance =
        std::max({distance, std::abs(glm::dot(c, right)) / tan_x - depth, std::abs(glm::dot(c, up)) / tan_y - depth});
  }
  camera.position = corner + (0.5 * size - distance * camera.forward);
  return camera;
}

}  // namespace world
