/// What a save survives: hard cases IO1 to IO7 and IO21, promises P-1 to P-4 and P-14. Each harness has a control: the
/// same harness over something that is known to break, which must be found.
#include <csignal>
#include <functional>
#include <set>
#include <thread>

#include <fcntl.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include "tests/world/saves/fault_vfs.h"
#include "tests/world/saves/saves_support.h"
#include "world/base/random.h"
#include "world/saves/check.h"

extern char** environ;

namespace world {
namespace {

namespace fs = std::filesystem;
using Session = std::unique_ptr<SaveSession>;

/// Two regions of stone with a few hundred odd blocks: a save of it takes some 20 ms.
World small_world() {
  World world(standard_blocks());
  EditBatch batch;
  batch.fill({{0, 0, 0}, {200, 20, 100}}, *world.palette->find("stone"));
  std::mt19937 rng(3);
  for (int i = 0; i < 300; ++i)
    batch.set({int(rng() % 200), int(rng() % 60), int(rng() % 100)}, static_cast<BlockId>(rng() % 100));
  EXPECT_TRUE(world.store.apply(batch).ok());
  return world;
}

EditBatch small_edit(int n) {
  EditBatch batch;
  for (int i = 0; i < 40; ++i)
    batch.set({(n * 37 + i * 11) % 200, 25 + i % 40, (n * 53 + i * 7) % 100}, static_cast<BlockId>(1 + (n + i) % 90));
  return batch;
}

/// The file as another process would find it after a crash now: with its journal, in a folder of its own.
std::optional<uint64_t> hash_after_crash(const fs::path& file, const fs::path& folder, std::string* why = nullptr) {
  fs::remove_all(folder);
  fs::create_directories(folder);
  fs::copy_file(file, folder / "crash.loam");
  const fs::path journal = file.string() + "-journal";
  if (fs::exists(journal)) fs::copy_file(journal, folder / "crash.loam-journal");
  const auto world = load(folder / "crash.loam");
  if (!world.ok()) {
    if (why) *why = world.error().message;
    return std::nullopt;
  }
  return world->store.content_hash();
}

// ---- I/O errors, short writes, a full disk ---------------------------------------------------------------------

struct FaultCase {
  const char* name;
  unsigned calls;
  FaultVfs::Kind kind;
  bool forever;
};

class HardCaseIO3 : public testing::TestWithParam<FaultCase> {};

TEST_P(HardCaseIO3, TheKthFailingCallCostsNothingSavedAndTheSessionGoesOn) {
  FaultVfs& vfs = FaultVfs::install();
  const FaultCase& fault = GetParam();
  const TemporaryFolder folder;
  SaveSession::Options options;
  options.vfs = vfs.name();
  auto created = SaveSession::create(folder / "a.loam", small_world(), options);
  ASSERT_TRUE(created.ok()) << created.error().message;
  const Session session = std::move(*created);
  Store& store = session->world().store;
  int failed = 0, k = 1;
  // Each of the first calls, then one in sixteen more: a save writes hundreds of pages alike.
  for (bool reached = true; reached; k += 1 + k / 16) {
    ASSERT_LT(k, 4000);
    const uint64_t before = store.content_hash();
    ASSERT_TRUE(store.apply(small_edit(k)).ok());
    const uint64_t after = store.content_hash();
    vfs.arm(fault.calls, k, fault.forever, fault.kind);
    const Status status = session->save();
    reached = vfs.faults() > 0;
    vfs.disarm();
    // Whatever was said: the disk holds one whole save, and where a failure was said, the world still counts as
    // unsaved.
    std::string why;
    const auto disk = hash_after_crash(folder / "a.loam", folder / "crash", &why);
    ASSERT_TRUE(disk) << "k = " << k << ": " << why;
    if (status.ok()) {
      EXPECT_EQ(*disk, after) << "k = " << k << ": a save that was acknowledged is not there";
      EXPECT_FALSE(session->has_changes());
      continue;
    }
    ++failed;
    EXPECT_TRUE(*disk == before || *disk == after) << "k = " << k;
    EXPECT_TRUE(session->has_changes());
    EXPECT_NE(status.error().message.find("a.loam"), std::string::npos) << status.error().message;
    if (fault.kind == FaultVfs::Kind::disk_full && fault.calls == bit(FaultVfs::Call::write)) {
      EXPECT_NE(status.error().message.find("full"), std::string::npos) << status.error().message;
      EXPECT_NE(status.error().message.find("space"), std::string::npos) << status.error().message;
    }
    EXPECT_EQ(store.content_hash(), after) << "the world in memory must not change";
    const Status again = session->save();
    ASSERT_TRUE(again.ok()) << "k = " << k << ": " << again.error().message;
    ASSERT_EQ(hash_after_crash(folder / "a.loam", folder / "crash"), after);
  }
  EXPECT_GT(failed, 3) << "the fault was hardly ever met: does the shim still see SQLite's calls?";
  const auto checked = check_save(folder / "a.loam");
  ASSERT_TRUE(checked.ok());
  EXPECT_TRUE(checked->clean()) << checked->problems.front();
}

INSTANTIATE_TEST_SUITE_P(
    Faults, HardCaseIO3,
    testing::Values(FaultCase{"AnyCallOnce", kWritingCalls, FaultVfs::Kind::error, false},
                    FaultCase{"AnyCallForever", kWritingCalls, FaultVfs::Kind::error, true},
                    FaultCase{"ShortWriteOnce", bit(FaultVfs::Call::write), FaultVfs::Kind::short_write, false},
                    FaultCase{"ShortWriteForever", bit(FaultVfs::Call::write), FaultVfs::Kind::short_write, true},
                    FaultCase{"DiskFull", bit(FaultVfs::Call::write), FaultVfs::Kind::disk_full, true}),
    [](const auto& parameter) { return std::string(parameter.param.name); });

TEST(HardCaseIO3, AReadThatFailsIsSaid) {
  FaultVfs& vfs = FaultVfs::install();
  const TemporaryFolder folder;
  ASSERT_TRUE(write_world(small_world(), folder / "a.loam").ok());
  int failed = 0;
  for (int k = 1;; ++k) {
    vfs.arm(bit(FaultVfs::Call::read) | bit(FaultVfs::Call::open), k, false, FaultVfs::Kind::error);
    const auto file = SaveFile::open(folder / "a.loam", SaveFile::Access::read, vfs.name());
    const Result<World> world = file.ok() ? (*file)->read_all() : Result<World>(file.error());
    const bool reached = vfs.faults() > 0;
    vfs.disarm();
    if (world.ok())
      EXPECT_EQ(world->store.content_hash(), small_world().store.content_hash());
    else
      EXPECT_NE(world.error().message.find("a.loam"), std::string::npos) << world.error().message;
    failed += !world.ok();
    if (!reached) break;
  }
  EXPECT_GT(failed, 3);
}

TEST(HardCaseIO5, AFileSizeLimitOfTheSystemIsAFailedSaveAndNoMore) {
  const TemporaryFolder folder;
  auto created = SaveSession::create(folder / "a.loam", small_world(), {});
  ASSERT_TRUE(created.ok());
  const Session session = std::move(*created);
  const uint64_t before = session->world().store.content_hash();
  // Noise in a region: 2 MB that do not compress.
  EditBatch batch;
  std::mt19937 rng(1);
  for (int i = 0; i < 400000; ++i)
    batch.set({int(rng() % 128), int(rng() % 128), int(rng() % 100)}, static_cast<BlockId>(1 + rng() % 100));
  ASSERT_TRUE(session->world().store.apply(batch).ok());
  struct rlimit old {};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &old), 0);
  const auto previous = std::signal(SIGXFSZ, SIG_IGN);
  rlimit limit = old;
  limit.rlim_cur = fs::file_size(folder / "a.loam") + 50000;
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &limit), 0);
  const Status status = session->save();
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &old), 0);
  std::signal(SIGXFSZ, previous);
  ASSERT_FALSE(status.ok());
  EXPECT_NE(status.error().message.find("a.loam"), std::string::npos) << status.error().message;
  EXPECT_EQ(hash_after_crash(folder / "a.loam", folder / "crash"), before);
  ASSERT_TRUE(session->save().ok());
  EXPECT_EQ(hash_after_crash(folder / "a.loam", folder / "crash"), session->world().store.content_hash());
}

