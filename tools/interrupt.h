/// Ctrl-C, and what `kill` and the end of a session send, as a wish: long work ends where it can keep what it has.
#pragma once

#include <atomic>
#include <csignal>

namespace tools {

/// While it lives, the first of SIGINT and SIGTERM only asks to stop; the second of a kind ends the program.
class StopOnInterrupt {
 public:
  StopOnInterrupt() {
    asked_ = false;
    for (const int signal : kSignals)
      std::signal(signal, [](int sent) {
        asked_ = true;
        std::signal(sent, SIG_DFL);
      });
  }
  ~StopOnInterrupt() {
    for (const int signal : kSignals) std::signal(signal, SIG_DFL);
  }
  const std::atomic<bool>& asked() const { return asked_; }

 private:
  static constexpr int kSignals[] = {SIGINT, SIGTERM};
  static inline std::atomic<bool> asked_{false};
};

}  // namespace tools
