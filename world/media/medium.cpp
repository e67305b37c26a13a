#include "world/media/medium.h"

namespace world {

Medium read_medium(TomlTable& table, VoxelPos) {
  table.fail({}, "media are not read yet");
  return {};
}

}  // namespace world
