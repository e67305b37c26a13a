/// loam convert IN OUT: import and export, by extension and content, with a table of what could not be mapped.
#include <cstdio>
#include <iostream>

#include <nlohmann/json.hpp>

#include "tools/progress.h"
#include "tools/json_text.h"
#include "tools/picture.h"
#include "render/export/export.h"
#include "tools/verb.h"
#include "world/base/text.h"
#include "world/formats/format.h"
#include "world/scenes/scene.h"

namespace tools {

namespace {

struct ConvertOptions {
  std::string input, output;
  std::vector<int> window;
  world::ImportOptions import;
  bool json = false;
  std::string surface;  // a method of isosurfaces; empty: the faces of blocks
  render::SmoothOptions smooth;
};

void print_report(const world::World& world, const world::ImportReport& report, const std::string& output,
                  const std::vector<std::string>& lost) {
  for (const auto& [name, value] : report.facts) std::printf("%-24s %s\n", name.c_str(), value.c_str());
  std::printf("%-24s %s\n", "voxels", world::with_thousands(world.store.voxel_count()).c_str());
  if (!report.unmapped.empty()) std::printf("\nno block for:\n");
  for (const auto& [name, count] : report.unmapped)
    std::printf("  %-38s %s\n", name.c_str(), world::with_thousands(count).c_str());
  if (!lost.empty()) std::printf("\nnot in %s:\n", output.c_str());
  for (const std::string& sentence : lost) std::printf("  %s\n", sentence.c_str());
  for (const std::string& warning : report.warnings) std::fprintf(stderr, "warning: %s\n", warning.c_str());
}

world::Result<int> run_convert(ConvertOptions options) {
  if (!options.window.empty()) {
    if (options.window.size() != 4)
      return world::usage_error("--window takes COLUMN ROW WIDTH HEIGHT in posts, columns from west, rows from north");
    options.import.window = {options.window[0], options.window[1], options.window[2], options.window[3]};
  }
  // Before the work: an output that cannot be written should not cost an import.
  const render::SurfaceFormat* const surface = render::surface_format_for(options.output);
  const world::Format* writer = nullptr;
  if (!surface) {
    const world::Result<const world::Format*> found = world::format_for_writing(options.output);
    if (!found) return world::usage_error(found.error().message + "; and surfaces, as .obj, .ply or .glb");
    writer = *found;
  }
  if (!options.surface.empty() && !surface)
    return world::usage_error("--surface makes a mesh, which is written as .obj, .ply or .glb");
  if (options.smooth.adaptivity > 0 && options.smooth.method != render::SurfaceMethod::openvdb)
    return world::usage_error("--adaptivity goes with --surface openvdb");
  world::ImportReport report;
  TRY(world::Scene scene, world::load_scene(options.input));
  if (scene.file == options.input) scene.import_options = options.import;  // else it is a scene, with its own
  Progress progress;
  progress.stage("reading " + options.input);
  TRY(world::World world, build_picture_world(scene, report));  // with the images and meshes that a save keeps
  if (options.import.strict && !report.unmapped.empty())
    return world::input_error(options.input + ": " + std::to_string(report.unmapped.size()) +
                              " kinds of block have no match, the first is \"" + report.unmapped.begin()->first +
                              "\": map them or leave --strict out");
  const std::vector<std::string> lost = surface          ? render::surface_losses(world, *surface)
                                        : writer->losses ? writer->losses(world)
                                                         : std::vector<std::string>();
  if (options.import.strict && !lost.empty())
    return world::input_error(options.output + ": " + lost.front() + "; leave --strict out to write it so");
  progress.stage("writing " + options.output);
  TRY_STATUS(!options.surface.empty() ? render::write_smooth_surface(world, options.smooth, *surface, options.output)
             : surface                ? render::write_surface(world, *surface, options.output)
                                      : world::write_world(world, options.output));
  progress.stage("");
  if (options.json) {
    nlohmann::json j{{"voxels", world.store.voxel_count()},
                     {"unmapped", report.unmapped},
                     {"warnings", report.warnings},
                     {"lost", lost}};
    for (const auto& [name, value] : report.facts) j["facts"][name] = value;
    std::cout << json_text(j) << '\n';
  } else {
    print_report(world, report, options.output, lost);
  }
  return 0;
}

}  // namespace

void add_import_options(CLI::App* verb, world::ImportOptions& import, std::vector<int>& window) {
  verb->add_flag("--strict", import.strict, "what has no match is an error");
  verb->add_flag("--visible-only", import.visible_only, "leave hidden parts out");
  verb->add_option("--frame", import.frame, "frame of an animated file");
  verb->add_option("--metres-per-voxel", import.metres_per_voxel,
                   "elevation, surfaces, points: size of a voxel (default: the spacing of the posts; a round number)")
      ->check(CLI::PositiveNumber);
  verb->add_option("--window", window, "elevation: COLUMN ROW WIDTH HEIGHT in posts, from the north-west")->expected(4);
  verb->add_option("--vertical-scale", import.vertical_scale, "elevation: heights times this")
      ->check(CLI::PositiveNumber);
  verb->add_option("--depth", import.depth_voxels, "elevation: ground below the lowest height, in voxels")
      ->check(CLI::Range(1, 4096));
  verb->add_option("--post-spacing", import.post_spacing_m, "elevation pictures: metres between posts")
      ->check(CLI::PositiveNumber);
  verb->add_option_function<std::vector<double>>(
          "--height-range",
          [&import](const std::vector<double>& range) {
            import.height_range_m = {range[0], range[1]};
          },
          "elevation pictures: LOW HIGH, the metres of black and white")
      ->expected(2);
  verb->add_option("--supersampling", import.supersampling, "surfaces, points: points along each axis of a voxel")
      ->check(CLI::Range(1, 16));
  verb->add_option("--coverage", import.coverage,
                   "surfaces, points: a voxel is filled where this part of it is; 0: wherever it is touched")
      ->check(CLI::Range(0.0, 1.0));
  verb->add_flag("--shell", import.shell, "surfaces: one voxel thick, in place of filled");
  verb->add_option("--point-radius", import.point_radius_m, "points: balls of this radius (m)")
      ->check(CLI::PositiveNumber);
  verb->add_option_function<std::string>(
          "--up",
          [&import](const std::string& axis) {
            import.up = axis == "y" ? world::ImportOptions::Up::y : world::ImportOptions::Up::z;
          },
          "surfaces, points: y or z, the axis that points upwards in the file")
      ->check(CLI::IsMember({"y", "z"}));
  verb->add_option("--grid", import.grid, ".vdb, .nvdb: the grid to read, where a file holds several");
}

void add_convert_verb(CommandLine& command) {
  auto options = std::make_shared<ConvertOptions>();
  CLI::App* verb = command.verb("convert", "import and export worlds, by extension");
  verb->add_option("IN", options->input, "a file, a scene, or a scene .toml")->required();
  verb->add_option("OUT", options->output, "what to write")->required();
  add_import_options(verb, options->import, options->window);
  const auto methods = render::surface_method_names();
  CLI::Option* const surface = verb->add_option_function<std::string>(
                                       "--surface",
                                       [options](const std::string& name) {
                                         options->surface = name;
                                         options->smooth.method = *render::surface_method_from_name(name);
                                       },
                                       "meshes: the smooth surface of the world's level set or density, by this method")
                                   ->check(CLI::IsMember(std::vector<std::string>(methods.begin(), methods.end())));
  verb->add_option("--iso", options->smooth.iso, "--surface of a density: denser is inside (default: 0.5)")
      ->check(CLI::PositiveNumber)
      ->needs(surface);
  verb->add_option("--adaptivity", options->smooth.adaptivity,
                   "--surface openvdb: 0 to 1, fewer and larger triangles where it is flat")
      ->check(CLI::Range(0.0, 1.0))
      ->needs(surface);
  verb->add_flag("--json", options->json, "one JSON object on stdout");
  command.action(verb, [options] { return run_convert(*options); });
}

}  // namespace tools
