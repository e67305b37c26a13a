#include "tools/play/controls.h"

#include <algorithm>
#include <array>

#include <GLFW/glfw3.h>

#include "world/base/text.h"

namespace tools {

namespace {

struct NamedKey {
  std::string_view name;
  int code;
};

const std::vector<NamedKey>& named_keys() {
  static const std::vector<NamedKey> all = [] {
    std::vector<NamedKey> keys = {{"space", GLFW_KEY_SPACE},
                                  {"apostrophe", GLFW_KEY_APOSTROPHE},
                                  {"comma", GLFW_KEY_COMMA},
                                  {"minus", GLFW_KEY_MINUS},
                                  {"period", GLFW_KEY_PERIOD},
                                  {"slash", GLFW_KEY_SLASH},
                                  {"semicolon", GLFW_KEY_SEMICOLON},
                                  {"equal", GLFW_KEY_EQUAL},
                                  {"left_bracket", GLFW_KEY_LEFT_BRACKET},
                                  {"backslash", GLFW_KEY_BACKSLASH},
                                  {"right_bracket", GLFW_KEY_RIGHT_BRACKET},
                                  {"grave_accent", GLFW_KEY_GRAVE_ACCENT},
                                  {"escape", GLFW_KEY_ESCAPE},
                                  {"enter", GLFW_KEY_ENTER},
                                  {"tab", GLFW_KEY_TAB},
                                  {"backspace", GLFW_KEY_BACKSPACE},
                                  {"insert", GLFW_KEY_INSERT},
                                  {"delete", GLFW_KEY_DELETE},
                                  {"arrow_right", GLFW_KEY_RIGHT},
                                  {"arrow_left", GLFW_KEY_LEFT},
                                  {"arrow_down", GLFW_KEY_DOWN},
                                  {"arrow_up", GLFW_KEY_UP},
                                  {"page_up", GLFW_KEY_PAGE_UP},
                                  {"page_down", GLFW_KEY_PAGE_DOWN},
                                  {"home", GLFW_KEY_HOME},
                                  {"end", GLFW_KEY_END},
                                  {"left_shift", GLFW_KEY_LEFT_SHIFT},
                                  {"left_control", GLFW_KEY_LEFT_CONTROL},
                                  {"left_alt", GLFW_KEY_LEFT_ALT},
                                  {"right_shift", GLFW_KEY_RIGHT_SHIFT},
                                  {"right_control", GLFW_KEY_RIGHT_CONTROL},
                                  {"right_alt", GLFW_KEY_RIGHT_ALT},
                                  {"mouse_left", kMouseButton},
                                  {"mouse_right", kMouseButton + 1},
                                  {"mouse_middle", kMouseButton + 2},
                                  {"mouse_4", kMouseButton + 3},
                                  {"mouse_5", kMouseButton + 4}};
    static constexpr std::string_view kLetters = "abcdefghijklmnopqrstuvwxyz", kDigits = "0123456789";
    for (size_t i = 0; i < kLetters.size(); ++i)
      keys.push_back({kLetters.substr(i, 1), GLFW_KEY_A + static_cast<int>(i)});
    for (size_t i = 0; i < kDigits.size(); ++i)
      keys.push_back({kDigits.substr(i, 1), GLFW_KEY_0 + static_cast<int>(i)});
    static constexpr std::array<std::string_view, 12> kFunctions{"f1", "f2", "f3", "f4",  "f5",  "f6",
                                                                 "f7", "f8", "f9", "f10", "f11", "f12"};
    for (size_t i = 0; i < kFunctions.size(); ++i) keys.push_back({kFunctions[i], GLFW_KEY_F1 + static_cast<int>(i)});
    return keys;
  }();
  return all;
}

world::Result<std::vector<Key>> keys_from(std::string_view text) {
  std::vector<Key> keys;
  while (!text.empty()) {
    const size_t end = std::min(text.find(' '), text.size());
    if (end > 0) {
      TRY(const Key key, key_from_name(text.substr(0, end)));
      keys.push_back(key);
    }
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return keys;
}

}  // namespace

std::string key_name(const Key& key) {
  std::string name;
  if (key.modifiers & kControl) name += "ctrl+";
  if (key.modifiers & kShift) name += "shift+";
  if (key.modifiers & kAlt) name += "alt+";
  for (const NamedKey& known : named_keys())
    if (known.code == key.code) return name + std::string(known.name);
  return name + "key_" + std::to_string(key.code);
}

world::Result<Key> key_from_name(std::string_view name) {
  Key key;
  std::string_view rest = name;
  for (const auto& [prefix, bit] : {std::pair<std::string_view, int>{"ctrl+", kControl},
                                    {"shift+", kShift},
                                    {"alt+", kAlt},
                                    {"ctrl+", kControl},
                                    {"shift+", kShift}})
    if (rest.starts_with(prefix)) key.modifiers |= bit, rest.remove_prefix(prefix.size());
  std::vector<std::string> names;
  for (const NamedKey& known : named_keys()) {
    if (known.name == rest) {
      key.code = known.code;
      return key;
    }
    names.emplace_back(known.name);
  }
  if (rest.starts_with("key_") && rest.size() < 10) {
    const int code = std::atoi(std::string(rest.substr(4)).c_str());
    if (code > 0) return Key{code, key.modifiers};
  }
  return world::usage_error("there is no key \"" + std::string(name) + "\" (did you mean \"" +
                            std::string(world::nearest_text(std::string(rest), names)) + "\"?)");
}

const std::vector<ActionRow>& action_rows() {
  static const std::vector<ActionRow> rows = {
#define ACTION(name, keys, group, what) {Action::name, #name, keys, group, what},
#include "tools/play/actions.def"
#undef ACTION
  };
  return rows;
}

const ActionRow& row_of(Action action) { return action_rows()[static_cast<size_t>(action)]; }

std::optional<Action> action_from_name(std::string_view name) {
  for (const ActionRow& row : action_rows())
    if (row.name == name) return row.action;
  return std::nullopt;
}

Bindings::Bindings() : keys_(static_cast<size_t>(Action::count)) {
  for (const ActionRow& row : action_rows()) reset(row.action);
}

const std::vector<Key>& Bindings::keys(Action action) const { return keys_[static_cast<size_t>(action)]; }

std::string Bindings::text(Action action) const {
  std::string all;
  for (const Key& key : keys(action)) {
    std::string name = key_name(key);
    for (size_t i = 0; i < name.size(); ++i) {
      if (i == 0 || name[i - 1] == '+') name[i] = static_cast<char>(std::toupper(static_cast<unsigned char>(name[i])));
      if (name[i] == '_') name[i] = ' ';
    }
    all += (all.empty() ? "" : " or ") + name;
  }
  return all.empty() ? "no key" : all;
}

world::Status Bindings::set(Action action, std::string_view keys) {
  TRY(keys_[static_cast<size_t>(action)], keys_from(keys));
  return {};
}

void Bindings::reset(Action action) { CHECK(set(action, row_of(action).keys).ok()); }

std::optional<Action> Bindings::find(int code, int modifiers) const {
  modifiers &= kShift | kControl | kAlt;
  for (const bool exact : {true, false})
    for (size_t a = 0; a < keys_.size(); ++a)
      for (const Key& key : keys_[a])
        if (key.code == code && (exact ? key.modifiers == modifiers : key.modifiers == 0))
          return static_cast<Action>(a);
  return std::nullopt;
}

bool Bindings::has_code(Action action, int code) const {
  return std::any_of(keys(action).begin(), keys(action).end(), [&](const Key& key) { return key.code == code; });
}

std::vector<Bindings::Conflict> Bindings::conflicts() const {
  std::vector<Conflict> all;
  for (size_t a = 0; a < keys_.size(); ++a)
    for (size_t b = a + 1; b < keys_.size(); ++b)
      for (const Key& key : keys_[a])
        if (std::find(keys_[b].begin(), keys_[b].end(), key) != keys_[b].end())
          all.push_back({static_cast<Action>(a), static_cast<Action>(b), key});
  return all;
}

std::map<std::string, std::string> Bindings::changed() const {
  std::map<std::string, std::string> all;
  for (const ActionRow& row : action_rows()) {
    std::string now;
    for (const Key& key : keys(row.action)) now += (now.empty() ? "" : " ") + key_name(key);
    if (now != row.keys) all[std::string(row.name)] = now;
  }
  return all;
}

}  // namespace tools
