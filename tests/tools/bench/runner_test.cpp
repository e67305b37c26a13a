#include "tools/bench/runner.h"

#include <chrono>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tools/bench/report.h"
#include "world/base/jobs.h"

namespace tools {

namespace {

RunOptions brief() {
  RunOptions options = RunOptions::quick_run();
  options.repetition_seconds = 1e-5, options.row_seconds = 1;
  return options;
}

Registry::Row reported_row(double value, Better better, std::optional<Reach> reach, double rival = 1) {
  Bench bench{.name = "row",
              .what = "a number",
              .unit = "things",
              .better = better,
              .timing = Timing::reported,
              .reach = reach,
              .prepare = [=](BenchContext&) -> Result<Prepared> {
                return Prepared{.ours = {"loam", [=] { return value; }}, .rivals = {{"rival", [=] { return rival; }}}};
              }};
  return {"suite", bench};
}

void spin(double seconds) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (std::chrono::steady_clock::now() < end) {
  }
}

}  // namespace

TEST(BenchRunner, ReachIsMetInTheDirectionThatIsBetter) {
  BenchContext context(true, 1);
  const auto met = [&](double value, Better better) {
    return run_row(reported_row(value, better, Reach{10, "here"}), context, brief()).met;
  };
  EXPECT_EQ(met(11, Better::higher), true);
  EXPECT_EQ(met(10, Better::higher), true);
  EXPECT_EQ(met(9, Better::higher), false);
  EXPECT_EQ(met(11, Better::lower), false);
  EXPECT_EQ(met(9, Better::lower), true);
  EXPECT_EQ(run_row(reported_row(1, Better::lower, std::nullopt), context, brief()).met, std::nullopt);
}

TEST(BenchRunner, RatioAboveOneIsBetterWhicheverWayBetterPoints) {
  BenchContext context(true, 1);
  EXPECT_DOUBLE_EQ(run_row(reported_row(8, Better::higher, {}, 2), context, brief()).ratio->median, 4);
  EXPECT_DOUBLE_EQ(run_row(reported_row(8, Better::lower, {}, 2), context, brief()).ratio->median, 0.25);
}

