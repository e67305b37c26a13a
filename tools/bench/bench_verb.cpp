#include "tools/bench/bench_verb.h"

#include <algorithm>
#include <iostream>

#include <fmt/format.h>
#include <unistd.h>

#include "tools/bench/compare.h"
#include "tools/bench/plot.h"
#include "tools/bench/report.h"
#include "world/base/text.h"
#include "world/formats/format.h"

namespace tools {

namespace {

RunOptions run_options(const BenchRequest& request) {
  RunOptions options = request.quick ? RunOptions::quick_run() : RunOptions{};
  options.seed = request.seed;
  return options;
}

/// A line that rewrites itself on a terminal, a line each elsewhere.
void show_progress(size_t done, size_t total, const std::string& what) {
  const bool terminal = isatty(STDERR_FILENO) != 0;
  if (terminal)
    std::cerr << fmt::format("\r\033[K[{}/{}] {}", done, total, what) << (done == total ? "\n" : "") << std::flush;
  else if (done < total)
    std::cerr << fmt::format("[{}/{}] {}\n", done + 1, total, what);
}

world::Error unknown(const std::string& kind, const std::string& name, const std::vector<std::string>& known) {
  const std::string nearest = world::nearest_text(name, known);
  std::string all;
  for (const std::string& k : known) all += (all.empty() ? "" : ", ") + k;
  return world::usage_error(fmt::format("no {} is called \"{}\"{}; known: {}", kind, name,
                                        nearest.empty() ? "" : ", did you mean \"" + nearest + "\"?", all));
}

}  // namespace

Result<std::vector<Registry::Row>> select_rows(const Registry& registry, const std::vector<std::string>& names) {
  if (names.empty()) return registry.rows();
  std::vector<Registry::Row> rows;
  std::vector<std::string> known = registry.suites();
  for (const Registry::Row& row : registry.rows()) known.push_back(row.suite + "/" + row.bench.name);
  for (const std::string& name : names)
    if (std::find(known.begin(), known.end(), name) == known.end())
      return unknown("suite or benchmark", name, registry.suites());
  for (const Registry::Row& row : registry.rows())  // each once, in the registry's order
    if (std::any_of(names.begin(), names.end(), [&](const std::string& name) {
          return name == row.suite || name == row.suite + "/" + row.bench.name;
        }))
      rows.push_back(row);
  return rows;
}

Result<std::vector<Subject>> select_subjects(const Registry& registry, const std::vector<std::string>& names) {
  if (names.empty()) return registry.subjects();
  std::vector<std::string> known;
  for (const Subject& subject : registry.subjects()) known.push_back(subject.name);
  std::vector<Subject> subjects;
  for (const std::string& name : names) {
    const auto found = std::find(known.begin(), known.end(), name);
    if (found == known.end()) return unknown("subject", name, known);
    subjects.push_back(registry.subjects()[static_cast<size_t>(found - known.begin())]);
  }
  return subjects;
}

Result<int> bench_list(const Registry& registry, bool json) {
  if (json) {
    Json list = {{"rows", Json::array()}, {"subjects", Json::array()}};
    for (const auto& [suite, bench] : registry.rows())
      list["rows"].push_back(
          {{"suite", suite},
           {"name", bench.name},
           {"what", bench.what},
           {"unit", bench.unit},
           {"better", bench.better == Better::higher ? "higher" : "lower"},
           {"reach", bench.reach && !bench.reach->times_rival ? Json(bench.reach->value) : Json()},
           {"reach_times_rival", bench.reach && bench.reach->times_rival ? Json(bench.reach->value) : Json()},
           {"reach_origin", bench.reach ? Json(bench.reach->origin) : Json()}});
    for (const Subject& subject : registry.subjects())
      list["subjects"].push_back(
          {{"name", subject.name}, {"question", subject.question}, {"reference", subject.reference}});
    std::cout << list.dump(2) << '\n';
    return 0;
  }
  std::vector<std::vector<std::string>> rows{{"benchmark", "unit", "reach", "what"}};
  for (const auto& [suite, bench] : registry.rows())
    rows.push_back({suite + "/" + bench.name, bench.unit, reach_text(bench.reach, bench.better), bench.what});
  std::vector<std::vector<std::string>> subjects{{"subject of pareto", "question"}};
  for (const Subject& subject : registry.subjects()) subjects.push_back({subject.name, subject.question});
  std::cout << table_text(rows) << '\n' << table_text(subjects);
  return 0;
}

Result<int> bench_run(const Registry& registry, const BenchRequest& request) {
  TRY(const std::vector<Registry::Row> rows, select_rows(registry, request.names));
  const RunOptions options = run_options(request);
  const Machine machine = this_machine();
  BenchContext context(request.quick, request.seed);
  std::vector<RowResult> results;
  for (const Registry::Row& row : rows) {
    show_progress(results.size(), rows.size(), row.suite + "/" + row.bench.name);
    results.push_back(run_row(row, context, options));
  }
  show_progress(rows.size(), rows.size(), "done");
  if (request.json)
    std::cout << run_json(machine, options, results).dump(2) << '\n';
  else
    std::cout << machine_text(machine) << run_text(results);
  const bool failed =
      std::any_of(results.begin(), results.end(), [](const RowResult& r) { return !r.error.empty() && !r.no_device; });
  return failed ? static_cast<int>(world::ErrorKind::comparison) : 0;
}

Result<int> bench_pareto(const Registry& registry, const BenchRequest& request) {
  TRY(const std::vector<Subject> subjects, select_subjects(registry, request.names));
  if (!request.plot_folder.empty()) {
    std::error_code failed;
    std::filesystem::create_directories(request.plot_folder, failed);
    if (failed)
      return world::input_error(request.plot_folder.string() + ": cannot make this folder (" + failed.message() +
                                "); give --plot a writable one");
  }
  const RunOptions options = run_options(request);
  const Machine machine = this_machine();
  BenchContext context(request.quick, request.seed);
  std::vector<SubjectResult> results;
  int code = 0;
  for (const Subject& subject : subjects) {
    show_progress(results.size(), subjects.size(), subject.name);
    SubjectResult result = run_subject(subject, context, options);
    const bool slopes_met =
        std::all_of(result.slopes.begin(), result.slopes.end(), [](const SlopeResult& s) { return s.met; });
    if (!result.error.empty() || !slopes_met) code = static_cast<int>(world::ErrorKind::comparison);
    if (!request.plot_folder.empty() && result.error.empty()) {
      TRY_STATUS(world::write_bytes_atomically(request.plot_folder / (subject.name + ".svg"), pareto_svg(result)));
      if (!result.slopes.empty())
        TRY_STATUS(
            world::write_bytes_atomically(request.plot_folder / (subject.name + "-slopes.svg"), slopes_svg(result)));
      TRY_STATUS(world::write_bytes_atomically(request.plot_folder / (subject.name + ".csv"), pareto_csv(result)));
    }
    results.push_back(std::move(result));
  }
  show_progress(subjects.size(), subjects.size(), "done");
  if (request.json) {
    std::cout << pareto_json(machine, options, results).dump(2) << '\n';
  } else {
    std::cout << machine_text(machine);
    for (const SubjectResult& result : results) std::cout << '\n' << pareto_text(result);
  }
  return code;
}

Result<int> bench_compare(const std::filesystem::path& before, const std::filesystem::path& after, bool json) {
  TRY(const Json old_result, read_result(before));
  TRY(const Json new_result, read_result(after));
  TRY(const Comparison comparison, compare_results(old_result, before.string(), new_result, after.string()));
  if (json)
    std::cout << comparison_json(comparison).dump(2) << '\n';
  else
    std::cout << comparison_text(comparison);
  return comparison.regressed() ? static_cast<int>(world::ErrorKind::comparison) : 0;
}

}  // namespace tools
