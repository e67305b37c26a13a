#include <algorithm>

#include "tools/bench/benchmark.h"

namespace tools {

#define BENCH_SUITE(name) void add_suite_##name(Registry&);
#include "tools_bench_suites.list.h"
#undef BENCH_SUITE
#define BENCH_SUBJECT(name) void add_subject_##name(Registry&);
#include "tools_bench_subjects.list.h"
#undef BENCH_SUBJECT

void Registry::begin_member(std::string name) { member_ = std::move(name); }

void Registry::add(Bench bench) { rows_.push_back({member_, std::move(bench)}); }

void Registry::add(Subject subject) {
  if (subject.name.empty()) subject.name = member_;
  subjects_.push_back(std::move(subject));
}

std::vector<std::string> Registry::suites() const {
  std::vector<std::string> names;
  for (const Row& row : rows_) names.push_back(row.suite);
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  return names;
}

Registry all_benchmarks() {
  Registry registry;
#define BENCH_SUITE(name) registry.begin_member(#name), add_suite_##name(registry);
#include "tools_bench_suites.list.h"
#undef BENCH_SUITE
#define BENCH_SUBJECT(name) registry.begin_member(#name), add_subject_##name(registry);
#include "tools_bench_subjects.list.h"
#undef BENCH_SUBJECT
  return registry;
}

}  // namespace tools
