/// What is fuzzed: a target for each format that other programs write, and a second one where checksums or compression
/// would keep damage out. A target takes any bytes, wraps them into a file, and reads it. libFuzzer drives them
/// (fuzzer.cpp), and so does an ordinary test with a generator of its own (tests/world/formats/damage_test.cpp).
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "world/base/errors.h"

namespace world::fuzz {

using Bytes = std::vector<uint8_t>;

struct Target {
  std::string name;       // lower_snake_case
  std::string file_name;  // decides which format reads it
  std::function<Bytes(std::span<const uint8_t>)> wrap;
  std::function<std::vector<Bytes>()> seeds;  // small and valid; more from ../shared/data where that is there
  std::function<Status(const std::filesystem::path&)> read = nullptr;  // null: read_world()
};

const std::vector<Target>& targets();

/// Wraps the bytes into folder/file_name and reads that. What it said is returned: "" or the error. Aborts where an
/// error isn't one sentence that names the file.
std::string run(const Target& target, std::span<const uint8_t> bytes, const std::filesystem::path& folder);

}  // namespace world::fuzz
