/// What `loam bench pareto --report DIR` leaves: pages that open without a network.
///
///   report.html   every subject: its plot, its tables, and for each point its picture, its error map and the command
///   accuracy.md   the same tables as text; `loam bench document` writes them from kept results for the project's pages
#pragma once

#include <string>
#include <vector>

#include "tools/bench/machine.h"
#include "tools/bench/runner.h"

namespace tools {

/// Milliseconds that tables are made for: powers of four, and errors: 1 and 3 of a decade, some that lie among a
/// subject's own, from the first that anything keeps to the first that all do.
std::vector<double> budgets_of(const SubjectResult& subject);
std::vector<double> target_errors_of(const SubjectResult& subject);

/// Within one problem of a subject, by medians.
struct Choice {
  std::string problem;
  double asked = 0;                    // ms, or the error
  const PointResult* point = nullptr;  // null: nothing is so fast, or so right
};
/// What is nearest to the reference within each budget.
std::vector<Choice> best_within(const SubjectResult& subject, double budget_ms);
/// What is cheapest with no more than that error.
std::vector<Choice> cheapest_for(const SubjectResult& subject, double error);

/// Fails where a picture can't be written beside the report on its way into it.
world::Result<std::string> html_report(const Machine& machine, const RunOptions& options,
                                       const std::vector<SubjectResult>& subjects);

struct MeasuredSubject {
  SubjectResult result;
  std::string on;  // which machine, when
};
/// by: the command that writes it. Where a subject was measured is said where it isn't where the one before it was.
std::string accuracy_markdown(const std::string& by, const std::vector<MeasuredSubject>& subjects);

}  // namespace tools
