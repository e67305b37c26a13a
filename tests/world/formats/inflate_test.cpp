#include "world/formats/archive/inflate.h"

#include <fmt/format.h>
#include <zlib.h>

#include <random>

#include "tests/support.h"

namespace world {
namespace {

constexpr int kZlib = MAX_WBITS, kGzip = MAX_WBITS + 16;

std::vector<uint8_t> packed_by_zlib(std::span<const uint8_t> bytes, int level, int window) {
  z_stream z{};
  CHECK_EQ(deflateInit2(&z, level, Z_DEFLATED, window, 8, Z_DEFAULT_STRATEGY), Z_OK);
  std::vector<uint8_t> packed(deflateBound(&z, bytes.size()));
  z.next_in = const_cast<Bytef*>(bytes.data());
  z.avail_in = static_cast<uInt>(bytes.size());
  z.next_out = packed.data();
  z.avail_out = static_cast<uInt>(packed.size());
  CHECK_EQ(deflate(&z, Z_FINISH), Z_STREAM_END);
  packed.resize(z.total_out);
  deflateEnd(&z);
  return packed;
}

/// Runs of equal bytes between random ones, as chunks of block games hold.
std::vector<uint8_t> some_bytes(size_t size, uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<uint8_t> bytes;
  while (bytes.size() < size) bytes.insert(bytes.end(), 1 + random() % 40, static_cast<uint8_t>(random() % 16));
  bytes.resize(size);
  return bytes;
}

TEST(Inflater, GivesBackWhatWasPacked) {
  MemoryBudget budget(64 << 20);
  Inflater inflater(budget);  // one for all: its buffer holds what came before
  for (const size_t size : {0, 1, 1000, 262'144, 262'145, 3'000'000}) {
    for (const int level : {0, 1, 6, 9}) {
      for (const int window : {kZlib, kGzip}) {
        const std::vector<uint8_t> bytes = some_bytes(size, static_cast<uint32_t>(size));
        std::vector<uint8_t> packed = packed_by_zlib(bytes, level, window);
        const size_t length = packed.size();
        packed.insert(packed.end(), 100, 0xab);
        size_t used = 0;
        const auto inflated = inflater.inflate(packed, UINT64_MAX, &used);
        ASSERT_TRUE(inflated) << size << " at " << level << ": " << inflated.error().message;
        EXPECT_TRUE(std::ranges::equal(*inflated, bytes)) << size << " at " << level;
        EXPECT_EQ(used, length) << "what comes after the stream is left alone";
      }
    }
  }
}

TEST(Inflater, SaysWhereAStreamIsDamagedOrCutOff) {
  MemoryBudget budget(64 << 20);
  Inflater inflater(budget);
  const std::vector<uint8_t> bytes = some_bytes(50'000, 7);
  for (const int window : {kZlib, kGzip}) {
    const std::vector<uint8_t> packed = packed_by_zlib(bytes, 6, window);
    for (size_t length = 0; length < packed.size(); length += 97) {
      const auto inflated = inflater.inflate(std::span(packed).first(length));
      ASSERT_FALSE(inflated) << length << " of " << packed.size();
      EXPECT_NE(inflated.error().message.find(fmt::format("ends after {} bytes", length)), std::string::npos)
          << inflated.error().message;
    }
    size_t found = 0, flips = 0;
    for (size_t at = 10; at < packed.size(); at += 31) {
      std::vector<uint8_t> flipped = packed;
      flipped[at] ^= 0x10;
      const auto inflated = inflater.inflate(flipped);
      found += !inflated, ++flips;
      // A copy from another place of the same run says the same.
      EXPECT_TRUE(!inflated || std::ranges::equal(*inflated, bytes)) << "byte " << at << " of " << packed.size();
    }
    EXPECT_GT(found, flips * 9 / 10);
  }
}

TEST(HardCaseIO9, AStreamThatInflatesWithoutEndStopsAtItsLimitAndAtItsBudget) {
  const std::vector<uint8_t> packed = packed_by_zlib(std::vector<uint8_t>(200 << 20), 9, kZlib);
  for (const uint64_t limit : {uint64_t{1} << 20, (uint64_t{1} << 20) + 1}) {
    MemoryBudget budget(packed.size());
    const uint64_t before = budget.left();
    Inflater inflater(budget);
    const auto inflated = inflater.inflate(packed, limit);
    ASSERT_FALSE(inflated);
    EXPECT_NE(inflated.error().message.find(fmt::format("more than {} bytes", limit)), std::string::npos)
        << inflated.error().message;
    EXPECT_LE(before - budget.left(), limit);
  }
  MemoryBudget small(0);
  ASSERT_TRUE(small.take(small.left() - (100 << 20)));
  Inflater inflater(small);
  const auto inflated = inflater.inflate(packed);
  ASSERT_FALSE(inflated);
  EXPECT_NE(inflated.error().message.find("which a file of this size never needs"), std::string::npos);
  // What was made is counted, whether it was kept or not.
  EXPECT_LE(small.inflated_left(), MemoryBudget::kInflatedAlways - (100 << 20));
}

}  // namespace
}  // namespace world
