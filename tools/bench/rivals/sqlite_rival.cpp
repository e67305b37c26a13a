#include "tools/bench/rivals/sqlite_rival.h"

#include <memory>

#include <sqlite3.h>

namespace tools {

namespace {

struct Close {
  void operator()(sqlite3* db) const { sqlite3_close(db); }
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};
using Database = std::unique_ptr<sqlite3, Close>;
using Statement = std::unique_ptr<sqlite3_stmt, Close>;

world::Error failed(const std::filesystem::path& path, sqlite3* db) {
  return world::input_error(path.string() + ": SQLite: " + (db ? sqlite3_errmsg(db) : "cannot open"));
}

world::Result<Database> open(const std::filesystem::path& path, int flags) {
  sqlite3* db = nullptr;
  const int code = sqlite3_open_v2(path.c_str(), &db, flags, nullptr);
  Database owner(db);
  if (code != SQLITE_OK) return failed(path, db);
  return owner;
}

}  // namespace

world::Status sqlite_write_blobs(const std::filesystem::path& path, const std::vector<std::string>& blobs) {
  std::error_code ignored;
  std::filesystem::remove(path, ignored);
  TRY(const Database db, open(path, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE));
  const auto run = [&](const char* sql) { return sqlite3_exec(db.get(), sql, nullptr, nullptr, nullptr) == SQLITE_OK; };
  if (!run("PRAGMA synchronous=FULL") || !run("CREATE TABLE region (id INTEGER PRIMARY KEY, bytes BLOB)") ||
      !run("BEGIN"))
    return failed(path, db.get());
  sqlite3_stmt* raw = nullptr;
  if (sqlite3_prepare_v2(db.get(), "INSERT INTO region (bytes) VALUES (?)", -1, &raw, nullptr) != SQLITE_OK)
    return failed(path, db.get());
  const Statement insert(raw);
  for (const std::string& blob : blobs) {
    sqlite3_bind_blob64(insert.get(), 1, blob.data(), blob.size(), SQLITE_STATIC);
    if (sqlite3_step(insert.get()) != SQLITE_DONE) return failed(path, db.get());
    sqlite3_reset(insert.get());
  }
  return run("COMMIT") ? world::Status{} : world::Status{failed(path, db.get())};
}

world::Result<std::vector<std::string>> sqlite_read_blobs(const std::filesystem::path& path) {
  TRY(const Database db, open(path, SQLITE_OPEN_READONLY));
  sqlite3_stmt* raw = nullptr;
  if (sqlite3_prepare_v2(db.get(), "SELECT bytes FROM region", -1, &raw, nullptr) != SQLITE_OK)
    return failed(path, db.get());
  const Statement select(raw);
  std::vector<std::string> blobs;
  int code;
  while ((code = sqlite3_step(select.get())) == SQLITE_ROW)
    blobs.emplace_back(static_cast<const char*>(sqlite3_column_blob(select.get(), 0)),
                       static_cast<size_t>(sqlite3_column_bytes(select.get(), 0)));
  if (code != SQLITE_DONE) return failed(path, db.get());
  return blobs;
}

}  // namespace tools
