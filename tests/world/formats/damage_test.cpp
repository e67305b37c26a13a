// Damaged and hostile files of other programs: every target of tests/fuzz with a generator of our own, bounded in
// number, and what is known to hurt, made by hand. No crash, no hang, memory within 16 times the file and 256 MiB.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <zlib.h>

#include <cstdlib>
#include <iostream>

#include "tests/fuzz/targets.h"
#include "tests/world/formats/formats_support.h"
#include "world/base/jobs.h"
#include "world/base/trial.h"
#include "world/formats/nbt/nbt.h"

namespace world {
namespace {

using fuzz::Bytes;

#if defined(__SANITIZE_ADDRESS__)
constexpr int kMutations = 60;  // of each target; ten times slower each
constexpr double kLimitSeconds = 10;
#else
constexpr int kMutations = 600;
constexpr double kLimitSeconds = 1;
#endif
constexpr double kEnoughSeconds = 2;  // of one target's mutations: some build a world of a million posts for each

/// Of the processor, in this process and its children: what else runs on the machine doesn't count.
double seconds_of(const std::function<void()>& body) {
  const auto used = [] {
    double seconds = 0;
    for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
      rusage usage{};
      getrusage(who, &usage);
      for (const timeval& t : {usage.ru_utime, usage.ru_stime})
        seconds += static_cast<double>(t.tv_sec) + static_cast<double>(t.tv_usec) * 1e-6;
    }
    return seconds;
  };
  const double before = used();
  body();
  return used() - before;
}

class EveryTarget : public testing::TestWithParam<std::string> {
 protected:
  const fuzz::Target& target() const {
    for (const fuzz::Target& t : fuzz::targets())
      if (t.name == GetParam()) return t;
    std::abort();
  }
};

TEST_P(EveryTarget, SeedsAreReadAndDamageIsSurvived) {
  TemporaryFolder folder;
  const std::vector<Bytes> seeds = target().seeds();
  int rejected = 0, accepted = 0;
  double slowest = 0, sum = 0;
  const auto run = [&](std::span<const uint8_t> bytes) {
    if (sum > kEnoughSeconds) return;
    std::string said;
    const double seconds = seconds_of([&] { said = fuzz::run(target(), bytes, folder / ""); });
    slowest = std::max(slowest, seconds), sum += seconds;
    ++(said.empty() ? accepted : rejected);
  };
  uint32_t random = 1;
  for (const Bytes& seed : seeds) {
    if (seed.size() > 300'000) continue;
    EXPECT_EQ(fuzz::run(target(), seed, folder / ""), "");
    for_each_mutation(seed, 256, kMutations / static_cast<int>(seeds.size()) + 1, random++, run);
    for_each_truncation(seed, seed.size() / 16 + 1, run);
  }
  if (!seeds.empty()) {
    EXPECT_GT(accepted + rejected, 0);
    // Any samples are heights, and something is had back of any save.
    EXPECT_TRUE(rejected > 0 || target().name == "hgt" || target().name == "loam_repair");
  }
  EXPECT_LT(slowest, kLimitSeconds);
}

// Where LOAM_FUZZ_CORPUS names a folder with one of each target's name, as libFuzzer keeps them, all of that as well.
TEST_P(EveryTarget, WhatFuzzingFoundIsSurvived) {
  TemporaryFolder folder;
  const char* corpus = std::getenv("LOAM_FUZZ_CORPUS");
  std::vector<std::filesystem::path> corpora{std::filesystem::path(kSourceFolder) / "tests/fuzz/corpus"};
  if (corpus) corpora.emplace_back(corpus);
  int count = 0;
  double slowest = 0;
  for (const std::filesystem::path& all : corpora) {
    std::error_code none;
    for (const auto& file : std::filesystem::directory_iterator(all / target().name, none)) {
      SCOPED_TRACE(file.path());
      const Bytes bytes = bytes_of(file.path());
      const double seconds = seconds_of([&] { fuzz::run(target(), bytes, folder / ""); });
      EXPECT_LT(seconds, kLimitSeconds);
      ++count, slowest = std::max(slowest, seconds);
    }
  }
  if (corpus) std::cout << fmt::format("{}\t{} inputs, the slowest {:.3f} s\n", target().name, count, slowest);
}

std::vector<std::string> target_names() {
  std::vector<std::string> names;
  for (const fuzz::Target& t : fuzz::targets()) names.push_back(t.name);
  return names;
}
INSTANTIATE_TEST_SUITE_P(Fuzz, EveryTarget, testing::ValuesIn(target_names()),
                         [](const auto& made) { return made.param; });

// ---- made to harm ----------------------------------------------------------------------------------------------

Bytes gzip(std::span<const uint8_t> bytes) {
  z_stream z{};
  deflateInit2(&z, 1, Z_DEFLATED, MAX_WBITS + 16, 9, Z_DEFAULT_STRATEGY);
  Bytes out(deflateBound(&z, bytes.size()));
  z.next_in = const_cast<Bytef*>(bytes.data());
  z.avail_in = static_cast<uInt>(bytes.size());
  z.next_out = out.data();
  z.avail_out = static_cast<uInt>(out.size());
  deflate(&z, Z_FINISH);
  out.resize(z.total_out);
  deflateEnd(&z);
  return out;
}

void write(const std::filesystem::path& path, std::span<const uint8_t> bytes) {
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

/// Reads the file in a child that may take 16 bytes for each of the file and 256 MiB; its error, or "".
std::string bounded_read(const std::filesystem::path& path) {
  const auto body = [&]() -> Status {
    const ThreadLimit one(1);
    ImportReport report;
    const auto world = read_world(path, {}, report);
    return world ? Status{} : Status{world.error()};
  };
#if defined(__SANITIZE_ADDRESS__)
  const Status read = body();  // its shadow memory is beyond any limit
#else
  const Status read =
      try_in_child({.memory_bytes = std::filesystem::file_size(path) * 16 + (256 << 20), .cpu_seconds = 10}, body);
#endif
  return read ? "" : read.error().message;
}

TEST(HardCaseIO9, ACompressionBombIsRejectedWithinItsMemory) {
  // A list of 500 million compounds, each one empty.
  Bytes zeros(size_t{500} << 20);
  const uint8_t head[] = {10, 0, 0, 9, 0, 1, 'x', 10, 0x1f, 0x40, 0, 0};
  std::copy(std::begin(head), std::end(head), zeros.begin());
  const Bytes bomb = gzip(zeros);
  ASSERT_LT(bomb.size(), 4u << 20);
  TemporaryFolder folder;
  for (const char* name : {"a.schem", "a.schematic", "a.litematic"}) {
    write(folder / name, bomb);
    EXPECT_NE(bounded_read(folder / name).find("inflates to more than"), std::string::npos)
        << bounded_read(folder / name);
  }
}

/// A .litematic whose 2-bit indices claim a cube of n^3 blocks that all differ from their neighbours.
Bytes litematic_of_side(int n, bool hostile) {
  nbt::Writer out;
  out.open("");
  out.open("Regions");
  out.open("r");
  for (const char* name : {"Position", "Size"}) {
    out.open(name);
    for (const char* axis : {"x", "y", "z"}) out.int_number(axis, name[0] == 'S' ? n : 0);
    out.close();
  }
  out.list("BlockStatePalette", nbt::Type::compound, 3);
  for (const char* name : {"minecraft:air", "minecraft:stone", "minecraft:dirt"}) {
    out.text("Name", name);
    out.close();
  }
  const size_t words = static_cast<size_t>(n) * static_cast<size_t>(n) * static_cast<size_t>(n) / 32;
  out.array_head("BlockStates", nbt::Type::long_array, static_cast<uint32_t>(words));
  std::string bytes = std::move(out.bytes);
  bytes.append(words * 8, hostile ? '\x64' : '\0');
  bytes += std::string(3, '\0');
  return {bytes.begin(), bytes.end()};
}

TEST(HardCaseIO9, VoxelsFromRepeatedBytesAreBoundedToo) {
  TemporaryFolder folder;
  write(folder / "big.litematic", gzip(litematic_of_side(768, true)));
  EXPECT_NE(bounded_read(folder / "big.litematic").find("takes more memory"), std::string::npos);
  write(folder / "empty.litematic", gzip(litematic_of_side(768, false)));
  EXPECT_EQ(bounded_read(folder / "empty.litematic"), "");
}

TEST(HardCaseIO9, ManySectionsOfOneChunkStayWithinMemory) {
  // Palettes of two and indices that alternate, in 1000 sections of each of 1024 chunks that lie at one place of the
  // file.
  nbt::Writer out;
  out.open("");
  out.int_number("DataVersion", 3465);
  out.list("sections", nbt::Type::compound, 255);
  for (int y = -128; y < 127; ++y) {
    out.byte_number("Y", static_cast<int8_t>(y));
    out.open("block_states");
    out.list("palette", nbt::Type::compound, 2);
    for (const char* name : {"minecraft:stone", "minecraft:dirt"}) {
      out.text("Name", name);
      out.close();
    }
    out.long_array("data", std::vector<uint64_t>(256, 0x1010101010101010));
    out.close();
    out.close();
  }
  out.close();
  Bytes packed(compressBound(out.bytes.size()));
  uLongf size = packed.size();
  compress2(packed.data(), &size, reinterpret_cast<const Bytef*>(out.bytes.data()), out.bytes.size(), 9);
  const size_t sectors = (size + 5 + 4095) / 4096;
  Bytes file;
  for (size_t i = 0; i < 1024; ++i) {
    const size_t at = 2 + i * sectors;
    file.insert(file.end(), {static_cast<uint8_t>(at >> 16), static_cast<uint8_t>(at >> 8), static_cast<uint8_t>(at),
                             static_cast<uint8_t>(sectors)});
  }
  file.resize(8192);
  for (int i = 0; i < 1024; ++i) {
    file.insert(file.end(), {0, 0, static_cast<uint8_t>((size + 1) >> 8), static_cast<uint8_t>(size + 1), 2});
    file.insert(file.end(), packed.begin(), packed.begin() + static_cast<std::ptrdiff_t>(size));
    file.resize((file.size() + 4095) / 4096 * 4096);
  }
  TemporaryFolder folder;
  write(folder / "r.0.0.mca", file);
  const std::string said = bounded_read(folder / "r.0.0.mca");
  EXPECT_NE(said.find("memory"), std::string::npos) << said;
}

TEST(HardCaseIO9, ChunksAtOnePlaceOfTheFileAreOneChunk) {
  // 1024 entries of the header that all point to one bomb: it is inflated once.
  const Bytes bomb = gzip(Bytes(size_t{100} << 20));
  Bytes file;
  for (int i = 0; i < 1024; ++i) file.insert(file.end(), {0, 0, 2, 255});
  file.resize(8192);
  const size_t size = bomb.size() + 1;
  for (int shift = 24; shift >= 0; shift -= 8) file.push_back(static_cast<uint8_t>(size >> shift));
  file.push_back(1);
  file.insert(file.end(), bomb.begin(), bomb.end());
  TemporaryFolder folder;
  write(folder / "r.0.0.mca", file);
  std::string said;
  EXPECT_LT(seconds_of([&] { said = bounded_read(folder / "r.0.0.mca"); }), kLimitSeconds);
  EXPECT_NE(said.find("inflates to more than"), std::string::npos) << said;
}

TEST(HardCaseIO11, RunsThatClaimMoreThanAMatrixHoldsAreRejected) {
  Bytes file = {1, 1, 0, 0};
  const auto put = [&](uint32_t n) {
    for (int i = 0; i < 4; ++i) file.push_back(static_cast<uint8_t>(n >> (8 * i)));
  };
  for (const uint32_t n : {0u, 1u, 1u, 0u, 1u}) put(n);
  file.push_back(0);
  for (const uint32_t n : {65536u, 65536u, 65536u, 0u, 0u, 0u}) put(n);
  for (int z = 0; z < 4; ++z)
    for (const uint32_t n : {2u, 0xffffffffu, 0xff0000ffu, 6u}) put(n);
  TemporaryFolder folder;
  write(folder / "a.qb", file);
  EXPECT_NE(bounded_read(folder / "a.qb").find("voxels"), std::string::npos) << bounded_read(folder / "a.qb");
}

TEST(HardCaseIO14, ADatabaseWhoseBlocksAreAViewIsRefused) {
  TemporaryFolder folder;
  const auto path = folder / "map.sqlite";
  ASSERT_EQ(
      std::system(("sqlite3 '" + path.string() +
                   "' \"CREATE VIEW blocks AS WITH RECURSIVE c(pos) AS (SELECT 1 UNION ALL SELECT pos + 1 FROM c) "
                   "SELECT pos, x'00' AS data FROM c\"")
                      .c_str()),
      0);
  EXPECT_NE(bounded_read(path).find("no table 'blocks'"), std::string::npos) << bounded_read(path);
}

TEST(Mca, ABrokenChunkIsNamedAndTheOthersAreRead) {
  const auto path = shared_data("mca/1.18.2/r.0.0.mca");
  if (!path) GTEST_SKIP();
  Bytes bytes = bytes_of(*path);
  // The third chunk that is there: its packed bytes are overwritten.
  int found = 0;
  for (size_t i = 0; i < 1024; ++i) {
    const size_t sector =
        static_cast<size_t>(bytes[i * 4]) << 16 | static_cast<size_t>(bytes[i * 4 + 1]) << 8 | bytes[i * 4 + 2];
    if (sector && ++found == 3) std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(sector * 4096 + 50), 200, 0x55);
  }
  TemporaryFolder folder;
  write(folder / "r.0.0.mca", bytes);
  ImportReport report;
  const auto world = read_world(folder / "r.0.0.mca", {}, report);
  ASSERT_TRUE(world) << world.error().message;
  ASSERT_EQ(report.warnings.size(), 1u);
  EXPECT_NE(report.warnings[0].find("r.0.0.mca: chunk ("), std::string::npos) << report.warnings[0];
  EXPECT_EQ(fact(report, "broken chunks"), "1");
  EXPECT_GT(world->store.voxel_count(), 1'600'000u);
}

}  // namespace
}  // namespace world
