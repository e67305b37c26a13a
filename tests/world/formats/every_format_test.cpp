/// Laws of all formats that read files: whatever a file holds, the reader ends in time and memory, with a world or with
/// an error that names the file.
#include <chrono>
#include <cstring>
#include <fstream>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/world/formats/formats_support.h"
#include "world/base/jobs.h"
#include "world/base/trial.h"

namespace world {
namespace {

namespace fs = std::filesystem;

#if defined(__SANITIZE_ADDRESS__)
constexpr int kInputs = 12;
constexpr unsigned kSlower = 20;
constexpr bool kLimitMemory = false;  // the sanitizer's own takes more
#else
constexpr int kInputs = 40;
constexpr unsigned kSlower = 1;
constexpr bool kLimitMemory = true;
#endif

/// The smallest real file of the format's kind.
std::optional<fs::path> smallest_seed(const Format& format) {
  const fs::path shared = fs::path(kSourceFolder) / "../shared/data";
  std::optional<fs::path> best;
  std::error_code none;
  for (fs::recursive_directory_iterator it(shared, none), end; !none && it != end; it.increment(none)) {
    if (!it->is_regular_file()) continue;
    const std::string name = it->path().filename();
    const bool fits = std::any_of(format.extensions.begin(), format.extensions.end(),
                                  [&](const std::string& extension) { return name.ends_with(extension); });
    // Pictures of heights, not those of light.
    if (fits && it->file_size() > 64 && (!best || it->file_size() < fs::file_size(*best)) && name != "not_a.vox")
      best = it->path();
  }
  return best;
}

/// Damage of the kinds that headers suffer: random bytes, extremes in whole fields, cut ends, doubled parts.
std::vector<uint8_t> damaged(std::vector<uint8_t> bytes, std::mt19937& random) {
  const auto below = [&](size_t n) { return n ? static_cast<size_t>(random()) % n : 0; };
  const size_t head = std::min<size_t>(bytes.size(), 1024);
  for (size_t n = 1 + below(3); n > 0; --n) {
    const size_t at = below(below(3) ? head : bytes.size());
    switch (below(5)) {
      case 0:
        bytes[at] = static_cast<uint8_t>(random());
        break;
      case 1:
        bytes[at] ^= static_cast<uint8_t>(1u << below(8));
        break;
      case 2: {
        const uint64_t fields[] = {0, 0x7fffffff, 0xffffffff, 0x7fffffffffffffff, 0x10000000, 0x00ffffff};
        const size_t size = std::min(below(2) ? size_t{4} : size_t{8}, bytes.size() - at);
        std::memcpy(&bytes[at], &fields[below(6)], size);
        break;
      }
      case 3:
        bytes.resize(std::max<size_t>(1, at));
        return bytes;
      default: {
        const size_t length = std::min<size_t>(1 + below(64), bytes.size() - at);
        const std::vector<uint8_t> part(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                                        bytes.begin() + static_cast<std::ptrdiff_t>(at + length));
        bytes.insert(bytes.begin() + static_cast<std::ptrdiff_t>(below(bytes.size())), part.begin(), part.end());
      }
    }
  }
  return bytes;
}

TEST(EveryFormat, DamagedFilesEndInAWorldOrAnErrorThatNamesThem) {
  const TemporaryFolder folder;
  int formats_tried = 0;
  for (const Format& format : formats()) {
    const auto seed = format.read ? smallest_seed(format) : std::nullopt;
    if (!seed || fs::file_size(*seed) > (4u << 20)) continue;
    SCOPED_TRACE(format.name);
    ++formats_tried;
    const std::vector<uint8_t> whole = bytes_of(*seed);
    std::mt19937 random(static_cast<uint32_t>(whole.size()));
    // The name of an elevation tile says where it lies.
    const fs::path path = folder / (seed->filename().string());
    const TrialLimits limits{
        .memory_bytes = kLimitMemory ? (uint64_t{256} << 20) + 16 * whole.size() : uint64_t{1} << 40,
        .cpu_seconds = kSlower * (2 + static_cast<unsigned>(whole.size() >> 20))};
    for (int i = 0; i < kInputs; ++i) {
      const std::vector<uint8_t> bytes = damaged(whole, random);
      std::ofstream(path, std::ios::binary)
          .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
      const Status tried = try_in_child(limits, [&]() -> Status {
        const ThreadLimit one(1);  // the pool's threads are not in the child
        ImportReport report;
        const Result<World> world = format.read(path, {}, report);
        if (world.ok()) return {};
        if (world.error().message.rfind(path.string(), 0) != 0)
          return input_error("its error names no file: " + world.error().message);
        return {};
      });
      if (tried.ok()) continue;
      const fs::path kept = fs::temp_directory_path() / fmt::format("loam-damaged-{}{}", i, path.extension().string());
      fs::copy_file(path, kept, fs::copy_options::overwrite_existing);
      ADD_FAILURE() << "input " << i << " (kept as " << kept << "): " << tried.error().message;
    }
  }
  if (formats_tried == 0) GTEST_SKIP() << "skipped: no files of ../shared/data are on this machine";
}

TEST(EveryFormat, WorldsSayFromWhichFileTheyCameAndHowLargeAVoxelIs) {
  for (const Format& format : formats()) {
    const auto seed = format.read ? smallest_seed(format) : std::nullopt;
    if (!seed) continue;
    SCOPED_TRACE(format.name);
    ImportReport report;
    const auto world = format.read(*seed, {}, report);
    ASSERT_TRUE(world) << world.error().message;
    EXPECT_EQ(world->metadata.at("source"), seed->filename().string());
    EXPECT_TRUE(world->metadata.contains("format"));
    EXPECT_GT(std::stod(world->metadata.at("voxel_size_m")), 0);
  }
}

TEST(EveryFormat, NamesAndExtensionsAreUniqueAndEachSaysWhatItIs) {
  std::map<std::string, std::string> readers;
  for (const Format& format : formats()) {
    EXPECT_FALSE(format.what.empty()) << format.name;
    EXPECT_TRUE(format.read || format.write) << format.name;
    ASSERT_FALSE(format.extensions.empty()) << format.name;
    for (const std::string& extension : format.extensions) {
      EXPECT_TRUE(extension.starts_with('.')) << format.name;
      EXPECT_TRUE(readers.emplace(extension, format.name).second)
          << extension << " is " << readers[extension] << " too";
    }
  }
}

}  // namespace
}  // namespace world
