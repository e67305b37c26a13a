/// What a figure was measured on. Without it a figure says nothing.
#pragma once

#include <string>
#include <vector>

namespace tools {

struct Machine {
  std::string cpu, kernel, compiler, flags, governor, date;
  std::string device;             // of Vulkan, with its driver; "none" where there is none to draw with
  std::vector<std::string> simd;  // targets that run-time dispatch may choose here, best first
  int cores = 0;                  // hardware threads this process may use
  double memory_bytes = 0;
  double load = 0;  // average of one minute when the run began; above `cores` the figures are of a busy machine
  /// For file names: the CPU model and cores, lower case, words joined by '-'.
  std::string slug() const;
};

Machine this_machine();
/// The commit that the program was built from.
const char* build_commit();

}  // namespace tools
