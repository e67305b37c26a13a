#include "tools/bench/absent.h"

#include <algorithm>
#include <chrono>
#include <exception>

#include <fmt/format.h>

#include "tools/bench/cpu_clock.h"
#include "tools/bench/statistics.h"
#include "world/base/random.h"

namespace tools {

#define ABSENT_CASES(name) void add_absent_##name(std::vector<AbsentCase>&);
#include "tools_bench_absent.list.h"
#undef ABSENT_CASES

std::vector<AbsentCase> absent_cases() {
  std::vector<AbsentCase> cases;
#define ABSENT_CASES(name) add_absent_##name(cases);
#include "tools_bench_absent.list.h"
#undef ABSENT_CASES
  return cases;
}

namespace {

constexpr int kLeastRounds = 3, kMostRounds = 200, kResamples = 500;
/// One pair of scenes can be faster than its twin by a fifth for as long as it lives, by where its memory and the
/// driver's code came to lie: so each case is made anew so often, and what counts is the median of each.
constexpr int kPairs = 7, kPairsQuick = 3;

/// The median of the ratios, and where 95 % of the medians of samples drawn from them lie.
/// source  Bradley Efron. Bootstrap Methods: Another Look at the Jackknife. 1979
void take_interval(const std::vector<double>& ratios, uint64_t seed, AbsentRow& row) {
  row.time_ratio = spread_of(ratios).median;
  std::vector<double> medians;
  for (uint64_t k = 0; k < kResamples; ++k) {
    std::vector<double> drawn;
    for (size_t i = 0; i < ratios.size(); ++i)
      drawn.push_back(ratios[world::hash_combine(world::hash_combine(seed, k), i) % ratios.size()]);
    medians.push_back(spread_of(std::move(drawn)).median);
  }
  std::sort(medians.begin(), medians.end());
  row.low = medians[kResamples / 40], row.high = medians[kResamples - 1 - kResamples / 40];
}

/// What the two runs differ in; empty where in nothing.
std::string difference(const AbsentRun& without, const AbsentRun& with) {
  if (without.hash != with.hash) return "the picture or state is not the same";
  for (const auto& [name, value] : with.counters) {
    const auto found = without.counters.find(name);
    const uint64_t before = found == without.counters.end() ? 0 : found->second;
    if (before != value) return fmt::format("{} is {}, and {} without", name, value, before);
  }
  for (const auto& [name, value] : without.counters)
    if (!with.counters.count(name)) return fmt::format("{} is 0, and {} without", name, value);
  return {};
}

/// The median ratio of rounds of one pair, in processor time, by turns.
Result<double> ratio_of(const AbsentCase::Pair& pair, BenchContext& context, double seconds) {
  const auto start = std::chrono::steady_clock::now();
  std::vector<double> ratios;
  for (int round = 0; round < kMostRounds; ++round) {
    double times[2];
    for (const size_t i : shuffled_order(2, context.seed(), static_cast<uint64_t>(round))) {
      const double before = cpu_seconds(CLOCK_PROCESS_CPUTIME_ID);
      TRY_STATUS((i ? pair.with() : pair.without()));
      times[i] = cpu_seconds(CLOCK_PROCESS_CPUTIME_ID) - before;
    }
    ratios.push_back(times[1] / std::max(times[0], 1e-9));
    const double spent = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (round + 1 >= kLeastRounds && spent > seconds) break;
  }
  return spread_of(std::move(ratios)).median;
}

Status measure(const AbsentCase& the_case, BenchContext& context, double seconds, AbsentRow& row) {
  const int pairs = seconds > 0 ? (context.quick() ? kPairsQuick : kPairs) : 1;
  std::vector<double> ratios;
  for (int i = 0; i < pairs; ++i) {
    TRY(const AbsentCase::Pair pair, the_case.make(context));
    // Once to warm up, and to count.
    TRY(const AbsentRun without, pair.without());
    TRY(const AbsentRun with, pair.with());
    row.passes = with.passes, row.leaves_visited = with.leaves_visited, row.bytes = with.bytes;
    row.fault = difference(without, with);
    row.equal = row.fault.empty();
    if (row.fault.empty() && row.passes + row.leaves_visited + row.bytes > 0)
      row.fault = fmt::format("{} passes, {} leaves, {} bytes of it", row.passes, row.leaves_visited, row.bytes);
    if (!row.fault.empty()) return {};
    if (seconds <= 0) return {};
    TRY(const double ratio, ratio_of(pair, context, seconds / pairs));
    ratios.push_back(ratio);
  }
  take_interval(ratios, context.seed(), row);
  if (row.low > kTimeSlack)
    row.fault = fmt::format("it takes {:.3f} times as long, at least {:.3f}", row.time_ratio, row.low);
  return {};
}

}  // namespace

AbsentRow run_absent(const AbsentCase& the_case, BenchContext& context, double seconds) {
  AbsentRow row;
  row.effect = the_case.effect, row.what = the_case.what;
  try {
    if (const Status status = measure(the_case, context, seconds, row); !status.ok()) {
      row.fault = status.error().message;
      row.no_device = status.error().kind == world::ErrorKind::no_device;
    }
  } catch (const std::exception& e) {
    row.fault = e.what();
  }
  return row;
}

std::string absent_text(const std::vector<AbsentRow>& rows) {
  std::vector<std::vector<std::string>> table{
      {"effect", "passes", "leaves", "bytes", "equal", "time", "95 % from", "to", "scenes"}};
  std::string faults;
  for (const AbsentRow& r : rows) {
    if (r.no_device) {
      table.push_back({r.effect, "no device"});
      continue;
    }
    table.push_back({r.effect, number_text(static_cast<double>(r.passes)),
                     number_text(static_cast<double>(r.leaves_visited)), number_text(static_cast<double>(r.bytes)),
                     r.equal ? "yes" : "NO", fmt::format("{:.3f}", r.time_ratio), fmt::format("{:.3f}", r.low),
                     fmt::format("{:.3f}", r.high), r.what});
    if (!r.fault.empty()) faults += r.effect + ": " + r.fault + "\n";
  }
  return table_text(table) + (faults.empty() ? "" : "\n" + faults);
}

Json absent_json(const Machine& machine, const RunOptions& options, const std::vector<AbsentRow>& rows) {
  Json json = {{"machine", machine_json(machine)}, {"commit", build_commit()}, {"quick", options.quick}};
  json["rows"] = Json::array();
  for (const AbsentRow& r : rows)
    json["rows"].push_back({{"effect", r.effect},
                            {"passes", r.passes},
                            {"leaves_visited", r.leaves_visited},
                            {"bytes", r.bytes},
                            {"equal", r.no_device ? Json() : Json(r.equal)},
                            {"time_ratio", r.time_ratio},
                            {"low", r.low},
                            {"high", r.high},
                            {"what", r.what},
                            {"fault", r.fault.empty() ? Json() : Json(r.fault)},
                            {"no_device", r.no_device}});
  return json;
}

}  // namespace tools
