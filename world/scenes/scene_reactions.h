/// The reactions that a scene has of its own, for the simulation to read: world/ doesn't know what they mean.
#pragma once

#include <string>

#include "world/base/errors.h"
#include "world/world.h"

namespace world {

/// Keys of World::metadata, which is saved: the text of the scene's file in which all but its [[reaction]] tables is
/// empty, so that lines and columns are the file's; and the file's name.
inline constexpr const char* kReactionsKey = "reactions";
inline constexpr const char* kReactionsFileKey = "reactions.file";

/// Puts the [[reaction]] tables of a scene, named as for load_scene(), in the place of those that its world has from a
/// file. Does nothing where the scene has none, or is a saved world.
Status add_scene_reactions(const std::string& name_or_path, World& world);

}  // namespace world
