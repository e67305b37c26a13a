/// What the mean of N samples of a pixel loses by how they are added up.
///
/// Samples are uniform in [0, 1), as floats; the mean is compared, relative, with that of a long double sum.
///   naive     one float sum: its error grows between N^(1/2) and N, and past 2^24 samples are lost whole
///   pairwise  blocks of 8, then sums of sums in a binary tree: log N units of a float at most
///   Kahan     a second float carries what the first rounds off: 2 units
///   double    one double sum, rounded to float at the end
///   film      Welford's update in doubles (render/trace/film.h), of three bands and with the variance; ships
/// Means that end as floats are half a unit off, 3e-8, whatever the sum.
/// source  William Kahan. Further Remarks on Reducing Truncation Errors. 1965; Nicholas Higham. The Accuracy of
///         Floating Point Summation. 1993
#include <cmath>
#include <memory>

#include <fmt/format.h>

#include "render/trace/film.h"
#include "tools/bench/benchmark.h"
#include "world/base/random.h"

namespace tools {

namespace {

constexpr int kSeeds = 4;  // sequences whose root mean square error is one measurement

using Samples = std::vector<float>;

double naive_mean(const Samples& samples) {
  float sum = 0;
  for (const float s : samples) sum += s;
  return sum / static_cast<float>(samples.size());
}

/// Samples come one by one, so the tree is kept as one sum for each of its levels.
double pairwise_mean(const Samples& samples) {
  float levels[64] = {};
  const size_t whole = samples.size() / 8 * 8;
  for (size_t i = 0; i < whole; i += 8) {
    const float* s = &samples[i];
    float sum = ((s[0] + s[1]) + (s[2] + s[3])) + ((s[4] + s[5]) + (s[6] + s[7]));
    size_t level = 0;
    for (size_t block = i / 8; block & 1; block >>= 1) sum += levels[level], levels[level++] = 0;
    levels[level] = sum;
  }
  float sum = 0;
  for (size_t i = whole; i < samples.size(); ++i) sum += samples[i];
  for (const float level : levels) sum += level;
  return sum / static_cast<float>(samples.size());
}

double kahan_mean(const Samples& samples) {
  float sum = 0, lost = 0;
  for (const float s : samples) {
    const float wanted = s - lost, next = sum + wanted;
    lost = (next - sum) - wanted;
    sum = next;
  }
  return sum / static_cast<float>(samples.size());
}

double double_mean(const Samples& samples) {
  double sum = 0;
  for (const float s : samples) sum += s;
  return static_cast<float>(sum / static_cast<double>(samples.size()));
}

double film_mean(const Samples& samples) {
  render::PixelSamples pixel;
  for (const float s : samples) pixel.add(world::Vec3d(s));
  return pixel.mean[0];
}

double exact_mean(const Samples& samples) {
  long double sum = 0;
  for (const float s : samples) sum += s;
  return static_cast<double>(sum / static_cast<long double>(samples.size()));
}

struct Sequence {
  Samples samples;
  double exact = 0;
};

std::vector<Sequence> make_sequences(int count, uint64_t seed) {
  std::vector<Sequence> all(kSeeds);
  for (int k = 0; k < kSeeds; ++k) {
    all[static_cast<size_t>(k)].samples.resize(static_cast<size_t>(count));
    for (int i = 0; i < count; ++i)
      all[static_cast<size_t>(k)].samples[static_cast<size_t>(i)] = world::uniform01(world::random_bits(seed, i, k, 0));
    all[static_cast<size_t>(k)].exact = exact_mean(all[static_cast<size_t>(k)].samples);
  }
  return all;
}

struct Method {
  const char* name;
  double (*mean)(const Samples&);
};

ErrorSample errors_of(const std::vector<Sequence>& sequences, const Method& method) {
  double squares = 0, sum = 0, worst = 0;
  for (const Sequence& s : sequences) {
    const double error = method.mean(s.samples) / s.exact - 1;
    squares += error * error, sum += error, worst = std::max(worst, std::abs(error));
  }
  return {{std::sqrt(squares / kSeeds), worst}, sum / kSeeds};
}

}  // namespace

void add_subject_film_accumulation(Registry& registry) {
  Subject subject{.question = "how are the samples of a pixel added up so that many don't drown?",
                  .reference = "mean by a long double sum, 64 bits of mantissa",
                  .metrics = {"error of the mean (relative RMS)", "error of the mean (relative largest)"},
                  .work_unit = "samples; of the film, times 3 bands"};
  subject.settings = [](BenchContext& context) -> Result<std::vector<Setting>> {
    std::vector<Setting> settings;
    for (const int count : context.quick() ? std::vector{100, 10000, 1000000}
                                           : std::vector{100, 1000, 10000, 100000, 1000000, 10000000}) {
      const uint64_t seed = context.seed();
      const std::string problem = fmt::format("{} samples", count);
      const auto sequences = [=, &context] {
        return context.shared<std::vector<Sequence>>("film_accumulation " + problem, [&] {
          return std::make_shared<std::vector<Sequence>>(make_sequences(count, seed));
        });
      };
      for (const Method& method :
           {Method{"naive", naive_mean}, Method{"pairwise", pairwise_mean}, Method{"Kahan", kahan_mean},
            Method{"double", double_mean}, Method{"film", film_mean}}) {
        Setting s{.method = method.name, .setting = fmt::format("{}@{}", method.name, count), .problem = problem};
        s.knob = count;
        s.is_default = method.mean == film_mean;
        s.measure = [=](uint64_t) { return errors_of(*sequences(), method); };
        s.run = [=] {
          keep(method.mean(sequences()->front().samples));
          return static_cast<double>(count);
        };
        settings.push_back(std::move(s));
      }
    }
    return settings;
  };
  registry.add(std::move(subject));
}

}  // namespace tools
