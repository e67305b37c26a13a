/// The distinct block states of a file, numbered as they are found, by any thread. A state is its text,
/// "minecraft:oak_log[axis=y]", properties sorted by name; numeric states of old versions are "id:data".
#pragma once

#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>

#include "world/formats/archive/budget.h"

namespace world {

using StateNumber = uint32_t;

class StateTable {
 public:
  static constexpr size_t kMostStates = 1 << 20, kMostTextBytes = 4096;
  explicit StateTable(MemoryBudget& budget) : budget_(budget) {}

  /// Nothing where there are too many, or where the text is too long.
  std::optional<StateNumber> number(std::string_view text) {
    const std::lock_guard lock(mutex_);
    if (const auto found = numbers_.find(text); found != numbers_.end()) return found->second;
    if (texts_.size() >= kMostStates || text.size() > kMostTextBytes || !budget_.take(text.size() + 160)) return {};
    texts_.emplace_back(text);
    const auto number = static_cast<StateNumber>(texts_.size() - 1);
    numbers_.emplace(texts_.back(), number);
    return number;
  }
  std::string text(StateNumber number) const {
    const std::lock_guard lock(mutex_);
    return texts_[number];
  }
  /// Not while others add.
  const std::deque<std::string>& texts() const { return texts_; }

 private:
  MemoryBudget& budget_;
  mutable std::mutex mutex_;
  std::deque<std::string> texts_;
  std::unordered_map<std::string_view, StateNumber> numbers_;
};

}  // namespace world
