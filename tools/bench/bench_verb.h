/// loam bench list | run [SUITE...] | pareto | absent | stability | compare A.json B.json | document FILE: the
/// benchmark runner's commands.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/bench/benchmark.h"
#include "tools/bench/runner.h"
#include "world/base/errors.h"

namespace tools {

struct BenchRequest {
  std::vector<std::string> names;  // suites or suite/row for run, subjects for pareto; none = all
  bool json = false, quick = false;
  uint64_t seed = 1;
  std::filesystem::path plot_folder;    // pareto: one SVG and one CSV a subject
  std::filesystem::path report_folder;  // pareto: report.html, accuracy.md, pareto.csv, pareto.json
  std::filesystem::path keep_folder;    // run, pareto: a file a suite or subject (kept_results.h)
};

/// What a request names; the error of an unknown name holds the nearest known one.
Result<std::vector<Registry::Row>> select_rows(const Registry& registry, const std::vector<std::string>& names);
Result<std::vector<Subject>> select_subjects(const Registry& registry, const std::vector<std::string>& names);

/// Each prints to stdout and returns the exit code.
Result<int> bench_list(const Registry& registry, bool json);
/// 0 whether reaches are met or not; 1 where a row failed.
Result<int> bench_run(const Registry& registry, const BenchRequest& request);
/// 1 where a subject failed, or doesn't keep what it declares: slopes, biases, defaults on the front.
Result<int> bench_pareto(const Registry& registry, const BenchRequest& request);
/// 1 where an effect costs anything that a scene doesn't call for. Names: effects.
Result<int> bench_absent(const BenchRequest& request);
/// 1 where a hard case doesn't keep its bound. Names: hard cases.
Result<int> bench_stability(const BenchRequest& request);
/// 1 on a regression. Files, or folders of kept results.
Result<int> bench_compare(const std::filesystem::path& before, const std::filesystem::path& after, bool json);

struct DocumentRequest {
  std::filesystem::path file;     // Markdown with marks (document.h)
  std::filesystem::path results;  // empty: tools/bench/results beside the file. accuracy.md in it is written too
  bool check = false;             // writes nothing
  bool json = false;
};
/// 1 where `check` found a number that would move.
Result<int> bench_document(const DocumentRequest& request);

}  // namespace tools
