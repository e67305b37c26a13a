#include "tools/bench/bench_verb.h"

#include <algorithm>
#include <chrono>
#include <iostream>

#include <fmt/format.h>
#include <unistd.h>

#include "tools/bench/absent.h"
#include "tools/bench/compare.h"
#include "tools/bench/document.h"
#include "tools/bench/html_report.h"
#include "tools/bench/kept_results.h"
#include "tools/bench/plot.h"
#include "tools/bench/report.h"
#include "tools/bench/stability.h"
#include "world/base/file.h"
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

/// Of what is left, as if each took as long as those before.
class TimeLeft {
 public:
  explicit TimeLeft(size_t total) : total_(total) {}
  std::string text(size_t done) const {
    if (!done) return {};
    const double spent = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    return fmt::format(", about {:.0f} s left", spent / static_cast<double>(done) * static_cast<double>(total_ - done));
  }

 private:
  size_t total_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// What run() gives for each of them, with progress on stderr.
template <class Case, class Name, class Run>
auto run_each(const std::vector<Case>& cases, Name name_of, Run run) {
  std::vector<decltype(run(cases.front()))> results;
  const TimeLeft time_left(cases.size());
  for (const Case& c : cases) {
    show_progress(results.size(), cases.size(), name_of(c) + time_left.text(results.size()));
    results.push_back(run(c));
  }
  show_progress(cases.size(), cases.size(), "done");
  return results;
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
  const std::vector<RowResult> results = run_each(
      rows, [](const Registry::Row& row) { return row.suite + "/" + row.bench.name; },
      [&](const Registry::Row& row) { return run_row(row, context, options); });
  if (!request.keep_folder.empty()) TRY_STATUS(keep_rows(request.keep_folder, machine, options, registry, results));
  if (request.json)
    std::cout << run_json(machine, options, results).dump(2) << '\n';
  else
    std::cout << machine_text(machine) << run_text(results);
  const bool failed =
      std::any_of(results.begin(), results.end(), [](const RowResult& r) { return !r.error.empty() && !r.no_device; });
  return failed ? static_cast<int>(world::ErrorKind::comparison) : 0;
}

namespace {

Status make_folder(const std::filesystem::path& folder, const char* option) {
  if (folder.empty()) return {};
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed)
    return world::input_error(fmt::format("{}: cannot make this folder ({}); give {} a writable one", folder.string(),
                                          failed.message(), option));
  return {};
}

Status write_plots(const std::filesystem::path& folder, const SubjectResult& result) {
  if (folder.empty() || !result.error.empty()) return {};
  TRY_STATUS(world::write_bytes_atomically(folder / (result.name + ".svg"), pareto_svg(result)));
  if (!result.slopes.empty())
    TRY_STATUS(world::write_bytes_atomically(folder / (result.name + "-slopes.svg"), slopes_svg(result)));
  return world::write_bytes_atomically(folder / (result.name + ".csv"), pareto_csv(result));
}

Status write_report(const std::filesystem::path& folder, const Machine& machine, const RunOptions& options,
                    const std::vector<SubjectResult>& results) {
  if (folder.empty()) return {};
  TRY(const std::string html, html_report(machine, options, results));
  TRY_STATUS(world::write_bytes_atomically(folder / "report.html", html));
  const Json json = pareto_json(machine, options, results);
  std::vector<MeasuredSubject> measured;
  for (const SubjectResult& result : results) measured.push_back({result, machine_line(json)});
  TRY_STATUS(world::write_bytes_atomically(folder / "accuracy.md",
                                           accuracy_markdown("loam bench pareto --report DIR", measured)));
  std::string csv;
  for (const SubjectResult& result : results) csv += pareto_csv(result) + "\n";
  TRY_STATUS(world::write_bytes_atomically(folder / "pareto.csv", csv));
  return world::write_bytes_atomically(folder / "pareto.json", json.dump(2) + "\n");
}

}  // namespace

Result<int> bench_pareto(const Registry& registry, const BenchRequest& request) {
  TRY(const std::vector<Subject> subjects, select_subjects(registry, request.names));
  TRY_STATUS(make_folder(request.plot_folder, "--plot"));
  TRY_STATUS(make_folder(request.report_folder, "--report"));
  RunOptions options = run_options(request);
  options.pictures = !request.report_folder.empty();
  const Machine machine = this_machine();
  BenchContext context(request.quick, request.seed);
  std::vector<SubjectResult> results;
  TimeLeft time_left(subjects.size());
  for (const Subject& subject : subjects) {
    show_progress(results.size(), subjects.size(), subject.name + time_left.text(results.size()));
    results.push_back(run_subject(subject, context, options));
    TRY_STATUS(write_plots(request.plot_folder, results.back()));
    if (!request.keep_folder.empty() && results.back().error.empty())
      TRY_STATUS(keep_subject(request.keep_folder, machine, options, results.back()));
    // After each, so that a run that is stopped leaves what it has.
    TRY_STATUS(write_report(request.report_folder, machine, options, results));
  }
  show_progress(subjects.size(), subjects.size(), "done");
  if (request.json) {
    std::cout << pareto_json(machine, options, results).dump(2) << '\n';
  } else {
    std::cout << machine_text(machine);
    for (const SubjectResult& result : results) std::cout << '\n' << pareto_text(result);
  }
  const bool met = std::all_of(results.begin(), results.end(), [](const SubjectResult& r) { return r.gates_met(); });
  return met ? 0 : static_cast<int>(world::ErrorKind::comparison);
}

