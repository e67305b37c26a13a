/// How much memory one import may hold: 16 bytes for each byte of the file and 256 MiB, whatever the file claims.
/// What is big (inflated bytes, voxels) is taken from here before it is allocated. Any thread may take.
#pragma once

#include <atomic>
#include <cstdint>

namespace world {

class MemoryBudget {
 public:
  static constexpr uint64_t kPerFileByte = 16, kAlways = uint64_t{256} << 20;
  static constexpr uint64_t kProgram = uint64_t{24} << 20;  // what the program itself may need meanwhile

  explicit MemoryBudget(uint64_t file_bytes)
      : left_(static_cast<int64_t>(kPerFileByte * (file_bytes >> 40 ? uint64_t{1} << 40 : file_bytes) + kAlways -
                                   kProgram)) {}
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

 private:
  std::atomic<int64_t> left_;
};

}  // namespace world
