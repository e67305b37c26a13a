/// The windows of play: menus, blocks, options, commands. With ImGui, between its NewFrame and Render. Each returns
/// what was asked for there.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/play/console.h"
#include "tools/play/game.h"
#include "tools/play/settings.h"
#include "tools/play/worlds.h"

struct ImGuiInputTextCallbackData;

namespace tools {

// ---- blocks ----

/// In which part of the palette a block stands.
std::string_view category_of(const world::Block& block, const world::BlockShapes& shapes, world::BlockId id);

class PaletteView {
 public:
  void open();
  /// The block that was chosen; `wants_close` where the view should go.
  std::optional<world::BlockId> draw(const Game& game, float scale, bool& wants_close);

 private:
  std::string search_;
  std::string category_ = "All";
  bool focus_ = false;
  std::optional<world::BlockShapes> shapes_;
};

// ---- commands ----

class ConsoleView {
 public:
  void open();
  /// A line that was entered.
  std::optional<std::string> draw(const ConsoleWords& words, float height, float scale, bool& wants_close);
  void print(const std::string& line);
  size_t lines() const { return printed_; }  // printed so far

 private:
  std::string line_;
  std::vector<std::string> history_, output_;
  int at_ = -1;
  size_t printed_ = 0;
  bool focus_ = false;
  const ConsoleWords* words_ = nullptr;
  static int callback(ImGuiInputTextCallbackData* data);
};

// ---- menus ----

struct Thumbnail {
  uint32_t texture = 0;  // 0: none yet
};

struct MenuChoice {
  std::optional<WorldChoice> play;
  bool resume = false, save = false, leave = false, quit = false, help = false;
  bool lose = false;  // to leave though the world can't be saved
};

struct SceneEntry {
  std::string name, what;
  void* texture = nullptr;  // null: none yet
};

class MenuView {
 public:
  /// The first thing that is seen.
  MenuChoice draw_start(const std::vector<SceneEntry>& scenes, PlaySettings& settings, float width, float height,
                        float scale);
  /// Over the game.
  MenuChoice draw_pause(PlaySettings& settings, const Game& game, float width, float height, float scale);
  /// Where leaving the game would lose what `why` keeps from being saved: resume, save (to try again), or lose.
  static MenuChoice draw_unsaved(const std::string& world, const std::string& why, float width, float height,
                                 float scale);
  /// True where settings changed. `waiting` takes the next key that is pressed, for an action.
  bool draw_settings(PlaySettings& settings, float scale);
  std::optional<Action> waiting_for_key() const { return waiting_; }
  void got_key() { waiting_.reset(); }

 private:
  bool draw_keys(PlaySettings& settings);
  enum class Page { start, new_world, settings };
  Page page_ = Page::start;
  WorldChoice new_world_{.scene = {}, .generator = "valley", .name = "My world"};
  std::optional<Action> waiting_;
};

/// What every key does; true where it was closed.
bool draw_help(const Bindings& bindings, float width, float height, float scale);

}  // namespace tools