TEST(BenchRunner, ReachInTimesTheRivalIsARatioToTheBestOfThem) {
  BenchContext context(true, 1);
  const auto run = [&](double value, Better better, std::vector<double> rivals) {
    Registry::Row row = reported_row(value, better, Reach{2, "twice the best", true});
    row.bench.prepare = [=](BenchContext&) -> Result<Prepared> {
      Prepared prepared{.ours = {"loam", [=] { return value; }}};
      for (double rival : rivals) prepared.rivals.push_back({fmt::format("{}", rival), [=] { return rival; }});
      return prepared;
    };
    return run_row(row, context, brief());
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const RowResult reached = run(10, Better::higher, {1, 5, nan, 3});
  EXPECT_EQ(reached.met, true);
  EXPECT_EQ(reached.ratio->median, 2);
  ASSERT_EQ(reached.rivals.size(), 4u);
  EXPECT_EQ(reached.rivals[0].name, "5");  // the best comes first, the others keep their order
  EXPECT_EQ(reached.rivals[1].name, "1");
  EXPECT_EQ(reached.rivals[3].name, "3");
  EXPECT_EQ(run(9.9, Better::higher, {1, 5}).met, false);
  EXPECT_EQ(run(1.5, Better::lower, {9, 3, 4}).met, true);
  EXPECT_EQ(run(1.6, Better::lower, {9, 3, 4}).met, false);
  EXPECT_EQ(run(10, Better::higher, {nan}).met, false);
  EXPECT_NE(run(10, Better::higher, {}).error, "");

  const Json json = Json::parse(run_json(this_machine(), brief(), {reached}).dump())["rows"][0];
  EXPECT_EQ(json["reach"], 10);  // in the row's unit, as for other rows
  EXPECT_EQ(json["reach_times_rival"], 2);
  EXPECT_EQ(json["rival_value"], 5);
}

TEST(BenchRunner, OursAndRivalsInterleaveInAnOrderThatTheSeedFixes) {
  const auto order_of = [](uint64_t seed) {
    std::string order;
    Bench bench{.name = "row",
                .what = "order",
                .unit = "things",
                .timing = Timing::reported,
                .prepare = [&](BenchContext&) -> Result<Prepared> {
                  return Prepared{
                      .ours = {"a", [&] { return order += 'a', 1.0; }},
                      .rivals = {{"b", [&] { return order += 'b', 1.0; }}, {"c", [&] { return order += 'c', 1.0; }}}};
                }};
    BenchContext context(true, seed);
    RunOptions options = brief();
    options.seed = seed, options.repetitions = 12;
    run_row({"suite", bench}, context, options);
    return order;
  };
  const std::string first = order_of(1);
  EXPECT_EQ(first, order_of(1));
  EXPECT_NE(first, order_of(2));
  ASSERT_EQ(first.size(), 3u + 36u);  // one warm-up each, then twelve rounds
  for (size_t round = 0; round < 12; ++round) {
    const std::string part = first.substr(3 + 3 * round, 3);
    for (char c : {'a', 'b', 'c'}) EXPECT_NE(part.find(c), std::string::npos) << "round " << round;
  }
}

TEST(BenchRunner, WarmUpIsNotCounted) {
  int calls = 0;
  Bench bench{.name = "row",
              .what = "a first call that is another number",
              .unit = "things",
              .timing = Timing::reported,
              .prepare = [&](BenchContext&) -> Result<Prepared> {
                return Prepared{.ours = {"loam", [&] { return calls++ == 0 ? 1e9 : 5.0; }}};
              }};
  BenchContext context(true, 1);
  const RowResult result = run_row({"suite", bench}, context, brief());
  EXPECT_EQ(result.value.maximum, 5);
}

TEST(BenchRunner, ShortCallsAreRepeatedAndARateIsWorkOverTime) {
  Bench bench{.name = "row",
              .what = "waits 10 us for 1000 things",
              .unit = "k things/s",
              .scale = 1e3,
              .clock = Clock::wall,
              .prepare = [](BenchContext&) -> Result<Prepared> {
                return Prepared{.ours = {"loam", [] { return spin(1e-5), 1000.0; }}};
              }};
  BenchContext context(true, 1);
  RunOptions options = brief();
  options.repetition_seconds = 0.2, options.repetitions = 1;  // far above what a busy machine takes from one call
  const RowResult result = run_row({"suite", bench}, context, options);
  EXPECT_GT(result.calls, 1);
  // 1000 things in 10 us are 100,000 k things/s; a call never takes less, and on a busy machine it takes more.
  EXPECT_LE(result.value.maximum, 100'001);
  EXPECT_GT(result.value.maximum, 0);
}

TEST(BenchRunner, BeforeRunsUntimedBeforeEachCall) {
  int prepared = 0, run = 0;
  bool in_step = true;
  Bench bench{
      .name = "row",
      .what = "needs a fresh input",
      .unit = "ms",
      .better = Better::lower,
      .timing = Timing::milliseconds,
      .prepare = [&](BenchContext&) -> Result<Prepared> {
        return Prepared{.ours = {"loam", [&] { return in_step &= prepared == ++run, 0.0; }, [&] { ++prepared; }}};
      }};
  BenchContext context(true, 1);
  EXPECT_EQ(run_row({"suite", bench}, context, brief()).error, "");
  EXPECT_GT(run, 1);
  EXPECT_TRUE(in_step);
}

TEST(BenchRunner, RowHoldsParallelLoopsToItsThreads) {
  Bench bench{.name = "row",
              .what = "asks for the threads",
              .unit = "threads",
              .timing = Timing::reported,
              .threads = 1,
              .prepare = [](BenchContext&) -> Result<Prepared> {
                return Prepared{.ours = {"loam", [] { return double(world::thread_count()); }}};
              }};
  BenchContext context(true, 1);
  const RowResult result = run_row({"suite", bench}, context, brief());
  EXPECT_EQ(result.threads, 1);
  EXPECT_EQ(result.value.maximum, 1);
  EXPECT_TRUE(result.thread_clock);
}

TEST(BenchRunner, FailuresAreRowsNeverSilence) {
  BenchContext context(true, 1);
  const auto error_of = [&](std::function<Result<Prepared>(BenchContext&)> prepare) {
    Bench bench{.name = "row", .what = "fails", .unit = "x", .reach = Reach{1, "here"}, .prepare = prepare};
    return run_row({"suite", bench}, context, brief());
  };
  EXPECT_EQ(error_of([](BenchContext&) -> Result<Prepared> { return world::input_error("no input"); }).error,
            "no input");
  EXPECT_EQ(error_of([](BenchContext&) -> Result<Prepared> { throw std::runtime_error("thrown"); }).error, "thrown");
  const RowResult nan = error_of([](BenchContext&) -> Result<Prepared> {
    return Prepared{.ours = {"loam", [] { return std::nan(""); }}};
  });
  EXPECT_NE(nan.error, "");
  EXPECT_EQ(nan.met, false);
  const RowResult differs = error_of([](BenchContext&) -> Result<Prepared> {
    return Prepared{.ours = {"loam", [] { return 1.0; }},
                    .check = []() -> Status { return world::input_error("hashes differ"); }};
  });
  EXPECT_EQ(differs.error, "hashes differ");
  EXPECT_EQ(differs.met, false);
  const RowResult no_device = error_of([](BenchContext&) -> Result<Prepared> {
    return world::Error{world::ErrorKind::no_device, "no driver"};
  });
  EXPECT_TRUE(no_device.no_device);
  EXPECT_EQ(no_device.met, std::nullopt);
}

TEST(BenchRunner, RunJsonHasTheKeysThatAreReliedOn) {
  BenchContext context(true, 1);
  const RowResult row = run_row(reported_row(8, Better::higher, Reach{10, "here"}, 2), context, brief());
  const RowResult failed = run_row(
      {"suite", Bench{.name = "failed",
                      .what = "fails",
                      .unit = "x",
                      .prepare = [](BenchContext&) -> Result<Prepared> { return world::input_error("no input"); }}},
      context, brief());
  const Json json = Json::parse(run_json(this_machine(), brief(), {row, failed}).dump());
  for (const char* key : {"machine", "commit", "rows"}) EXPECT_TRUE(json.contains(key)) << key;
  for (const char* key : {"cpu", "cores", "simd", "memory_bytes", "kernel", "compiler", "load_average"})
    EXPECT_TRUE(json["machine"].contains(key)) << key;
  ASSERT_EQ(json["rows"].size(), 2u);
  for (const Json& item : json["rows"])
    for (const char* key :
         {"suite", "name", "value", "unit", "better", "rival", "rival_value", "ratio", "reach", "met"})
      EXPECT_TRUE(item.contains(key)) << key;
  EXPECT_EQ(json["rows"][0]["value"], 8);
  EXPECT_EQ(json["rows"][0]["better"], "higher");
  EXPECT_EQ(json["rows"][0]["rival_value"], 2);
  EXPECT_EQ(json["rows"][0]["ratio"], 4);
  EXPECT_EQ(json["rows"][0]["met"], false);
  EXPECT_TRUE(json["rows"][1]["value"].is_null());
  EXPECT_EQ(json["rows"][1]["error"], "no input");
}

namespace {

Setting setting(const std::string& method, double knob, double error, double seconds) {
  Setting s{.method = method, .setting = method + "@" + std::to_string(int(knob)), .knob = knob};
  s.measure = [=](uint64_t) { return ErrorSample{{error, error / 2}, -error}; };
  s.run = [=] { return spin(seconds), 100 * knob; };
  return s;
}

}  // namespace

TEST(BenchRunner, SubjectRanksItsPointsAndKeepsFailures) {
  Subject subject{.name = "square",
                  .question = "which method?",
                  .reference = "closed form",
                  .metrics = {"worst, m", "mean, m"},
                  .work_unit = "steps",
                  .expected_slopes = {{"first", {-1}}, {"second", {-1}}}};
  subject.settings = [](BenchContext&) -> Result<std::vector<Setting>> {
    std::vector<Setting> all;
    for (double n : {1.0, 2.0, 4.0}) all.push_back(setting("first", n, 1 / n, 2e-4 * n));
    for (double n : {1.0, 2.0, 4.0}) all.push_back(setting("second", n, 2 / (n * n), 0.0199 * n));  // dearer and worse
    all.push_back(setting("broken", 1, std::numeric_limits<double>::quiet_NaN(), 1e-6));
    all[0].is_default = true, all[5].is_default = true;
    all.push_back(setting("exact", 1, 0, 1e-5));
    all.back().is_reference = true;  // better than all, and no rival of any
    return all;
  };
  BenchContext context(true, 1);
  const SubjectResult result = run_subject(subject, context, brief());
  ASSERT_EQ(result.error, "");
  ASSERT_EQ(result.points.size(), 8u);
  EXPECT_TRUE(result.points[0].front);
  EXPECT_FALSE(result.points[3].front);
  EXPECT_FALSE(result.points[4].front);
  EXPECT_TRUE(result.points[5].front);  // error 2/16 is the least of all
  EXPECT_EQ(result.points[0].default_on_front, true);
  EXPECT_TRUE(result.points[6].failed);
  EXPECT_FALSE(result.points[6].front);
  EXPECT_FALSE(result.points[7].front);
  EXPECT_EQ(result.points[2].work, 400);
  EXPECT_EQ(result.points[2].bias, -0.25);
  ASSERT_EQ(result.slopes.size(), 2u);
  EXPECT_NEAR(*result.slopes[0].fitted, -1, 1e-9);
  EXPECT_TRUE(result.slopes[0].met);
  EXPECT_NEAR(*result.slopes[1].fitted, -2, 1e-9);
  EXPECT_FALSE(result.slopes[1].met);

  const Json json = Json::parse(pareto_json(this_machine(), brief(), {result}).dump());
  for (const char* key : {"name", "reference", "metric", "points"})
    EXPECT_TRUE(json["subjects"][0].contains(key)) << key;
  EXPECT_EQ(json["subjects"][0]["metric"], "worst, m");
  for (const Json& point : json["subjects"][0]["points"])
    for (const char* key : {"setting", "error", "bias", "work", "ms", "spread"})
      EXPECT_TRUE(point.contains(key)) << key;
  EXPECT_TRUE(json["subjects"][0]["points"][6]["error"].is_null());
  EXPECT_EQ(json["subjects"][0]["points"][6]["failed"], true);
}

TEST(BenchRunner, PointsNearerThanThreeNoiseFloorsAreNotRanked) {
  Subject subject{
      .name = "noisy", .question = "?", .reference = "two halves", .metrics = {"rmse"}, .work_unit = "rays"};
  subject.noise_floor = 0.1;
  subject.settings = [](BenchContext&) -> Result<std::vector<Setting>> {
    std::vector<Setting> all{setting("a", 1, 0.29, 1e-5), setting("a", 2, 0.31, 1e-4)};
    return all;
  };
  BenchContext context(true, 1);
  const SubjectResult result = run_subject(subject, context, brief());
  EXPECT_TRUE(result.points[0].below_floor);
  EXPECT_FALSE(result.points[0].front);
  EXPECT_FALSE(result.points[1].below_floor);
  EXPECT_TRUE(result.points[1].front);
}

TEST(BenchRunner, StochasticSettingsAreMeasuredOverManySeeds) {
  Subject subject{
      .name = "dice", .question = "?", .reference = "closed form", .metrics = {"error"}, .work_unit = "rolls"};
  int calls = 0;
  subject.settings = [&](BenchContext&) -> Result<std::vector<Setting>> {
    Setting s = setting("roll", 1, 0, 1e-5);
    s.stochastic = true;
    s.measure = [&](uint64_t seed) { return ++calls, ErrorSample{{double(seed)}, 0}; };
    return std::vector<Setting>{s};
  };
  BenchContext context(false, 1);
  RunOptions options = brief();
  options.quick = false, options.repetitions = 3;
  const SubjectResult result = run_subject(subject, context, options);
  EXPECT_EQ(calls, 16);
  EXPECT_DOUBLE_EQ(result.points[0].errors[0].median, 8.5);  // of seeds 1 .. 16
}

}  // namespace tools
