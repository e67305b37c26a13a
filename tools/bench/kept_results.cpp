#include "tools/bench/kept_results.h"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>

#include "tools/bench/compare.h"
#include "world/base/file.h"
#include "world/base/text.h"

namespace tools {

namespace fs = std::filesystem;

namespace {

constexpr const char* kLists[] = {"rows", "subjects", "points"};

/// Six digits: more would be noise, and noise in git.
Json rounded(const Json& json) {
  if (json.is_number_float()) {
    const double value = json;
    if (value == 0 || !std::isfinite(value)) return json;
    return std::stod(fmt::format("{:.6g}", value));
  }
  Json result = json;
  if (json.is_structured())
    for (auto& [key, value] : result.items()) value = rounded(value);
  return result;
}

bool has_list(const Json& json) {
  return json.is_object() && std::any_of(std::begin(kLists), std::end(kLists),
                                         [&](const char* key) { return json.contains(key) && json[key].is_array(); });
}

/// A key a line, and of its lists an element a line.
std::string lines_of(const Json& json, const std::string& indent) {
  if (!has_list(json)) return json.dump();
  std::string text = "{";
  for (const auto& [key, value] : json.items()) {
    text += (text == "{" ? "\n" : ",\n") + indent + " " + Json(key).dump() + ": ";
    if (std::find(std::begin(kLists), std::end(kLists), key) == std::end(kLists)) {
      text += value.dump();
      continue;
    }
    text += "[";
    for (size_t i = 0; i < value.size(); ++i)
      text += (i ? ",\n  " : "\n  ") + indent + lines_of(value[i], indent + "  ");
    text += "\n" + indent + " ]";
  }
  return text + "\n" + indent + "}";
}

/// What no table and no comparison reads.
void shorten(Json& spread) {
  if (spread.is_object())
    for (const char* key : {"min", "max", "count"}) spread.erase(key);
}

Status write_kept(const fs::path& path, const Json& json) {
  std::error_code failed;
  fs::create_directories(path.parent_path(), failed);
  if (failed)
    return world::input_error(fmt::format("{}: cannot make this folder ({}); give --keep a writable one",
                                          path.parent_path().string(), failed.message()));
  return world::write_bytes_atomically(path, lines_of(rounded(json), "") + "\n");
}

Result<std::vector<fs::path>> files_of(const fs::path& folder, bool folders, const char* extension) {
  std::vector<fs::path> paths;
  std::error_code failed;
  for (const auto& entry : fs::directory_iterator(folder, failed))
    if (entry.is_directory() == folders && entry.path().extension() == extension) paths.push_back(entry.path());
  if (failed)
    return world::input_error(
        fmt::format("{}: {}; expected a folder of kept results", folder.string(), failed.message()));
  std::sort(paths.begin(), paths.end());
  return paths;
}

/// All results of a machine's folder.
Result<std::vector<std::pair<fs::path, Json>>> results_of(const fs::path& folder) {
  TRY(std::vector<fs::path> paths, files_of(folder, false, ".json"));
  if (fs::is_directory(folder / "pareto")) {
    TRY(const std::vector<fs::path> subjects, files_of(folder / "pareto", false, ".json"));
    paths.insert(paths.end(), subjects.begin(), subjects.end());
  }
  std::vector<std::pair<fs::path, Json>> results;
  for (const fs::path& path : paths) {
    TRY(Json json, read_result(path));
    if (!json.is_object() || !has_list(json) || !json.contains("machine"))
      return world::input_error(path.string() + " is no result of `loam bench run` or `pareto`");
    results.emplace_back(path, std::move(json));
  }
  return results;
}

std::string text_of(const Json& item, const char* key) {
  return item.is_object() && item.contains(key) && item[key].is_string() ? item[key].get<std::string>() : "";
}

/// As ISO 8601 has them, so that later ones are greater.
std::string date_of(const Json& head) { return text_of(head["machine"], "date"); }

}  // namespace

Status keep_rows(const fs::path& folder, const Machine& machine, const RunOptions& options, const Registry& registry,
                 const std::vector<RowResult>& rows) {
  std::set<std::string> suites;
  for (const RowResult& row : rows) suites.insert(row.suite);
  for (const std::string& suite : suites) {
    std::vector<RowResult> of_suite;
    std::copy_if(rows.begin(), rows.end(), std::back_inserter(of_suite),
                 [&](const RowResult& row) { return row.suite == suite; });
    const auto all = std::count_if(registry.rows().begin(), registry.rows().end(),
                                   [&](const Registry::Row& row) { return row.suite == suite; });
    if (all != static_cast<std::ptrdiff_t>(of_suite.size()))
      return world::usage_error(fmt::format("{} of {} rows of {} were run: whole suites are kept; run `{}`",
                                            of_suite.size(), all, suite, suite));
    Json json = run_json(machine, options, of_suite);
    for (Json& row : json["rows"]) {
      shorten(row["spread"]), shorten(row["ratio_spread"]);
      for (Json& rival : row["rivals"]) shorten(rival["spread"]);
    }
    TRY_STATUS(write_kept(folder / machine.slug() / (suite + ".json"), json));
  }
  return {};
}

Status keep_subject(const fs::path& folder, const Machine& machine, const RunOptions& options,
                    const SubjectResult& subject) {
  Json json = pareto_json(machine, options, {subject});
  for (Json& point : json["subjects"][0]["points"]) {
    for (Json& error : point["errors"]) shorten(error);
    shorten(point["ms_spread"]);
    point.erase("command");
  }
  return write_kept(folder / machine.slug() / "pareto" / (subject.name + ".json"), json);
}

Result<KeptResults> KeptResults::read(const fs::path& folder) {
  KeptResults kept;
  kept.folder_ = folder;
  TRY(const std::vector<fs::path> machines, files_of(folder, true, ""));
  for (const fs::path& machine : machines) {
    TRY(auto results, results_of(machine));
    if (results.empty()) continue;  // a folder of plots
    MachineResults& numbers = kept.machines_[machine.filename().string()];
    for (auto& [path, json] : results) {
      const auto add = [&, &file = path](const std::string& name, KeptNumber number) -> Status {
        if (numbers.numbers.emplace(name, std::move(number)).second) return {};
        return world::input_error(fmt::format("{} has {}, and another file of that folder too", file.string(), name));
      };
      auto head = std::make_unique<Json>(json);
      for (const char* key : kLists) head->erase(key);
      if (json.contains("rows"))
        for (const Json& row : json["rows"])
          TRY_STATUS(add(text_of(row, "suite") + "/" + text_of(row, "name"), {row, {}, head.get()}));
      if (json.contains("subjects"))
        for (const Json& subject : json["subjects"]) {
          std::vector<std::string> metrics;
          for (const Json& metric : subject.value("metrics", Json::array()))
            metrics.push_back(metric.is_string() ? metric.get<std::string>() : "");
          if (metrics.empty()) return world::input_error(path.string() + ": a subject lacks its \"metrics\"");
          for (const Json& point : subject.value("points", Json::array()))
            TRY_STATUS(add(text_of(subject, "name") + "/" + text_of(point, "setting"), {point, metrics, head.get()}));
          KeptSubject& latest = kept.subjects_[text_of(subject, "name")];
          if (!latest.head || date_of(*latest.head) < date_of(*head)) latest = {subject, head.get()};
        }
      numbers.heads.push_back(std::move(head));
    }
  }
  return kept;
}

std::vector<std::string> KeptResults::machines() const {
  std::vector<std::string> names;
  for (const auto& [name, results] : machines_) names.push_back(name);
  return names;
}

Result<std::vector<MeasuredSubject>> KeptResults::subjects() const {
  std::vector<MeasuredSubject> subjects;
  for (const auto& [name, kept] : subjects_) {
    auto subject = subject_from_json(kept.subject);
    if (!subject.ok())
      return world::input_error(fmt::format("{}: {} is {}", folder_.string(), name, subject.error().message));
    subjects.push_back({std::move(*subject), machine_line(*kept.head)});
  }
  return subjects;
}

const Json* KeptResults::head(const std::string& machine) const {
  const auto found = machines_.find(machine);
  return found == machines_.end() ? nullptr : found->second.heads.front().get();
}

Result<const KeptNumber*> KeptResults::find(const std::string& machine, const std::string& name) const {
  const auto results = machines_.find(machine);
  if (results == machines_.end())
    return world::input_error(fmt::format("{} has no results of the machine \"{}\"", folder_.string(), machine));
  const auto& numbers = results->second.numbers;
  if (const auto found = numbers.find(name); found != numbers.end()) return &found->second;
  const KeptNumber* only = nullptr;
  size_t settings = 0;
  for (auto i = numbers.lower_bound(name + "@"); i != numbers.end() && i->first.rfind(name + "@", 0) == 0; ++i)
    only = &i->second, ++settings;
  if (settings == 1) return only;
  std::vector<std::string> known;
  for (const auto& [known_name, number] : numbers) known.push_back(known_name);
  const std::string nearest = world::nearest_text(name, known);
  return world::input_error(fmt::format("{} has no row \"{}\"{}", (folder_ / machine).string(), name,
                                        settings          ? fmt::format(", but {} settings of that method", settings)
                                        : nearest.empty() ? std::string()
                                                          : ", did you mean \"" + nearest + "\"?"));
}

Result<Json> merged_result(const fs::path& folder) {
  TRY(const auto results, results_of(folder));
  Json rows = Json::array(), subjects = Json::array(), merged;
  for (const auto& [path, json] : results) {
    if (merged.is_null())
      for (const char* key : {"machine", "commit", "quick"})
        if (json.contains(key)) merged[key] = json[key];
    if (json.contains("rows")) rows.insert(rows.end(), json["rows"].begin(), json["rows"].end());
    if (json.contains("subjects")) subjects.insert(subjects.end(), json["subjects"].begin(), json["subjects"].end());
  }
  if (merged.is_null()) return world::input_error(folder.string() + " holds no results");
  if (!rows.empty()) merged["rows"] = rows;
  if (!subjects.empty()) merged["subjects"] = subjects;
  return merged;
}

}  // namespace tools
