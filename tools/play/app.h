/// `loam play`: the window, what it shows, and what is typed into it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "world/base/errors.h"

namespace tools {

struct PlayOptions {
  std::string world;                  // a scene, or a file; empty: the last world, or the menu
  std::string backend;                // empty: as in the settings
  std::vector<std::string> settings;  // KNOB=VALUE of pictures
  std::filesystem::path record;       // a log for `loam replay`
  std::filesystem::path status;       // a JSON object that says what is going on, rewritten ten times a second
  int width = 1280, height = 720;
  bool menu = false;       // the menu, whatever was played last
  bool keep = true;        // false: a scene is played without a file of its own
  bool no_vulkan = false;  // for tests: as on a machine without
};

/// Runs until the window is closed. Fails with one sentence where there is no display, or nothing that draws.
world::Result<int> run_play(const PlayOptions& options);

}  // namespace tools
