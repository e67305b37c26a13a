/// Parts of a TOML text, for whoever reads them later.
#pragma once

#include <string>
#include <string_view>

#include "world/base/toml_reader.h"

namespace world {

/// The text of a document in which all lines but those of [[key]] are empty, so that what is found in it is where it
/// was; empty where there are none. Makes the key known. `root`: of the document that `text` was parsed to.
std::string text_of_tables(TomlTable root, std::string_view key, std::string_view text);

}  // namespace world
