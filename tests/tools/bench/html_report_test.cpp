#include "tools/bench/html_report.h"

#include <cmath>

#include <gtest/gtest.h>

namespace tools {

namespace {

PointResult point(const std::string& setting, double error, double ms) {
  PointResult p;
  p.method = "m", p.setting = setting, p.errors = {spread_of({error})}, p.ms = spread_of({ms});
  p.failed = !std::isfinite(error);
  p.command = "loam bench pareto --subject s";
  return p;
}

SubjectResult subject() {
  SubjectResult s;
  s.name = "s", s.question = "a < b?", s.reference = "closed form", s.metrics = {"error"}, s.work_unit = "steps";
  s.points = {point("rough", 0.2, 0.5), point("fair", 0.02, 3), point("fine", 0.005, 40), point("broken", NAN, 0.1)};
  return s;
}

}  // namespace

TEST(HtmlReport, EqualTimeTakesTheNearestAndEqualErrorTheCheapest) {
  const SubjectResult s = subject();
  EXPECT_EQ(best_within(s, 1)[0].point->setting, "rough");
  EXPECT_EQ(best_within(s, 16)[0].point->setting, "fair");
  EXPECT_EQ(best_within(s, 64)[0].point->setting, "fine");
  EXPECT_EQ(best_within(s, 0.2)[0].point, nullptr) << "what failed is no choice";
  EXPECT_EQ(cheapest_for(s, 0.1)[0].point->setting, "fair");
  EXPECT_EQ(cheapest_for(s, 0.01)[0].point->setting, "fine");
  EXPECT_EQ(cheapest_for(s, 0.001)[0].point, nullptr);
}

TEST(HtmlReport, BudgetsAndErrorsThatAreAskedForLieAmongTheSubjectsOwn) {
  SubjectResult s = subject();
  EXPECT_EQ(budgets_of(s), (std::vector<double>{1, 4, 16, 64}));
  const std::vector<double> targets = target_errors_of(s);
  ASSERT_EQ(targets.size(), 4u);
  for (size_t i = 0; i < targets.size(); ++i) EXPECT_NEAR(targets[i], (std::vector{0.3, 0.1, 0.03, 0.01})[i], 1e-12);
  for (PointResult& p : s.points) p.ms.median *= 1e-6, p.errors[0].median *= 1e-9;
  for (const double budget : budgets_of(s)) EXPECT_TRUE(best_within(s, budget)[0].point) << budget;
  for (const double target : target_errors_of(s)) EXPECT_TRUE(cheapest_for(s, target)[0].point) << target;
  s.points.resize(1);
  s.points[0].is_reference = true;
  EXPECT_TRUE(budgets_of(s).empty());
  EXPECT_EQ(best_within(s, 64)[0].point, nullptr) << "the reference itself is no choice";
}

TEST(HtmlReport, IsOnePageWithPlotTablesPicturesAndCommandsAndAsksNoNetwork) {
  SubjectResult s = subject();
  s.reference_picture = render::Image(8, 4);
  s.points[1].picture = render::Image(8, 4);
  s.points[1].picture->at(3, 2) = {100, 100, 100};
  const auto html = html_report({}, {}, {s});
  ASSERT_TRUE(html.ok());
  for (const char* part : {"<svg", "Equal time", "Equal error", "loam bench pareto --subject s",
                           "data:image/png;base64,", "FLIP, mean", "a &lt; b?"})
    EXPECT_NE(html->find(part), std::string::npos) << part;
  for (const char* part : {"<script src", "<link", "@import", "src=\"http"})
    EXPECT_EQ(html->find(part), std::string::npos) << part;
  EXPECT_NE(accuracy_markdown("a command", {{s, "a machine"}}).find("| fair |"), std::string::npos);
}

TEST(HtmlReport, GatesNeedSlopesBiasesAndADefaultThatSomeAxisAllows) {
  SubjectResult s = subject();
  EXPECT_TRUE(s.gates_met());
  s.points[0].default_on_front = false, s.points[0].default_on_work_front = true;
  EXPECT_TRUE(s.gates_met());
  s.points[0].default_on_work_front = false;
  EXPECT_FALSE(s.gates_met());
  s = subject();
  s.biases.push_back({"m", 0.1, 0.2, false});
  EXPECT_FALSE(s.gates_met());
}

}  // namespace tools
