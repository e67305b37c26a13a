// What `bench absent` and `bench stability` must find: nothing where there is nothing, and a fault where there is one.
#include "tools/bench/absent.h"

#include <set>

#include <gtest/gtest.h>

#include "sim/matter/rule.h"
#include "tools/bench/stability.h"

namespace tools {

namespace {

AbsentCase made_case(AbsentRun without, AbsentRun with) {
  return {"effect", "two runs", [=](BenchContext&) -> Result<AbsentCase::Pair> {
            return AbsentCase::Pair{[=]() -> Result<AbsentRun> { return without; },
                                    [=]() -> Result<AbsentRun> { return with; }};
          }};
}

}  // namespace

TEST(BenchAbsent, FindsAPassABytePixelsAndCountersThatDiffer) {
  BenchContext context(true, 1);
  EXPECT_TRUE(run_absent(made_case({}, {}), context, 0).equal);
  AbsentRun pass;
  pass.passes = 1;
  AbsentRun picture;
  picture.hash = 7;
  AbsentRun rays;
  rays.counters["rays"] = 1;
  for (const AbsentRun& run : {pass, picture, rays}) {
    const AbsentRow row = run_absent(made_case({}, run), context, 0);
    EXPECT_FALSE(row.fault.empty());
    EXPECT_FALSE(row.met());
  }
  EXPECT_FALSE(run_absent(made_case(rays, {}), context, 0).met()) << "what is missing is a difference too";
}

TEST(BenchAbsent, EveryRuleHasACaseAndNoNameIsThereTwice) {
  std::set<std::string> names;
  for (const AbsentCase& c : absent_cases()) EXPECT_TRUE(names.insert(c.effect).second) << c.effect;
  for (const sim::RuleRow& row : sim::rule_rows()) EXPECT_TRUE(names.count(std::string(row.info.name)));
}

TEST(BenchAbsent, RulesThatNothingCallsForCostNothing) {
  BenchContext context(true, 1);
  for (const AbsentCase& c : absent_cases()) {
    if (c.effect != "fire" && c.effect != "liquid" && c.effect != "settled_sand") continue;
    const AbsentRow row = run_absent(c, context, 0);
    EXPECT_TRUE(row.equal) << c.effect << ": " << row.fault;
    EXPECT_EQ(row.passes + row.leaves_visited + row.bytes, 0u) << c.effect;
  }
}

TEST(BenchAbsent, PicturesOfEffectsThatNothingCallsForAreTheSame) {
  BenchContext context(true, 1);
  size_t drawn = 0;
  for (const AbsentCase& c : absent_cases()) {
    if (!c.effect.starts_with("raster_") && !c.effect.starts_with("raycast_")) continue;
    const AbsentRow row = run_absent(c, context, 0);
    if (row.no_device) continue;
    // Here as to pictures and counters: what time it takes is for the benchmark to say.
    EXPECT_TRUE(row.equal) << c.effect << ": " << row.fault;
    EXPECT_EQ(row.passes + row.leaves_visited + row.bytes, 0u) << c.effect;
    ++drawn;
  }
  EXPECT_GE(drawn, 15u);
}

TEST(BenchStability, ABoundThatIsNotKeptAndANaiveWayThatKeepsItAreFaults) {
  BenchContext context(true, 1);
  StabilityCase c{"X", "claim", "unit", 1, "origin", [](BenchContext&) -> Result<double> { return 0.5; }};
  EXPECT_TRUE(run_stability(c, context).fault.empty());
  c.naive = [] { return 2.0; };
  EXPECT_TRUE(run_stability(c, context).fault.empty());
  c.naive = [] { return 0.9; };
  EXPECT_FALSE(run_stability(c, context).fault.empty());
  c.naive = nullptr;
  c.error = [](BenchContext&) -> Result<double> { return 1.5; };
  EXPECT_FALSE(run_stability(c, context).fault.empty());
  c.error = [](BenchContext&) -> Result<double> { return NAN; };
  EXPECT_FALSE(run_stability(c, context).fault.empty());
}

TEST(BenchStability, QuickCasesKeepTheirBounds) {
  BenchContext context(true, 1);
  const std::set<std::string> quick{"N1", "N4", "N8", "A2", "A4", "A6", "L2", "R1", "CM4", "P4"};
  size_t run = 0;
  for (const StabilityCase& c : stability_cases()) {
    if (!quick.count(c.id)) continue;
    const StabilityRow row = run_stability(c, context);
    EXPECT_TRUE(row.fault.empty()) << c.id << ": " << row.fault;
    ++run;
  }
  EXPECT_EQ(run, quick.size());
}

}  // namespace tools
