/// loam diff A B: two pictures by error metrics (A is judged, B is the reference), or two worlds voxel by voxel.
#include <cstdio>
#include <iostream>
#include <optional>

#include <fmt/format.h>

#include "render/image/png_exr.h"
#include "tools/diff.h"
#include "tools/json_text.h"
#include "tools/verb.h"
#include "world/base/text.h"
#include "world/scenes/scene.h"

namespace tools {
namespace {

struct DiffOptions {
  std::string a, b, map;
  std::vector<Threshold> thresholds;
  bool equal = false, json = false;
};

/// What can be asked for: option, key, and whether the value must stay below.
struct ThresholdOption {
  const char *option, *name, *what;
  bool at_most;
};
constexpr ThresholdOption kThresholds[] = {
    {"--max-mse", "mse", "mean squared error", true},
    {"--max-rel-mse", "rel_mse", "relative mean squared error", true},
    {"--max-flip", "flip", "mean FLIP, 0..1", true},
    {"--min-psnr", "psnr", "peak signal to noise ratio in dB", false},
    {"--min-ssim", "ssim", "structural similarity, up to 1", false},
    {"--min-within", "fraction_within_1", "fraction of pixels whose channels all differ by at most 1/255", false},
};

void print_metrics(const render::ErrorMetrics& m) {
  const auto row = [](const char* name, double value) { std::printf("%-20s %.6g\n", name, value); };
  row("mse", m.mse), row("rel_mse", m.rel_mse), row("trimmed_rel_mse", m.trimmed_rel_mse), row("smape", m.smape);
  row("bias", m.bias), row("psnr", m.psnr), row("ssim", m.ssim), row("flip", m.flip);
  std::printf("%-20s %.6f\n", "fraction_within_1", m.fraction_within_1);
  if (m.not_finite) std::printf("%-20s %s pixels\n", "not_finite", world::with_thousands(m.not_finite).c_str());
  if (!m.equal) {
    std::printf("%-20s (%d, %d): %g %g %g against %g %g %g\n", "worst", m.worst.x, m.worst.y, m.worst.a[0],
                m.worst.a[1], m.worst.a[2], m.worst.b[0], m.worst.b[1], m.worst.b[2]);
  }
  std::printf("%-20s %s\n", "equal", m.equal ? "yes" : "no");
}

world::Result<int> finish(const nlohmann::json& json, bool as_json, const std::vector<std::string>& failed) {
  if (as_json) {
    nlohmann::json all = json;
    all["failed"] = failed;
    std::cout << json_text(all) << '\n';
  }
  for (const std::string& sentence : failed) std::cerr << "loam: " << sentence << '\n';
  return failed.empty() ? 0 : static_cast<int>(world::ErrorKind::comparison);
}

world::Result<int> diff_pictures(const DiffOptions& options) {
  TRY(const render::ImageComparison comparison, compare_picture_files(options.a, options.b));
  if (!options.map.empty()) {
    TRY_STATUS(render::write_png(options.map, render::heat_picture(comparison.flip),
                                 {{"a", options.a}, {"b", options.b}, {"shows", "FLIP: black 0 to white 1"}}));
  }
  std::vector<std::string> failed = failed_thresholds(comparison.metrics, options.thresholds);
  if (options.equal && !comparison.metrics.equal) failed.push_back(options.a + " does not equal " + options.b);
  if (!options.json) print_metrics(comparison.metrics);
  return finish(metrics_json(comparison.metrics), options.json, failed);
}

void print_difference(const WorldDifference& difference) {
  std::printf("%-20s %s\n%-20s %s\n%-20s %s\n", "differing voxels", world::with_thousands(difference.differing).c_str(),
              "only in A", world::with_thousands(difference.only_a).c_str(), "only in B",
              world::with_thousands(difference.only_b).c_str());
  for (const VoxelDifference& d : difference.first) {
    std::printf("  (%d, %d, %d) %s against %s\n", d.pos.x, d.pos.y, d.pos.z, d.a.c_str(), d.b.c_str());
  }
  for (const LayerDifference& d : difference.layers) {
    const auto value = [](const std::optional<double>& v) {
      return v ? fmt::format("{}", *v) : std::string("nothing");
    };
    std::printf("%-20s %s voxels, first at (%d, %d, %d): %s against %s\n", d.layer.c_str(),
                world::with_thousands(d.differing).c_str(), d.pos.x, d.pos.y, d.pos.z, value(d.a).c_str(),
                value(d.b).c_str());
  }
  std::printf("%-20s %s\n", "equal", difference.equal() ? "yes" : "no");
}

world::Result<int> diff_worlds(const DiffOptions& options) {
  if (!options.map.empty() || !options.thresholds.empty()) {
    return world::usage_error("--map and thresholds other than --equal are for pictures, and " + options.a +
                              " is not one");
  }
  world::ImportReport report;
  const auto build = [&](const std::string& name) -> world::Result<world::World> {
    TRY(const world::Scene scene, world::load_scene(name));
    return world::build_world(scene, report);
  };
  TRY(const world::World a, build(options.a));
  TRY(const world::World b, build(options.b));
  const WorldDifference difference = compare_worlds(a, b);
  std::vector<std::string> failed;
  if (options.equal && !difference.equal()) {
    std::string layers;
    for (const LayerDifference& d : difference.layers) layers += fmt::format(", and in {} of {}", d.layer, d.differing);
    failed.push_back(
        fmt::format("{} differs from {} in {} voxels{}", options.a, options.b, difference.differing, layers));
  }
  if (!options.json) print_difference(difference);
  return finish(difference_json(difference), options.json, failed);
}

bool named_as_picture(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension == ".png" || extension == ".exr";
}

world::Result<int> run_diff(const DiffOptions& options) {
  const auto picture = [](const std::string& path) { return is_picture_file(path) || named_as_picture(path); };
  for (const std::string& path : {options.a, options.b}) {
    // Say that a file is missing before saying what it should have been; a world may be the name of a scene.
    std::error_code ignored;
    if (std::filesystem::exists(path, ignored)) continue;
    if (named_as_picture(path)) return world::input_error(path + ": there is no such file");
    TRY([[maybe_unused]] const world::Scene scene, world::load_scene(path));
  }
  if (picture(options.a) != picture(options.b)) {
    return world::input_error(fmt::format("{} is a {} and {} is not: only two pictures or two worlds compare",
                                          options.a, picture(options.a) ? "picture" : "world", options.b));
  }
  return picture(options.a) ? diff_pictures(options) : diff_worlds(options);
}

}  // namespace

void add_diff_verb(CommandLine& command) {
  auto options = std::make_shared<DiffOptions>();
  CLI::App* verb = command.verb("diff", "compare two pictures (A with the reference B), or two worlds");
  verb->add_option("A", options->a, "a .png or .exr, or a world")->required();
  verb->add_option("B", options->b, "the reference, of the same size")->required();
  verb->add_option("--map", options->map, "write a PNG of where the difference is seen (FLIP)");
  for (const ThresholdOption& t : kThresholds) {
    verb->add_option_function<double>(
        t.option,
        [options, &t](double limit) {
          options->thresholds.push_back({t.option, t.name, t.at_most, limit});
        },
        std::string("exit 1 beyond this ") + t.what);
  }
  verb->add_flag("--equal", options->equal, "exit 1 where anything differs");
  verb->add_flag("--json", options->json, "one JSON object on stdout");
  command.action(verb, [options] { return run_diff(*options); });
}

}  // namespace tools
