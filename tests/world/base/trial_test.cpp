#include "world/base/trial.h"

#include <csignal>
#include <vector>

#include <gtest/gtest.h>

namespace world {
namespace {

std::string message_of(const std::function<Status()>& body, TrialLimits limits = {}) {
  const Status status = try_in_child(limits, body);
  return status ? "" : status.error().message;
}

TEST(Trial, WhatTheBodySaysComesBackAndItsChangesDont) {
  int changed = 0;
  EXPECT_EQ(message_of([&]() -> Status {
              changed = 1;
              return {};
            }),
            "");
  EXPECT_EQ(changed, 0);
  EXPECT_EQ(message_of([]() -> Status { return input_error("byte 7 is odd"); }), "byte 7 is odd");
}

TEST(Trial, CrashesHangsAndHungerAreErrors) {
  EXPECT_NE(message_of([]() -> Status {
              std::raise(SIGSEGV);
              return {};
            }).find("crashed"),
            std::string::npos);
  EXPECT_NE(message_of([]() -> Status { throw 1; }).find("failed"), std::string::npos);
  EXPECT_NE(message_of(
                []() -> Status {
                  for (volatile bool forever = true; forever;) {
                  }
                  return {};
                },
                {.memory_bytes = 1 << 30, .cpu_seconds = 1})
                .find("does not end"),
            std::string::npos);
  const std::string hungry = message_of(
      []() -> Status {
        std::vector<char> much(uint64_t{1} << 30, 'x');
        return much.back() == 'x' ? Status{} : Status{input_error("")};
      },
      {.memory_bytes = 64 << 20, .cpu_seconds = 5});
#if defined(__SANITIZE_ADDRESS__)
  EXPECT_NE(hungry, "");  // the sanitizer ends the child before operator new can throw
#else
  EXPECT_NE(hungry.find("memory"), std::string::npos) << hungry;
#endif
}

}  // namespace
}  // namespace world
