/// Keys and buttons: what each does, by its place on the keyboard, so that WASD is where it is on any layout.
///
/// One table lists all actions: the help, the man page and the settings are made of it. Keys are numbered as GLFW does,
/// which names the places of a US keyboard; buttons of the mouse follow from kMouseButton on.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "world/base/errors.h"

namespace tools {

enum class Action {
#define ACTION(name, keys, group, what) name,
#include "tools/play/actions.def"
#undef ACTION
  count
};

constexpr int kMouseButton = 1000;
enum Modifiers : int { kNoModifier = 0, kShift = 1, kControl = 2, kAlt = 4 };  // bits as GLFW's

struct Key {
  int code = 0;  // GLFW's, or kMouseButton + button
  int modifiers = 0;
  friend auto operator<=>(const Key&, const Key&) = default;
};

/// "ctrl+z", "space", "mouse_left", "f3": and back. Errors name the nearest known key.
std::string key_name(const Key& key);
world::Result<Key> key_from_name(std::string_view name);

struct ActionRow {
  Action action;
  std::string_view name, keys, group, what;  // keys: separated by spaces
};
const std::vector<ActionRow>& action_rows();
const ActionRow& row_of(Action action);
std::optional<Action> action_from_name(std::string_view name);

class Bindings {
 public:
  Bindings();  // the usual ones

  const std::vector<Key>& keys(Action action) const;
  /// "W", or "Ctrl+Y or Ctrl+Shift+Z": for people.
  std::string text(Action action) const;
  world::Status set(Action action, std::string_view keys);  // separated by spaces; empty: none
  void reset(Action action);

  /// What this key does; keys with modifiers come first, and a key that is held through them still moves the player.
  std::optional<Action> find(int code, int modifiers) const;
  /// Whether one of the action's keys is this code, whatever is held beside it: for what goes on while a key is down.
  bool has_code(Action action, int code) const;

  struct Conflict {
    Action a, b;
    Key key;
  };
  std::vector<Conflict> conflicts() const;
  /// Names and keys of those that differ from the usual.
  std::map<std::string, std::string> changed() const;

 private:
  std::vector<std::vector<Key>> keys_;  // by action
};

}  // namespace tools
