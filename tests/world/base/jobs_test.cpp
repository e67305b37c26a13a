#include "world/base/jobs.h"

#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "world/base/random.h"

namespace world {
namespace {

float term(size_t i) { return uniform01(random_bits(3, static_cast<int64_t>(i), 0, 0)) - 0.3f; }

float sum_of_terms(size_t count, size_t grain) {
  return ordered_reduce(
      count, grain, 0.0f,
      [](size_t begin, size_t end) {
        float sum = 0;
        for (size_t i = begin; i < end; ++i) sum += term(i);
        return sum;
      },
      [](float a, float b) { return a + b; });
}

TEST(Jobs, AFloatSumHasTheSameBitsForAnyNumberOfThreads) {
  const auto with_threads = [](int threads) {
    const ThreadLimit limit(threads);
    return sum_of_terms(100'003, 1000);
  };
  const float one = with_threads(1);
  EXPECT_EQ(with_threads(2), one);
  EXPECT_EQ(with_threads(8), one);
  EXPECT_EQ(with_threads(0), one);
  EXPECT_NE(sum_of_terms(100'003, 777), one);  // other chunks, other rounding: the claim above is not empty
}

TEST(Jobs, OrderedReduceCombinesInIndexOrder) {
  const auto digits = [](size_t count, size_t grain) {
    return ordered_reduce(
        count, grain, std::string(), [](size_t begin, size_t) { return std::to_string(begin) + ","; },
        [](std::string a, const std::string& b) { return a + b; });
  };
  EXPECT_EQ(digits(10, 3), "0,3,6,9,");
  EXPECT_EQ(digits(0, 3), "");
  EXPECT_EQ(digits(5, 100), "0,");
}

TEST(Jobs, ParallelForVisitsEachIndexOnce) {
  for (int threads : {1, 2, 8}) {
    const ThreadLimit limit(threads);
    std::vector<std::atomic<int>> visits(10'000);
    parallel_for(visits.size(), [&](size_t i) { ++visits[i]; });
    for (const auto& v : visits) ASSERT_EQ(v, 1);
  }
  parallel_for(0, [](size_t) { FAIL(); });
}

TEST(Jobs, ParallelRangesCoverEachIndexOnceInPiecesOfAtMostTheGrain) {
  for (size_t grain : {1u, 7u, 64u, 5000u, 20000u}) {
    std::vector<std::atomic<int>> visits(10'000);
    std::atomic<size_t> longest = 0;
    parallel_ranges(visits.size(), grain, [&](size_t begin, size_t end) {
      for (size_t seen = longest; end - begin > seen && !longest.compare_exchange_weak(seen, end - begin);) {
      }
      for (size_t i = begin; i < end; ++i) ++visits[i];
    });
    for (const auto& v : visits) ASSERT_EQ(v, 1) << grain;
    EXPECT_LE(longest, grain);
  }
  parallel_ranges(10, 0, [](size_t begin, size_t end) { EXPECT_EQ(end - begin, 1u); });
}

uint64_t sum_in_parallel(size_t count) {
  std::atomic<uint64_t> sum{0};
  parallel_ranges(count, 16, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) sum += i;
  });
  return sum;
}

TEST(Jobs, LoopsInLoopsAndOfManyCallersAtOnceVisitEachIndexOnce) {
  std::vector<std::atomic<int>> visits(64 * 64);
  parallel_for(64, [&](size_t i) { parallel_for(64, [&](size_t k) { ++visits[i * 64 + k]; }); });
  for (const auto& v : visits) ASSERT_EQ(v, 1);
  std::vector<std::thread> callers;
  std::atomic<int> wrong{0};
  for (int c = 0; c < 4; ++c)
    callers.emplace_back([&] {
      for (int k = 0; k < 500; ++k) wrong += sum_in_parallel(1000) != 499'500;
    });
  for (std::thread& caller : callers) caller.join();
  EXPECT_EQ(wrong, 0);
}

TEST(Jobs, LoopsGoOnAfterAPauseAndAfterAnException) {
  for (const int us : {0, 50, 2000, 20'000}) {
    std::this_thread::sleep_for(std::chrono::microseconds(us));
    for (int k = 0; k < 100; ++k) ASSERT_EQ(sum_in_parallel(1000), 499'500u) << us;
    EXPECT_THROW(parallel_for(100, [](size_t i) { i == 57 ? throw std::runtime_error("57") : void(); }),
                 std::runtime_error);
  }
}

TEST(Jobs, AChildProcessHasLoopsToo) {
  ASSERT_EQ(sum_in_parallel(1000), 499'500u);
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    const ThreadLimit limit(1);
    _exit(sum_in_parallel(1000) == 499'500 ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

TEST(Jobs, ALimitOfOneRunsEverythingOnTheCallersThread) {
  const int before = thread_count();
  {
    const ThreadLimit limit(1);
    EXPECT_EQ(thread_count(), 1);
    const auto caller = std::this_thread::get_id();
    parallel_for(1000, [&](size_t) { EXPECT_EQ(std::this_thread::get_id(), caller); });
  }
  EXPECT_EQ(thread_count(), before);
}

}  // namespace
}  // namespace world
