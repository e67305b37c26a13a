/// Says on stderr what long work is at; nothing where stderr is no terminal.
#pragma once

#include <cstdio>
#include <string>

#include <unistd.h>

namespace tools {

class Progress {
 public:
  ~Progress() { stage(""); }
  /// Replaces the line; an empty text clears it.
  void stage(const std::string& text) {
    if (!terminal_ || (text.empty() && !shown_)) return;
    std::fprintf(stderr, "\r\033[K%s", text.c_str());
    std::fflush(stderr);
    shown_ = !text.empty();
  }

 private:
  bool terminal_ = isatty(STDERR_FILENO) != 0, shown_ = false;
};

}  // namespace tools
