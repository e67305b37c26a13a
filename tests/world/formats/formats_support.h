/// What the tests of file formats share: the facts worked out elsewhere, and damaged copies of files.
#pragma once

#include <fstream>
#include <random>

#include <nlohmann/json.hpp>

#include "tests/support.h"
#include "world/formats/format.h"

namespace world {

/// ../shared/data/facts.json, or null where it is not on this machine.
inline const nlohmann::json& shared_facts() {
  static const nlohmann::json facts = [] {
    const auto path = shared_data("facts.json");
    return path ? nlohmann::json::parse(std::ifstream(*path)) : nlohmann::json();
  }();
  return facts;
}

inline std::vector<uint8_t> bytes_of(const std::filesystem::path& path) { return read_file(path).value(); }

inline std::string fact(const ImportReport& report, const std::string& name) {
  for (const auto& [key, value] : report.facts) {
    if (key == name) return value;
  }
  return "(no fact '" + name + "')";
}

/// Calls check(damaged) for each prefix whose length is a multiple of `step`.
template <class Check>
void for_each_truncation(const std::vector<uint8_t>& bytes, size_t step, Check check) {
  for (size_t length = 0; length < bytes.size(); length += step) check(std::span(bytes).first(length));
}

/// Calls check(damaged) for `count` copies, each with one to three changed bytes: random, or extreme, or a flipped bit;
/// half of them in the first `head` bytes, where the structure lies.
template <class Check>
void for_each_mutation(std::vector<uint8_t> bytes, size_t head, int count, uint32_t seed, Check check) {
  std::mt19937 random(seed);
  const auto below = [&](size_t n) { return static_cast<size_t>(random()) % n; };
  for (int i = 0; i < count; ++i) {
    std::vector<std::pair<size_t, uint8_t>> old;
    for (size_t n = 1 + below(3); n > 0; --n) {
      const size_t at = below(below(2) ? std::min(head, bytes.size()) : bytes.size());
      old.emplace_back(at, bytes[at]);
      const uint8_t extremes[] = {0, 1, 0x7f, 0x80, 0xff};
      switch (below(3)) {
        case 0:
          bytes[at] = static_cast<uint8_t>(random());
          break;
        case 1:
          bytes[at] = extremes[below(5)];
          break;
        default:
          bytes[at] ^= static_cast<uint8_t>(1u << below(8));
      }
    }
    check(std::span<const uint8_t>(bytes));
    for (auto it = old.rbegin(); it != old.rend(); ++it) bytes[it->first] = it->second;
  }
}

}  // namespace world
