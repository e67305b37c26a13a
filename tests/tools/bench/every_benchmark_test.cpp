// Laws that hold for every suite, row and subject, whoever added it.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include <gtest/gtest.h>

#include "render/knobs.h"
#include "tools/bench/bench_verb.h"
#include "tools/bench/benchmark.h"
#include "tools/bench/runner.h"

namespace tools {

namespace {

std::set<std::string> file_names(const std::string& folder) {
  std::set<std::string> names;
  const std::filesystem::path path = std::filesystem::path(LOAM_SOURCE_DIR) / folder;
  if (!std::filesystem::exists(path)) return names;
  for (const auto& entry : std::filesystem::directory_iterator(path))
    if (entry.path().extension() == ".cpp") names.insert(entry.path().stem().string());
  return names;
}

bool is_lower_snake_case(const std::string& name) {
  return !name.empty() && std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
  });
}

}  // namespace

TEST(EveryBenchmark, EachFileOfTheFoldersIsAMember) {
  const Registry registry = all_benchmarks();
  const std::vector<std::string> suites = registry.suites();
  EXPECT_EQ(std::set<std::string>(suites.begin(), suites.end()), file_names("tools/bench/suites"));
  std::set<std::string> subjects;
  for (const Subject& subject : registry.subjects()) subjects.insert(subject.name);
  for (const std::string& name : file_names("tools/bench/subjects"))
    EXPECT_TRUE(
        std::any_of(subjects.begin(), subjects.end(), [&](const std::string& s) { return s.rfind(name, 0) == 0; }))
        << name << ".cpp adds no subject whose name begins so";
}

TEST(EveryBenchmark, NamesAreUniqueAndOfOneForm) {
  std::set<std::string> seen;
  const Registry registry = all_benchmarks();
  for (const auto& [suite, bench] : registry.rows()) {
    EXPECT_TRUE(seen.insert(suite + "/" + bench.name).second) << suite << "/" << bench.name << " is there twice";
    EXPECT_TRUE(is_lower_snake_case(bench.name)) << bench.name;
  }
  for (const Subject& subject : registry.subjects()) {
    EXPECT_TRUE(seen.insert("subject " + subject.name).second) << subject.name << " is there twice";
    EXPECT_TRUE(is_lower_snake_case(subject.name)) << subject.name;
  }
}

TEST(EveryBenchmark, RowsSayWhatTheyMeasureInWhichUnitAndWhereAReachComesFrom) {
  const Registry registry = all_benchmarks();
  ASSERT_FALSE(registry.rows().empty());
  for (const auto& [suite, bench] : registry.rows()) {
    SCOPED_TRACE(suite + "/" + bench.name);
    EXPECT_FALSE(bench.what.empty());
    EXPECT_FALSE(bench.unit.empty());
    EXPECT_TRUE(bench.prepare != nullptr);
    EXPECT_GT(bench.scale, 0);
    EXPECT_GE(bench.threads, 0);
    for (const auto& number : {bench.reach, bench.limit}) {
      if (!number) continue;
      EXPECT_GT(number->value, 0);
      EXPECT_GE(number->origin.size(), 4u) << "a number to be met says where it comes from";
    }
    EXPECT_FALSE(bench.limit && bench.limit->times_rival);
    // A rate is better the higher, a time the lower; the prefix of a rate's unit is its scale.
    if (bench.timing == Timing::rate) {
      EXPECT_EQ(bench.better, Better::higher);
      const char prefix = bench.unit.size() > 1 && bench.unit[1] == ' ' ? bench.unit[0] : ' ';
      const double expected = prefix == 'G' ? 1e9 : prefix == 'M' ? 1e6 : prefix == 'k' ? 1e3 : 1;
      EXPECT_EQ(bench.scale, expected) << bench.unit;
    }
    if (bench.timing == Timing::milliseconds) {
      EXPECT_EQ(bench.better, Better::lower);
      EXPECT_TRUE(bench.unit == "ms" || bench.unit == "us") << bench.unit;
      EXPECT_EQ(bench.scale, bench.unit == "us" ? 1e-3 : 1);
    }
  }
}

TEST(EveryBenchmark, RowsOfTheStoreAndOfProxiesRunAndTheirRivalsAgree) {
  RunOptions once = RunOptions::quick_run();
  once.repetition_seconds = once.row_seconds = 0, once.repetitions = once.least_repetitions = 1;
  BenchContext context(true, once.seed);
  const Registry registry = all_benchmarks();
  for (const Registry::Row& row : registry.rows()) {
    if (row.suite != "store" && row.suite != "proxies") continue;
    if (row.bench.timing == Timing::reported) continue;  // flights take their time
    const RowResult result = run_row(row, context, once);
    EXPECT_TRUE(result.error.empty() || result.no_device) << row.suite << '/' << row.bench.name << ": " << result.error;
  }
}

