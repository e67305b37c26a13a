#include "tools/bench/runner.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <limits>

#include "tools/bench/cpu_clock.h"
#include "world/base/jobs.h"

namespace tools {

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr int kMostCalls = 1 << 24;

double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double thread_seconds() { return cpu_seconds(CLOCK_THREAD_CPUTIME_ID); }

struct Repetition {
  double seconds = 0;  // by the row's clock, all calls
  double wall = 0;
  double cpu = 0;       // of all threads of this process
  double returned = 0;  // sum of what the calls returned
};

Repetition repeat(const Contender& contender, int calls, bool thread_clock) {
  if (contender.before) contender.before();
  Repetition r;
  const double cpu = cpu_seconds(CLOCK_PROCESS_CPUTIME_ID);
  const double wall = wall_seconds(), start = thread_clock ? thread_seconds() : wall;
  for (int i = 0; i < calls; ++i) r.returned += contender.run();
  r.seconds = (thread_clock ? thread_seconds() : wall_seconds()) - start;
  r.wall = wall_seconds() - wall;
  r.cpu = cpu_seconds(CLOCK_PROCESS_CPUTIME_ID) - cpu;
  return r;
}

/// Warms a contender up and finds how many calls fill a repetition.
int calibrate(const Contender& contender, double seconds, bool thread_clock, bool once) {
  const Repetition first = repeat(contender, 1, thread_clock);
  if (once || contender.before || !std::isfinite(first.returned) || first.wall >= seconds) return 1;
  int calls = 1;
  while (calls < kMostCalls) {
    const double wall = repeat(contender, calls, thread_clock).wall;
    if (wall >= 0.5 * seconds) return std::clamp(static_cast<int>(calls * seconds / wall), 1, kMostCalls);
    calls *= wall < 0.01 * seconds ? 16 : 2;
  }
  return kMostCalls;
}

double value_of(const Repetition& r, int calls, const Bench& bench) {
  if (!std::isfinite(r.returned)) return kNan;
  if (bench.timing == Timing::reported) return r.returned / calls;
  const double seconds = std::max(r.seconds, 1e-9);  // the clock's grain
  return bench.timing == Timing::rate ? r.returned / seconds / bench.scale : 1e3 * seconds / calls / bench.scale;
}

/// Rounds over all contenders, each round in its own order, until there are enough or time is up.
template <class Run>
void interleave(size_t contenders, const RunOptions& options, int repetitions, Run run) {
  const double start = wall_seconds();
  for (int round = 0; round < repetitions; ++round) {
    for (size_t i : shuffled_order(contenders, options.seed, static_cast<uint64_t>(round))) run(i);
    if (round + 1 >= options.least_repetitions && wall_seconds() - start > options.row_seconds) break;
  }
}

Status measure_row(const Bench& bench, Prepared& prepared, const RunOptions& options, RowResult& result) {
  const world::ThreadLimit limit(bench.threads);
  result.threads = bench.threads > 0 ? bench.threads : world::thread_count();
  result.ours = prepared.ours.name;
  if (prepared.check) TRY_STATUS(prepared.check());

  std::vector<const Contender*> contenders{&prepared.ours};
  for (const Contender& rival : prepared.rivals) contenders.push_back(&rival);
  const bool once = bench.timing == Timing::reported;
  std::vector<int> calls;
  for (const Contender* c : contenders)
    calls.push_back(calibrate(*c, options.repetition_seconds, result.thread_clock, once));
  result.calls = calls[0];

  std::vector<std::vector<double>> values(contenders.size());
  const int repetitions = bench.repetitions > 0 ? bench.repetitions : options.repetitions;
  std::vector<double> cpu_ms;
  interleave(contenders.size(), options, repetitions, [&](size_t i) {
    const Repetition r = repeat(*contenders[i], calls[i], result.thread_clock);
    values[i].push_back(value_of(r, calls[i], bench));
    if (i == 0) cpu_ms.push_back(1e3 * r.cpu / calls[i]);
  });
  result.cpu_ms = spread_of(cpu_ms).median;

  result.value = spread_of(values[0]);
  for (size_t i = 1; i < contenders.size(); ++i) result.rivals.push_back({contenders[i]->name, spread_of(values[i])});
  const bool higher = bench.better == Better::higher, times_rival = bench.reach && bench.reach->times_rival;
  if (times_rival) {
    if (result.rivals.empty()) return world::input_error("the reach is a ratio to a rival, and the row has none");
    const auto best = std::min_element(
        result.rivals.begin(), result.rivals.end(), [&](const ContenderResult& a, const ContenderResult& b) {
          if (std::isnan(a.value.median) || std::isnan(b.value.median)) return !std::isnan(a.value.median);
          return higher ? a.value.median > b.value.median : a.value.median < b.value.median;
        });
    const auto index = best - result.rivals.begin();
    std::rotate(result.rivals.begin(), best, best + 1);
    std::rotate(values.begin() + 1, values.begin() + 1 + index, values.begin() + 2 + index);
  }
  if (!result.rivals.empty()) {
    std::vector<double> ratios;
    for (size_t i = 0; i < values[0].size(); ++i)
      ratios.push_back(higher ? values[0][i] / values[1][i] : values[1][i] / values[0][i]);
    result.ratio = spread_of(ratios);
  }
  if (std::isnan(result.value.median)) return world::input_error("a repetition failed");
  if (times_rival)
    result.met = result.ratio->median >= bench.reach->value;
  else if (bench.reach)
    result.met = higher ? result.value.median >= bench.reach->value : result.value.median <= bench.reach->value;
  if (prepared.counters) result.counters = prepared.counters();
  return {};
}

}  // namespace