// ---- power loss ------------------------------------------------------------------------------------------------

/// Files as a disk holds them after the events: a write that no later sync of its file covers may be missing.
class Disk {
 public:
  Disk(const fs::path& file, std::string content) { files_[file.string()] = std::move(content); }
  void apply(const FaultVfs::Event& e) {
    std::string& content = files_[e.file];
    switch (e.kind) {
      case FaultVfs::Event::Kind::write:
        if (content.size() < static_cast<size_t>(e.offset) + e.bytes.size())
          content.resize(static_cast<size_t>(e.offset) + e.bytes.size(), '\0');
        content.replace(static_cast<size_t>(e.offset), e.bytes.size(), e.bytes);
        break;
      case FaultVfs::Event::Kind::truncate:
        content.resize(static_cast<size_t>(e.offset), '\0');
        break;
      case FaultVfs::Event::Kind::remove:
        files_.erase(e.file);
        break;
      case FaultVfs::Event::Kind::sync:
        break;
    }
  }
  std::optional<uint64_t> hash(const fs::path& file, const fs::path& folder, std::string* why) const {
    fs::remove_all(folder);
    fs::create_directories(folder);
    for (const auto& [name, content] : files_) {
      const std::string suffix = name.substr(file.string().size());
      std::ofstream(folder / ("crash.loam" + suffix), std::ios::binary) << content;
    }
    const auto world = load(folder / "crash.loam");
    if (!world.ok()) {
      *why = world.error().message;
      return std::nullopt;
    }
    return world->store.content_hash();
  }

