/// `loam check`: damage anywhere is found and said, and the rest of the world is had back.
#include "world/saves/check.h"

#include "tests/world/saves/saves_support.h"
#include "world/saves/salvage.h"

namespace world {
namespace {

namespace fs = std::filesystem;

/// A save that has been edited and saved several times, so that rows of several ages and free pages lie in it.
World aged_world(const fs::path& path) {
  auto session = SaveSession::create(path, sample_world(), {});
  EXPECT_TRUE(session.ok()) << session.error().message;
  for (int n = 1; n <= 4; ++n) {
    EXPECT_TRUE((*session)->world().store.apply(edit_number(n)).ok());
    EXPECT_TRUE((*session)->save().ok());
  }
  session->reset();
  return *load(path);
}

/// Every region that both worlds hold has the same blocks, by name; returns how many of `all`'s are missing in `some`.
size_t missing_regions(const World& all, const World& some) {
  size_t missing = 0;
  for (const RegionPos& r : all.store.regions()) {
    if (some.store.region_census(r).empty()) {
      ++missing;
      continue;
    }
    for (int l = 0; l < kLeavesPerRegion; l += 7) {
      const LeafPos leaf = leaf_from_region(r) + leaf_offset_in_region(l);
      const LeafBlocks a = all.store.leaf(leaf), b = some.store.leaf(leaf);
      for (int v = 0; v < kLeafVoxels; v += 3)
        EXPECT_EQ((*all.palette)[a[v]].name, (*some.palette)[b[v]].name) << "a repair changed blocks";
    }
  }
  return missing;
}

/// Every one of the first pages, where headers, schema and palette lie, then twenty of the others, and the last.
size_t next_page(size_t page, size_t pages) {
  if (page < 10 || page + 1 == pages) return page + 1;
  return std::min(page + std::max<size_t>(1, pages / 20), pages - 1);
}

TEST(LoamCheck, AWholeSaveIsClean) {
  const TemporaryFolder folder;
  const World world = aged_world(folder / "a.loam");
  const auto report = check_save(folder / "a.loam");
  ASSERT_TRUE(report.ok()) << report.error().message;
  EXPECT_TRUE(report->clean()) << report->problems.front();
  EXPECT_TRUE(report->lost.empty());
  EXPECT_EQ(report->version, kSaveVersion);
  EXPECT_EQ(report->saves, 5);
  EXPECT_EQ(report->regions, world.store.regions().size());
  EXPECT_EQ(report->voxels, world.store.voxel_count());
}

TEST(LoamCheck, RepairLeavesAWholeSaveAlone) {
  const TemporaryFolder folder;
  aged_world(folder / "a.loam");
  const auto before = *read_file(folder / "a.loam");
  const auto report = repair_save(folder / "a.loam");
  ASSERT_TRUE(report.ok());
  EXPECT_TRUE(report->repaired.empty());
  EXPECT_EQ(*read_file(folder / "a.loam"), before);
}

TEST(HardCaseIO6, AFlippedBitInAnyPageIsFoundOrHarmlessAndTheRestIsHadBack) {
  SKIP_UNDER_SANITIZERS();
  const TemporaryFolder folder;
  const World world = aged_world(folder / "a.loam");
  const auto bytes = *read_file(folder / "a.loam");
  const size_t pages = bytes.size() / kSavePageBytes;
  std::mt19937 rng(4);
  size_t found = 0, most_missing = 0;
  size_t tried = 0;
  for (size_t page = 0; page < pages; page = next_page(page, pages), ++tried)
    for (const size_t offset : {size_t{page == 0 ? 100u : 0u}, size_t{rng() % 64}, size_t{rng() % kSavePageBytes},
                                size_t{kSavePageBytes - 1 - rng() % 125}}) {
      auto flipped = bytes;
      flipped[page * kSavePageBytes + offset] ^= static_cast<uint8_t>(1u << rng() % 8);
      write_bytes(folder / "b.loam", flipped);
      SCOPED_TRACE("page " + std::to_string(page + 1) + ", byte " + std::to_string(offset));
      const auto report = check_save(folder / "b.loam");
      ASSERT_TRUE(report.ok()) << report.error().message;
      const auto read = load(folder / "b.loam");
      if (report->clean()) {
        ASSERT_TRUE(read.ok()) << "check calls it whole, but it does not load: " << read.error().message;
        EXPECT_EQ(read->store.content_hash(), world.store.content_hash());
        continue;
      }
      ++found;
      const auto repaired = repair_save(folder / "b.loam");
      ASSERT_TRUE(repaired.ok()) << repaired.error().message;
      EXPECT_EQ(*read_file(repaired->backup), flipped) << "the damaged file must be kept as it was";
      const auto again = check_save(folder / "b.loam");
      ASSERT_TRUE(again.ok() && again->clean()) << (again.ok() ? again->problems.front() : again.error().message);
      const auto rest = load(folder / "b.loam");
      ASSERT_TRUE(rest.ok()) << rest.error().message;
      const size_t missing = missing_regions(world, *rest);
      most_missing = std::max(most_missing, missing);
      if (missing > 0) {
        EXPECT_FALSE(repaired->lost.empty()) << "a region is gone and nobody said so";
      }
      fs::remove(repaired->backup);
    }
  EXPECT_GT(found, tried / 2);  // of two flips a page, some hit unused bytes
  // The control of the harness is its reach: one page holds a few regions' rows, never the most of them.
  EXPECT_LE(most_missing, world.store.regions().size() / 2);
}

TEST(HardCaseIO7, ATruncationAtAnyPageIsFoundAndTheRestIsHadBack) {
  SKIP_UNDER_SANITIZERS();
  const TemporaryFolder folder;
  const World world = aged_world(folder / "a.loam");
  const auto bytes = *read_file(folder / "a.loam");
  size_t fewest = SIZE_MAX;
  const size_t pages = bytes.size() / kSavePageBytes;
  for (size_t page = 1; page < pages; page = next_page(page, pages)) {
    const size_t length = page * kSavePageBytes;
    write_bytes(folder / "b.loam", std::span(bytes).first(length));
    SCOPED_TRACE(length);
    const auto report = check_save(folder / "b.loam");
    ASSERT_TRUE(report.ok()) << report.error().message;
    EXPECT_FALSE(report->clean());
    const auto repaired = repair_save(folder / "b.loam");
    if (!repaired.ok() && report->regions == 0) continue;  // the first pages alone hold nothing whole
    ASSERT_TRUE(repaired.ok()) << repaired.error().message;
    const auto rest = load(folder / "b.loam");
    ASSERT_TRUE(rest.ok()) << rest.error().message;
    fewest = std::min(fewest, missing_regions(world, *rest));
    fs::remove(repaired->backup);
  }
  EXPECT_LE(fewest, 3u) << "with the last page cut off, nearly all is there";
}

TEST(LoamCheck, ADamagedRegionIsNamedAndTheOthersAreKept) {
  const TemporaryFolder folder;
  const World world = aged_world(folder / "a.loam");
  sql(folder / "a.loam",
      "UPDATE region SET bytes = CAST(substr(bytes, 1, 300) || x'5a5b' || substr(bytes, 303) AS BLOB) "
      "WHERE x = 0 AND y = 0 AND z = 0");
  const auto report = check_save(folder / "a.loam");
  ASSERT_TRUE(report.ok());
  ASSERT_FALSE(report->clean());
  EXPECT_NE(report->problems.front().find("region (0, 0, 0)"), std::string::npos) << report->problems.front();
  const auto repaired = repair_save(folder / "a.loam");
  ASSERT_TRUE(repaired.ok());
  ASSERT_EQ(repaired->lost.size(), 1u);
  EXPECT_EQ(repaired->lost.front(), "region (0, 0, 0)");
  EXPECT_TRUE(fs::exists(repaired->backup));
  const auto rest = load(folder / "a.loam");
  ASSERT_TRUE(rest.ok());
  EXPECT_EQ(missing_regions(world, *rest), 1u);
}

TEST(LoamCheck, CensusPaletteAndMetadataAreVerified) {
  const TemporaryFolder folder;
  aged_world(folder / "whole.loam");
  for (const char* damage :
       {"UPDATE census SET voxels = voxels + 1 WHERE block = (SELECT max(block) FROM census)",
        "UPDATE palette SET bytes = CAST(substr(bytes, 1, 60) || x'5a5b' || substr(bytes, 63) AS BLOB) WHERE id = 1",
        "UPDATE meta SET value = '18' WHERE key = 'metadata.seed'", "DELETE FROM palette WHERE id > 128",
        "UPDATE palette SET blocks = blocks - 1 WHERE id = 1", "DELETE FROM region WHERE x = 0 AND y = 0 AND z = 0",
        "UPDATE region SET x = x + 1000 WHERE x = -1", "UPDATE region SET voxels = voxels + 1 WHERE x = 0",
        "DROP TABLE census", "CREATE VIEW v AS SELECT 1"}) {
    SCOPED_TRACE(damage);
    fs::copy_file(folder / "whole.loam", folder / "a.loam", fs::copy_options::overwrite_existing);
    sql(folder / "a.loam", damage);
    EXPECT_FALSE(load(folder / "a.loam").ok());
    const auto report = check_save(folder / "a.loam");
    ASSERT_TRUE(report.ok()) << report.error().message;
    EXPECT_FALSE(report->clean());
    ASSERT_TRUE(repair_save(folder / "a.loam").ok());
    EXPECT_TRUE(load(folder / "a.loam").ok()) << load(folder / "a.loam").error().message;
  }
}

TEST(LoamCheck, OtherFilesAreNoSaves) {
  const TemporaryFolder folder;
  std::ofstream(folder / "text.loam") << "nothing of the kind";
  EXPECT_FALSE(check_save(folder / "text.loam").ok());
  std::ofstream(folder / "empty.loam").flush();
  EXPECT_FALSE(check_save(folder / "empty.loam").ok());
  EXPECT_FALSE(check_save(folder / "missing.loam").ok());
  EXPECT_FALSE(check_save(folder / "").ok());
  sql(folder / "other.loam", "CREATE TABLE t (a); INSERT INTO t VALUES (1)");
  EXPECT_FALSE(check_save(folder / "other.loam").ok());
}

}  // namespace
}  // namespace world
