#include "tools/bench/plot.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include <fmt/format.h>

namespace tools {

std::string xml_text(const std::string& text) {
  std::string out;
  for (char c : text) switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
    }
  return out;
}

namespace {

constexpr double kWidth = 990, kHeight = 640, kLeft = 80, kRight = 760, kTop = 60, kBottom = 570;
// Okabe and Ito's colours, which stay apart for most colour-blind readers.
constexpr const char* kColours[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000"};

/// Logarithmic, from 1, 2 or 5 of a decade below the values to one above them.
struct LogAxis {
  double low = 0, high = 1;   // logarithms
  double start = 0, end = 1;  // in the picture
  LogAxis(const std::vector<double>& values, double picture_start, double picture_end)
      : start(picture_start), end(picture_end) {
    double least = INFINITY, most = -INFINITY;
    for (double v : values)
      if (v > 0 && std::isfinite(v)) least = std::min(least, std::log10(v)), most = std::max(most, std::log10(v));
    if (least > most) return;
    const double margin = std::max(0.05 * (most - least), 0.1);
    low = least - margin, high = most + margin;
    const std::vector<double> fine = grid(std::floor(low), std::ceil(high), true);
    low = *(std::upper_bound(fine.begin(), fine.end(), low + 1e-9) - 1);
    high = *std::lower_bound(fine.begin(), fine.end(), high - 1e-9);
  }
  double place(double value) const {
    const double t = (std::log10(value) - low) / (high - low);
    return start + std::clamp(t, 0.0, 1.0) * (end - start);
  }
  bool holds(double value) const { return std::log10(value) > low - 1e-9 && std::log10(value) < high + 1e-9; }
  /// Decades, every so many where there are many; 1, 2 and 5 of each where there are few.
  std::vector<double> ticks() const {
    const bool few = high - low < 2.5;
    const std::vector<double> all = grid(std::floor(low), std::ceil(high), few);
    const size_t step = few ? 1 : std::max<size_t>(1, all.size() / 12);
    std::vector<double> shown;
    for (size_t i = 0; i < all.size(); i += step)
      if (holds(std::pow(10.0, all[i]))) shown.push_back(std::pow(10.0, all[i]));
    return shown;
  }

 private:
  static std::vector<double> grid(double first, double last, bool fine) {
    std::vector<double> logs;
    for (double decade = first; decade <= last; ++decade) {
      logs.push_back(decade);
      if (fine) logs.insert(logs.end(), {decade + std::log10(2.0), decade + std::log10(5.0)});
    }
    return logs;
  }
};

struct Picture {
  std::string svg;
  void line(double x1, double y1, double x2, double y2, const std::string& style) {
    svg += fmt::format("<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" {}/>\n", x1, y1, x2, y2, style);
  }
  void text(double x, double y, const std::string& style, const std::string& words) {
    svg += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" {}>{}</text>\n", x, y, style, xml_text(words));
  }
  void path(const std::vector<std::pair<double, double>>& points, const std::string& style) {
    std::string list;
    for (const auto& [x, y] : points) list += fmt::format("{}{:.1f},{:.1f}", list.empty() ? "" : " ", x, y);
    svg += fmt::format("<polyline points=\"{}\" fill=\"none\" {}/>\n", list, style);
  }
};

std::set<double> noise_floors_of(const SubjectResult& s) {
  std::set<double> floors;
  if (s.noise_floor > 0) floors.insert(s.noise_floor);
  for (const PointResult& p : s.points)
    if (p.noise_floor > 0) floors.insert(p.noise_floor);
  return floors;
}

enum class Across { time, work, knob };

void draw_axes(Picture& picture, const LogAxis& time, const LogAxis& error, const SubjectResult& s, Across across) {
  for (const double tick : time.ticks()) {
    const double x = time.place(tick);
    picture.line(x, kTop, x, kBottom, "stroke=\"#ddd\"");
    picture.text(x, kBottom + 18, "text-anchor=\"middle\"", fmt::format("{:g}", tick));
  }
  for (const double tick : error.ticks()) {
    const double y = error.place(tick);
    picture.line(kLeft, y, kRight, y, "stroke=\"#ddd\"");
    picture.text(kLeft - 8, y + 4, "text-anchor=\"end\"", fmt::format("{:g}", tick));
  }
  double written_to = kLeft;  // along the top
  for (const double budget : {1.0, 4.0, 16.0, 64.0}) {
    if (across != Across::time || !time.holds(budget)) continue;
    const double x = time.place(budget);
    picture.line(x, kTop, x, kBottom, "stroke=\"#888\" stroke-dasharray=\"2 4\"");
    if (x < written_to || x + 40 > kRight) continue;
    picture.text(x + 3, kTop + 12, "fill=\"#666\"", fmt::format("{:g} ms", budget));
    written_to = x + 44;
  }
  // One reference has a band; several, a problem each, lines.
  const std::set<double> floors = noise_floors_of(s);
  for (const double floor : floors) {
    const double y = error.place(3 * floor);
    if (floors.size() == 1)
      picture.svg +=
          fmt::format("<rect x=\"{}\" y=\"{:.1f}\" width=\"{}\" height=\"{:.1f}\" fill=\"#bbb\" opacity=\"0.4\"/>\n",
                      kLeft, y, kRight - kLeft, std::max(0.0, kBottom - y));
    else
      picture.line(kLeft, y, kRight, y, "stroke=\"#bbb\" stroke-width=\"3\"");
    std::string of = "the reference";
    for (const PointResult& p : s.points)
      if (floors.size() > 1 && p.noise_floor == floor) of = "the reference of " + p.problem;
    picture.text(kLeft + 6, y + 14, "fill=\"#555\"", "below three noise floors of " + of);
  }
  picture.svg += fmt::format("<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"#333\"/>\n",
                             kLeft, kTop, kRight - kLeft, kBottom - kTop);
  picture.text((kLeft + kRight) / 2, kBottom + 44, "text-anchor=\"middle\"",
               across == Across::time   ? "ms of one call; work: " + s.work_unit
               : across == Across::work ? "work of one call: " + s.work_unit
                                        : s.knob_unit);
  picture.svg += fmt::format("<text transform=\"translate(22 {}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
                             (kTop + kBottom) / 2, xml_text(s.metrics.empty() ? "error" : s.metrics[0]));
}

/// Where labels go without covering each other; what finds no place is left to the tooltip.
class Labels {
 public:
  void put(Picture& picture, double x, double y, const std::string& words, const std::string& colour) {
    const double width = 5.4 * static_cast<double>(words.size());
    for (const auto& [dx, dy] : {std::pair{7.0, -5.0}, {7.0, 12.0}, {-7.0 - width, -5.0}, {-7.0 - width, 12.0}}) {
      const Box box{x + dx, y + dy - 8, x + dx + width, y + dy + 1};
      if (std::any_of(taken_.begin(), taken_.end(), [&](const Box& other) { return meet(box, other); })) continue;
      taken_.push_back(box);
      picture.text(x + dx, y + dy, "font-size=\"9\" fill=\"" + colour + "\"", words);
      return;
    }
  }

 private:
  struct Box {
    double left, top, right, bottom;
  };
  static bool meet(const Box& a, const Box& b) {
    return a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
  }
  std::vector<Box> taken_;
};

/// "method@knob" or "problem method@knob" -> "knob": the colour says the method, and the front the problem.
std::string short_label(const PointResult& p) {
  std::string words = p.setting;
  if (!p.problem.empty() && words.rfind(p.problem + " ", 0) == 0) words.erase(0, p.problem.size() + 1);
  const size_t at = words.rfind('@');
  return at == std::string::npos || words.compare(0, at, p.method) != 0 ? words : words.substr(at + 1);
}

void draw_point(Picture& picture, double x, double y, const PointResult& p, double error, const std::string& colour) {
  const std::string stroke = "stroke=\"" + colour + "\" stroke-width=\"2\"";
  picture.svg += "<g><title>" + xml_text(p.setting) + "</title>\n";
  if (p.failed) {
    picture.line(x - 5, y - 5, x + 5, y + 5, stroke);
    picture.line(x - 5, y + 5, x + 5, y - 5, stroke);
  } else if (error <= 0) {
    picture.svg += fmt::format("<polygon points=\"{0:.1f},{1:.1f} {2:.1f},{3:.1f} {4:.1f},{3:.1f}\" fill=\"{5}\"/>\n",
                               x, y - 9, x - 5, y, x + 5, colour);
  } else {
    picture.svg += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4\" fill=\"{}\" {}/>\n", x, y,
                               p.below_floor ? "white" : colour, stroke);
  }
  if (p.is_default)
    picture.svg += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"9\" fill=\"none\" stroke=\"#333\"/>\n", x, y);
  picture.svg += "</g>\n";
}

