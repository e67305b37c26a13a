/// loam bench stability: hard cases of numbers, each with the bound that it keeps and how far it is from it.
///
/// How to add some: tools/bench/stability/<name>.cpp defines  void add_stability_<name>(std::vector<StabilityCase>&);
/// the folder is the registry. The tests of the same names (tests/stability and others) state more of each case; these
/// are the ones whose margin is a number that a reader wants to see. `naive` is the way that fails: a case in which it
/// keeps the bound is not hard, and its row is a failure.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tools/bench/benchmark.h"
#include "tools/bench/report.h"

namespace tools {

struct StabilityCase {
  std::string id;      // of the catalogue of hard cases: "T1"
  std::string claim;   // one line
  std::string unit;    // of the error
  double bound = 0;    // the error is at most this
  std::string origin;  // where the bound comes from
  std::function<Result<double>(BenchContext&)> error;
  std::function<double()> naive = nullptr;  // the error of the way that fails, where there is one
};

struct StabilityRow {
  const StabilityCase* of = nullptr;
  double error = 0;
  std::optional<double> naive;
  double ms = 0;
  std::string fault;  // empty: kept
};

std::vector<StabilityCase> stability_cases();
StabilityRow run_stability(const StabilityCase& the_case, BenchContext& context);

std::string stability_text(const std::vector<StabilityRow>& rows);
/// {"machine", "commit", "rows": [{id, claim, error, bound, unit, margin, met, naive, origin, ms}]}; margin: bound over
/// error, null where the error is 0.
Json stability_json(const Machine& machine, const std::vector<StabilityRow>& rows);

}  // namespace tools
