/// Two results of `bench run --json`, or two of `bench pareto --json`, or two folders of kept ones: which rows changed
/// for sure.
///
/// Each point of a subject is three rows: its error and its time, as rows of `run`, and its work, which is the same on
/// every machine: 2 % more of it is a regression, unless the error fell.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/bench/report.h"

namespace tools {

struct Change {
  std::string name;  // suite/name
  std::string unit;
  double before = 0, after = 0;
  double gain = 0;  // after/before where higher is better, else before/after: above 1 is better
  bool regression = false;
};

struct Comparison {
  std::vector<Change> changes;           // medians more than 5 % apart (work: 2 %) whose quartile ranges don't overlap
  std::vector<std::string> gone, added;  // rows that one side lacks, or that failed there; a row gone is a regression
  size_t compared = 0;
  bool same_machine = true;
  bool regressed() const;
};

world::Result<Json> read_result(const std::filesystem::path& path);
/// The keys that a result must have; the error names the file and the missing key.
world::Result<Comparison> compare_results(const Json& before, const std::string& before_name, const Json& after,
                                          const std::string& after_name);
std::string comparison_text(const Comparison& comparison);
Json comparison_json(const Comparison& comparison);

}  // namespace tools