/// A line of this slope through the middle of a method's points, across the picture.
void draw_slope(Picture& picture, const LogAxis& across, const LogAxis& error, const std::vector<double>& xs,
                const std::vector<double>& ys, double slope) {
  double x = 0, y = 0, least = INFINITY, most = 0;
  int count = 0;
  for (size_t i = 0; i < xs.size(); ++i) {
    if (!(xs[i] > 0) || !(ys[i] > 0) || !std::isfinite(ys[i])) continue;
    x += std::log10(xs[i]), y += std::log10(ys[i]), ++count;
    least = std::min(least, xs[i]), most = std::max(most, xs[i]);
  }
  if (count < 2) return;
  const auto at = [&](double v) { return error.place(std::pow(10, y / count + slope * (std::log10(v) - x / count))); };
  picture.line(across.place(least), at(least), across.place(most), at(most),
               "stroke=\"#333\" stroke-dasharray=\"6 4\"");
}

std::string svg_of(const SubjectResult& s, Across across) {
  Picture picture;
  picture.svg = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" "
      "height=\"{1}\" viewBox=\"0 0 {0} {1}\" font-family=\"sans-serif\" font-size=\"12\">\n"
      "<rect width=\"{0}\" height=\"{1}\" fill=\"white\"/>\n",
      kWidth, kHeight);
  picture.text(kLeft, 24, "font-size=\"16\"", s.name + ": " + s.question);
  picture.text(kLeft, 44, "fill=\"#555\"", "reference: " + s.reference);

  std::vector<double> times, errors;
  for (const PointResult& p : s.points) {
    times.push_back(across == Across::time ? p.ms.median : across == Across::work ? p.work : p.knob);
    errors.push_back(p.errors.empty() ? NAN : p.errors[0].median);
  }
  for (const double floor : noise_floors_of(s)) errors.push_back(floor);
  const bool exact = std::any_of(errors.begin(), errors.end(), [](double e) { return e == 0; });
  if (exact) picture.text(kLeft + 6, kBottom - 14, "fill=\"#555\" font-size=\"10\"", "triangles: exact, error 0");
  const LogAxis time(times, kLeft, kRight), error(errors, kBottom, kTop);
  draw_axes(picture, time, error, s, across);

  const auto place = [&](size_t i) -> std::pair<double, double> {
    const PointResult& p = s.points[i];
    const double x = std::isfinite(times[i]) && times[i] > 0 ? time.place(times[i]) : kLeft;
    return {x, p.failed ? kTop : errors[i] > 0 ? error.place(errors[i]) : kBottom};
  };

  // The front of each problem, from the dearest point to the cheapest.
  Labels labels;
  std::set<std::string> problems;
  for (const PointResult& p : s.points)
    if (across == Across::time) problems.insert(p.problem);
  for (const std::string& problem : problems) {
    std::vector<size_t> front;
    for (size_t i = 0; i < s.points.size(); ++i)
      if (s.points[i].front && s.points[i].problem == problem) front.push_back(i);
    std::sort(front.begin(), front.end(), [&](size_t a, size_t b) { return times[a] < times[b]; });
    std::vector<std::pair<double, double>> line;
    for (size_t i : front) line.push_back(place(i));
    if (line.size() > 1) picture.path(line, "stroke=\"#333\" stroke-width=\"3\" opacity=\"0.5\"");
    if (problems.size() > 1 && !front.empty()) labels.put(picture, line[0].first, line[0].second, problem, "#333");
  }

  // The points, joined by method and problem, dashed in the second round of colours; over the knob, the slope that is
  // expected.
  std::vector<std::string> methods;
  for (const PointResult& p : s.points)
    if (std::find(methods.begin(), methods.end(), p.method) == methods.end()) methods.push_back(p.method);
  for (size_t m = 0; m < methods.size(); ++m) {
    const std::string colour = kColours[m % std::size(kColours)];
    const std::string dashes = m < std::size(kColours) ? "" : " stroke-dasharray=\"3 3\"";
    std::map<std::string, std::vector<std::pair<double, double>>> lines;  // by problem
    std::vector<double> xs, ys;
    for (size_t i = 0; i < s.points.size(); ++i) {
      if (s.points[i].method != methods[m]) continue;
      lines[s.points[i].problem].push_back(place(i));
      xs.push_back(times[i]), ys.push_back(errors[i]);
    }
    for (const auto& [problem, line] : lines)
      if (line.size() > 1) picture.path(line, "stroke=\"" + colour + "\" stroke-width=\"1\" opacity=\"0.6\"" + dashes);
    for (const SlopeResult& slope : s.slopes)
      if (across == Across::knob && slope.method == methods[m])
        draw_slope(picture, time, error, xs, ys, slope.expected);
    for (size_t i = 0; i < s.points.size(); ++i) {
      const PointResult& p = s.points[i];
      if (p.method != methods[m]) continue;
      const auto [x, y] = place(i);
      draw_point(picture, x, y, p, errors[i], colour);
      if (across != Across::knob) labels.put(picture, x, y, short_label(p), colour);
    }
    const double y = kTop + 14 + 18 * static_cast<double>(m);
    picture.svg += fmt::format("<circle cx=\"{}\" cy=\"{:.1f}\" r=\"4\" fill=\"{}\"/>\n", kRight + 16, y - 4, colour);
    std::string legend = methods[m];
    for (const SlopeResult& slope : s.slopes)
      if (slope.method == methods[m] && slope.fitted)
        legend += fmt::format(", slope {:.2f}", std::round(*slope.fitted * 100) / 100 + 0.0);
    picture.text(kRight + 26, y, "font-size=\"11\"", legend);
  }
  return picture.svg + "</svg>\n";
}

}  // namespace

std::string pareto_svg(const SubjectResult& subject) { return svg_of(subject, Across::time); }
std::string work_svg(const SubjectResult& subject) { return svg_of(subject, Across::work); }
std::string slopes_svg(const SubjectResult& subject) { return svg_of(subject, Across::knob); }

}  // namespace tools
