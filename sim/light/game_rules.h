/// The rules by which other games light their blocks, so that the light which their files hold can be compared with
/// ours. A table is a file of sim/light/games:
///
///   namespace = "minecraft"         left out of names in the table
///   sky_level = 15                  of the open sky
///   sources_take_light = false      a closed block that gives light takes light too, at a loss of 1
///   [[blocks]]                      the first that fits; blocks that none fits are closed
///   names = ["*_leaves", "ice"]     one * stands for any text
///   when = "waterlogged=true"       only with this property, or without one of that name where nothing follows
///   loss = 1                        1 to 15
///   passes_sky = false              the full light of the sky goes straight down through it; loss is then 1
///   [[sources]]                     the first that fits gives the level
///   names, when
///   level = 15                      1 to 15
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "sim/light/optics.h"
#include "world/formats/translation/translation.h"

namespace sim {

class GameRules {
 public:
  int sky_level() const { return sky_level_; }
  BlockOptics optics(const world::BlockState& state) const;

 private:
  friend world::Result<GameRules> read_game_rules(std::string_view text, const std::string& file_name);
  struct Row {
    std::vector<std::string> names;
    std::string property, value;  // empty: any
    BlockOptics optics;
    bool fits(const world::BlockState& state, std::string_view name) const;
  };
  std::string namespace_;
  int sky_level_ = 15;
  bool sources_take_light_ = false;
  std::vector<Row> blocks_, sources_;
};

/// Errors name file, line and column.
world::Result<GameRules> read_game_rules(std::string_view text, const std::string& file_name);
/// One of those compiled in: "minecraft_1_8" (to 1.12), "minecraft_1_13", "minecraft_1_14" (on), "luanti".
world::Result<GameRules> game_rules(std::string_view game);

}  // namespace sim
