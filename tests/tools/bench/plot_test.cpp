#include "tools/bench/plot.h"

#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "tools/bench/report.h"

namespace tools {

namespace {

PointResult point(const std::string& method, double error, double ms) {
  PointResult p;
  p.method = method, p.setting = method + "@1 <&\">", p.errors = {spread_of({error})}, p.ms = spread_of({ms});
  p.failed = !std::isfinite(error);
  return p;
}

SubjectResult subject() {
  SubjectResult s;
  s.name = "marching", s.question = "is a < b & c?", s.reference = "closed form", s.work_unit = "steps";
  s.metrics = {"worst, m"};
  s.noise_floor = 1e-6;
  s.points = {point("a", 0.1, 1), point("a", 0.01, 20), point("b", 0, 3), point("c", NAN, 2),
              point("d", std::numeric_limits<double>::infinity(), 0)};
  s.points[0].front = s.points[1].front = true;
  s.points[1].is_default = true;
  return s;
}

/// Whether every tag is closed in order, every attribute quoted and every entity known: enough of XML for what we
/// write.
std::string xml_fault(const std::string& text) {
  std::vector<std::string> open;
  for (size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '&') {
      const std::string rest = text.substr(i, 6);
      if (rest.rfind("&amp;", 0) && rest.rfind("&lt;", 0) && rest.rfind("&gt;", 0) && rest.rfind("&quot;", 0))
        return "entity at " + std::to_string(i);
    }
    if (text[i] == '>') return "stray > at " + std::to_string(i);
    if (text[i] != '<') continue;
    std::string tag;
    bool quoted = false;
    for (++i; i < text.size() && (quoted || text[i] != '>'); ++i) {
      if (text[i] == '<') return "< within a tag at " + std::to_string(i);
      quoted ^= text[i] == '"';
      tag += text[i];
    }
    if (quoted || i == text.size()) return "open tag " + tag;
    if (tag.front() == '?' || tag.back() == '/') continue;
    const std::string name = tag.substr(tag.front() == '/', tag.find_first_of(" ", 1) - (tag.front() == '/'));
    if (tag.front() != '/')
      open.push_back(name);
    else if (open.empty() || open.back() != name)
      return "closes " + name;
    else
      open.pop_back();
  }
  return open.empty() ? "" : "never closes " + open.back();
}

}  // namespace

TEST(BenchPlot, SvgIsWellFormedWhateverTheNamesHold) {
  EXPECT_EQ(xml_fault(pareto_svg(subject())), "");
  EXPECT_EQ(xml_fault(pareto_svg(SubjectResult{})), "");
  EXPECT_NE(xml_fault("<a><b></a>"), "");  // the check itself can fail
}

TEST(BenchPlot, SvgDrawsEveryPointAndNoCoordinateIsNotANumber) {
  const std::string svg = pareto_svg(subject());
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(svg.find("inf"), std::string::npos);
  for (const char* label : {"a@1", "b@1", "c@1", "d@1"}) EXPECT_NE(svg.find(label), std::string::npos) << label;
  EXPECT_NE(svg.find("polygon"), std::string::npos);       // the exact one
  EXPECT_NE(svg.find("r=\"9\""), std::string::npos);       // the ring of the default
  EXPECT_NE(svg.find("noise floors"), std::string::npos);  // the band
}

TEST(BenchPlot, OverTheKnobTheExpectedSlopeIsADashedLineThroughTheMethod) {
  SubjectResult s = subject();
  s.knob_unit = "samples & more";
  s.points = {point("a", 0.1, 7), point("a", 0.05, 3), point("a", 0.02, 1), point("b", NAN, 2)};
  for (size_t i = 0; i < s.points.size(); ++i) s.points[i].knob = std::pow(4, static_cast<double>(i));
  EXPECT_EQ(slopes_svg(s).find("stroke-dasharray"), std::string::npos);
  s.slopes = {{"a", -0.5, -0.58, true}, {"b", -0.5, std::nullopt, false}};
  const std::string svg = slopes_svg(s);
  EXPECT_EQ(xml_fault(svg), "");
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  const size_t dashed = svg.find("stroke-dasharray=\"6 4\"");
  ASSERT_NE(dashed, std::string::npos);
  EXPECT_EQ(svg.find("stroke-dasharray", dashed + 1), std::string::npos);  // of one point there is no line
  EXPECT_NE(svg.find("samples &amp; more"), std::string::npos);
  EXPECT_EQ(pareto_svg(s).find("6 4"), std::string::npos);
}

TEST(BenchPlot, CsvHasARowAPointAndAsManyCellsAsItsHead) {
  SubjectResult s = subject();
  s.metrics = {"worst m"};
  const std::string csv = pareto_csv(s);
  std::vector<size_t> cells;
  size_t commas = 0;
  for (char c : csv) {
    commas += c == ',';
    if (c == '\n') cells.push_back(commas), commas = 0;
  }
  ASSERT_EQ(cells.size(), 1 + s.points.size());
  for (size_t c : cells) EXPECT_EQ(c, cells[0]);
}

TEST(BenchReport, NumbersKeepFourDigits) {
  EXPECT_EQ(number_text(1.23456), "1.235");
  EXPECT_EQ(number_text(1234567), "1,234,567");
  EXPECT_EQ(number_text(1.2e-7), "1.2e-07");
  EXPECT_EQ(number_text(NAN), "failed");
}

}  // namespace tools
