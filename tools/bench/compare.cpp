#include "tools/bench/compare.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "world/formats/format.h"

namespace tools {

namespace {

constexpr double kLeastChange = 0.05, kLeastChangeOfWork = 0.02;

struct Row {
  std::string unit;
  bool higher_is_better = true;
  double median = 0, q1 = 0, q3 = 0;
  double least_change = kLeastChange;
  std::string excuse = {};  // a row whose improvement pays for this one's
};

using Rows = std::map<std::string, Row>;

bool of_subjects(const Json& json) { return json.is_object() && json.contains("subjects"); }

/// A spread's quartiles, where it has them.
void take_quartiles(const Json& item, const char* key, Row& row) {
  if (!item.contains(key) || !item[key].is_object()) return;
  const Json& spread = item[key];
  if (spread.contains("q1") && spread["q1"].is_number()) row.q1 = spread["q1"];
  if (spread.contains("q3") && spread["q3"].is_number()) row.q3 = spread["q3"];
}

world::Result<Rows> rows_of_subjects(const Json& json, const std::string& file) {
  const auto bad = [&](const std::string& what) {
    return world::input_error(file + " is not a result of `loam bench pareto --json`: " + what);
  };
  Rows rows;
  if (!json["subjects"].is_array()) return bad("\"subjects\" is no array");
  for (const Json& subject : json["subjects"]) {
    if (!subject.is_object() || !subject.contains("name") || !subject["name"].is_string() ||
        !subject.contains("points") || !subject["points"].is_array())
      return bad("a subject lacks its \"name\" or \"points\"");
    for (const Json& point : subject["points"]) {
      if (!point.is_object() || !point.contains("setting") || !point["setting"].is_string())
        return bad("a point of " + subject["name"].get<std::string>() + " lacks the text \"setting\"");
      std::string name = subject["name"].get<std::string>() + "/";
      if (point.contains("problem") && point["problem"].is_string() && !point["problem"].get<std::string>().empty())
        name += point["problem"].get<std::string>() + " ";
      name += point["setting"].get<std::string>();
      const auto add = [&](const char* key, const std::string& unit) -> Row* {
        if (!point.contains(key) || !point[key].is_number()) return nullptr;  // it failed there
        const double value = point[key];
        return &(rows[name + " " + key] = Row{unit, false, value, value, value});
      };
      if (Row* error = add("error", "error"); error && point.contains("errors") && point["errors"].is_array() &&
                                              !point["errors"].empty() && point["errors"][0].is_object()) {
        const Json wrapped = {{"spread", point["errors"][0]}};
        take_quartiles(wrapped, "spread", *error);
      }
      if (Row* ms = add("ms", "ms")) take_quartiles(point, "ms_spread", *ms);
      if (Row* work = add("work", "work")) work->least_change = kLeastChangeOfWork, work->excuse = name + " error";
    }
  }
  return rows;
}

/// A folder of results may have both kinds.
world::Result<Rows> rows_of(const Json& json, const std::string& file) {
  if (of_subjects(json) && !json.contains("rows")) return rows_of_subjects(json, file);
  const auto bad = [&](const std::string& what) {
    return world::input_error(file + " is not a result of `loam bench run --json`: " + what);
  };
  if (!json.is_object() || !json.contains("rows") || !json["rows"].is_array()) return bad("it has no array \"rows\"");
  Rows rows;
  size_t index = 0;
  for (const Json& item : json["rows"]) {
    const std::string where = fmt::format("row {} ", index++);
    for (const char* key : {"suite", "name", "unit", "better"})
      if (!item.is_object() || !item.contains(key) || !item[key].is_string())
        return bad(where + "lacks the text \"" + key + "\"");
    if (!item.contains("value")) return bad(where + "lacks \"value\"");
    if (item["value"].is_null()) continue;  // the row failed: as if it were not there
    if (!item["value"].is_number()) return bad(where + "has a \"value\" that is no number");
    Row row{item["unit"], item["better"] == "higher", item["value"], item["value"], item["value"]};
    take_quartiles(item, "spread", row);
    rows[item["suite"].get<std::string>() + "/" + item["name"].get<std::string>()] = row;
  }
  if (of_subjects(json)) {
    TRY(Rows points, rows_of_subjects(json, file));
    rows.merge(points);
  }
  return rows;
}

std::string machine_name(const Json& json) {
  if (!json.contains("machine") || !json["machine"].is_object()) return {};
  const Json& m = json["machine"];
  return (m.contains("cpu") ? m["cpu"].dump() : "") + (m.contains("cores") ? m["cores"].dump() : "");
}

}  // namespace

bool Comparison::regressed() const {
  return !gone.empty() || std::any_of(changes.begin(), changes.end(), [](const Change& c) { return c.regression; });
}

world::Result<Json> read_result(const std::filesystem::path& path) {
  TRY(const std::vector<uint8_t> bytes, world::read_file(path, uint64_t{1} << 28));
  try {
    return Json::parse(bytes.begin(), bytes.end());
  } catch (const nlohmann::json::parse_error& e) {
    return world::input_error(
        fmt::format("{}: byte {}: not JSON; expected a result of `loam bench run --json` or `loam bench pareto --json`",
                    path.string(), e.byte));
  }
}

world::Result<Comparison> compare_results(const Json& before, const std::string& before_name, const Json& after,
                                          const std::string& after_name) {
  const auto has_rows = [](const Json& json) { return !of_subjects(json) || json.contains("rows"); };
  if (has_rows(before) != has_rows(after) && of_subjects(before) != of_subjects(after))
    return world::input_error(
        fmt::format("{} is a result of `loam bench run`, and {} of `pareto`: compare two of a kind",
                    of_subjects(before) ? after_name : before_name, of_subjects(before) ? before_name : after_name));
  TRY(const Rows old_rows, rows_of(before, before_name));
  TRY(const Rows new_rows, rows_of(after, after_name));
  Comparison result;
  result.same_machine = machine_name(before) == machine_name(after);
  for (const auto& [name, old_row] : old_rows) {
    const auto found = new_rows.find(name);
    if (found == new_rows.end()) {
      result.gone.push_back(name);
      continue;
    }
    const Row& new_row = found->second;
    if (new_row.unit != old_row.unit || new_row.higher_is_better != old_row.higher_is_better)
      return world::input_error(fmt::format("{} is in {} in {} but in {} in {}; compare results of like commits", name,
                                            old_row.unit, before_name, new_row.unit, after_name));
    ++result.compared;
    const bool apart = new_row.q1 > old_row.q3 || new_row.q3 < old_row.q1;
    const double larger = std::max(std::abs(old_row.median), std::abs(new_row.median));
    if (!apart || std::abs(new_row.median - old_row.median) <= old_row.least_change * larger) continue;
    const double gain = old_row.higher_is_better ? new_row.median / old_row.median : old_row.median / new_row.median;
    const bool worse = old_row.higher_is_better ? new_row.median < old_row.median : new_row.median > old_row.median;
    bool excused = false;
    if (worse && !old_row.excuse.empty()) {
      const auto was = old_rows.find(old_row.excuse), is = new_rows.find(old_row.excuse);
      excused =
          was != old_rows.end() && is != new_rows.end() && is->second.median < (1 - kLeastChange) * was->second.median;
    }
    result.changes.push_back({name, old_row.unit, old_row.median, new_row.median, gain, worse && !excused});
  }
  for (const auto& [name, row] : new_rows)
    if (!old_rows.count(name)) result.added.push_back(name);
  return result;
}

std::string comparison_text(const Comparison& c) {
  std::string text;
  if (!c.same_machine) text += "the two results are of different machines\n";
  if (!c.changes.empty()) {
    std::vector<std::vector<std::string>> table{{"benchmark", "before", "after", "unit", "gain", ""}};
    for (const Change& change : c.changes)
      table.push_back({change.name, number_text(change.before), number_text(change.after), change.unit,
                       number_text(change.gain), change.regression ? "WORSE" : "better"});
    text += table_text(table);
  }
  for (const std::string& name : c.gone) text += name + ": gone, or failed in the second\n";
  for (const std::string& name : c.added) text += name + ": new\n";
  const size_t worse = static_cast<size_t>(
      std::count_if(c.changes.begin(), c.changes.end(), [](const Change& change) { return change.regression; }));
  return text + fmt::format("{} rows compared: {} worse, {} better, {} gone, {} new\n", c.compared, worse,
                            c.changes.size() - worse, c.gone.size(), c.added.size());
}

Json comparison_json(const Comparison& c) {
  Json json = {{"compared", c.compared},
               {"same_machine", c.same_machine},
               {"regressed", c.regressed()},
               {"gone", c.gone},
               {"new", c.added}};
  json["changes"] = Json::array();
  for (const Change& change : c.changes)
    json["changes"].push_back({{"name", change.name},
                               {"unit", change.unit},
                               {"before", change.before},
                               {"after", change.after},
                               {"gain", std::isfinite(change.gain) ? Json(change.gain) : Json()},
                               {"regression", change.regression}});
  return json;
}

}  // namespace tools
