/// What play keeps from one start to the next, and where: the XDG folders, or LOAM_DATA for both.
///
///   settings   $XDG_CONFIG_HOME/loam/play.toml     only what differs from the usual
///   worlds     $XDG_DATA_HOME/loam/worlds/NAME.loam
///   pictures   $XDG_DATA_HOME/loam/screenshots/
/// source freedesktop.org. XDG Base Directory Specification, version 0.8. 2021
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "tools/play/controls.h"

namespace tools {

struct PlaySettings {
  double mouse_speed = 1;  // 0.1 .. 10
  bool invert_mouse = false;
  double fov_deg = 70;       // 45 .. 120, vertical
  double ui_scale = 1;       // 0.5 .. 3
  double picture_scale = 0;  // 0.1 .. 1: pixels of the picture for each of the window, along each axis; 0: as many
                             // as can be drawn 30 times a second
  bool vertical_sync = true;
  double autosave_s = 60;   // 0: never
  double day_minutes = 20;  // 0: the sun stands still; 0 .. 1440 of the world's time, where it has hours
  std::string backend = "raster";
  std::map<std::string, std::string> knobs;  // of pictures, over those of the world
  bool seen_help = false;
  std::string last_world;           // a path; empty: none
  std::vector<std::string> recent;  // paths, newest first
  Bindings bindings;

  void note_world(const std::string& path);  // it is the last, and the first of the recent ones
};

std::filesystem::path config_folder();
std::filesystem::path data_folder();
std::filesystem::path settings_path();

/// A missing file gives the usual settings. What is wrong in the file is an error that names line and key.
world::Result<PlaySettings> read_settings(const std::filesystem::path& path);
/// As the file has them.
std::string settings_text(const PlaySettings& settings);
/// Makes the folder; writes beside the file first, so that it is whole or as before.
world::Status write_settings(const PlaySettings& settings, const std::filesystem::path& path);

}  // namespace tools
