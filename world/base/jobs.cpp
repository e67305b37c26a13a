#include "world/base/jobs.h"

#include <pthread.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <exception>
#include <mutex>
#include <thread>

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>

#include "world/base/function_ref.h"

namespace world {

using oneapi::tbb::global_control;

namespace {

void pause_briefly() {
#if defined(__x86_64__)
  __builtin_ia32_pause();
#else
  std::this_thread::yield();
#endif
}

/// Threads for one loop at a time, that of a caller which is in no loop yet. A tick is a row of loops of 100 us each:
/// oneTBB's threads sleep between them, and come half a loop late. These look out for the next one for a while, unless
/// the last one was long in coming: then others need the processor.
///
/// Pieces lie in as many blocks as there are threads. Each thread begins with the block that it had in the loops before
/// this one, in whose data it may still have its cache, and then helps with the others.
class Crew {
 public:
  static Crew& instance() {
    static Crew* const crew = new Crew;  // never destroyed: its threads wait until the process ends
    return *crew;
  }

  /// False, and nothing is done, where there is another loop already.
  bool run(size_t threads, size_t pieces, FunctionRef<void(size_t piece)> body) {
    threads = std::min({threads, pieces, hands_ + 1, kMostThreads});
    if (in_loop_ || threads < 2 || !one_loop_.try_lock()) return false;
    const std::lock_guard lock(one_loop_, std::adopt_lock);
    body_ = &body, threads_ = threads, failure_ = nullptr;
    for (size_t b = 0; b < threads; ++b) {
      blocks_[b].next.store(b * pieces / threads, std::memory_order_relaxed);
      blocks_[b].end = (b + 1) * pieces / threads;
    }
    open_.store(true);
    loops_.fetch_add(1);
    loops_.notify_all();
    work_on(0);
    // All pieces are taken. Who came in before this is waited for, who comes after it finds it closed.
    open_.store(false);
    for (int spins = 0; inside_.load() != 0; ++spins) spins < kSpins ? pause_briefly() : std::this_thread::yield();
    if (failure_) std::rethrow_exception(failure_);
    return true;
  }

 private:
  static constexpr size_t kMostThreads = 256;
  static constexpr int kSpins = 4096;
  static constexpr std::chrono::microseconds kLookout{500};

  Crew() {
    const int machine = oneapi::tbb::info::default_concurrency();
    hands_ = std::min(static_cast<size_t>(std::max(machine, 1)), kMostThreads) - 1;
    for (size_t h = 0; h < hands_; ++h) std::thread([this, h] { wait_and_work(h + 1); }).detach();
    // A child process has none of these threads.
    pthread_atfork(nullptr, nullptr, [] { instance().hands_ = 0; });
  }

  void wait_and_work(size_t thread) {
    bool looks_out = false;  // the last loop came soon after the one before it: so may the next
    for (uint64_t seen = 0;;) {
      const auto start = std::chrono::steady_clock::now();
      const auto is_soon = [&] { return std::chrono::steady_clock::now() - start < kLookout; };
      uint64_t now = loops_.load();
      for (int spins = 1; looks_out && now == seen; ++spins, now = loops_.load()) {
        pause_briefly();
        if (spins % 64 == 0) looks_out = is_soon();
      }
      if (now == seen) {
        loops_.wait(seen);
        now = loops_.load();
      }
      looks_out = is_soon();
      seen = now;
      inside_.fetch_add(1);
      if (open_.load() && thread < threads_) work_on(thread);
      inside_.fetch_sub(1);
    }
  }

  void work_on(size_t thread) {
    in_loop_ = true;
    for (size_t k = 0; k < threads_; ++k) {
      Block& block = blocks_[(thread + k) % threads_];
      for (size_t piece; (piece = block.next.fetch_add(1, std::memory_order_relaxed)) < block.end;) {
        try {
          (*body_)(piece);
        } catch (...) {
          const std::lock_guard lock(failing_);
          if (!failure_) failure_ = std::current_exception();
        }
      }
    }
    in_loop_ = false;
  }

  struct alignas(64) Block {
    std::atomic<size_t> next{0};
    size_t end = 0;
  };
  static thread_local bool in_loop_;
  std::mutex one_loop_, failing_;
  size_t hands_ = 0;                            // threads beside the caller
  alignas(64) std::atomic<uint64_t> loops_{0};  // so far
  alignas(64) std::atomic<int> inside_{0};      // threads that look at the loop
  std::atomic<bool> open_{false};               // there are pieces, and what is below holds still while one is inside
  const FunctionRef<void(size_t)>* body_ = nullptr;
  size_t threads_ = 0;
  std::exception_ptr failure_;
  Block blocks_[kMostThreads];
};

thread_local bool Crew::in_loop_ = false;

}  // namespace

int thread_count() {
  const auto allowed = global_control::active_value(global_control::max_allowed_parallelism);
  const int machine = oneapi::tbb::info::default_concurrency();
  return allowed < static_cast<size_t>(machine) ? static_cast<int>(allowed) : machine;
}

ThreadLimit::ThreadLimit(int threads) {
  if (threads > 0) control_ = new global_control(global_control::max_allowed_parallelism, static_cast<size_t>(threads));
}

ThreadLimit::~ThreadLimit() { delete static_cast<global_control*>(control_); }

void parallel_ranges(size_t count, size_t grain, const std::function<void(size_t, size_t)>& body) {
  grain = std::max<size_t>(grain, 1);
  const size_t pieces = (count + grain - 1) / grain;
  if (pieces == 1) return body(0, count);
  const auto piece = [&](size_t k) { body(k * grain, std::min(count, (k + 1) * grain)); };
  if (Crew::instance().run(static_cast<size_t>(thread_count()), pieces, piece)) return;
  oneapi::tbb::parallel_for(
      oneapi::tbb::blocked_range<size_t>(0, count, grain), [&](const auto& range) { body(range.begin(), range.end()); },
      oneapi::tbb::simple_partitioner());  // others leave pieces longer than the grain
}

void parallel_for(size_t count, const std::function<void(size_t)>& body) {
  if (count == 1) return body(0);
  if (Crew::instance().run(static_cast<size_t>(thread_count()), count, body)) return;
  oneapi::tbb::parallel_for(
      oneapi::tbb::blocked_range<size_t>(0, count, 1),
      [&](const auto& range) {
        for (size_t i = range.begin(); i != range.end(); ++i) body(i);
      },
      oneapi::tbb::simple_partitioner());
}

}  // namespace world
