/// How many bands of wavelength light needs: three, as Loam carries, against up to 64, for lamps and glass with smooth
/// spectra and with narrow ones.
///
/// Light of a lamp passes 2 cm of glass and falls on paint. Each of them is its mean over every band, as a renderer of
/// so many bands has them, and what comes out is seen through the mean of the eye's curves over the band. Bands cut 400
/// to 700 nm into equal parts.
///   daylight     a black body of 6504 K, clear glass, paint with one soft edge
///   red_club     a red diode of 20 nm, bottle green glass, the same paint: what a green bottle is in red light
///   sodium       a lamp of two lines at 589 nm, the same glass and paint
///   fluorescent  three lines of phosphor and mercury
/// Three bands are right where spectra are broad; where lamp or glass is narrower than a band they are not, whatever
/// the light does in between.
/// source  Chris Wyman, Peter-Pike Sloan, Peter Shirley. Simple Analytic Approximations to the CIE XYZ Color Matching
///         Functions. 2013, equations 4; Max Planck's law; CIE 15, L*a*b*
#include <array>
#include <cmath>
#include <functional>
#include <memory>

#include <fmt/format.h>

#include "tools/bench/benchmark.h"

namespace tools {

namespace {

constexpr double kFrom = 400, kTo = 700;  // nm
constexpr int kFineSteps = 19200;         // of the reference, 1/64 nm: lines of 0.5 nm are smooth in it
constexpr double kGlassMetres = 0.02;

using Spectrum = std::function<double(double)>;  // of nm
using Xyz = std::array<double, 3>;

double lobe(double nm, double middle, double below, double above) {
  const double t = (nm - middle) / (nm < middle ? below : above);
  return std::exp(-0.5 * t * t);
}
double eye(int c, double nm) {
  if (c == 0)
    return 1.056 * lobe(nm, 599.8, 37.9, 31.0) + 0.362 * lobe(nm, 442.0, 16.0, 26.7) -
           0.065 * lobe(nm, 501.1, 20.4, 26.2);
  if (c == 1) return 0.821 * lobe(nm, 568.8, 46.9, 40.5) + 0.286 * lobe(nm, 530.9, 16.3, 31.1);
  return 1.217 * lobe(nm, 437.0, 11.8, 36.0) + 0.681 * lobe(nm, 459.0, 26.0, 13.8);
}

double black_body(double nm, double kelvin) { return std::pow(nm / 560, -5) / std::expm1(1.438777e7 / (nm * kelvin)); }
double paint(double nm) { return 0.1 + 0.7 / (1 + std::exp((570 - nm) / 18)); }
double clear_glass(double nm) { return 4 + 0.01 * (nm - 400); }  // 1/m
/// Iron in bottle glass: it passes a window of green.
double green_glass(double nm) { return 15 + 260 * lobe(nm, 400, 45, 45) + 300 * lobe(nm, 690, 70, 70); }

struct Case {
  std::string name;
  Spectrum lamp, glass;
};
std::vector<Case> cases() {
  const auto line = [](double nm, double middle, double width) { return lobe(nm, middle, width, width); };
  return {{"daylight", [](double nm) { return black_body(nm, 6504); }, clear_glass},
          {"red_club", [=](double nm) { return line(nm, 632, 8.5); }, green_glass},
          {"sodium", [=](double nm) { return line(nm, 588.995, 0.25) + 0.5 * line(nm, 589.592, 0.25); }, green_glass},
          {"fluorescent", [=](double nm) { return line(nm, 435.8, 2) + 2 * line(nm, 544, 4) + 1.6 * line(nm, 611, 4); },
           green_glass}};
}

double mean(const Spectrum& s, double from, double to, int steps) {
  double sum = 0;
  for (int i = 0; i < steps; ++i) sum += s(from + (to - from) * (i + 0.5) / steps);
  return sum / steps;
}

/// What a renderer of `bands` bands holds of a case.
struct Bands {
  std::vector<double> lamp, glass, paint;
  std::vector<Xyz> eye;
};
Bands bands_of(const Case& c, int bands) {
  Bands b;
  const int fine = kFineSteps / bands;
  for (int i = 0; i < bands; ++i) {
    const double from = kFrom + (kTo - kFrom) * i / bands, to = kFrom + (kTo - kFrom) * (i + 1) / bands;
    b.lamp.push_back(mean(c.lamp, from, to, fine));
    b.glass.push_back(mean(c.glass, from, to, fine));
    b.paint.push_back(mean(paint, from, to, fine));
    Xyz seen;
    for (int k = 0; k < 3; ++k)
      seen[static_cast<size_t>(k)] = mean([=](double nm) { return eye(k, nm); }, from, to, fine) / bands;
    b.eye.push_back(seen);
  }
  return b;
}

Xyz seen(const Bands& b) {
  Xyz sum{};
  for (size_t i = 0; i < b.lamp.size(); ++i) {
    const double light = b.lamp[i] * std::exp(-b.glass[i] * kGlassMetres) * b.paint[i];
    for (size_t k = 0; k < 3; ++k) sum[k] += light * b.eye[i][k];
  }
  return sum;
}

/// Of two colours, under a white that the lamp makes on a perfect reflector.
double delta_e(const Xyz& a, const Xyz& b, const Xyz& white) {
  const auto lab = [&](const Xyz& c) {
    Xyz f;
    for (size_t k = 0; k < 3; ++k) {
      const double t = c[k] / white[k];
      f[k] = t > 216.0 / 24389 ? std::cbrt(t) : (24389.0 / 27 * t + 16) / 116;
    }
    return Xyz{116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])};
  };
  const Xyz la = lab(a), lb = lab(b);
  double squares = 0;
  for (size_t k = 0; k < 3; ++k) squares += (la[k] - lb[k]) * (la[k] - lb[k]);
  return std::sqrt(squares);
}

