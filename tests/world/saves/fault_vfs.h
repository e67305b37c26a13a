/// A file system under SQLite that fails when it is told to, and remembers what was written: for tests only.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <string>
#include <vector>

namespace world {

class FaultVfs {
 public:
  enum class Call { write, sync, truncate, remove, open, read, count };
  enum class Kind {
    error,        // an I/O error, nothing done
    short_write,  // half of the bytes arrive, then an I/O error
    disk_full,
  };

  /// Registers a VFS of that name over the system's; it stays until the program ends.
  static FaultVfs& install();
  const std::string& name() const { return name_; }

  /// From now on the k-th call (from 1) of any kind in `calls` fails, and where `forever` all that follow.
  void arm(unsigned calls, int k, bool forever, Kind kind);
  void disarm();
  /// Calls of armed kinds since arm(); faults among them.
  int calls() const { return calls_; }
  int faults() const { return faults_; }

  /// What reached the disk in order. Only what lies before a sync of its file is sure to survive a power loss.
  struct Event {
    enum class Kind { write, truncate, sync, remove } kind;
    std::string file;
    int64_t offset = 0;  // of a write; the new size of a truncation
    std::string bytes;
  };
  void record(bool on);
  const std::vector<Event>& events() const { return events_; }

  // For the functions that SQLite calls.
  bool fails(Call call, Kind& kind);
  void note(Event event);

 private:
  std::string name_ = "loam-fault";
  mutable std::mutex mutex_;
  unsigned armed_ = 0;
  int k_ = 0, calls_ = 0, faults_ = 0;
  bool forever_ = false, recording_ = false;
  Kind kind_ = Kind::error;
  std::vector<Event> events_;
};

constexpr unsigned bit(FaultVfs::Call call) { return 1u << static_cast<int>(call); }
constexpr unsigned kWritingCalls = bit(FaultVfs::Call::write) | bit(FaultVfs::Call::sync) |
                                   bit(FaultVfs::Call::truncate) | bit(FaultVfs::Call::remove) |
                                   bit(FaultVfs::Call::open);

}  // namespace world
