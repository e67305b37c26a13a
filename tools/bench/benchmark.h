/// How to add a benchmark. One file is one member, its name is the file's name, and the folder is the registry:
///
///   tools/bench/suites/<name>.cpp     defines  void add_suite_<name>(Registry&)     rows of `loam bench run <name>`
///   tools/bench/subjects/<name>.cpp   defines  void add_subject_<name>(Registry&)   accuracy against time (pareto)
///
/// CMake lists the files (concept_folder), so nothing else changes when one is added.
/// tests/tools/bench/every_benchmark_test.cpp states what holds for all. A suite in short:
///
///   void add_suite_store(Registry& registry) {
///     registry.add({.name = "leaf_read", .what = "reads every leaf of the valley", .unit = "G voxels/s", .scale = 1e9,
///                   .threads = 1, .reach = Reach{1.0, "where the number comes from"},
///                   .prepare = [](BenchContext& context) -> Result<Prepared> {
///                     TRY(const World* valley, context.world("valley"));
///                     return Prepared{.ours = {"loam", [=] { return read_all(*valley); }},
///                                     .rivals = {{"dense array", [=] { return read_dense(); }}}};
///                   }});
///   }
///
/// The runner warms each contender up, then runs ours and the rivals interleaved in an order drawn from the seed, and
/// reports medians and spread. Nothing here prints or knows the clock.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "render/image/image.h"
#include "world/base/errors.h"
#include "world/world.h"

namespace tools {

using world::Result;
using world::Status;

/// What members share within one run of the command: made on first use, kept until the end.
class BenchContext {
 public:
  BenchContext(bool quick, uint64_t seed);
  ~BenchContext();
  BenchContext(const BenchContext&) = delete;
  BenchContext& operator=(const BenchContext&) = delete;

  bool quick() const { return quick_; }  // less work for the same statement
  uint64_t seed() const { return seed_; }
  /// The world of a scene, built once and read by all: "valley" is 1024 x 256 x 1024.
  Result<const world::World*> world(const std::string& scene);
  /// Whatever else several rows share, by a name of their choice: made where it is missing.
  template <class T>
  std::shared_ptr<T> shared(const std::string& name, const std::function<std::shared_ptr<T>()>& make) {
    std::shared_ptr<void>& slot = shared_[name];
    if (!slot) slot = make();
    return std::static_pointer_cast<T>(slot);
  }
  /// A folder of this run's own, removed at the end.
  Result<std::filesystem::path> scratch();

