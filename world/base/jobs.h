/// Parallel loops on oneTBB whose results don't depend on the number of threads or on the order of execution:
/// each index writes only its own output, and reductions combine fixed chunks in index order.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

namespace world {

/// Threads that parallel loops use now.
int thread_count();

/// Bounds the threads of all parallel loops for its lifetime. 0 means all.
class ThreadLimit {
 public:
  explicit ThreadLimit(int threads);
  ~ThreadLimit();
  ThreadLimit(const ThreadLimit&) = delete;
  ThreadLimit& operator=(const ThreadLimit&) = delete;

 private:
  void* control_ = nullptr;
};

/// Calls body(begin, end) over [0, count) in pieces of at most `grain` indices.
void parallel_ranges(size_t count, size_t grain, const std::function<void(size_t begin, size_t end)>& body);

/// Calls body(i) for each i in [0, count), each a task of its own: for coarse work.
void parallel_for(size_t count, const std::function<void(size_t index)>& body);

/// Reduces [0, count) over fixed chunks of `grain`: map(begin, end) -> T in parallel, then combine(T, T) in index
/// order, so that floating-point sums are the same for any number of threads.
template <class T, class Map, class Combine>
T ordered_reduce(size_t count, size_t grain, T identity, Map map, Combine combine) {
  const size_t chunks = grain == 0 ? 0 : (count + grain - 1) / grain;
  std::vector<T> partial(chunks, identity);
  parallel_for(chunks, [&](size_t c) {
    const size_t begin = c * grain;
    partial[c] = map(begin, begin + grain < count ? begin + grain : count);
  });
  T total = identity;
  for (T& p : partial) total = combine(total, p);
  return total;
}

}  // namespace world
