/// Results that stay with the code, as text that git shows line by line:
///
///   DIR/<machine>/<suite>.json            a suite of `bench run`, a row a line
///   DIR/<machine>/pareto/<subject>.json   a subject of `bench pareto`, a point a line
///
/// Each file is a result of its own, with machine and commit, which `bench compare` reads; numbers have six digits.
/// Written by `--keep DIR` of both commands, read by `bench document` and by `compare` (of two folders).
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tools/bench/html_report.h"
#include "tools/bench/report.h"
#include "world/base/errors.h"

namespace tools {

/// Rewrites the file of each suite in `rows`; a suite of which rows are missing would be kept in part: an error.
Status keep_rows(const std::filesystem::path& folder, const Machine& machine, const RunOptions& options,
                 const Registry& registry, const std::vector<RowResult>& rows);
/// The same for a subject.
Status keep_subject(const std::filesystem::path& folder, const Machine& machine, const RunOptions& options,
                    const SubjectResult& subject);

/// One row of a suite or one point of a subject.
struct KeptNumber {
  Json item;                         // of "rows", or of "points"
  std::vector<std::string> metrics;  // of a point's subject
  const Json* source = nullptr;      // the file's head: machine, commit, quick
  bool is_point() const { return !metrics.empty(); }
};

class KeptResults {
 public:
  /// Every machine's folder in `folder`.
  static Result<KeptResults> read(const std::filesystem::path& folder);

  std::vector<std::string> machines() const;
  /// By "suite/row" or "subject/setting"; of a method with one setting its name will do. The error says what is missing
  /// and what is nearest.
  Result<const KeptNumber*> find(const std::string& machine, const std::string& name) const;
  /// Every subject by name, from the machine that measured it last.
  Result<std::vector<MeasuredSubject>> subjects() const;
  /// A head of that machine's files: all have the same machine, but not the same commit.
  const Json* head(const std::string& machine) const;

 private:
  struct MachineResults {
    std::vector<std::unique_ptr<Json>> heads;
    std::map<std::string, KeptNumber> numbers;
  };
  struct KeptSubject {
    Json subject;
    const Json* head = nullptr;
  };
  std::filesystem::path folder_;
  std::map<std::string, MachineResults> machines_;
  std::map<std::string, KeptSubject> subjects_;  // the latest of each
};

/// Of all result files of a machine's folder one result, with "rows", "subjects" or both.
Result<Json> merged_result(const std::filesystem::path& folder);

}  // namespace tools
