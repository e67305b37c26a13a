/// How the albedo of a block varies from place to place. A property of standard blocks, by name: a block that a scene
/// or a file adds under a name of its own is even.
#pragma once

#include <string>
#include <string_view>

namespace world {

struct BlockTexture {
  std::string kind;       // a member of render/textures
  float contrast = 0.3f;  // the most that it varies by, over the albedo, in [0, 1]
  std::string where;      // file:line:column of the kind, for messages
};

/// Null: its albedo is the same everywhere.
const BlockTexture* block_texture(std::string_view block_name);

}  // namespace world
