/// How much memory one import may hold: 16 bytes for each byte of the file and 256 MiB, whatever the file claims.
/// What is big (inflated bytes, voxels) is taken from here before it is allocated. And how many bytes it may inflate in
/// all, whether kept or not, which bounds the time: 256 for each of the file (empty land packs to a two hundredth) and
/// 384 MiB, half a second. Any thread may take.
#pragma once

#include <atomic>
#include <cstdint>

namespace world {

class MemoryBudget {
 public:
  static constexpr uint64_t kPerFileByte = 16, kAlways = uint64_t{256} << 20;
  static constexpr uint64_t kProgram = uint64_t{24} << 20;  // what the program itself may need meanwhile

  static constexpr uint64_t kInflatedPerFileByte = 256, kInflatedAlways = uint64_t{384} << 20;

  explicit MemoryBudget(uint64_t file_bytes)
      : left_(bounded(kPerFileByte, file_bytes, kAlways - kProgram)),
        inflated_left_(bounded(kInflatedPerFileByte, file_bytes, kInflatedAlways)) {}
  MemoryBudget(const MemoryBudget&) = delete;
  MemoryBudget& operator=(const MemoryBudget&) = delete;

  /// False where that much is not left; nothing is taken then.
  bool take(uint64_t bytes) {
    if (bytes > uint64_t{1} << 60) return false;
    if (left_.fetch_sub(static_cast<int64_t>(bytes)) >= static_cast<int64_t>(bytes)) return true;
    give_back(bytes);
    return false;
  }
  void give_back(uint64_t bytes) { left_.fetch_add(static_cast<int64_t>(bytes)); }
  uint64_t left() const {
    const int64_t left = left_.load();
    return left > 0 ? static_cast<uint64_t>(left) : 0;
  }

  /// Counts bytes that were inflated; false where there were too many.
  bool inflated(uint64_t bytes) {
    return inflated_left_.fetch_sub(static_cast<int64_t>(bytes)) >= static_cast<int64_t>(bytes);
  }
  uint64_t inflated_left() const {
    const int64_t left = inflated_left_.load();
    return left > 0 ? static_cast<uint64_t>(left) : 0;
  }

 private:
  static int64_t bounded(uint64_t ratio, uint64_t file_bytes, uint64_t always) {
    constexpr uint64_t kMostFileBytes = uint64_t{1} << 40;
    return static_cast<int64_t>(ratio * (file_bytes < kMostFileBytes ? file_bytes : kMostFileBytes) + always);
  }
  std::atomic<int64_t> left_, inflated_left_;
};

}  // namespace world
