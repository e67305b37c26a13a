#include "tools/bench/compare.h"

#include <fstream>

#include <gtest/gtest.h>

#include "tests/support.h"
#include "tools/bench/bench_verb.h"

namespace tools {

namespace {

RowResult row(const std::string& name, double median, double half_iqr, Better better = Better::higher) {
  RowResult r;
  r.suite = "suite", r.name = name, r.unit = "things", r.better = better;
  r.value = {median, median - half_iqr, median + half_iqr, median - 2 * half_iqr, median + 2 * half_iqr, 9};
  return r;
}

Json result(const std::vector<RowResult>& rows) { return run_json(Machine{}, RunOptions{}, rows); }

Comparison compare(const std::vector<RowResult>& before, const std::vector<RowResult>& after) {
  auto comparison = compare_results(result(before), "a.json", result(after), "b.json");
  EXPECT_TRUE(comparison.ok());
  return std::move(*comparison);
}

}  // namespace

TEST(BenchCompare, OnlyChangesBeyondSpreadAndFivePercentCount) {
  EXPECT_TRUE(compare({row("a", 100, 1)}, {row("a", 104, 1)}).changes.empty());    // apart, but 4 %
  EXPECT_TRUE(compare({row("a", 100, 20)}, {row("a", 120, 20)}).changes.empty());  // 20 %, but the spreads overlap
  const Comparison better = compare({row("a", 100, 1)}, {row("a", 120, 1)});
  ASSERT_EQ(better.changes.size(), 1u);
  EXPECT_FALSE(better.changes[0].regression);
  EXPECT_NEAR(better.changes[0].gain, 1.2, 1e-12);
  EXPECT_FALSE(better.regressed());
}

TEST(BenchCompare, WorseFollowsTheDirectionOfTheRow) {
  EXPECT_TRUE(compare({row("a", 100, 1)}, {row("a", 80, 1)}).regressed());
  EXPECT_FALSE(compare({row("a", 100, 1, Better::lower)}, {row("a", 80, 1, Better::lower)}).regressed());
  EXPECT_TRUE(compare({row("a", 100, 1, Better::lower)}, {row("a", 120, 1, Better::lower)}).regressed());
}

TEST(BenchCompare, ARowThatFailsOrVanishesIsARegression) {
  RowResult failed = row("a", 100, 1);
  failed.error = "no input";
  EXPECT_TRUE(compare({row("a", 100, 1)}, {failed}).regressed());
  EXPECT_TRUE(compare({row("a", 100, 1)}, {}).regressed());
  const Comparison added = compare({}, {row("a", 100, 1)});
  EXPECT_FALSE(added.regressed());
  EXPECT_EQ(added.added, std::vector<std::string>{"suite/a"});
}

TEST(BenchCompare, ExitCodesTellARegressionFromBadInput) {
  world::TemporaryFolder folder;
  const auto write = [&](const char* name, const std::string& text) {
    std::ofstream(folder / name) << text;
    return folder / name;
  };
  const auto good = write("good.json", result({row("a", 100, 1)}).dump());
  const auto worse = write("worse.json", result({row("a", 50, 1)}).dump());
  const auto broken = write("broken.json", "{\"rows\": [");
  const auto other = write("other.json", "{\"subjects\": []}");
  testing::internal::CaptureStdout();
  EXPECT_EQ(*bench_compare(good, good, false), 0);
  EXPECT_EQ(*bench_compare(good, worse, false), 1);
  EXPECT_EQ(*bench_compare(worse, good, true), 0);
  for (const auto& bad : {broken, other, folder / "missing.json"}) {
    const auto failed = bench_compare(good, bad, false);
    ASSERT_FALSE(failed.ok());
    EXPECT_EQ(failed.error().kind, world::ErrorKind::input_output);
    EXPECT_NE(failed.error().message.find(bad.filename().string()), std::string::npos) << failed.error().message;
  }
  testing::internal::GetCapturedStdout();
}

namespace {

Json pareto(double error, double work) {
  SubjectResult s;
  s.name = "s", s.metrics = {"error"};
  PointResult p;
  p.method = "m", p.setting = "m@1", p.errors = {spread_of({error})}, p.ms = spread_of({1}), p.work = work;
  s.points = {p};
  return pareto_json(Machine{}, RunOptions{}, {s});
}

bool regressed(const Json& before, const Json& after) {
  auto comparison = compare_results(before, "a.json", after, "b.json");
  EXPECT_TRUE(comparison.ok());
  return comparison->regressed();
}

}  // namespace

TEST(BenchCompare, SubjectsMayNotErrMoreNorWorkMoreForTheSameError) {
  EXPECT_FALSE(regressed(pareto(0.1, 100), pareto(0.1, 100)));
  EXPECT_TRUE(regressed(pareto(0.1, 100), pareto(0.12, 100)));
  EXPECT_TRUE(regressed(pareto(0.1, 100), pareto(0.1, 103)));
  EXPECT_FALSE(regressed(pareto(0.1, 100), pareto(0.1, 101)));
  EXPECT_FALSE(regressed(pareto(0.1, 100), pareto(0.05, 150))) << "more work for less error is a choice";
}

}  // namespace tools