 private:
  bool quick_;
  uint64_t seed_;
  std::map<std::string, std::unique_ptr<world::World>> worlds_;
  std::map<std::string, std::shared_ptr<void>> shared_;
  std::filesystem::path scratch_;
};

/// Makes the compiler believe that the value is used and that memory has changed.
template <class T>
inline void keep(const T& value) {
  asm volatile("" : : "g"(&value) : "memory");
}

// ---- suites ----

enum class Better { higher, lower };

/// What one call's time is turned into.
enum class Timing {
  rate,          // run() returns the work done;  value = work / seconds / scale
  milliseconds,  // what run() returns is ignored; value = ms of one call / scale (run() may return NaN to fail)
  reported,      // run() returns the value itself: bytes per m^3, or a time that it took from a report
};

/// Thread time leaves out what other programs do to the core; it means nothing where other threads or the disk work.
enum class Clock { automatic /* thread time where threads == 1 */, wall, thread };

/// A number to be met, and where it comes from: an issue's table, a paper, a measurement with its date.
struct Reach {
  double value = 0;
  std::string origin;
  bool times_rival = false;  // of a reach: value is a ratio, to the best rival of the run
};

/// One of those who do the same work. NaN means that the run failed. The runner calls run() several times, and where
/// one call is short many times a repetition. `before` is called, untimed, before each call; it forces one call a
/// repetition.
struct Contender {
  std::string name;
  std::function<double()> run;
  std::function<void()> before = nullptr;
};

/// A row's inputs, ready to run.
struct Prepared {
  Contender ours;
  /// The first is the row's rival, or where the reach is in times_rival the best; the others are printed after it.
  std::vector<Contender> rivals = {};
  /// Deterministic work of one call (faces, bytes, hashes as numbers), bit for bit the same in each run.
  std::function<std::map<std::string, double>()> counters = nullptr;
  /// Whether ours and the rivals give the same answer; an error fails the row.
  std::function<Status()> check = nullptr;
};

struct Bench {
  std::string name;  // unique within its suite; lower_snake_case
  std::string what;  // one line: the work, the input, the sizes
  std::string unit;  // "G voxels/s", "ms", "B/m^3"
  Better better = Better::higher;
  Timing timing = Timing::rate;
  double scale = 1;  // of Timing::rate: 1e6 where the unit says M; of milliseconds: 1e-3 where it says us
  int threads = 0;   // parallel loops are held to this many; 0 = all. 1 is printed as "a core"
  Clock clock = Clock::automatic;
  int repetitions = 0;  // 0 = the runner's usual number
  std::optional<Reach> reach = std::nullopt;
  std::optional<Reach> limit = std::nullopt;  // what the hardware allows at most, where known
  std::function<Result<Prepared>(BenchContext&)> prepare = nullptr;
};

// ---- subjects: accuracy against time ----

/// How far an output lies from the reference: one value for each metric of the subject, in its order. NaN and infinity
/// are kept and drawn as failures.
struct ErrorSample {
  std::vector<double> errors;
  double bias = 0;         // signed, in the unit of the first metric
  double noise_floor = 0;  // of this problem's reference, where that was measured; else the subject's
};

/// One method at one setting of its knobs.
struct Setting {
  std::string method;         // points of one method are joined by a line
  std::string setting;        // "method@knob", unique within the subject
  std::string problem = {};   // points compete only within one problem, e.g. one distance; empty = one for all
  double knob = 0;            // the method's knob as a number, for fitted slopes
  bool is_default = false;    // what Loam ships with; ringed in the plot
  bool is_reference = false;  // what the others are measured against, timed too: no rival of theirs
  bool stochastic = false;    // measured over many seeds, else once
  std::function<ErrorSample(uint64_t seed)> measure = nullptr;
  std::function<double()> run =
      nullptr;  // timed; returns the deterministic work of one call in the subject's work_unit
  std::function<render::Image()> picture = nullptr;  // what it looks like, where it looks like anything: for reports
  std::string command = {};                          // that does the same by hand; empty: the subject's own
};

/// The log-log slope of the first metric over the knob that a method must show, within +-0.1, from a least knob on.
struct ExpectedSlope {
  double slope = 0;
  double from_knob = 0;
};

struct Subject {
  std::string name = {};             // lower_snake_case; by default the file's name
  std::string question;              // one line
  std::string reference;             // closed form, exact arithmetic, or another algorithm in two halves; say which
  std::vector<std::string> metrics;  // two or more, the first is the error axis; with units
  std::string work_unit;             // "transforms", "steps", "rays"
  std::string knob_unit = "knob";    // "samples a pixel": what a setting's knob counts
  double noise_floor = 0;            // of the reference, in the unit of the first metric; 0 = exact, or by sample
  int threads = 1;
  std::map<std::string, ExpectedSlope> expected_slopes = {};  // by method
  std::map<std::string, double> bias_limits =
      {};  // by method: |bias| at its last knob, in the unit of the first metric
  std::function<render::Image()> reference_picture = nullptr;
  std::function<Result<std::vector<Setting>>(BenchContext&)> settings = nullptr;
};

// ---- the registry ----

class Registry {
 public:
  struct Row {
    std::string suite;
    Bench bench;
  };
  void add(Bench bench);
  void add(Subject subject);
  /// The name that add() files under from now on.
  void begin_member(std::string name);

  const std::vector<Row>& rows() const { return rows_; }
  const std::vector<Subject>& subjects() const { return subjects_; }
  std::vector<std::string> suites() const;  // sorted, each once

 private:
  std::string member_;
  std::vector<Row> rows_;
  std::vector<Subject> subjects_;
};

/// Every member of the two folders.
Registry all_benchmarks();

}  // namespace tools
