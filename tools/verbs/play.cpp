/// loam play [WORLD or SCENE]: the sandbox, in a window.
#include "tools/play/app.h"
#include "tools/verb.h"

namespace tools {

void add_play_verb(CommandLine& command) {
  auto options = std::make_shared<PlayOptions>();
  CLI::App* verb =
      command.verb("play", "the sandbox, in a window: walk, build, pour water, and see what each option costs");
  verb->add_option("WORLD", options->world, "a scene, a saved world, or any file that can be read (default: the menu)");
  verb->add_option("--backend", options->backend, "what draws: raster, raycast or reference; F6 changes it");
  verb->add_option("--set", options->settings, "a knob of pictures, KNOB=VALUE; F9 shows all")->allow_extra_args(false);
  verb->add_option("--record", options->record, "write what is done to this file: `loam replay` repeats it");
  verb->add_option_function<std::string>(
      "--size",
      [options](const std::string& text) {
        if (std::sscanf(text.c_str(), "%dx%d", &options->width, &options->height) != 2 || options->width < 64 ||
            options->height < 64 || options->width > 16384 || options->height > 16384)
          throw CLI::ValidationError("--size", "takes WIDTHxHEIGHT, for instance 1280x720");
      },
      "the window's size, WIDTHxHEIGHT (default: 1280x720)");
  verb->add_flag("--menu", options->menu, "begin with the menu");
  verb->add_flag("!--no-save", options->keep, "play a scene without a file of its own");
  verb->add_option("--status", options->status, "for tests: rewrite this file with what is going on")->group("");
  verb->add_flag("--no-vulkan", options->no_vulkan, "for tests: as on a machine without Vulkan")->group("");
  command.action(verb, [options] { return run_play(*options); });
}

}  // namespace tools
