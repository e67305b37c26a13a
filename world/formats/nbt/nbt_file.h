/// A file that holds one NBT tree: plain, or packed by gzip or zlib.
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <vector>

#include "world/formats/archive/inflate.h"

namespace world::nbt {

struct File {
  std::vector<uint8_t> packed;
  std::unique_ptr<MemoryBudget> budget;
  std::unique_ptr<Inflater> inflater;
  std::span<const uint8_t> tree;  // in one of the two above
};
Result<File> open_file(const std::filesystem::path& path);

}  // namespace world::nbt
