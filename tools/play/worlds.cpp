#include "tools/play/worlds.h"

#include <algorithm>

#include "tools/picture.h"
#include "tools/play/settings.h"
#include "world/base/text.h"
#include "world/gen/generator.h"
#include "world/scenes/scene_reactions.h"

namespace tools {

namespace {

/// Of letters, digits, - and _: a name of a file anywhere.
std::string file_name_of(const std::string& name) {
  std::string out;
  for (const char c : name) out += std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_' ? c : '_';
  return out.empty() ? "world" : out.substr(0, 80);
}

/// A morning: most of the first day is light.
constexpr const char* kFirstHour = "8.000";

world::Scene scene_of_new(const WorldChoice& choice) {
  world::Scene scene;
  scene.name = choice.name.empty() ? choice.generator : choice.name;
  scene.generator = choice.generator;
  scene.seed = choice.seed;
  world::VoxelPos size = choice.size;
  for (int a = 0; a < 3; ++a) size[a] = std::clamp(size[a], 1, 4096);
  scene.box.min = {-size.x / 2, 0, -size.z / 2};
  scene.box.max = scene.box.min + size - world::VoxelPos{1, 1, 1};
  scene.simulation.seed = choice.seed;
  scene.knobs["time_of_day"] = kFirstHour;
  return scene;
}

/// Blocks that Loam has gained since the world was made.
void add_new_blocks(world::BlockPalette& palette) {
  const world::BlockPalette& standard = world::standard_blocks();
  for (size_t id = 0; id < standard.size(); ++id) {
    const world::Block& block = standard[static_cast<world::BlockId>(id)];
    if (!palette.find(block.name) && !palette.add(block)) return;  // there is no room for more
  }
}

}  // namespace

std::filesystem::path free_world_path(const std::string& name) {
  const std::filesystem::path folder = data_folder() / "worlds";
  std::error_code ignored;
  std::filesystem::create_directories(folder, ignored);
  const std::string base = file_name_of(name);
  std::filesystem::path path = folder / (base + ".loam");
  for (int n = 2; std::filesystem::exists(path, ignored); ++n)
    path = folder / (base + "-" + std::to_string(n) + ".loam");
  return path;
}

world::Result<OpenedWorld> open_world(const WorldChoice& choice) {
  OpenedWorld opened;
  opened.played = std::make_unique<PlayedWorld>();
  PlayedWorld& played = *opened.played;
  const world::SaveSession::Options options{.autosave_s = 0};
  if (choice.generator.empty() && std::filesystem::path(choice.scene).extension() == ".loam") {
    std::error_code ignored;
    if (!std::filesystem::exists(choice.scene, ignored))
      return world::input_error(choice.scene + ": there is no such world");
    TRY(played.session, world::SaveSession::open(choice.scene, options));
    played.scene = choice.scene, played.path = std::filesystem::absolute(choice.scene, ignored);
    played.name = played.path.stem().string();
    add_new_blocks(*played.world().palette);
    TRY_STATUS(world::add_scene_reactions(choice.scene, played.world()));
    return opened;
  }
  world::Scene scene = scene_of_new(choice);
  if (choice.generator.empty()) {
    TRY(scene, world::load_scene(choice.scene));
  }
  world::ImportReport report;
  TRY(world::World world, build_picture_world(scene, report));
  if (choice.generator.empty()) TRY_STATUS(world::add_scene_reactions(choice.scene, world));
  opened.warnings = report.warnings;
  played.name = scene.name, played.scene = choice.scene;
  if (choice.keep) {
    const std::filesystem::path path = free_world_path(scene.name);
    auto session = world::SaveSession::create(path, std::move(world), options);
    if (session) {
      played.session = std::move(*session), played.path = path;
      if (!choice.generator.empty()) played.scene = path.string();
      opened.made_file = true;
      return opened;
    }
    opened.warnings.push_back("this world can't be saved: " + session.error().message);
  }
  played.own = std::make_unique<world::World>(std::move(world));
  return opened;
}

}  // namespace tools
