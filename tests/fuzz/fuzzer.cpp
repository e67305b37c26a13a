// libFuzzer's side of tests/fuzz/targets.h: one program for all targets.
//
//   tools/build.sh fuzz fuzz -- -DLOAM_FUZZ=ON -DCMAKE_CXX_COMPILER=clang++-14 -DCMAKE_BUILD_TYPE=Debug
//   build/fuzz/fuzz --target=vox --write-seeds=corpus
//   build/fuzz/fuzz --target=vox corpus tests/fuzz/corpus/vox -max_total_time=600 -timeout=60 -rss_limit_mb=1024
//
// An input that takes more than kMostSeconds of the processor is a finding too: what else runs on the machine doesn't
// count, as it would in libFuzzer's own -timeout.
#include <pthread.h>
#include <sanitizer/common_interface_defs.h>
#include <signal.h>
#include <sys/time.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iostream>

#include "tests/fuzz/targets.h"
#include "world/base/jobs.h"

namespace {

constexpr int kMostSeconds = 5;  // sanitizers and -O1 cost a factor of 5 to 10: the aim is one second without them

const world::fuzz::Target* chosen = nullptr;

std::filesystem::path scratch() {
  static const auto& folder = *[] {  // never destroyed: the handler below outlives it otherwise
    const auto base = std::filesystem::exists("/dev/shm") ? "/dev/shm/" : "/tmp/";
    std::string name = std::string(base) + "loam-fuzz-XXXXXX";
    if (!mkdtemp(name.data())) std::abort();
    std::atexit([] {
      std::error_code ignored;
      std::filesystem::remove_all(scratch(), ignored);
    });
    return new std::filesystem::path(name);
  }();
  return folder;
}

void too_slow(int) {
  constexpr char kMessage[] = "the input takes too many seconds of the processor\n";
  if (write(STDERR_FILENO, kMessage, sizeof kMessage - 1) >= 0) std::abort();
}

void allow_seconds(int seconds) {
  const itimerval limit{{0, 0}, {seconds, 0}};
  setitimer(ITIMER_PROF, &limit, nullptr);
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* count, char*** arguments) {
  std::string name, seeds;
  for (int i = 1; i < *count; ++i) {
    const std::string argument = (*arguments)[i];
    if (argument.starts_with("--target=")) name = argument.substr(9);
    if (argument.starts_with("--write-seeds=")) seeds = argument.substr(14);
  }
  for (const world::fuzz::Target& t : world::fuzz::targets())
    if (t.name == name) chosen = &t;
  if (!chosen) {
    std::cerr << "give --target=NAME, one of:";
    for (const world::fuzz::Target& t : world::fuzz::targets()) std::cerr << ' ' << t.name;
    std::cerr << '\n';
    std::exit(2);
  }
  if (!seeds.empty()) {
    std::filesystem::create_directories(seeds);
    int n = 0;
    for (const world::fuzz::Bytes& seed : chosen->seeds()) {
      std::ofstream out(std::filesystem::path(seeds) / ("seed" + std::to_string(n++)), std::ios::binary);
      out.write(reinterpret_cast<const char*>(seed.data()), static_cast<std::streamsize>(seed.size()));
    }
    std::exit(0);
  }
  signal(SIGPROF, too_slow);
  // A library that crashes in a child, where it was tried because it may, is no finding.
  pthread_atfork(nullptr, nullptr, [] { __sanitizer_set_death_callback(nullptr); });
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const world::ThreadLimit one_thread(1);  // what crashes, crashes again
  allow_seconds(kMostSeconds);
  world::fuzz::run(*chosen, {data, size}, scratch());
  allow_seconds(0);
  return 0;
}