 private:
  std::map<std::string, std::string> files_;
};

/// Checks disks after power losses at `losses` moments of a save, each with random subsets of what was not synced.
/// Returns how many held neither the old nor the new world.
int broken_disks(bool ignore_journal, int losses, std::string* why) {
  FaultVfs& vfs = FaultVfs::install();
  const TemporaryFolder folder;
  SaveSession::Options options;
  options.vfs = vfs.name();
  auto created = SaveSession::create(folder / "a.loam", small_world(), options);
  EXPECT_TRUE(created.ok());
  const Session session = std::move(*created);
  const auto content = *read_file(folder / "a.loam");
  const std::string start(content.begin(), content.end());
  const uint64_t before = session->world().store.content_hash();
  EXPECT_TRUE(session->world().store.apply(small_edit(1)).ok());
  const uint64_t after = session->world().store.content_hash();
  vfs.record(true);
  EXPECT_TRUE(session->save().ok());
  vfs.record(false);
  std::vector<FaultVfs::Event> events = vfs.events();
  if (ignore_journal) std::erase_if(events, [](const auto& e) { return e.file.ends_with("-journal"); });
  std::mt19937 rng(8);
  int broken = 0;
  for (int loss = 0; loss < losses; ++loss) {
    // The first passes cut the log at each event, in order; then at random ones, with unsynced writes dropped.
    const size_t moment =
        static_cast<size_t>(loss) <= events.size() ? static_cast<size_t>(loss) : rng() % (events.size() + 1);
    const bool drop = static_cast<size_t>(loss) > events.size();
    Disk disk(folder / "a.loam", start);
    for (size_t i = 0; i < moment; ++i) {
      bool synced = false;
      for (size_t j = i + 1; j < moment && !synced; ++j)
        synced = events[j].kind == FaultVfs::Event::Kind::sync && events[j].file == events[i].file;
      const bool may_be_lost = !synced && events[i].kind == FaultVfs::Event::Kind::write;
      if (!drop || !may_be_lost || rng() % 2) disk.apply(events[i]);
    }
    const auto hash = disk.hash(folder / "a.loam", folder / "crash", why);
    if (!hash || (*hash != before && *hash != after)) ++broken;
  }
  return broken;
}

