/// Results as JSON (keys of the design, section 7, and more), as text tables, and as CSV.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tools/bench/machine.h"
#include "tools/bench/runner.h"
#include "world/base/errors.h"

namespace tools {

using Json = nlohmann::ordered_json;

/// Null where it isn't finite.
Json number_or_null(double value);
Json machine_json(const Machine& machine);
/// {"machine", "commit", "quick", "rows": [{suite, name, value, unit, better, rival, rival_value, ratio, reach, met,
/// ...}]} Absent values are null. `ratio` above 1 means better than the rival, whichever way `better` points. Where a
/// row must reach so many times its best rival, `reach_times_rival` is that number, and `reach` what it came to in
/// `unit`.
Json run_json(const Machine& machine, const RunOptions& options, const std::vector<RowResult>& rows);
/// {"machine", "commit", "quick", "subjects": [{name, reference, metric, points: [{setting, error, bias, work, ms,
/// spread}]}]}
Json pareto_json(const Machine& machine, const RunOptions& options, const std::vector<SubjectResult>& subjects);

/// A subject of pareto_json(), or of a kept file, which leaves out what no table reads.
world::Result<SubjectResult> subject_from_json(const Json& json);

std::string machine_text(const Machine& machine);
/// The same in one line, with flags and date, from the head of a result.
std::string machine_line(const Json& head);
std::string run_text(const std::vector<RowResult>& rows);
std::string pareto_text(const SubjectResult& subject);
/// One row a point, with a header; numbers in full precision.
std::string pareto_csv(const SubjectResult& subject);

/// Four significant digits, thousands separated: 1.234, 12,345, 1.2e-07.
std::string number_text(double value);
/// ">= 5", "<= 5", or ">= 2x rival"; empty where there is none.
std::string reach_text(const std::optional<Reach>& reach, Better better);
/// Columns padded to their widest cell; numbers to the right. The first row is the head.
std::string table_text(const std::vector<std::vector<std::string>>& rows);

}  // namespace tools
