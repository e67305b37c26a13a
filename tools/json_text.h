/// JSON as the one line that --json prints.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace tools {

/// Names of blocks, grids and metadata come from files and need not be UTF-8: what is not becomes U+FFFD.
inline std::string json_text(const nlohmann::json& json) {
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace tools
