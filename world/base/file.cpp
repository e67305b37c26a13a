#include "world/base/file.h"

#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

namespace world {
namespace {

/// Closes a file descriptor at the end of its scope.
struct Descriptor {
  int fd = -1;
  ~Descriptor() {
    if (fd >= 0) ::close(fd);
  }
};

Error system_error(const std::filesystem::path& path, const char* what) {
  return input_error(fmt::format("{}: cannot {}: {}", path.string(), what, std::strerror(errno)));
}

}  // namespace

Result<std::vector<uint8_t>> read_file(const std::filesystem::path& path, uint64_t limit) {
  const Descriptor file{::open(path.c_str(), O_RDONLY | O_CLOEXEC)};
  if (file.fd < 0) return system_error(path, "open");
  struct stat status {};
  if (::fstat(file.fd, &status) != 0) return system_error(path, "read its size");
  if (S_ISDIR(status.st_mode)) return input_error(fmt::format("{}: is a folder, expected a file", path.string()));
  if (!S_ISREG(status.st_mode)) return input_error(fmt::format("{}: is not a regular file", path.string()));
  const uint64_t size = static_cast<uint64_t>(status.st_size);
  if (size > limit) {
    return input_error(
        fmt::format("{}: has {} bytes, more than the {} bytes that such a file may have", path.string(), size, limit));
  }
  std::vector<uint8_t> bytes(size);
  uint64_t done = 0;
  while (done < size) {
    const ssize_t got = ::read(file.fd, bytes.data() + done, size - done);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return system_error(path, "read");
    if (got == 0) break;  // it became shorter meanwhile
    done += static_cast<uint64_t>(got);
  }
  bytes.resize(done);
  return bytes;
}

}  // namespace world