TEST(HardCaseIO2, APowerLossAtAnyMomentLeavesTheOldOrTheNewWorld) {
  SKIP_UNDER_SANITIZERS();
  std::string why;
  EXPECT_EQ(broken_disks(false, 250, &why), 0) << why;
}

TEST(HardCaseIO2, ControlWithoutTheJournalTheHarnessFindsBrokenWorlds) {
  SKIP_UNDER_SANITIZERS();
  std::string why;
  EXPECT_GT(broken_disks(true, 60, &why), 5);
}

// ---- kill -9 ---------------------------------------------------------------------------------------------------

constexpr const char* kKillFile = "LOAM_KILLED_SAVE";

/// What the killed program does: four regions of noise, 7 MB packed, so that a save is larger than SQLite's cache and
/// part of it reaches the file before its end; new noise and another save without end. It says before each save which
/// world is being saved, and after it that it was.
void edit_and_save_without_end(const fs::path& path) {
  World world(standard_blocks());
  const auto noise = [](Store& store, int round) {
    for (int n = 0; n < 4; ++n) {
      RegionBuilder region({n & 1, 0, n >> 1});
      for (int leaf = 0; leaf < kLeavesPerRegion; ++leaf) {
        BlockId values[kLeafVoxels];
        for (int i = 0; i < kLeafVoxels; i += 4) {
          const uint64_t bits = random_bits(static_cast<uint64_t>(round), n, leaf, i);
          for (int k = 0; k < 4; ++k) values[i + k] = static_cast<BlockId>(bits >> (16 * k) & 127);
        }
        region.set_leaf(leaf, values);
      }
      store.adopt(std::move(region));
    }
  };
  noise(world.store, 0);
  const int log = ::open((path.string() + ".log").c_str(), O_CREAT | O_WRONLY | O_APPEND, 0600);
  const auto say = [&](const char* what, uint64_t hash) {
    const std::string line = std::string(what) + " " + std::to_string(hash) + "\n";
    CHECK_EQ(::write(log, line.data(), line.size()), static_cast<ssize_t>(line.size()));
  };
  say("saving", world.store.content_hash());
  auto session = SaveSession::create(path, std::move(world), {});
  CHECK(session.ok());
  say("saved", (*session)->world().store.content_hash());
  for (int round = 1;; ++round) {
    noise((*session)->world().store, round);
    say("saving", (*session)->world().store.content_hash());
    CHECK((*session)->save().ok());
    say("saved", (*session)->world().store.content_hash());
  }
}

/// Runs only as the program that is killed.
TEST(SaveKill, DISABLED_Killed) {
  if (const char* path = std::getenv(kKillFile)) edit_and_save_without_end(path);
}

struct KillResult {
  bool had_journal = false, opened = false, one_save = false, clean = false;
  std::string why;
};

