// What `loam bench pareto` demands of subjects, on those that take little time, where it stops a build: slopes, biases,
// defaults that nothing beats by work, and no more work for the same error than tests/golden/subjects.json says. Times
// are not looked at.
#include <algorithm>
#include <cstdlib>
#include <fstream>

#include <gtest/gtest.h>

#include "tests/tools/command.h"
#include "tools/bench/bench_verb.h"
#include "tools/bench/compare.h"
#include "tools/bench/report.h"

namespace tools {

namespace {

const std::filesystem::path kGolden = std::filesystem::path(LOAM_SOURCE_DIR) / "tests/golden/subjects.json";

const std::vector<std::string> kSubjects{"area_light_samples", "body_time_step", "depth_format",      "dam_break",
                                         "dam_break_wet",      "fog_marching",   "film_accumulation", "grid_walk",
                                         "integrators",        "particle_count", "position_formats",  "u_tube"};

const std::vector<SubjectResult>& quick_results() {
  static const std::vector<SubjectResult> results = [] {
    RunOptions once = RunOptions::quick_run();
    once.repetition_seconds = once.row_seconds = 0, once.repetitions = once.least_repetitions = 1;
    BenchContext context(true, once.seed);
    std::vector<SubjectResult> made;
    const auto subjects = select_subjects(all_benchmarks(), kSubjects);
    for (const Subject& subject : subjects.value()) made.push_back(run_subject(subject, context, once));
    return made;
  }();
  return results;
}

/// What is the same on every machine.
Json work_of(const std::vector<SubjectResult>& results) {
  Json json = {{"subjects", Json::array()}};
  for (const SubjectResult& r : results) {
    Json points = Json::array();
    for (const PointResult& p : r.points)
      points.push_back(
          {{"problem", p.problem}, {"setting", p.setting}, {"error", p.errors[0].median}, {"work", p.work}});
    json["subjects"].push_back({{"name", r.name}, {"points", points}});
  }
  return json;
}

std::vector<std::string> regressions(const Json& golden, const Json& now) {
  std::vector<std::string> names;
  const auto comparison = compare_results(golden, "golden", now, "now");
  EXPECT_TRUE(comparison.ok());
  for (const Change& c : comparison->changes)
    if (c.regression) names.push_back(c.name);
  names.insert(names.end(), comparison->gone.begin(), comparison->gone.end());
  return names;
}

}  // namespace

TEST(BenchGates, QuickSubjectsKeepTheirSlopesAndBiases) {
  for (const SubjectResult& r : quick_results()) {
    EXPECT_EQ(r.error, "") << r.name;
    for (const SlopeResult& s : r.slopes)
      EXPECT_TRUE(s.met) << r.name << ": slope of " << s.method << " is " << s.fitted.value_or(0) << ", declared "
                         << s.expected;
    for (const BiasResult& b : r.biases) EXPECT_TRUE(b.met) << r.name << ": bias of " << b.method << ' ' << b.bias;
  }
}

TEST(BenchGates, WhatShipsIsBeatenByNothingThatWorksLess) {
  for (const SubjectResult& r : quick_results()) {
    if (r.name.rfind("dam_break", 0) == 0) continue;  // a voxel of waves takes longer than one without
    for (const PointResult& p : r.points)
      EXPECT_TRUE(p.default_on_work_front.value_or(true)) << r.name << ' ' << p.setting;
  }
}

TEST(BenchGates, NoMoreWorkIsDoneForTheSameError) {
  const Json now = work_of(quick_results());
  if (std::getenv("LOAM_REMAKE_GOLDEN")) {
    std::ofstream out(kGolden);
    out << "{\"subjects\": [";
    for (size_t i = 0; i < now["subjects"].size(); ++i) {
      const Json& subject = now["subjects"][i];
      out << (i ? ",\n" : "\n") << "{\"name\": " << subject["name"].dump() << ", \"points\": [";
      for (size_t p = 0; p < subject["points"].size(); ++p) out << (p ? ",\n " : "\n ") << subject["points"][p].dump();
      out << "]}";
    }
    out << "\n]}\n";
    GTEST_SKIP() << kGolden << " was written";
  }
  const auto golden = read_result(kGolden);
  ASSERT_TRUE(golden.ok()) << golden.error().message;
  EXPECT_EQ(regressions(*golden, now), std::vector<std::string>{})
      << "if that is meant, LOAM_REMAKE_GOLDEN=1 writes " << kGolden;
}

// Controls: each gate must see what it is there for.

TEST(BenchGates, AMethodOfAnotherOrderIsFound) {
  const auto subjects = select_subjects(all_benchmarks(), {"integrators"});
  ASSERT_TRUE(subjects.ok());
  Subject subject = subjects->front();
  ASSERT_FALSE(subject.expected_slopes.empty());
  for (auto& [method, slope] : subject.expected_slopes) slope.slope -= 0.3;
  RunOptions once = RunOptions::quick_run();
  once.repetition_seconds = once.row_seconds = 0;
  BenchContext context(true, once.seed);
  const SubjectResult wrong = run_subject(subject, context, once);
  EXPECT_TRUE(std::none_of(wrong.slopes.begin(), wrong.slopes.end(), [](const SlopeResult& s) { return s.met; }));
  EXPECT_FALSE(wrong.gates_met());
}

TEST(BenchGates, AHundredthMoreWorkPassesAndThreeDoNot) {
  const Json golden = work_of(quick_results());
  const auto with = [&](double work, double error) {
    Json json = golden;
    Json& point = json["subjects"][0]["points"][0];
    point["work"] = point["work"].get<double>() * work, point["error"] = point["error"].get<double>() * error;
    return regressions(golden, json).size();
  };
  EXPECT_EQ(with(1, 1), 0u);
  EXPECT_EQ(with(1.01, 1), 0u);
  EXPECT_EQ(with(1.03, 1), 1u);
  EXPECT_EQ(with(1, 1.1), 1u);
  EXPECT_EQ(with(1.5, 0.5), 0u) << "more work for less error is a choice";
  Json fewer = golden;
  fewer["subjects"][0]["points"].erase(0);
  EXPECT_EQ(regressions(golden, fewer).size(), 2u) << "error and work of a point are gone";
}

TEST(BenchGates, ADefaultThatAnotherBeatsInBothIsFound) {
  Subject subject{.name = "s",
                  .question = "which?",
                  .reference = "closed form",
                  .metrics = {"error", "worst"},
                  .work_unit = "steps"};
  subject.settings = [](BenchContext&) -> Result<std::vector<Setting>> {
    std::vector<Setting> settings(2);
    for (int i = 0; i < 2; ++i) {
      settings[static_cast<size_t>(i)].method = settings[static_cast<size_t>(i)].setting = i ? "dear" : "cheap";
      settings[static_cast<size_t>(i)].is_default = i == 1;
      settings[static_cast<size_t>(i)].measure = [i](uint64_t) { return ErrorSample{{0.1 + i, 0.1 + i}, 0}; };
      settings[static_cast<size_t>(i)].run = [i] { return 10.0 + 10 * i; };
    }
    return settings;
  };
  BenchContext context(true, 1);
  const SubjectResult r = run_subject(subject, context, RunOptions::quick_run());
  EXPECT_FALSE(r.points[1].default_on_work_front.value_or(true));
}

}  // namespace tools
