#include "tests/world/saves/fault_vfs.h"

#include <cstdlib>
#include <cstring>
#include <new>

#include <sqlite3.h>

namespace world {

namespace {

/// SQLite hands out memory of szOsFile bytes: ours, then the system's file behind it.
struct File {
  sqlite3_file base;
  std::string* path;
  sqlite3_file* real() { return reinterpret_cast<sqlite3_file*>(this + 1); }
};

FaultVfs* instance = nullptr;
sqlite3_vfs* system_vfs = nullptr;

File* ours(sqlite3_file* f) { return reinterpret_cast<File*>(f); }
sqlite3_file* real(sqlite3_file* f) { return ours(f)->real(); }

int close_file(sqlite3_file* f) {
  const int code = real(f)->pMethods ? real(f)->pMethods->xClose(real(f)) : SQLITE_OK;
  delete ours(f)->path;
  return code;
}
int read_file(sqlite3_file* f, void* p, int n, sqlite3_int64 at) {
  FaultVfs::Kind kind;
  if (instance->fails(FaultVfs::Call::read, kind)) return SQLITE_IOERR_READ;
  return real(f)->pMethods->xRead(real(f), p, n, at);
}
int write_file(sqlite3_file* f, const void* p, int n, sqlite3_int64 at) {
  FaultVfs::Kind kind;
  if (instance->fails(FaultVfs::Call::write, kind)) {
    if (kind == FaultVfs::Kind::disk_full) return SQLITE_FULL;
    if (kind == FaultVfs::Kind::short_write) {
      real(f)->pMethods->xWrite(real(f), p, n / 2, at);
      instance->note({FaultVfs::Event::Kind::write, *ours(f)->path, at, {static_cast<const char*>(p), size_t(n) / 2}});
    }
    return SQLITE_IOERR_WRITE;
  }
  const int code = real(f)->pMethods->xWrite(real(f), p, n, at);
  instance->note({FaultVfs::Event::Kind::write, *ours(f)->path, at, {static_cast<const char*>(p), size_t(n)}});
  return code;
}
int truncate_file(sqlite3_file* f, sqlite3_int64 size) {
  FaultVfs::Kind kind;
  if (instance->fails(FaultVfs::Call::truncate, kind)) return SQLITE_IOERR_TRUNCATE;
  instance->note({FaultVfs::Event::Kind::truncate, *ours(f)->path, size, {}});
  return real(f)->pMethods->xTruncate(real(f), size);
}
int sync_file(sqlite3_file* f, int flags) {
  FaultVfs::Kind kind;
  if (instance->fails(FaultVfs::Call::sync, kind)) return SQLITE_IOERR_FSYNC;
  instance->note({FaultVfs::Event::Kind::sync, *ours(f)->path, 0, {}});
  return real(f)->pMethods->xSync(real(f), flags);
}
int file_size(sqlite3_file* f, sqlite3_int64* size) { return real(f)->pMethods->xFileSize(real(f), size); }
int lock(sqlite3_file* f, int level) { return real(f)->pMethods->xLock(real(f), level); }
int unlock(sqlite3_file* f, int level) { return real(f)->pMethods->xUnlock(real(f), level); }
int check_reserved(sqlite3_file* f, int* out) { return real(f)->pMethods->xCheckReservedLock(real(f), out); }
int control(sqlite3_file* f, int op, void* arg) { return real(f)->pMethods->xFileControl(real(f), op, arg); }
int sector_size(sqlite3_file* f) { return real(f)->pMethods->xSectorSize(real(f)); }
// None: the file system promises nothing about atomic or ordered writes.
int characteristics(sqlite3_file*) { return 0; }

const sqlite3_io_methods kMethods = {
    1,       close_file, read_file,      write_file, truncate_file, sync_file,       file_size,
    lock,    unlock,     check_reserved, control,    sector_size,   characteristics, nullptr,
    nullptr, nullptr,    nullptr,        nullptr,    nullptr};

int open_file(sqlite3_vfs*, const char* path, sqlite3_file* f, int flags, int* out_flags) {
  FaultVfs::Kind kind;
  std::memset(f, 0, sizeof(File));
  if (instance->fails(FaultVfs::Call::open, kind)) return SQLITE_CANTOPEN;
  const int code = system_vfs->xOpen(system_vfs, path, ours(f)->real(), flags, out_flags);
  if (code != SQLITE_OK) return code;
  ours(f)->path = new std::string(path ? path : "");
  ours(f)->base.pMethods = &kMethods;
  return SQLITE_OK;
}
int remove_file(sqlite3_vfs*, const char* path, int sync_folder) {
  FaultVfs::Kind kind;
  if (instance->fails(FaultVfs::Call::remove, kind)) return SQLITE_IOERR_DELETE;
  instance->note({FaultVfs::Event::Kind::remove, path, sync_folder, {}});
  return system_vfs->xDelete(system_vfs, path, sync_folder);
}

}  // namespace

FaultVfs& FaultVfs::install() {
  static FaultVfs vfs;
  if (instance) return vfs;
  instance = &vfs;
  sqlite3_initialize();
  system_vfs = sqlite3_vfs_find(nullptr);
  static sqlite3_vfs ours_vfs =
      *system_vfs;  // what is not replaced below is the system's, which looks at its own pAppData
  ours_vfs.zName = vfs.name_.c_str();
  ours_vfs.szOsFile = static_cast<int>(sizeof(File)) + system_vfs->szOsFile;
  ours_vfs.pNext = nullptr;
  ours_vfs.xOpen = open_file;
  ours_vfs.xDelete = remove_file;
  sqlite3_vfs_register(&ours_vfs, 0);
  return vfs;
}

void FaultVfs::arm(unsigned calls, int k, bool forever, Kind kind) {
  const std::lock_guard guard(mutex_);
  armed_ = calls, k_ = k, forever_ = forever, kind_ = kind;
  calls_ = faults_ = 0;
}

void FaultVfs::disarm() {
  const std::lock_guard guard(mutex_);
  armed_ = 0;
}

bool FaultVfs::fails(Call call, Kind& kind) {
  const std::lock_guard guard(mutex_);
  if (!(armed_ & bit(call))) return false;
  ++calls_;
  if (calls_ < k_ || (calls_ > k_ && !forever_)) return false;
  kind = kind_;
  ++faults_;
  return true;
}

void FaultVfs::record(bool on) {
  const std::lock_guard guard(mutex_);
  recording_ = on;
  if (on) events_.clear();
}

void FaultVfs::note(Event event) {
  const std::lock_guard guard(mutex_);
  if (recording_) events_.push_back(std::move(event));
}

}  // namespace world