namespace {

/// Those of the asked names, all where none is asked for.
template <class Case, class Name>
Result<std::vector<Case>> select_cases(std::vector<Case> all, const std::vector<std::string>& names, Name name_of,
                                       const char* kind) {
  if (names.empty()) return all;
  std::vector<std::string> known;
  for (const Case& c : all) known.push_back(name_of(c));
  for (const std::string& name : names)
    if (std::find(known.begin(), known.end(), name) == known.end()) return unknown(kind, name, known);
  std::erase_if(all, [&](const Case& c) { return std::find(names.begin(), names.end(), name_of(c)) == names.end(); });
  return all;
}

}  // namespace

Result<int> bench_absent(const BenchRequest& request) {
  const auto effect_of = [](const AbsentCase& c) { return c.effect; };
  TRY(const std::vector<AbsentCase> cases,
      select_cases(
          absent_cases(), request.names, [](const AbsentCase& c) { return c.effect; }, "effect"));
  const RunOptions options = run_options(request);
  const Machine machine = this_machine();
  BenchContext context(request.quick, request.seed);
  const std::vector<AbsentRow> rows =
      run_each(cases, effect_of, [&](const AbsentCase& c) { return run_absent(c, context, options.quick ? 0.3 : 3); });
  if (request.json)
    std::cout << absent_json(machine, options, rows).dump(2) << '\n';
  else
    std::cout << machine_text(machine) << absent_text(rows);
  const bool met = std::all_of(rows.begin(), rows.end(), [](const AbsentRow& r) { return r.met(); });
  return met ? 0 : static_cast<int>(world::ErrorKind::comparison);
}

Result<int> bench_stability(const BenchRequest& request) {
  const auto id_of = [](const StabilityCase& c) { return c.id; };
  TRY(const std::vector<StabilityCase> cases,
      select_cases(
          stability_cases(), request.names, [](const StabilityCase& c) { return c.id; }, "hard case"));
  const Machine machine = this_machine();
  BenchContext context(request.quick, request.seed);
  const std::vector<StabilityRow> rows =
      run_each(cases, id_of, [&](const StabilityCase& c) { return run_stability(c, context); });
  if (request.json)
    std::cout << stability_json(machine, rows).dump(2) << '\n';
  else
    std::cout << machine_text(machine) << stability_text(rows);
  const bool met = std::all_of(rows.begin(), rows.end(), [](const StabilityRow& r) { return r.fault.empty(); });
  return met ? 0 : static_cast<int>(world::ErrorKind::comparison);
}

Result<int> bench_compare(const std::filesystem::path& before, const std::filesystem::path& after, bool json) {
  const auto read = [](const std::filesystem::path& path) {
    return std::filesystem::is_directory(path) ? merged_result(path) : read_result(path);
  };
  TRY(const Json old_result, read(before));
  TRY(const Json new_result, read(after));
  TRY(const Comparison comparison, compare_results(old_result, before.string(), new_result, after.string()));
  if (json)
    std::cout << comparison_json(comparison).dump(2) << '\n';
  else
    std::cout << comparison_text(comparison);
  return comparison.regressed() ? static_cast<int>(world::ErrorKind::comparison) : 0;
}

namespace {

/// The tables of all kept subjects. Whether they aren't those of the file, which is then written, but for a check.
Result<bool> document_accuracy(const KeptResults& kept, const std::filesystem::path& file, bool check) {
  TRY(const std::vector<MeasuredSubject> subjects, kept.subjects());
  if (subjects.empty()) return false;
  const std::string text = accuracy_markdown("loam bench document README.md", subjects);
  if (std::filesystem::exists(file)) {
    TRY(const std::vector<uint8_t> bytes, world::read_file(file, uint64_t{1} << 28));
    if (std::equal(bytes.begin(), bytes.end(), text.begin(), text.end())) return false;
  }
  if (!check) TRY_STATUS(world::write_bytes_atomically(file, text));
  return true;
}

}  // namespace

Result<int> bench_document(const DocumentRequest& request) {
  const std::string file = request.file.string();
  const std::filesystem::path folder =
      request.results.empty() ? request.file.parent_path() / "tools" / "bench" / "results" : request.results;
  TRY(const KeptResults kept, KeptResults::read(folder));
  TRY(const std::vector<uint8_t> bytes, world::read_file(request.file, uint64_t{1} << 28));
  TRY(const DocumentResult result, document(std::string(bytes.begin(), bytes.end()), file, kept));
  if (!request.check && !result.changes.empty()) TRY_STATUS(world::write_bytes_atomically(request.file, result.text));
  TRY(const bool tables_moved, document_accuracy(kept, folder / "accuracy.md", request.check));
  if (request.json) {
    Json json = {{"file", file},
                 {"rows", result.rows.size()},
                 {"quick", result.quick},
                 {"tables_moved", tables_moved},
                 {"moved", Json::array()}};
    for (const DocumentChange& c : result.changes)
      json["moved"].push_back({{"line", c.line}, {"row", c.row}, {"before", c.before}, {"after", c.after}});
    std::cout << json.dump(2) << '\n';
  } else {
    for (const DocumentChange& c : result.changes)
      std::cout << fmt::format("{}:{}: {}: \"{}\" -> \"{}\"\n", file, c.line, c.row, c.before, c.after);
    std::cout << fmt::format("{}: {} numbers, {} {}{}\n", file, result.rows.size(), result.changes.size(),
                             request.check ? "would move" : "moved",
                             result.quick ? fmt::format(", {} from quick runs", result.quick) : std::string());
    if (tables_moved)
      std::cout << fmt::format("{}: {}\n", (folder / "accuracy.md").string(),
                               request.check ? "would be written anew" : "written anew");
  }
  const bool moved = !result.changes.empty() || tables_moved;
  return request.check && moved ? static_cast<int>(world::ErrorKind::comparison) : 0;
}

}  // namespace tools
