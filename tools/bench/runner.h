/// Runs rows and subjects: warm-up, then ours and the rivals interleaved in a random order drawn from a seed.
///
/// Who may call it: the verb and the tests. It prints nothing but calls `progress`.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tools/bench/benchmark.h"
#include "tools/bench/statistics.h"

namespace tools {

struct RunOptions {
  bool quick = false;
  uint64_t seed = 1;
  /// Least time of one repetition; short calls are repeated to fill it, so that the clock's grain does not show.
  double repetition_seconds = 0.05;
  /// Repetitions stop here once there are enough of them.
  double row_seconds = 12;
  int repetitions = 11, least_repetitions = 3;
  bool pictures = false;  // of subjects: made too, for a report
  std::function<void(size_t done, size_t total, const std::string& what)> progress;

  static RunOptions quick_run() {
    RunOptions options;
    options.quick = true, options.repetition_seconds = 0.01, options.row_seconds = 2, options.repetitions = 5;
    return options;
  }
};

struct ContenderResult {
  std::string name;
  Spread value;
};

struct RowResult {
  std::string suite, name, what, unit;
  Better better = Better::higher;
  int threads = 0;  // that parallel loops were held to
  bool thread_clock = false;
  std::string ours;  // name of our contender
  Spread value;
  std::vector<ContenderResult> rivals;
  /// How many times better than the first rival, paired by repetition: above 1 is better, whichever way `better`
  /// points.
  std::optional<Spread> ratio;
  std::optional<Reach> reach, limit;
  std::optional<bool> met;  // the median, or that of the ratio, against the reach
  /// Processor time of one call of ours, all threads of this process: what a busy machine does not stretch much.
  double cpu_ms = 0;
  std::map<std::string, double> counters;
  int calls = 1;           // in one repetition
  std::string error;       // empty: fine
  bool no_device = false;  // the error says that this machine lacks what the row needs
};

RowResult run_row(const Registry::Row& row, BenchContext& context, const RunOptions& options);

struct PointResult {
  std::string method, setting, problem;
  double knob = 0;
  bool is_default = false, is_reference = false;
  std::vector<Spread> errors;  // one for each metric
  double bias = 0;             // median over seeds
  double noise_floor = 0;      // of its problem's reference
  double work = 0;             // deterministic, of one call
  Spread ms;                   // of one call
  bool failed = false;         // an error or a time that is not finite
  bool below_floor = false;    // nearer to the reference than three of its noise floors: not ranked
  bool front = false;          // nothing beats it on (first metric, median ms) within its problem
  std::string command;         // that measures it again
  std::optional<render::Image> picture;
  /// Defaults only: on the front of its problem, within 5 %, by some metric.
  std::optional<bool> default_on_front;
  std::optional<bool> default_on_work_front;  // by work in the place of ms, which is the same on every machine
};

struct SlopeResult {
  std::string method;
  double expected = 0;
  std::optional<double> fitted;
  bool met = false;  // within +-0.1
};

/// The bias that a method keeps at its last knob.
struct BiasResult {
  std::string method;
  double limit = 0, bias = 0;
  bool met = false;
};

struct SubjectResult {
  std::string name, question, reference, work_unit, knob_unit;
  std::vector<std::string> metrics;
  double noise_floor = 0;  // declared
  int threads = 1;
  std::vector<PointResult> points;
  std::vector<SlopeResult> slopes;
  std::vector<BiasResult> biases;
  std::optional<render::Image> reference_picture;
  std::string error;
  /// Whether it ran, and every slope, bias and default is as declared: what stops a build.
  bool gates_met() const;
};

SubjectResult run_subject(const Subject& subject, BenchContext& context, const RunOptions& options);

}  // namespace tools
