/// Loads what the luminaires of a world name: images of slides and skies, triangles of mesh emitters.
#pragma once

#include "world/base/errors.h"
#include "world/world.h"

namespace render {

/// Fills light_image and triangles where `image` or `mesh_file` say so: .png (sRGB, made linear; 8 or 16 bits, alpha
/// left out), .exr and .hdr (linear), .obj and .ply. An image that several luminaires name is read once. What is wrong
/// with a file, and an image whose values are no light, is told with the luminaire's place in its scene.
world::Status load_light_files(world::World& world);

}  // namespace render