/// `in_transaction`: the delay counts from the moment in which a transaction first writes to the file itself.
KillResult kill_during_save(const fs::path& file, int delay_ms, bool in_transaction, bool remove_journal) {
  for (const char* suffix : {"", "-journal", ".log"}) fs::remove(file.string() + suffix);
  ::setenv(kKillFile, file.c_str(), 1);
  const char* arguments[] = {"/proc/self/exe", "--gtest_also_run_disabled_tests",
                             "--gtest_filter=SaveKill.DISABLED_Killed", nullptr};
  const std::string self = fs::read_symlink("/proc/self/exe");
  posix_spawn_file_actions_t quiet;
  posix_spawn_file_actions_init(&quiet);
  posix_spawn_file_actions_addopen(&quiet, 1, "/dev/null", O_WRONLY, 0);
  pid_t child = 0;
  EXPECT_EQ(posix_spawn(&child, self.c_str(), &quiet, nullptr, const_cast<char**>(arguments), environ), 0);
  posix_spawn_file_actions_destroy(&quiet);
  ::unsetenv(kKillFile);
  // The clock starts with the first save that replaces another.
  const auto log_text = [&] {
    std::ifstream in(file.string() + ".log");
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  for (int wait = 0; wait < 30000 && log_text().find("saved") == std::string::npos; ++wait)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  const fs::path journal = file.string() + "-journal";
  std::error_code ignored;
  if (in_transaction) {
    const auto poll = [](const std::function<bool()>& done) {
      for (int wait = 0; wait < 100000 && !done(); ++wait) std::this_thread::sleep_for(std::chrono::microseconds(100));
    };
    poll([&] { return fs::exists(journal, ignored); });
    const auto before = fs::last_write_time(file, ignored);
    poll([&] { return fs::last_write_time(file, ignored) != before; });
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(delay_ms));
  ::kill(child, SIGKILL);
  int status = 0;
  ::waitpid(child, &status, 0);
  KillResult result;
  EXPECT_TRUE(WIFSIGNALED(status)) << "the program ended by itself";

  // The last world that was said to be saved, and the one that was being saved then, if any.
  std::set<std::string> allowed;
  std::istringstream lines(log_text());
  for (std::string what, hash; lines >> what >> hash;) {
    if (what == "saved") allowed.clear();
    allowed.insert(hash);
  }
  result.had_journal = fs::exists(journal) && fs::file_size(journal) > 0;
  if (remove_journal) fs::remove(journal);
  const auto world = load(file);
  result.opened = world.ok();
  if (!world.ok()) {
    result.why = world.error().message;
    return result;
  }
  result.one_save = allowed.contains(std::to_string(world->store.content_hash()));
  const auto checked = check_save(file);
  result.clean = checked.ok() && checked->clean();
  if (!result.clean) result.why = checked.ok() ? checked->problems.front() : checked.error().message;
  return result;
}

int kill_rounds() {
  const char* text = std::getenv("LOAM_KILL_ROUNDS");  // 200 by hand
  return text ? std::atoi(text) : 25;
}

TEST(HardCaseIO1, AKillAtAnyMomentLeavesExactlyOneWholeSave) {
  SKIP_UNDER_SANITIZERS();
  const TemporaryFolder folder;
  const int rounds = kill_rounds();
  int journals = 0;
  for (int round = 0; round < rounds; ++round) {
    const bool in_transaction = round % 2 == 1;
    const int delay_ms = static_cast<int>(random_bits(7, round, 0, 0) % (in_transaction ? 20 : 400));
    const KillResult result = kill_during_save(folder / "killed.loam", delay_ms, in_transaction, false);
    journals += result.had_journal;
    EXPECT_TRUE(result.opened && result.one_save && result.clean)
        << "round " << round << ", killed after " << delay_ms << " ms: opened " << result.opened << ", one save "
        << result.one_save << ", clean " << result.clean << "; " << result.why;
  }
  EXPECT_GT(journals, 0) << "no kill met a save half written: the delays are wrong";
  std::cout << rounds << " kills, " << journals << " of them within a transaction\n";
}

TEST(HardCaseIO1, ControlWithoutItsJournalAKilledSaveDoesNotPass) {
  SKIP_UNDER_SANITIZERS();
  const TemporaryFolder folder;
  int journals = 0, broken = 0;
  for (int round = 0; round < 40 && broken == 0; ++round) {
    const int delay_ms = static_cast<int>(random_bits(11, round, 0, 0) % 8);
    const KillResult result = kill_during_save(folder / "killed.loam", delay_ms, true, true);
    journals += result.had_journal;
    broken += result.had_journal && !(result.opened && result.one_save && result.clean);
  }
  EXPECT_GT(broken, 0) << "of " << journals << " saves cut in two without a journal, none was found broken";
}

}  // namespace
}  // namespace world
