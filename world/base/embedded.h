/// Text files compiled into the program, so that it runs from anywhere.
#pragma once

namespace world {

struct EmbeddedText {
  const char* name;  // file name without folder; null ends the list
  const char* text;
};

}  // namespace world
