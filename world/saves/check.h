/// `loam check`: is a save whole, and what can be had of one that isn't?
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "world/base/errors.h"

namespace world {

struct CheckReport {
  int version = 0;                    // 0 where nothing of a save was found
  int64_t saves = 0;                  // saves so far, where the file says so
  uint64_t regions = 0;               // whole rows of all layers
  uint64_t voxels = 0;                // in them, not air
  std::vector<std::string> problems;  // a sentence each; empty: the save is whole
  std::vector<std::string> lost;      // what no copy of was found: "region (1, -2, 3)", "palette entry 7 (granite)"
  std::vector<std::string> missing;   // "1,234 voxels of granite": what the sums say is gone
  // Of a repair:
  std::filesystem::path repaired, backup;
  bool clean() const { return problems.empty(); }
};

/// SQLite's own integrity check, the schema, the palette and the digest; each row's hash, blocks and census; the sums.
/// Writes nothing but what SQLite takes back of a save that was interrupted. Fails where the file cannot be read or is
/// something else than a Loam save.
Result<CheckReport> check_save(const std::filesystem::path& path);

/// Puts what is whole into a new file, synced and then renamed to `path`, with the damaged one beside it under another
/// name: nothing is deleted. Blocks whose properties were lost take those of the standard block of that name, or are
/// visible placeholders. A save without problems is left as it is.
Result<CheckReport> repair_save(const std::filesystem::path& path);

}  // namespace world
