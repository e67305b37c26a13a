#include "tools/bench/html_report.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include <fmt/format.h>

#include "render/image/display.h"
#include "render/image/error_metrics.h"
#include "render/image/png_exr.h"
#include "tools/bench/plot.h"
#include "tools/bench/report.h"
#include "world/base/file.h"

namespace tools {

namespace {

std::vector<std::string> problems_of(const SubjectResult& subject) {
  std::vector<std::string> problems;
  for (const PointResult& p : subject.points)
    if (std::find(problems.begin(), problems.end(), p.problem) == problems.end()) problems.push_back(p.problem);
  return problems;
}

double error_of(const PointResult& p) { return p.errors.empty() ? NAN : p.errors[0].median; }

template <class Allowed, class Less>
std::vector<Choice> choose(const SubjectResult& subject, double asked, Allowed allowed, Less less) {
  std::vector<Choice> choices;
  for (const std::string& problem : problems_of(subject)) {
    Choice choice{problem, asked, nullptr};
    for (const PointResult& p : subject.points)
      if (p.problem == problem && !p.failed && !p.is_reference && allowed(p) &&
          (!choice.point || less(p, *choice.point)))
        choice.point = &p;
    choices.push_back(choice);
  }
  return choices;
}

std::string base64(const std::vector<uint8_t>& bytes) {
  constexpr const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    const size_t left = std::min<size_t>(3, bytes.size() - i);
    uint32_t word = 0;
    for (size_t k = 0; k < 3; ++k) word = word << 8 | (k < left ? bytes[i + k] : 0u);
    for (size_t k = 0; k < 4; ++k) text += k <= left ? kDigits[word >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

/// An <img> that holds its picture.
world::Result<std::string> inline_picture(const render::Image8& picture, const std::string& words) {
  const std::filesystem::path file =
      std::filesystem::temp_directory_path() / fmt::format("loam-report-{}.png", reinterpret_cast<uintptr_t>(&picture));
  TRY_STATUS(render::write_png(file, picture));
  auto bytes = world::read_file(file, uint64_t{1} << 30);
  std::error_code ignored;
  std::filesystem::remove(file, ignored);
  if (!bytes.ok()) return bytes.error();
  return fmt::format(
      "<figure><img alt=\"{0}\" width=\"{1}\" src=\"data:image/png;base64,{2}\"/><figcaption>{0}"
      "</figcaption></figure>\n",
      xml_text(words), std::clamp(picture.width, 160, 480), base64(*bytes));
}

/// Where a point's picture differs from the reference, as a person sees it.
world::Result<std::string> pictures_of(const PointResult& p, const SubjectResult& subject) {
  std::string html;
  if (!p.picture) return html;
  const render::Image8 shown = render::display_image(*p.picture, 0);
  TRY(html, inline_picture(shown, p.setting));
  const auto& truth = subject.reference_picture;
  if (!truth || truth->width != shown.width || truth->height != shown.height) return html;
  const render::Image8 right = render::display_image(*truth, 0);
  const render::FlipMap map = render::flip_map(shown, right);
  TRY(const std::string reference, inline_picture(right, "reference"));
  TRY(const std::string error, inline_picture(render::heat_picture(map), fmt::format("FLIP, mean {:.4f}", map.mean)));
  return html + reference + error;
}

std::string name_of(const std::string& problem) { return problem.empty() ? "all" : problem; }

/// Heads, then rows.
using Table = std::vector<std::vector<std::string>>;

Table choices_table(const SubjectResult& s, bool equal_time) {
  const std::string error = s.metrics.empty() ? "error" : s.metrics[0];
  Table table{
      {"problem", equal_time ? "within, ms" : "error of at most", equal_time ? "nearest" : "cheapest", error, "ms"}};
  const auto rows = [&](const std::vector<Choice>& choices) {
    for (const Choice& c : choices)
      if (c.point)
        table.push_back({name_of(c.problem), number_text(c.asked), c.point->setting, number_text(error_of(*c.point)),
                         number_text(c.point->ms.median)});
  };
  if (equal_time)
    for (const double budget : budgets_of(s)) rows(best_within(s, budget));
  else
    for (const double target : target_errors_of(s)) rows(cheapest_for(s, target));
  return table;
}

Table points_table(const SubjectResult& s) {
  Table table{{"setting"}};
  for (const std::string& metric : s.metrics) table[0].push_back(metric);
  for (const std::string& head :
       {std::string("bias"), "work, " + s.work_unit, std::string("ms"), std::string("IQR"), std::string("standing")})
    table[0].push_back(head);
  for (const PointResult& p : s.points) {
    std::vector<std::string> row{p.setting};
    for (const Spread& e : p.errors) row.push_back(number_text(e.median));
    std::string standing = p.failed         ? "failed"
                           : p.below_floor  ? "below the noise floor"
                           : p.is_reference ? "reference"
                           : p.front        ? "front"
                                            : "";
    if (p.is_default) standing += standing.empty() ? "default" : ", default";
    if (p.is_default && !p.default_on_front.value_or(true)) standing += " (dominated)";
    row.insert(row.end(),
               {number_text(p.bias), number_text(p.work), number_text(p.ms.median), number_text(p.ms.iqr()), standing});
    table.push_back(std::move(row));
  }
  return table;
}

std::string html_table(const Table& table) {
  std::string html = "<table>\n";
  for (size_t r = 0; r < table.size(); ++r) {
    html += "<tr>";
    for (const std::string& cell : table[r]) html += fmt::format("<{0}>{1}</{0}>", r ? "td" : "th", xml_text(cell));
    html += "</tr>\n";
  }
  return html + "</table>\n";
}

std::string markdown_table(const Table& table) {
  std::string text;
  for (size_t r = 0; r < table.size(); ++r) {
    text += "|";
    for (const std::string& cell : table[r]) text += " " + cell + " |";
    text += "\n";
    if (r) continue;
    text += "|";
    for (size_t c = 0; c < table[0].size(); ++c) text += "---|";
    text += "\n";
  }
  return text;
}

std::string gates_text(const SubjectResult& s) {
  std::string text;
  for (const SlopeResult& slope : s.slopes)
    text += fmt::format("slope of {}: {}, declared {:.2f} within 0.1: {}. ", slope.method,
                        slope.fitted ? fmt::format("{:.3f}", *slope.fitted) : "none", slope.expected,
                        slope.met ? "met" : "NOT MET");
  for (const BiasResult& bias : s.biases)
    text += fmt::format("bias of {} at its last knob: {}, at most {}: {}. ", bias.method, number_text(bias.bias),
                        number_text(bias.limit), bias.met ? "met" : "NOT MET");
  return text;
}

constexpr const char* kHead = R"(<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"/><title>Loam: what accuracy costs</title><style>
body { font: 15px/1.45 sans-serif; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; color: #222; }
svg { max-width: 100%; height: auto; }
table { border-collapse: collapse; font-size: 13px; margin: .6rem 0; }
th, td { border-bottom: 1px solid #ddd; padding: .2rem .6rem; text-align: left; }
td { font-variant-numeric: tabular-nums; }
figure { display: inline-block; margin: .4rem .6rem .4rem 0; } figcaption { font-size: 12px; color: #555; }
img { image-rendering: pixelated; }
summary { cursor: pointer; } code { background: #f4f4f4; padding: .1rem .3rem; }
section { border-top: 2px solid #333; margin-top: 2rem; }
</style></head><body>
)";

}  // namespace

namespace {

/// Of a rising series, those from the first that is no less than `least` to the first that is no less than `most`;
/// at most kMostAsked, evenly chosen, the last among them.
template <class Member>
std::vector<double> asked_between(double least, double most, Member member) {
  constexpr int kMostAsked = 5, kReach = 200;
  std::vector<double> all;
  for (int i = -kReach; i <= kReach; ++i) {
    const double value = member(i);
    if (value < least * (1 - 1e-9)) continue;
    all.push_back(value);
    if (value >= most) break;
  }
  std::vector<double> chosen;
  const int count = static_cast<int>(all.size()), kept = std::min(count, kMostAsked);
  for (int i = 1; i <= kept; ++i) chosen.push_back(all[static_cast<size_t>((count * i) / kept - 1)]);
  return chosen;
}

/// Over what may be chosen.
template <class Value>
std::vector<double> asked_of(const SubjectResult& subject, Value value, double (*member)(int)) {
  double least = INFINITY, most = 0;
  for (const PointResult& p : subject.points) {
    const double v = value(p);
    if (p.failed || p.is_reference || !(v > 0) || !std::isfinite(v)) continue;
    least = std::min(least, v), most = std::max(most, v);
  }
  return least <= most ? asked_between(least, most, member) : std::vector<double>{};
}

}  // namespace

std::vector<double> budgets_of(const SubjectResult& subject) {
  return asked_of(
      subject, [](const PointResult& p) { return p.ms.median; }, [](int i) { return std::pow(4.0, i); });
}

std::vector<double> target_errors_of(const SubjectResult& subject) {
  std::vector<double> targets = asked_of(subject, error_of, [](int i) {
    const int decade = static_cast<int>(std::floor(i / 2.0));
    return (i - 2 * decade ? 3 : 1) * std::pow(10.0, decade);
  });
  std::reverse(targets.begin(), targets.end());
  return targets;
}

std::vector<Choice> best_within(const SubjectResult& subject, double budget_ms) {
  return choose(
      subject, budget_ms, [&](const PointResult& p) { return p.ms.median <= budget_ms; },
      [](const PointResult& a, const PointResult& b) {
        const double ea = error_of(a), eb = error_of(b);
        return ea != eb ? ea < eb : a.ms.median < b.ms.median;
      });
}

std::vector<Choice> cheapest_for(const SubjectResult& subject, double error) {
  return choose(
      subject, error, [&](const PointResult& p) { return error_of(p) <= error; },
      [](const PointResult& a, const PointResult& b) { return a.ms.median < b.ms.median; });
}

world::Result<std::string> html_report(const Machine& machine, const RunOptions& options,
                                       const std::vector<SubjectResult>& subjects) {
  std::string html = kHead;
  html += "<h1>What accuracy costs</h1>\n<p>" + xml_text(machine_line(pareto_json(machine, options, {}))) +
          "</p>\n<p>Each plot: error against the reference over the time of one call, both logarithmic. The thick line "
          "is the Pareto front, a ring the setting that Loam ships with, grey what lies within three noise floors of "
          "the reference, crosses what failed. Medians; stochastic methods over many seeds.</p>\n<ul>\n";
  for (const SubjectResult& s : subjects)
    html += fmt::format("<li><a href=\"#{0}\">{0}</a>: {1}</li>\n", xml_text(s.name), xml_text(s.question));
  html += "</ul>\n";
  for (const SubjectResult& s : subjects) {
    html += fmt::format("<section id=\"{0}\"><h2>{0}</h2>\n<p>{1} Reference: {2}.</p>\n", xml_text(s.name),
                        xml_text(s.question), xml_text(s.reference));
    if (!s.error.empty()) {
      html += "<p><b>Failed:</b> " + xml_text(s.error) + "</p></section>\n";
      continue;
    }
    const auto drawing = [](std::string svg) { return svg.substr(svg.find("<svg")); };  // without the XML head
    html += drawing(pareto_svg(s));
    if (!s.slopes.empty())
      html += "<details><summary>Error over the knob</summary>" + drawing(slopes_svg(s)) + "</details>\n";
    if (const std::string gates = gates_text(s); !gates.empty()) html += "<p>" + xml_text(gates) + "</p>\n";
    if (std::any_of(s.points.begin(), s.points.end(), [&](const PointResult& p) { return p.work != s.points[0].work; }))
      html += "<details><summary>Error over work, which is the same on every machine</summary>" + drawing(work_svg(s)) +
              "</details>\n";
    html += "<h3>Equal time</h3>\n" + html_table(choices_table(s, true)) + "<h3>Equal error</h3>\n" +
            html_table(choices_table(s, false)) + "<h3>Points</h3>\n" + html_table(points_table(s));
    for (const PointResult& p : s.points) {
      TRY(const std::string pictures, pictures_of(p, s));
      html += fmt::format("<details><summary>{}</summary><p><code>{}</code></p>{}</details>\n", xml_text(p.setting),
                          xml_text(p.command), pictures);
    }
    html += "</section>\n";
  }
  return html + "</body></html>\n";
}

std::string accuracy_markdown(const std::string& by, const std::vector<MeasuredSubject>& subjects) {
  std::string text = "# What accuracy costs\n\nWritten by `" + by + "`, not by hand.\n", on;
  for (const auto& [s, measured_on] : subjects) {
    text += fmt::format("\n## {}\n\n{} Reference: {}.\n\n", s.name, s.question, s.reference);
    if (on != measured_on) text += measured_on + "\n\n";
    on = measured_on;
    if (!s.error.empty()) {
      text += "Failed: " + s.error + "\n";
      continue;
    }
    text += markdown_table(points_table(s)) + "\n";
    if (const std::string gates = gates_text(s); !gates.empty()) text += gates + "\n\n";
    text += markdown_table(choices_table(s, true)) + "\n" + markdown_table(choices_table(s, false));
  }
  return text;
}

}  // namespace tools
