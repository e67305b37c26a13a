#include "tools/bench/machine.h"

#include <cctype>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <map>
#include <thread>

#include <hwy/targets.h>
#include <sched.h>
#include <sys/utsname.h>
#include <unistd.h>

#include "commit.h"
#include "render/gpu/device.h"

namespace tools {

namespace {

std::string first_line(const char* path) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  return line;
}

/// As the system calls it, and the family and model numbers, since processors of unlike speed share a name ("AMD
/// EPYC").
std::string cpu_model() {
  std::ifstream file("/proc/cpuinfo");
  std::map<std::string, std::string> first;  // of the first processor
  for (std::string line; std::getline(file, line) && !line.empty();)
    if (const size_t colon = line.find(": "); colon != std::string::npos)
      first[line.substr(0, line.find_last_not_of(" \t:", colon) + 1)] = line.substr(colon + 2);
  if (!first.contains("model name")) return "unknown";
  if (!first.contains("cpu family") || !first.contains("model")) return first["model name"];
  return first["model name"] + " (family " + first["cpu family"] + ", model " + first["model"] + ")";
}

}  // namespace

std::string Machine::slug() const {
  std::string text;
  for (char c : cpu) {
    if (std::isalnum(static_cast<unsigned char>(c)))
      text += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    else if (!text.empty() && text.back() != '-')
      text += '-';
  }
  while (!text.empty() && text.back() == '-') text.pop_back();
  return (text.empty() ? "unknown" : text) + "-" + std::to_string(cores) + "-cores";
}

Machine this_machine() {
  Machine m;
  m.cpu = cpu_model();
  utsname name{};
  if (uname(&name) == 0) m.kernel = std::string(name.sysname) + " " + name.release + " " + name.machine;
#if defined(__clang__)
  m.compiler = "clang " __VERSION__;
#else
  m.compiler = "g++ " __VERSION__;
#endif
#ifdef NDEBUG
  m.flags = "release, -ffp-contract=off";
#else
  m.flags = "debug, -ffp-contract=off";
#endif
  m.governor = first_line("/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor");
  if (m.governor.empty()) m.governor = "not readable";
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  m.cores = sched_getaffinity(0, sizeof allowed, &allowed) == 0 ? CPU_COUNT(&allowed)
                                                                : static_cast<int>(std::thread::hardware_concurrency());
  m.memory_bytes = static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGE_SIZE));
  double load[1] = {0};
  if (getloadavg(load, 1) == 1) m.load = load[0];
  for (int64_t targets = hwy::SupportedTargets(); targets != 0; targets &= targets - 1)
    m.simd.push_back(hwy::TargetName(static_cast<int64_t>(targets & -targets)));
  const auto device = render::gpu::Device::make({});
  m.device = device.ok() ? (*device)->name() : "none";
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
  m.date = text;
  return m;
}

const char* build_commit() { return LOAM_COMMIT; }

}  // namespace tools
