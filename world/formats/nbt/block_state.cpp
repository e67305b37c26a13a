#include "world/formats/nbt/block_state.h"

#include <algorithm>

namespace world::nbt {

std::optional<std::string> read_block_state(Reader& in) {
  std::string text;
  std::vector<std::pair<std::string_view, std::string_view>> properties;
  for (Entry e; in.next(e);) {
    if (e.name == "Name") {
      text = in.text(e);
    } else if (e.name == "Properties" && e.type == Type::compound) {
      for (Entry p; in.next(p);) properties.emplace_back(p.name, in.text(p));
    } else {
      in.skip(e);
    }
  }
  if (in.failed() || text.empty()) return {};
  std::sort(properties.begin(), properties.end());
  char before = '[';
  for (const auto& [key, value] : properties) {
    text += before;
    text.append(key).append("=").append(value);
    before = ',';
  }
  if (before == ',') text += ']';
  return text;
}

}  // namespace world::nbt