ErrorSample error_of(const Case& c, const Xyz& got, const Xyz& right) {
  Xyz white{};
  const Bands fine = bands_of(c, kFineSteps / 8);
  for (size_t i = 0; i < fine.lamp.size(); ++i)
    for (size_t k = 0; k < 3; ++k) white[k] += fine.lamp[i] * fine.eye[i][k];
  // A line makes no white in blue: as much of it as of the others, then.
  for (double& w : white) w = std::max(w, 0.05 * white[1]);
  double squares = 0, size = 0;
  for (size_t k = 0; k < 3; ++k) squares += (got[k] - right[k]) * (got[k] - right[k]), size += right[k] * right[k];
  return {{std::sqrt(squares / size), delta_e(got, right, white)}, (got[1] - right[1]) / right[1]};
}

}  // namespace

void add_subject_spectral_bands(Registry& registry) {
  Subject subject{.question = "how many bands of wavelength does light need?",
                  .reference = "the same integral in steps of 1/64 nm",
                  .metrics = {"RMS error of XYZ (relative)", "CIE76 colour difference"},
                  .work_unit = "bands",
                  .knob_unit = "bands",
                  .bias_limits = {{"bands", 0.05}}};
  subject.settings = [](BenchContext&) -> Result<std::vector<Setting>> {
    std::vector<Setting> settings;
    for (const Case& c : cases()) {
      const Xyz right = seen(bands_of(c, kFineSteps));
      for (const int count : {1, 3, 4, 6, 8, 16, 32, 64}) {
        const auto bands = std::make_shared<const Bands>(bands_of(c, count));
        Setting s{.method = "bands", .setting = fmt::format("{} bands@{}", c.name, count), .problem = c.name};
        s.knob = count, s.is_default = count == 3;
        s.measure = [=](uint64_t) { return error_of(c, seen(*bands), right); };
        s.run = [=] {
          keep(seen(*bands));
          return static_cast<double>(bands->lamp.size());
        };
        settings.push_back(std::move(s));
      }
    }
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
