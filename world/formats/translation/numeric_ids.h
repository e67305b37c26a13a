/// Numeric ids of Minecraft before 1.13: an id of 12 bits and 4 bits of data -> the name and properties of later
/// versions.
///
///   [ids]
///   1 = ["stone", "granite", ...]     by data; the last name counts for what lies beyond
///   [id.53]
///   names = ["oak_stairs"]            by data & mask
///   mask = 3                          0 where missing: always the first name
///   set = "stairs"                    properties by [property_set.stairs]
///   [property_set.stairs.facing]
///   mask = 3                          the bits of data that choose the value
///   values = ["east", "west", "south", "north"]
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace world {

class TomlTable;

struct NumericId {
  int id = 0, data = 0;
};
/// "17:4"; nothing where it is no such text.
std::optional<NumericId> parse_numeric(std::string_view text);

class NumericIds {
 public:
  void read(TomlTable& root);
  /// "oak_log[axis=y]", or empty where the id is unknown.
  std::string state(int id, int data) const;

 private:
  struct Property {
    int mask = 0;
    std::vector<std::string> values;
  };
  struct Id {
    std::vector<std::string> names;
    int mask = 15;
    std::string set;
  };
  std::map<std::string, std::map<std::string, Property>> sets_;
  std::map<int, Id> ids_;
};

}  // namespace world
