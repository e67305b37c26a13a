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

/// Makes what was written under `path` (a file or a folder) survive a power loss.
Status sync_to_disk(const std::filesystem::path& path, bool folder) {
  const Descriptor file{::open(path.c_str(), (folder ? O_DIRECTORY | O_RDONLY : O_RDONLY) | O_CLOEXEC)};
  if (file.fd < 0) return system_error(path, "open to sync");
  // Some file systems have no sync for folders; they say so with EINVAL.
  if (::fsync(file.fd) != 0 && errno != EINVAL) return system_error(path, "sync to disk");
  return {};
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

Status write_file_atomically(const std::filesystem::path& path,
                             const std::function<Status(const std::filesystem::path&)>& write) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) {
    return input_error(fmt::format("{}: cannot write: it is a folder, expected a file name", path.string()));
  }
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");

  // Reserve a name beside the target: a rename is atomic within one file system only. The extension stays last,
  // because writers choose by it.
  std::string name = (folder / ("." + path.stem().string() + ".XXXXXX" + path.extension().string())).string();
  const int extension_length = static_cast<int>(path.extension().string().size());
  const int fd = ::mkstemps(name.data(), extension_length);
  if (fd < 0) {
    return input_error(
        fmt::format("{}: cannot write into {}: {}", path.string(), folder.string(), std::strerror(errno)));
  }
  // mkstemps makes it private; give it what a plain new file would get, or what the old file had.
  const mode_t mask = ::umask(0);
  ::umask(mask);
  struct stat old {};
  const mode_t mode = ::stat(path.c_str(), &old) == 0 ? (old.st_mode & 0777) : (0666 & ~mask);
  const bool mode_set = ::fchmod(fd, mode) == 0;
  ::close(fd);
  const std::filesystem::path temporary = name;
  struct RemoveOnFailure {
    const std::filesystem::path& path;
    bool armed = true;
    ~RemoveOnFailure() {
      std::error_code ignored_error;
      if (armed) std::filesystem::remove(path, ignored_error);
    }
  } guard{temporary};
  if (!mode_set) return system_error(temporary, "set its permissions");

  TRY_STATUS(write(temporary));
  TRY_STATUS(sync_to_disk(temporary, false));
  if (::rename(temporary.c_str(), path.c_str()) != 0) return system_error(path, "replace");
  guard.armed = false;
  return sync_to_disk(folder, true);
}

Status write_bytes_atomically(const std::filesystem::path& path, std::string_view bytes) {
  return write_file_atomically(path, [&](const std::filesystem::path& temporary) -> Status {
    const Descriptor file{::open(temporary.c_str(), O_WRONLY | O_TRUNC | O_CLOEXEC)};
    if (file.fd < 0) return system_error(path, "write");
    size_t done = 0;
    while (done < bytes.size()) {
      const ssize_t put = ::write(file.fd, bytes.data() + done, bytes.size() - done);
      if (put < 0 && errno == EINTR) continue;
      if (put < 0) return system_error(path, "write");
      done += static_cast<size_t>(put);
    }
    return {};
  });
}

}  // namespace world
