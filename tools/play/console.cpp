#include "tools/play/console.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>

#include "world/base/text.h"

namespace tools {

using world::usage_error;
using world::VoxelPos;
using world::WorldPoint;

namespace {

std::vector<std::string> words_of(const std::string& line) {
  std::istringstream in(line.starts_with("/") ? line.substr(1) : line);
  std::vector<std::string> words;
  for (std::string word; in >> word;) words.push_back(word);
  return words;
}

std::optional<double> number(std::string_view text) {
  double value = 0;
  const auto end = std::from_chars(text.data(), text.data() + text.size(), value);
  if (end.ec != std::errc() || end.ptr != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

world::Error no_such(const std::string& what, const std::string& word, const std::vector<std::string>& known) {
  const std::string nearest = world::nearest_text(word, known);
  return usage_error("there is no " + what + " \"" + word + "\"" +
                     (nearest.empty() ? "" : " (did you mean \"" + nearest + "\"?)"));
}

/// One coordinate as a voxel and a fraction; "~" counts from the one here.
world::Result<std::pair<int32_t, double>> coordinate(const std::string& word, int32_t voxel, double fraction) {
  std::string_view text = word;
  const bool relative = text.starts_with("~");
  if (relative) text.remove_prefix(1);
  const std::optional<double> value = relative && text.empty() ? 0.0 : number(text);
  if (!value) return usage_error("\"" + word + "\" is no coordinate: it is a number, ~ or ~ and a number");
  const double whole = std::floor(*value + (relative ? fraction : 0.0));
  const double at = whole + (relative ? voxel : 0);
  if (!(std::abs(at) < world::kWorldBorder))
    return usage_error("\"" + word + "\" lies outside of the world, which ends at 1,073,737,728 m");
  double rest = *value + (relative ? fraction : 0.0) - whole;
  if (rest >= 1) rest = 0x1.fffffffffffffp-1;
  return std::pair{static_cast<int32_t>(at), rest};
}

world::Result<WorldPoint> place(const std::vector<std::string>& words, size_t first, const WorldPoint& here) {
  WorldPoint p;
  for (int a = 0; a < 3; ++a) {
    TRY(const auto c, coordinate(words[first + static_cast<size_t>(a)], here.voxel[a], here.fraction[a]));
    p.voxel[a] = c.first, p.fraction[a] = c.second;
  }
  return p;
}

const std::vector<std::pair<std::string, double>>& named_hours() {
  static const std::vector<std::pair<std::string, double>> all = {{"dawn", 6.3},   {"day", 10},   {"dusk", 17.7},
                                                                  {"midnight", 0}, {"night", 22}, {"noon", 12}};
  return all;
}

world::Result<double> hours_of(const std::string& word) {
  std::vector<std::string> names;
  for (const auto& [name, hours] : named_hours()) {
    if (name == word) return hours;
    names.push_back(name);
  }
  if (const size_t colon = word.find(':'); colon != std::string::npos) {
    const auto h = number(word.substr(0, colon)), m = number(word.substr(colon + 1));
    if (h && m && *h >= 0 && *h <= 24 && *m >= 0 && *m < 60) return *h + *m / 60;
  } else if (const auto h = number(word); h && *h >= 0 && *h <= 24) {
    return *h;
  }
  return no_such("time", word, names);
}

world::Result<std::string> known(const std::string& what, const std::string& word,
                                 const std::vector<std::string>& all) {
  if (std::find(all.begin(), all.end(), word) != all.end()) return word;
  return no_such(what, word, all);
}

/// Actions that a command may do: those that aren't held down.
std::vector<std::string> action_names() {
  std::vector<std::string> names;
  for (const ActionRow& row : action_rows()) names.emplace_back(row.name);
  return names;
}

std::vector<std::string> all_commands() {
  std::vector<std::string> names = action_names();
  for (const CommandRow& row : command_rows()) names.emplace_back(row.name);
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  return names;
}

const std::vector<std::string> kLights{"flood4", "flood_rgb", "flux", "none"};

/// What the word of that number may be.
std::vector<std::string> choices(const std::vector<std::string>& before, const ConsoleWords& words) {
  if (before.empty()) return all_commands();
  const std::string& verb = before[0];
  const size_t n = before.size();
  if (verb == "time" && n == 1) {
    std::vector<std::string> names;
    for (const auto& [name, hours] : named_hours()) names.push_back(name);
    return names;
  }
  if (verb == "light" && n == 1) return kLights;
  if (verb == "set" && n == 1) return words.knobs;
  if (verb == "set" && n == 2) return words.values_of ? words.values_of(before[1]) : std::vector<std::string>{};
  if (verb == "give" && n == 1) return words.blocks;
  if (verb == "fill" && n == 7) return words.blocks;
  if (verb == "scene" && n == 1) return words.scenes;
  if (verb == "backend" && n == 1) return words.backends;
  if (verb == "speed" && n == 1) return {"1", "2", "4", "8", "16", "32", "64", "0.125", "0.25", "0.5"};
  if (verb == "bind" && n == 1) return action_names();
  return {};
}

}  // namespace

const std::vector<CommandRow>& command_rows() {
  static const std::vector<CommandRow> rows = {
      {"goto", "x y z", "go there: numbers, 1e8 too; ~ is here, ~5 is 5 m on"},
      {"time", "dawn|day|noon|dusk|night|midnight|HH:MM", "where the sun stands"},
      {"day", "minutes", "how long a day takes, 0 to 1440; 0: the sun stands still"},
      {"light", "none|flood4|flood_rgb|flux", "the model of the light in the world"},
      {"set", "knob value", "a knob of pictures"},
      {"fill", "x y z x y z block", "all voxels between two corners"},
      {"give", "block", "take a block into the hand"},
      {"speed", "1", "the world's time, 0.125 to 64 times"},
      {"seed", "number", "a new world like this one, of that seed"},
      {"scene", "name", "play a scene, or a file"},
      {"backend", "raster|raycast|reference", "what draws"},
      {"bench", "seconds", "measures pictures from here, turning once round"},
      {"bind", "action keys", "keys for an action, by their names"},
      {"commands", "", "lists these"},
  };
  return rows;
}

world::Result<ConsoleCommand> read_command(const std::string& line, const ConsoleWords& words, const WorldPoint& here) {
  const std::vector<std::string> w = words_of(line);
  if (w.empty()) return usage_error("type a command; Tab shows how it may go on");
  const std::string& verb = w[0];
  const auto needs = [&](size_t n) -> world::Status {
    if (w.size() == n + 1) return {};
    for (const CommandRow& row : command_rows())
      if (row.name == verb) return usage_error("/" + verb + " takes " + std::string(row.arguments));
    return usage_error("/" + verb + " takes nothing");
  };
  if (verb == "commands") return ConsoleCommand(ListCommands{});
  if (verb == "goto") {
    TRY_STATUS(needs(3));
    TRY(const WorldPoint p, place(w, 1, here));
    return ConsoleCommand(GoTo{p});
  }
  if (verb == "time") {
    TRY_STATUS(needs(1));
    TRY(const double hours, hours_of(w[1]));
    return ConsoleCommand(TimeOfDay{hours});
  }
  if (verb == "day") {
    TRY_STATUS(needs(1));
    const auto minutes = number(w[1]);
    if (!minutes || *minutes < 0 || *minutes > 1440)
      return usage_error("/day takes the minutes of a day, 0 (the sun stands still) to 1440");
    return ConsoleCommand(DayLength{*minutes});
  }
  if (verb == "light") {
    TRY_STATUS(needs(1));
    TRY(const std::string model, known("model of light", w[1], kLights));
    return ConsoleCommand(SetKnob{"light_model", model});
  }
  if (verb == "set") {
    TRY_STATUS(needs(2));
    TRY(const std::string knob, known("knob", w[1], words.knobs));
    return ConsoleCommand(SetKnob{knob, w[2]});
  }
  if (verb == "fill") {
    TRY_STATUS(needs(7));
    TRY(const WorldPoint from, place(w, 1, here));
    TRY(const WorldPoint to, place(w, 4, here));
    TRY(const std::string block, known("block", w[7], words.blocks));
    return ConsoleCommand(FillBox{from.voxel, to.voxel, block});
  }
  if (verb == "give") {
    TRY_STATUS(needs(1));
    TRY(const std::string block, known("block", w[1], words.blocks));
    return ConsoleCommand(GiveBlock{block});
  }
  if (verb == "speed") {
    TRY_STATUS(needs(1));
    const auto times = number(w[1]);
    if (!times || *times < 0.125 || *times > 64) return usage_error("/speed takes a number from 0.125 to 64");
    return ConsoleCommand(SpeedTo{static_cast<int>(std::lround(*times * 8))});
  }
  if (verb == "seed") {
    TRY_STATUS(needs(1));
    const auto seed = number(w[1]);
    if (!seed || *seed < 0 || *seed > 9e15 || *seed != std::floor(*seed))
      return usage_error("/seed takes a whole number from 0 on");
    return ConsoleCommand(NewSeed{static_cast<uint64_t>(*seed)});
  }
  if (verb == "scene") {
    TRY_STATUS(needs(1));
    return ConsoleCommand(OpenScene{w[1]});
  }
  if (verb == "backend") {
    TRY_STATUS(needs(1));
    TRY(const std::string backend, known("backend", w[1], words.backends));
    return ConsoleCommand(DrawnBy{backend});
  }
  if (verb == "bench") {
    const auto seconds = w.size() == 1 ? std::optional<double>(5.0) : number(w[1]);
    if (w.size() > 2 || !seconds || *seconds < 1 || *seconds > 600)
      return usage_error("/bench takes seconds, 1 to 600");
    return ConsoleCommand(RunBench{*seconds});
  }
  if (verb == "bind") {
    if (w.size() < 2) return needs(2).error();
    const auto action = action_from_name(w[1]);
    if (!action) return no_such("action", w[1], action_names());
    std::string keys;
    for (size_t i = 2; i < w.size(); ++i) keys += (i > 2 ? " " : "") + w[i];
    Bindings check;
    TRY_STATUS(check.set(*action, keys));
    return ConsoleCommand(BindKey{*action, keys});
  }
  if (const auto action = action_from_name(verb)) {
    TRY_STATUS(needs(0));
    return ConsoleCommand(PressAction{*action});
  }
  return no_such("command", verb, all_commands());
}

std::vector<std::string> complete_command(const std::string& line, const ConsoleWords& words) {
  std::vector<std::string> before = words_of(line);
  std::string last;
  if (!before.empty() && !line.ends_with(' ')) last = before.back(), before.pop_back();
  const std::string head = line.substr(0, line.size() - last.size());
  std::vector<std::string> lines;
  for (const std::string& choice : choices(before, words))
    if (choice.starts_with(last)) lines.push_back((head.empty() ? "/" : head) + choice);
  std::sort(lines.begin(), lines.end());
  return lines;
}

std::string common_beginning(const std::vector<std::string>& lines, const std::string& line) {
  if (lines.empty()) return line;
  std::string common = lines[0];
  for (const std::string& other : lines) {
    size_t n = 0;
    while (n < common.size() && n < other.size() && common[n] == other[n]) ++n;
    common.resize(n);
  }
  return lines.size() == 1 ? common + " " : common;
}

}  // namespace tools
