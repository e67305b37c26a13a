/// Commands that are typed: what they may be, what a line means, and how it may go on.
#pragma once

#include <functional>
#include <string>
#include <variant>
#include <vector>

#include "tools/play/controls.h"
#include "world/space/world_point.h"

namespace tools {

struct GoTo {
  world::WorldPoint place;
};
struct TimeOfDay {
  double hours = 12;
};
struct DayLength {
  double minutes = 20;
};
struct SetKnob {
  std::string name, value;
};
struct FillBox {
  world::VoxelPos from, to;
  std::string block;
};
struct GiveBlock {
  std::string block;
};
struct SpeedTo {
  int eighths = 8;
};
struct NewSeed {
  uint64_t seed = 1;
};
struct OpenScene {
  std::string scene;
};
struct RunBench {
  double seconds = 5;
};
struct BindKey {
  Action action = Action::forward;
  std::string keys;
};
struct DrawnBy {
  std::string backend;
};
struct PressAction {  // /pause, /undo, ...: every action is a command
  Action action = Action::pause;
};
struct ListCommands {};
using ConsoleCommand = std::variant<GoTo, TimeOfDay, DayLength, SetKnob, FillBox, GiveBlock, SpeedTo, NewSeed,
                                    OpenScene, RunBench, BindKey, DrawnBy, PressAction, ListCommands>;

/// Words that there are here.
struct ConsoleWords {
  std::vector<std::string> blocks, scenes, knobs, backends;
  /// The values that a knob may have; empty: numbers.
  std::function<std::vector<std::string>(const std::string& knob)> values_of;
};

/// With or without "/" first. Errors are one sentence, with the nearest word that is known. Coordinates are whole or
/// not, may be written as 1e8, and "~" or "~5" count from `here`.
world::Result<ConsoleCommand> read_command(const std::string& line, const ConsoleWords& words,
                                           const world::WorldPoint& here);
/// The ways in which the last word of the line may end, sorted; whole lines.
std::vector<std::string> complete_command(const std::string& line, const ConsoleWords& words);
/// The longest beginning that all have; `line` where there are none.
std::string common_beginning(const std::vector<std::string>& lines, const std::string& line);

struct CommandRow {
  std::string_view name, arguments, what;
};
const std::vector<CommandRow>& command_rows();  // those with arguments

}  // namespace tools
