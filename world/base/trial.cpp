#include "world/base/trial.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <new>
#include <string>

namespace world {
namespace {

constexpr int kFine = 0, kRefused = 3, kNoMemory = 4, kThrew = 5;
constexpr size_t kMaxMessage = 4096;

/// Address space in use now, bytes.
uint64_t address_space() {
  std::FILE* file = std::fopen("/proc/self/statm", "r");
  unsigned long long pages = 0;
  if (file) {
    if (std::fscanf(file, "%llu", &pages) != 1) pages = 0;
    std::fclose(file);
  }
  return pages * static_cast<uint64_t>(::sysconf(_SC_PAGESIZE));
}

void limit(int resource, uint64_t soft, uint64_t hard) {
  const rlimit both{soft, hard};
  ::setrlimit(static_cast<__rlimit_resource>(resource), &both);
}

[[noreturn]] void run_child(const TrialLimits& limits, const std::function<Status()>& body, int pipe) {
  // Handlers of the parent (a sanitizer's, a test's) would print or wait.
  for (const int signal : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT}) std::signal(signal, SIG_DFL);
  limit(RLIMIT_CORE, 0, 0);
  limit(RLIMIT_CPU, limits.cpu_seconds, limits.cpu_seconds + 1);
  // On top of what is mapped now, which with AddressSanitizer is terabytes of shadow.
  const uint64_t most = address_space() + limits.memory_bytes;
  limit(RLIMIT_AS, most, most);
  const int nothing = ::open("/dev/null", O_WRONLY);
  ::dup2(nothing, STDOUT_FILENO);
  ::dup2(nothing, STDERR_FILENO);
  int code = kThrew;
  try {
    const Status status = body();
    code = status ? kFine : kRefused;
    if (!status) {
      const std::string& message = status.error().message;
      if (::write(pipe, message.data(), std::min(message.size(), kMaxMessage)) < 0) code = kThrew;
    }
  } catch (const std::bad_alloc&) {
    code = kNoMemory;
  } catch (...) {
  }
  ::_exit(code);
}

}  // namespace

Status try_in_child(const TrialLimits& limits, const std::function<Status()>& body) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0)
    return input_error(std::string("no pipe to a child process: ") + std::strerror(errno));
  const pid_t child = ::fork();
  if (child < 0) {
    const int reason = errno;
    ::close(ends[0]), ::close(ends[1]);
    return input_error(std::string("no child process to try it in: ") + std::strerror(reason));
  }
  if (child == 0) run_child(limits, body, ends[1]);
  ::close(ends[1]);
  std::string message(kMaxMessage, '\0');
  size_t length = 0;
  for (ssize_t got; length < message.size();) {
    got = ::read(ends[0], message.data() + length, message.size() - length);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    length += static_cast<size_t>(got);
  }
  ::close(ends[0]);
  message.resize(length);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status)) {
    switch (WEXITSTATUS(status)) {
      case kFine:
        return {};
      case kRefused:
        return input_error(message);
      case kNoMemory:
        return input_error("it asks for more memory than it can need");
      default:
        return input_error("the library that reads it failed on it");
    }
  }
  const int signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  if (signal == SIGXCPU || signal == SIGKILL)
    return input_error("reading it does not end, or takes far too much memory");
  return input_error("the library that reads it crashed on it");
}

}  // namespace world
