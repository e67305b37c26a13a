/// Ctrl-C as a wish: long work ends where it can keep what it has.
#pragma once

#include <atomic>
#include <csignal>

namespace tools {

/// While it lives, the first Ctrl-C only asks to stop; the second ends the program.
class StopOnInterrupt {
 public:
  StopOnInterrupt() {
    asked_ = false;
    std::signal(SIGINT, [](int) {
      asked_ = true;
      std::signal(SIGINT, SIG_DFL);
    });
  }
  ~StopOnInterrupt() { std::signal(SIGINT, SIG_DFL); }
  const std::atomic<bool>& asked() const { return asked_; }

 private:
  static inline std::atomic<bool> asked_{false};
};

}  // namespace tools
