#include "tools/bench/stability.h"

#include <chrono>
#include <cmath>
#include <exception>

#include <fmt/format.h>

namespace tools {

#define STABILITY_CASES(name) void add_stability_##name(std::vector<StabilityCase>&);
#include "tools_bench_stability.list.h"
#undef STABILITY_CASES

std::vector<StabilityCase> stability_cases() {
  std::vector<StabilityCase> cases;
#define STABILITY_CASES(name) add_stability_##name(cases);
#include "tools_bench_stability.list.h"
#undef STABILITY_CASES
  return cases;
}

namespace {

/// False for NaN.
bool within(double error, double bound) { return std::abs(error) <= bound; }

}  // namespace

StabilityRow run_stability(const StabilityCase& the_case, BenchContext& context) {
  StabilityRow row;
  row.of = &the_case;
  const auto start = std::chrono::steady_clock::now();
  try {
    const Result<double> error = the_case.error(context);
    if (!error.ok()) {
      row.fault = error.error().message, row.error = NAN;
      return row;
    }
    row.error = *error;
    if (the_case.naive) row.naive = the_case.naive();
  } catch (const std::exception& e) {
    row.fault = e.what(), row.error = NAN;
    return row;
  }
  row.ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  if (!within(row.error, the_case.bound))
    row.fault = fmt::format("an error of {} {}, where {} is the most", number_text(row.error), the_case.unit,
                            number_text(the_case.bound));
  else if (row.naive && within(*row.naive, the_case.bound))
    row.fault =
        fmt::format("the naive way keeps the bound too, with {}: this case shows nothing", number_text(*row.naive));
  return row;
}

std::string stability_text(const std::vector<StabilityRow>& rows) {
  std::vector<std::vector<std::string>> table{{"case", "error", "bound", "unit", "naive", "kept", "claim"}};
  std::string faults, origins;
  for (const StabilityRow& r : rows) {
    table.push_back({r.of->id, number_text(r.error), number_text(r.of->bound), r.of->unit,
                     r.naive ? number_text(*r.naive) : "", r.fault.empty() ? "yes" : "NO", r.of->claim});
    origins += fmt::format("{}: bound from {}\n", r.of->id, r.of->origin);
    if (!r.fault.empty()) faults += fmt::format("{}: {}\n", r.of->id, r.fault);
  }
  return table_text(table) + "\n" + origins + (faults.empty() ? "" : "\n" + faults);
}

Json stability_json(const Machine& machine, const std::vector<StabilityRow>& rows) {
  Json json = {{"machine", machine_json(machine)}, {"commit", build_commit()}};
  json["rows"] = Json::array();
  for (const StabilityRow& r : rows)
    json["rows"].push_back({{"id", r.of->id},
                            {"claim", r.of->claim},
                            {"error", number_or_null(r.error)},
                            {"bound", r.of->bound},
                            {"unit", r.of->unit},
                            {"margin", number_or_null(r.of->bound / std::abs(r.error))},
                            {"met", r.fault.empty()},
                            {"naive", r.naive ? number_or_null(*r.naive) : Json()},
                            {"origin", r.of->origin},
                            {"ms", r.ms},
                            {"fault", r.fault.empty() ? Json() : Json(r.fault)}});
  return json;
}

}  // namespace tools
