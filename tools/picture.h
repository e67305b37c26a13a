/// One picture from the command line: which knobs hold, which backend draws it, and what is written into its file.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "render/backend.h"
#include "render/image/png_exr.h"
#include "world/scenes/scene.h"

namespace tools {

/// Presets first, then those of the scene or world, then the environment's, then the flags': each overrides the one
/// before.
world::Result<render::RenderKnobs> resolve_knobs(const std::string& accuracy,
                                                 const std::map<std::string, std::string>& of_the_world,
                                                 const std::vector<std::string>& environment_settings,
                                                 const std::vector<std::string>& flag_settings);

world::Result<std::unique_ptr<render::Backend>> make_backend(const std::string& name);

/// The world of a scene, with the images and meshes that its luminaires name: what a picture is made of.
world::Result<world::World> build_picture_world(const world::Scene& scene, world::ImportReport& report);

/// Where the knobs name a time of day, the sun and the sky of the world are those of that time, for all that simulates
/// light in it.
world::Status set_time_of_day(const render::RenderKnobs& knobs, world::World& world);

/// What a picture's file says of itself.
render::PictureText picture_text(const world::Scene& scene, const std::string& camera_name,
                                 const render::Camera& camera, const render::RenderKnobs& knobs,
                                 const std::string& backend, uint64_t world_hash);

/// PNG or EXR, by extension; anything else is a usage error.
world::Status write_picture(const std::string& path, const render::Image& image, const render::RenderKnobs& knobs,
                            const render::PictureText& text);
/// Says before the work that the extension is wrong.
world::Status check_picture_path(const std::string& path);

nlohmann::json report_json(const render::FrameReport& report, const world::World& world);

/// The camera at `frame` of a closed walk of `frames`: through the world's cameras in order, or, where there are fewer
/// than two, once around the middle of the world.
render::Camera camera_on_path(const world::World& world, const render::Camera& start, int frame, int frames);

/// Of 16 digits.
std::string hash_text(uint64_t hash);

}  // namespace tools