RowResult run_row(const Registry::Row& row, BenchContext& context, const RunOptions& options) {
  const Bench& bench = row.bench;
  RowResult result;
  result.suite = row.suite, result.name = bench.name, result.what = bench.what, result.unit = bench.unit;
  result.better = bench.better, result.reach = bench.reach, result.limit = bench.limit;
  result.thread_clock = bench.clock == Clock::thread || (bench.clock == Clock::automatic && bench.threads == 1);
  if (bench.reach) result.met = false;
  const auto fail = [&](const world::Error& error) {
    result.error = error.message, result.no_device = error.kind == world::ErrorKind::no_device;
    if (result.no_device) result.met.reset();
  };
  try {  // a rival's library may throw; one row must not end the run
    Result<Prepared> prepared = bench.prepare(context);
    if (!prepared) {
      fail(prepared.error());
      return result;
    }
    if (const Status measured = measure_row(bench, *prepared, options, result); !measured.ok()) fail(measured.error());
  } catch (const std::exception& e) {
    fail(world::input_error(e.what()));
  }
  return result;
}

namespace {

void measure_errors(const Subject& subject, const std::vector<Setting>& settings, const RunOptions& options,
                    SubjectResult& result) {
  const int many = options.quick ? 4 : 16;
  for (const Setting& setting : settings) {
    PointResult point;
    point.method = setting.method, point.setting = setting.setting, point.problem = setting.problem;
    point.knob = setting.knob, point.is_default = setting.is_default;
    point.is_reference = setting.is_reference;
    point.command = setting.command.empty() ? "loam bench pareto --subject " + subject.name : setting.command;
    if (options.pictures && setting.picture) point.picture = setting.picture();
    std::vector<std::vector<double>> errors(subject.metrics.size());
    std::vector<double> biases;
    point.noise_floor = subject.noise_floor;
    for (int i = 0; i < (setting.stochastic ? many : 1); ++i) {
      const ErrorSample sample = setting.measure(options.seed + static_cast<uint64_t>(i));
      for (size_t m = 0; m < errors.size(); ++m)
        errors[m].push_back(m < sample.errors.size() ? sample.errors[m] : kNan);
      biases.push_back(sample.bias);
      point.noise_floor = std::max(point.noise_floor, sample.noise_floor);
    }
    for (auto& e : errors) point.errors.push_back(spread_of(std::move(e)));
    point.bias = spread_of(std::move(biases)).median;
    result.points.push_back(std::move(point));
  }
}

void measure_times(const std::vector<Setting>& settings, const RunOptions& options, SubjectResult& result) {
  const world::ThreadLimit limit(result.threads);
  const bool thread_clock = result.threads == 1;
  std::vector<Contender> contenders;
  std::vector<int> calls;
  for (const Setting& setting : settings) {
    contenders.push_back({setting.setting, setting.run});
    calls.push_back(calibrate(contenders.back(), options.repetition_seconds / 4, thread_clock, false));
  }
  // Two more calls than calibration made: three are thrown away.
  for (size_t i = 0; i < settings.size(); ++i)
    for (int warm = 0; warm < 2; ++warm) result.points[i].work = settings[i].run();
  std::vector<std::vector<double>> ms(settings.size());
  interleave(settings.size(), options, std::max(options.repetitions, options.quick ? 3 : 9), [&](size_t i) {
    const Repetition r = repeat(contenders[i], calls[i], thread_clock);
    ms[i].push_back(std::isfinite(r.returned) ? 1e3 * r.seconds / calls[i] : kNan);
  });
  for (size_t i = 0; i < settings.size(); ++i) result.points[i].ms = spread_of(std::move(ms[i]));
}

void rank(SubjectResult& result) {
  for (PointResult& p : result.points) {
    p.failed = !std::isfinite(p.ms.median);
    for (const Spread& e : p.errors) p.failed |= !std::isfinite(e.median);
    p.below_floor = !p.failed && p.noise_floor > 0 && p.errors[0].median < 3 * p.noise_floor;
  }
  std::map<std::string, std::vector<size_t>> problems;
  for (size_t i = 0; i < result.points.size(); ++i) problems[result.points[i].problem].push_back(i);
  for (const auto& [problem, indices] : problems) {
    std::vector<double> costs, spreads, works;
    std::vector<std::vector<double>> errors(result.metrics.size());
    for (size_t i : indices) {
      const PointResult& p = result.points[i];
      const bool ranked = !p.failed && !p.below_floor && !p.is_reference;
      costs.push_back(ranked ? p.ms.median : kNan);
      spreads.push_back(p.ms.iqr());
      works.push_back(ranked ? p.work : kNan);
      for (size_t m = 0; m < errors.size(); ++m) errors[m].push_back(ranked ? p.errors[m].median : kNan);
    }
    const std::vector<bool> front = pareto_front(errors[0], costs);
    for (size_t k = 0; k < indices.size(); ++k) {
      PointResult& p = result.points[indices[k]];
      p.front = front[k];
      if (!p.is_default || p.below_floor) continue;
      const auto on_front_by = [&](const std::vector<double>& cost, const std::vector<double>& spread) {
        return std::any_of(errors.begin(), errors.end(), [&](const std::vector<double>& metric) {
          return !dominated_beyond(metric, cost, k, 0.05, spread);
        });
      };
      p.default_on_front = on_front_by(costs, spreads);
      p.default_on_work_front = on_front_by(works, {});
    }
  }
}

void fit_slopes(const Subject& subject, SubjectResult& result) {
  for (const auto& [method, expected] : subject.expected_slopes) {
    std::vector<double> knobs, errors;
    for (const PointResult& p : result.points)
      if (p.method == method && !p.failed && !p.below_floor && p.knob >= expected.from_knob)
        knobs.push_back(p.knob), errors.push_back(p.errors[0].median);
    SlopeResult slope{method, expected.slope, log_log_slope(knobs, errors), false};
    slope.met = slope.fitted && std::abs(*slope.fitted - expected.slope) <= 0.1;
    result.slopes.push_back(slope);
  }
}

/// At the method's largest knob, where its approximation is smallest: the largest over all problems.
void check_biases(const Subject& subject, SubjectResult& result) {
  for (const auto& [method, limit] : subject.bias_limits) {
    double last = -std::numeric_limits<double>::infinity(), bias = kNan;
    for (const PointResult& p : result.points) {
      if (p.method != method || p.knob < last) continue;
      bias = p.knob > last || std::abs(p.bias) > std::abs(bias) ? p.bias : bias;
      last = p.knob;
    }
    result.biases.push_back({method, limit, bias, std::abs(bias) <= limit});
  }
}

}  // namespace

