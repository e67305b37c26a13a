/// SQLite as values: a connection and a prepared statement that close themselves, whose errors are a sentence that
/// names the file. Internal to world/saves.
#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "world/base/errors.h"

struct sqlite3;
struct sqlite3_stmt;

namespace world {

constexpr int kMostPayloadBytes = 64 << 20;  // a region of 2 Mi ids as raw Int32 is 8 MiB
constexpr int kBusyTimeoutMs = 5000;         // a reader of a whole world holds its lock for about a second

class Database {
 public:
  enum class Access { read, edit, create };

  /// `vfs`: a registered SQLite VFS, for tests of faults; empty: the system's own.
  static Result<Database> open(const std::filesystem::path& path, Access access, const std::string& vfs = {});
  Status run(const std::string& sql);
  Result<int64_t> integer(const char* sql) const;  // of a query that gives one row
  /// What SQLite said last, and what to do about it.
  Error failed(const std::string& what) const;
  Error broken(const std::string& what) const;
  int last_code() const;  // SQLITE_*, extended
  int rows_changed() const;
  bool in_transaction() const;
  sqlite3* get() const { return handle_.get(); }
  const std::string& path() const { return path_; }

 private:
  struct Close {
    void operator()(sqlite3* db) const;
  };
  std::unique_ptr<sqlite3, Close> handle_;
  std::string path_;
};

class Statement {
 public:
  static Result<Statement> prepare(const Database& db, const char* sql);
  void bind(int at, int64_t v);
  void bind(int at, std::string_view v);
  void bind_blob(int at, std::span<const char> v);  // must live until reset()
  /// SQLITE_ROW, SQLITE_DONE or an error code.
  int step();
  /// True where there is a row; the error names the file.
  Result<bool> next();
  Status finish();  // of a statement that gives no rows; then reset()
  void reset();
  int64_t integer(int column) const;
  std::string text(int column) const;
  std::string blob(int column) const;

 private:
  struct Finalize {
    void operator()(sqlite3_stmt* s) const;
  };
  const Database* db_ = nullptr;
  std::unique_ptr<sqlite3_stmt, Finalize> handle_;
};

}  // namespace world
