/// Shaders with their constants fixed (specialise.h), kept on disk from one run to the next: a file each under
/// <folder>/shaders, named by a hash of the module, the constants and the version of the optimizer. A driver that keeps
/// what it compiles (PipelineCache) still asks for the module first, and some keep nothing.
///
///   "LOAMSPIR"  version u32  words u32  xxHash64 of the words u64   then the words
/// fails  never: what can't be read or isn't whole is made anew, and written again, with a warning
/// cost   at most kMostFiles files of some tens of KiB; the oldest go first
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "render/gpu/specialise.h"

namespace render::gpu {

class ShaderCache {
 public:
  static constexpr size_t kMostFiles = 512;

  /// An empty folder keeps nothing on disk.
  void open(const std::filesystem::path& folder);
  std::vector<uint32_t> specialised(std::span<const uint32_t> code, std::span<const SpecialConstant> constants);
  /// Modules that were made, and that were found.
  size_t made() const { return made_; }
  size_t found() const { return found_; }
  /// Says which files weren't whole; empty where all were.
  std::string warning() const;

 private:
  void write(const std::filesystem::path& file, const std::vector<uint32_t>& words) const;

  std::filesystem::path folder_;
  size_t made_ = 0, found_ = 0, damaged_ = 0;
  std::filesystem::path first_damaged_;
};

}  // namespace render::gpu
