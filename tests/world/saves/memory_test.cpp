/// Promise P-14, hard case IO4: where memory runs out while a world is saved or opened, the program says so, the file
/// keeps its last save, and the session goes on. Allocations of this program fail on demand, here and in SQLite.
#include <atomic>
#include <cstdlib>
#include <new>

#include "tests/world/saves/saves_support.h"
#include "world/saves/check.h"

// Replacing operator new would hide errors from the sanitizers, which replace it themselves.
#if !defined(__SANITIZE_ADDRESS__)

namespace {

std::atomic<int64_t> allocations_left{INT64_MAX};  // of threads that are not spared; INT64_MAX: none fails
thread_local bool spared = false;

bool allocation_fails() {
  if (allocations_left.load(std::memory_order_relaxed) == INT64_MAX || spared) return false;
  return allocations_left.fetch_sub(1) == 1;
}

void* allocate(std::size_t size, std::size_t alignment) {
  if (allocation_fails()) return nullptr;
  if (alignment <= alignof(std::max_align_t)) return std::malloc(size ? size : 1);
  return std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
}

}  // namespace

[[gnu::noinline]] void* operator new(std::size_t size) {
  if (void* p = allocate(size, 0)) return p;
  throw std::bad_alloc();
}
[[gnu::noinline]] void* operator new(std::size_t size, std::align_val_t alignment) {
  if (void* p = allocate(size, static_cast<std::size_t>(alignment))) return p;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* p) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete(void* p, std::size_t) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete(void* p, std::align_val_t) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete(void* p, std::size_t, std::align_val_t) noexcept { std::free(p); }

namespace world {
namespace {

TEST(HardCaseIO4, TheKthAllocationThatFailsWhileSavingCostsNothing) {
  const TemporaryFolder folder;
  auto created = SaveSession::create(folder / "a.loam", sample_world(), {.autosave_s = 0});
  ASSERT_TRUE(created.ok());
  const auto session = std::move(*created);
  Store& store = session->world().store;
  int failed = 0;
  // Ever sparser allocations, until a save meets none.
  int64_t k = 1;
  for (bool reached = true; reached; k += 1 + k / 5) {
    ASSERT_TRUE(store.apply(edit_number(static_cast<int>(k % 1000))).ok());
    const uint64_t after = store.content_hash();
    ASSERT_TRUE(session->begin_save());
    // The writer's thread and those that help it meet the failure; this one waits.
    spared = true;
    allocations_left = k;
    const Status status = session->wait();
    reached = allocations_left <= 0;
    allocations_left = INT64_MAX;
    EXPECT_EQ(store.content_hash(), after);
    if (status.ok()) continue;
    ++failed;
    EXPECT_NE(status.error().message.find("memory"), std::string::npos) << status.error().message;
    EXPECT_TRUE(session->has_changes());
    const Status again = session->save();
    ASSERT_TRUE(again.ok()) << "k = " << k << ": " << again.error().message;
  }
  EXPECT_GT(failed, 10);
  const auto checked = check_save(folder / "a.loam");
  ASSERT_TRUE(checked.ok());
  EXPECT_TRUE(checked->clean()) << checked->problems.front();
  EXPECT_EQ(load(folder / "a.loam")->store.content_hash(), store.content_hash());
}

}  // namespace
}  // namespace world

#endif
