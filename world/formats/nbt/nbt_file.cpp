#include "world/formats/nbt/nbt_file.h"

#include "world/base/file.h"

namespace world::nbt {
namespace {

constexpr uint64_t kMostFileBytes = uint64_t{1} << 31;

}  // namespace

Result<File> open_file(const std::filesystem::path& path) {
  File file;
  TRY(file.packed, read_file(path, kMostFileBytes));
  file.budget = std::make_unique<MemoryBudget>(file.packed.size());
  file.tree = file.packed;
  if (looks_like_gzip(file.packed) || looks_like_zlib(file.packed)) {
    file.inflater = std::make_unique<Inflater>(*file.budget);
    auto tree = file.inflater->inflate(file.packed);
    if (!tree) return input_error(path.string() + ": " + tree.error().message);
    file.tree = *tree;
  }
  return file;
}

}  // namespace world::nbt