bool SubjectResult::gates_met() const {
  const auto met = [](const auto& r) { return r.met; };
  return error.empty() && std::all_of(slopes.begin(), slopes.end(), met) &&
         std::all_of(biases.begin(), biases.end(), met) &&
         std::all_of(points.begin(), points.end(), [](const PointResult& p) {
           return p.default_on_front.value_or(true) || p.default_on_work_front.value_or(true);
         });
}

SubjectResult run_subject(const Subject& subject, BenchContext& context, const RunOptions& options) {
  SubjectResult result;
  result.name = subject.name, result.question = subject.question, result.reference = subject.reference;
  result.work_unit = subject.work_unit, result.knob_unit = subject.knob_unit, result.metrics = subject.metrics,
  result.noise_floor = subject.noise_floor;
  result.threads = subject.threads > 0 ? subject.threads : world::thread_count();
  try {
    Result<std::vector<Setting>> settings = subject.settings(context);
    if (!settings) {
      result.error = settings.error().message;
      return result;
    }
    measure_errors(subject, *settings, options, result);
    measure_times(*settings, options, result);
    if (options.pictures && subject.reference_picture) result.reference_picture = subject.reference_picture();
  } catch (const std::exception& e) {
    result.error = e.what();
    return result;
  }
  rank(result);
  fit_slopes(subject, result);
  check_biases(subject, result);
  return result;
}

}  // namespace tools
