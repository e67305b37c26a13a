#include "world/saves/database.h"

#include <cstring>

#include <fmt/format.h>
#include <sqlite3.h>

#include "world/base/text.h"

namespace world {

void Database::Close::operator()(sqlite3* db) const { sqlite3_close_v2(db); }
void Statement::Finalize::operator()(sqlite3_stmt* s) const { sqlite3_finalize(s); }

Result<Database> Database::open(const std::filesystem::path& path, Access access, const std::string& vfs) {
  Database db;
  db.path_ = path.string();
  const char* vfs_name = vfs.empty() ? nullptr : vfs.c_str();
  // A reader opens for writing too where it may: only so can it undo what a killed save left half written.
  const int flags = access == Access::create ? SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE : SQLITE_OPEN_READWRITE;
  sqlite3* raw = nullptr;
  int code = sqlite3_open_v2(path.c_str(), &raw, flags | SQLITE_OPEN_EXRESCODE, vfs_name);
  db.handle_.reset(raw);
  if (code != SQLITE_OK && access == Access::read) {
    code = sqlite3_open_v2(path.c_str(), &raw, SQLITE_OPEN_READONLY | SQLITE_OPEN_EXRESCODE, vfs_name);
    db.handle_.reset(raw);
  }
  if (code != SQLITE_OK) return db.failed("could not be opened");
  if (access == Access::edit && sqlite3_db_readonly(raw, "main") == 1)
    return db.broken("the save is write-protected: give the file write permission, or copy it");
  sqlite3_db_config(raw, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_limit(raw, SQLITE_LIMIT_LENGTH, kMostPayloadBytes);
  sqlite3_busy_timeout(raw, kBusyTimeoutMs);
  TRY_STATUS(db.run("PRAGMA trusted_schema=OFF; PRAGMA cell_size_check=ON; PRAGMA mmap_size=0"));
  return db;
}

Status Database::run(const std::string& sql) {
  return sqlite3_exec(handle_.get(), sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK
             ? Status{}
             : Status{failed("could not be read or written")};
}

Result<int64_t> Database::integer(const char* sql) const {
  TRY(Statement s, Statement::prepare(*this, sql));
  if (s.step() != SQLITE_ROW) return failed("is not a readable SQLite file");
  return s.integer(0);
}

int Database::last_code() const { return handle_ ? sqlite3_extended_errcode(handle_.get()) : SQLITE_NOMEM; }
int Database::rows_changed() const { return sqlite3_changes(handle_.get()); }
bool Database::in_transaction() const { return handle_ && sqlite3_get_autocommit(handle_.get()) == 0; }

Error Database::failed(const std::string& what) const {
  if (!handle_) return input_error(fmt::format("{}: the save {}: out of memory", path_, what));
  std::string text = fmt::format("{}: the save {}: {}", path_, what, one_line(sqlite3_errmsg(handle_.get())));
  const int code = sqlite3_extended_errcode(handle_.get());
  // The system's own reason, where the code is one of those that a system call leaves behind.
  if (const int system = sqlite3_system_errno(handle_.get());
      system != 0 && ((code & 0xff) == SQLITE_IOERR || (code & 0xff) == SQLITE_CANTOPEN))
    text += fmt::format(" ({})", std::strerror(system));
  switch (code & 0xff) {
    case SQLITE_FULL:
      text += "; free some space on the disk";
      break;
    case SQLITE_BUSY:
      text += "; another program has it open";
      break;
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
      text += "; `loam check FILE` says what is damaged";
      break;
    case SQLITE_READONLY:
      text += "; give the file and its folder write permission";
      break;
    default:
      break;
  }
  return input_error(text);
}

Error Database::broken(const std::string& what) const { return input_error(path_ + ": " + what); }

Result<Statement> Statement::prepare(const Database& db, const char* sql) {
  Statement s;
  s.db_ = &db;
  sqlite3_stmt* raw = nullptr;
  if (sqlite3_prepare_v2(db.get(), sql, -1, &raw, nullptr) != SQLITE_OK) return db.failed("could not be read");
  s.handle_.reset(raw);
  return s;
}

void Statement::bind(int at, int64_t v) { sqlite3_bind_int64(handle_.get(), at, v); }
void Statement::bind(int at, std::string_view v) {
  sqlite3_bind_text(handle_.get(), at, v.data(), static_cast<int>(v.size()), SQLITE_TRANSIENT);
}
void Statement::bind_blob(int at, std::span<const char> v) {
  sqlite3_bind_blob64(handle_.get(), at, v.data(), v.size(), SQLITE_STATIC);
}
int Statement::step() { return sqlite3_step(handle_.get()); }
Result<bool> Statement::next() {
  const int code = step();
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) return false;
  return db_->failed("could not be read");
}
Status Statement::finish() {
  if (step() != SQLITE_DONE) {
    const Error error = db_->failed("could not be written");
    reset();
    return error;
  }
  reset();
  return {};
}
void Statement::reset() { sqlite3_reset(handle_.get()); }
int64_t Statement::integer(int column) const { return sqlite3_column_int64(handle_.get(), column); }
std::string Statement::text(int column) const {
  const auto* p = reinterpret_cast<const char*>(sqlite3_column_text(handle_.get(), column));
  return p ? std::string(p, static_cast<size_t>(sqlite3_column_bytes(handle_.get(), column))) : std::string();
}
std::string Statement::blob(int column) const {
  const auto* p = static_cast<const char*>(sqlite3_column_blob(handle_.get(), column));
  return p ? std::string(p, static_cast<size_t>(sqlite3_column_bytes(handle_.get(), column))) : std::string();
}

}  // namespace world
