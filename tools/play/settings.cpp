#include "tools/play/settings.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>

#include <fmt/format.h>

#include "world/base/file.h"
#include "world/base/toml_reader.h"
#include "world/base/text.h"

namespace tools {

namespace {

constexpr size_t kMostRecent = 12;

std::filesystem::path folder_of(const char* variable, const char* below_home) {
  if (const char* all = std::getenv("LOAM_DATA"); all && *all) return all;
  // What isn't absolute is to be left aside, says the specification.
  if (const char* xdg = std::getenv(variable); xdg && *xdg == '/') return std::filesystem::path(xdg) / "loam";
  const char* home = std::getenv("HOME");
  return std::filesystem::path(home && *home ? home : "/tmp") / below_home / "loam";
}

void read_keys(world::TomlTable table, Bindings& bindings) {
  for (const ActionRow& row : action_rows()) {
    std::string keys;
    const std::string name(row.name);
    if (!table.read(name, keys)) continue;
    const world::Status set = bindings.set(row.action, keys);
    if (!set.ok()) table.fail(name, set.error().message);
  }
}

}  // namespace

std::filesystem::path config_folder() { return folder_of("XDG_CONFIG_HOME", ".config"); }
std::filesystem::path data_folder() { return folder_of("XDG_DATA_HOME", ".local/share"); }
std::filesystem::path settings_path() { return config_folder() / "play.toml"; }

void PlaySettings::note_world(const std::string& path) {
  last_world = path;
  std::erase(recent, path);
  recent.insert(recent.begin(), path);
  if (recent.size() > kMostRecent) recent.resize(kMostRecent);
}

world::Result<PlaySettings> read_settings(const std::filesystem::path& path) {
  PlaySettings s;
  std::ifstream in(path, std::ios::binary);
  if (!in) return s;
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  TRY(world::TomlDocument document, world::TomlDocument::parse(text, path.string()));
  world::TomlTable root = document.root();
  root.read("mouse_speed", s.mouse_speed, {0.1, 10});
  root.read("invert_mouse", s.invert_mouse);
  root.read("fov_deg", s.fov_deg, {45, 120});
  root.read("ui_scale", s.ui_scale, {0.5, 3});
  root.read("picture_scale", s.picture_scale, {0, 1});
  root.read("vertical_sync", s.vertical_sync);
  root.read("autosave_s", s.autosave_s, {0, 86400});
  root.read("day_minutes", s.day_minutes, {0, 1440});
  root.read("backend", s.backend);
  root.read("seen_help", s.seen_help);
  root.read("last_world", s.last_world);
  root.read("recent", s.recent);
  for (world::TomlTable knobs : root.table("knobs"))
    for (const std::string& name : knobs.keys()) knobs.read(name, s.knobs[name]);
  for (world::TomlTable keys : root.table("keys")) read_keys(keys, s.bindings);
  TRY_STATUS(document.finish());
  return s;
}

std::string settings_text(const PlaySettings& s) {
  const auto quoted = [](const std::string& text) { return world::toml_text(text); };
  std::string text = "# Settings of `loam play`; written by it.\n";
  text += fmt::format("mouse_speed = {}\ninvert_mouse = {}\nfov_deg = {}\nui_scale = {}\npicture_scale = {}\n",
                      world::number_text(s.mouse_speed), s.invert_mouse, world::number_text(s.fov_deg),
                      world::number_text(s.ui_scale), world::number_text(s.picture_scale));
  text += fmt::format(
      "vertical_sync = {}\nautosave_s = {}\nday_minutes = {}\nbackend = {}\nseen_help = {}\nlast_world = {}\n",
      s.vertical_sync, world::number_text(s.autosave_s), world::number_text(s.day_minutes), quoted(s.backend),
      s.seen_help, quoted(s.last_world));
  text += "recent = [";
  for (size_t i = 0; i < s.recent.size(); ++i) text += (i ? ", " : "") + quoted(s.recent[i]);
  text += "]\n\n[knobs]\n";
  for (const auto& [name, value] : s.knobs) text += name + " = " + quoted(value) + "\n";
  text += "\n[keys]\n";
  for (const auto& [name, keys] : s.bindings.changed()) text += name + " = " + quoted(keys) + "\n";
  return text;
}

world::Status write_settings(const PlaySettings& s, const std::filesystem::path& path) {
  const std::string text = settings_text(s);
  std::error_code made;
  std::filesystem::create_directories(path.parent_path(), made);
  return world::write_file_atomically(path, [&](const std::filesystem::path& temporary) -> world::Status {
    std::ofstream out(temporary, std::ios::binary);
    out << text << std::flush;
    if (!out) return world::input_error(path.string() + ": the settings can't be written there");
    return {};
  });
}

}  // namespace tools
