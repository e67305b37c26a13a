// libFuzzer's side of tests/fuzz/targets.h: one program a target, LOAM_FUZZ_TARGET names it.
//
//   tools/build.sh fuzz fuzzers -- -DLOAM_FUZZ=ON -DCMAKE_CXX_COMPILER=clang++-14
//   mkdir corpus && build/fuzz/fuzz_mca_chunk --write-seeds corpus && build/fuzz/fuzz_mca_chunk corpus
//   -max_total_time=600 -timeout=5
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iostream>

#include "tests/fuzz/targets.h"
#include "world/base/jobs.h"

namespace {

const world::fuzz::Target& target() {
  for (const world::fuzz::Target& t : world::fuzz::targets())
    if (t.name == LOAM_FUZZ_TARGET) return t;
  std::cerr << "there is no target " LOAM_FUZZ_TARGET "\n";
  std::abort();
}

std::filesystem::path scratch() {
  static const std::filesystem::path folder = [] {
    const auto base = std::filesystem::exists("/dev/shm") ? "/dev/shm/" : "/tmp/";
    std::string name = std::string(base) + "loam-fuzz-XXXXXX";
    if (!mkdtemp(name.data())) std::abort();
    return std::filesystem::path(name);
  }();
  return folder;
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* count, char*** arguments) {
  if (*count == 3 && std::strcmp((*arguments)[1], "--write-seeds") == 0) {
    int n = 0;
    for (const world::fuzz::Bytes& seed : target().seeds()) {
      std::ofstream out(std::filesystem::path((*arguments)[2]) / ("seed" + std::to_string(n++)), std::ios::binary);
      out.write(reinterpret_cast<const char*>(seed.data()), static_cast<std::streamsize>(seed.size()));
    }
    std::exit(0);
  }
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const world::ThreadLimit one_thread(1);  // what crashes, crashes again
  world::fuzz::run(target(), {data, size}, scratch());
  return 0;
}