TEST(EveryBenchmark, SubjectsNameAQuestionAReferenceAndTheirMetrics) {
  const Registry registry = all_benchmarks();
  for (const Subject& subject : registry.subjects()) {
    SCOPED_TRACE(subject.name);
    EXPECT_FALSE(subject.question.empty());
    EXPECT_GE(subject.reference.size(), 8u);
    EXPECT_GE(subject.metrics.size(), 2u) << "one metric alone can be fooled";
    EXPECT_FALSE(subject.work_unit.empty());
    EXPECT_GE(subject.noise_floor, 0);
    EXPECT_TRUE(subject.settings != nullptr);
    for (const std::string& metric : subject.metrics)
      EXPECT_EQ(metric.find(','), std::string::npos) << "breaks the CSV";
  }
}

TEST(EveryBenchmark, SettingsHaveUniqueNamesAndADefault) {
  BenchContext context(true, 1);
  const Registry registry = all_benchmarks();
  for (const Subject& subject : registry.subjects()) {
    SCOPED_TRACE(subject.name);
    const auto settings = subject.settings(context);
    ASSERT_TRUE(settings.ok()) << settings.error().message;
    std::set<std::string> seen, methods;
    for (const Setting& setting : *settings) {
      EXPECT_TRUE(seen.insert(setting.setting).second) << setting.setting << " is there twice";
      EXPECT_EQ(setting.setting.find(','), std::string::npos) << "breaks the CSV";
      EXPECT_TRUE(setting.measure != nullptr && setting.run != nullptr);
      methods.insert(setting.method);
    }
    EXPECT_TRUE(std::any_of(settings->begin(), settings->end(), [](const Setting& s) { return s.is_default; }))
        << "no setting is marked as what ships";
    for (const auto& [method, slope] : subject.expected_slopes) EXPECT_TRUE(methods.count(method)) << method;
  }
}

/// Knobs of pictures that choose among numbers or kinds and have no subject: why each needs none.
const std::map<std::string, std::string> kWithoutSubject{
    {"liquid_surface", "what there is to see: amounts, or blocks"},
    {"photons", "not measured yet: a ladder of it takes minutes"},
    {"photon_radius", "not measured yet: a ladder of it takes minutes"},
    {"latitude", "what there is to see"},
    {"day_of_year", "what there is to see"},
    {"turbidity", "what there is to see"},
    {"shutter", "what there is to see: streaks, or balls"},
    {"exposure_key", "a matter of taste that costs no time"},
    {"exposure_least", "a matter of taste that costs no time"},
    {"exposure_most", "a matter of taste that costs no time"},
    {"lens_flare", "a lens that the eye hasn't, as strong as one likes"},
    {"lens_flare_blades", "a lens that the eye hasn't"},
    {"vignette", "a lens that the eye hasn't, as strong as one likes"},
    {"chromatic_aberration", "a lens that the eye hasn't, as strong as one likes"},
    {"grain", "a film that the eye hasn't, as strong as one likes"},
    {"grain_seed", "other grains of the same size"},
    {"tone_map", "a matter of taste that costs no time"},
};

TEST(EveryBenchmark, EveryKnobOfPicturesHasASubjectOrAReasonWhyNot) {
  std::string sources;
  for (const std::string& name : file_names("tools/bench/subjects")) {
    std::ifstream in(std::filesystem::path(LOAM_SOURCE_DIR) / "tools/bench/subjects" / (name + ".cpp"));
    sources.append(std::istreambuf_iterator<char>(in), {});
  }
  std::set<std::string> names;
  for (const auto& row : render::render_knobs().rows()) {
    names.insert(row.name);
    if (row.fast == "true" || row.fast == "false") continue;
    EXPECT_NE(sources.find("." + row.name + " = ") != std::string::npos, kWithoutSubject.count(row.name) == 1)
        << row.name << ": a subject sets it, or the table above says why none does";
  }
  for (const auto& [name, reason] : kWithoutSubject) EXPECT_TRUE(names.count(name)) << name << " is no knob";
}

TEST(EveryBenchmark, AnUnknownNameIsAUsageErrorThatNamesTheNearest) {
  const Registry registry = all_benchmarks();
  const auto rows = select_rows(registry, {"stor"});
  ASSERT_FALSE(rows.ok());
  EXPECT_EQ(rows.error().kind, world::ErrorKind::usage);
  EXPECT_NE(rows.error().message.find("store"), std::string::npos) << rows.error().message;
  EXPECT_FALSE(select_subjects(registry, {"position_format"}).ok());
  EXPECT_TRUE(select_rows(registry, {"store"}).ok());
}

}  // namespace tools
