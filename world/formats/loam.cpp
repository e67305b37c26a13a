/// Loam's own save: one SQLite file, a row a 128^3 region and layer. See design, section 3.
///
///   meta     key, value                              format facts, surroundings, where the world came from
///   palette  id, name, properties (TOML)             ids as the regions use them
///   region   layer, x, y, z, voxels, hash, bytes     an OpenVDB stream and the xxHash (XXH3, 64 bits) of its bytes
///
/// A file is written beside its target and renamed, so it is whole or not there. Reading trusts nothing: the schema is
/// compared with the template, each payload with its hash, each id with the palette.
#include "world/formats/format.h"

#include <fmt/format.h>
#include <sqlite3.h>
#include <xxhash.h>

#include <charconv>
#include <memory>

#include "world/base/jobs.h"
#include "world/store/region_stream.h"

namespace world {

namespace {

constexpr int kApplicationId = 0x4c4f414d;  // "LOAM"
constexpr int kSchemaVersion = 1;
constexpr int kMostRegionBytes = 64 << 20;  // a region of 2 Mi ids as raw Int32 is 8 MiB
constexpr const char* kTables[] = {
    "CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL)",
    "CREATE TABLE palette (id INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE, properties TEXT NOT NULL)",
    "CREATE TABLE region (layer TEXT NOT NULL, x INTEGER NOT NULL, y INTEGER NOT NULL, z INTEGER NOT NULL, "
    "voxels INTEGER NOT NULL, hash INTEGER NOT NULL, bytes BLOB NOT NULL, PRIMARY KEY (layer, x, y, z))",
};

int64_t payload_hash(std::span<const char> bytes) {
  return static_cast<int64_t>(XXH3_64bits(bytes.data(), bytes.size()));
}

/// A connection that closes itself; errors name the file.
class Database {
 public:
  static Result<Database> open(const std::filesystem::path& path, bool write) {
    Database db;
    db.path_ = path.string();
    const int flags = write ? SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE : SQLITE_OPEN_READONLY;
    sqlite3* raw = nullptr;
    const int code = sqlite3_open_v2(path.c_str(), &raw, flags, nullptr);
    db.handle_.reset(raw);
    if (code != SQLITE_OK) return db.failed("could not be opened");
    sqlite3_db_config(raw, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
    sqlite3_limit(raw, SQLITE_LIMIT_LENGTH, kMostRegionBytes);
    TRY_STATUS(db.run("PRAGMA trusted_schema=OFF; PRAGMA cell_size_check=ON; PRAGMA mmap_size=0"));
    return db;
  }
  Status run(const std::string& sql) {
    return sqlite3_exec(handle_.get(), sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK
               ? Status{}
               : Status{failed("could not be read or written")};
  }
  Error failed(const std::string& what) const {
    return input_error(
        fmt::format("{}: the save {}: {}", path_, what, handle_ ? sqlite3_errmsg(handle_.get()) : "out of memory"));
  }
  Error broken(const std::string& what) const { return input_error(path_ + ": " + what); }
  sqlite3* get() const { return handle_.get(); }

 private:
  struct Close {
    void operator()(sqlite3* db) const { sqlite3_close_v2(db); }
  };
  std::unique_ptr<sqlite3, Close> handle_;
  std::string path_;
};

/// A prepared statement with bound parameters.
class Statement {
 public:
  static Result<Statement> prepare(const Database& db, const char* sql) {
    Statement s;
    sqlite3_stmt* raw = nullptr;
    if (sqlite3_prepare_v2(db.get(), sql, -1, &raw, nullptr) != SQLITE_OK) return db.failed("has an unexpected schema");
    s.handle_.reset(raw);
    return s;
  }
  void bind(int at, int64_t v) { sqlite3_bind_int64(handle_.get(), at, v); }
  void bind(int at, std::string_view v) {
    sqlite3_bind_text(handle_.get(), at, v.data(), static_cast<int>(v.size()), SQLITE_TRANSIENT);
  }
  void bind_blob(int at, std::string_view v) {
    sqlite3_bind_blob(handle_.get(), at, v.data(), static_cast<int>(v.size()), SQLITE_STATIC);
  }
  /// SQLITE_ROW, SQLITE_DONE or an error code.
  int step() { return sqlite3_step(handle_.get()); }
  void reset() { sqlite3_reset(handle_.get()); }
  int64_t integer(int column) const { return sqlite3_column_int64(handle_.get(), column); }
  std::string text(int column) const {
    const auto* p = reinterpret_cast<const char*>(sqlite3_column_text(handle_.get(), column));
    return p ? std::string(p, static_cast<size_t>(sqlite3_column_bytes(handle_.get(), column))) : std::string();
  }
  std::string blob(int column) const {
    const auto* p = static_cast<const char*>(sqlite3_column_blob(handle_.get(), column));
    return p ? std::string(p, static_cast<size_t>(sqlite3_column_bytes(handle_.get(), column))) : std::string();
  }

 private:
  struct Finalize {
    void operator()(sqlite3_stmt* s) const { sqlite3_finalize(s); }
  };
  std::unique_ptr<sqlite3_stmt, Finalize> handle_;
};

// ---- surroundings as text --------------------------------------------------------------------------------------

std::map<std::string, std::string> environment_text(const Environment& e) {
  const auto three = [](auto a, auto b, auto c) { return fmt::format("{} {} {}", a, b, c); };
  return {{"environment.sun_direction", three(e.sun_direction.x, e.sun_direction.y, e.sun_direction.z)},
          {"environment.sun_irradiance", three(e.sun_irradiance.r, e.sun_irradiance.g, e.sun_irradiance.b)},
          {"environment.sky_zenith", three(e.sky_zenith.r, e.sky_zenith.g, e.sky_zenith.b)},
          {"environment.sky_horizon", three(e.sky_horizon.r, e.sky_horizon.g, e.sky_horizon.b)},
          {"environment.sky_ground", three(e.sky_ground.r, e.sky_ground.g, e.sky_ground.b)}};
}

bool parse_three(const std::string& text, double (&out)[3]) {
  const char *at = text.data(), *end = at + text.size();
  for (double& value : out) {
    while (at != end && *at == ' ') ++at;
    const auto parsed = std::from_chars(at, end, value);
    if (parsed.ec != std::errc() || !std::isfinite(value)) return false;
    at = parsed.ptr;
  }
  return at == end;
}

bool set_environment(Environment& e, const std::string& key, const std::string& text) {
  double v[3];
  if (!parse_three(text, v)) return false;
  const auto bands = [&](auto& field) {
    field = {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
    return v[0] >= 0 && v[1] >= 0 && v[2] >= 0;
  };
  if (key == "environment.sun_direction") {
    e.sun_direction = {v[0], v[1], v[2]};
    return std::abs(glm::length(e.sun_direction) - 1) < 1e-6;
  }
  if (key == "environment.sun_irradiance") return bands(e.sun_irradiance);
  if (key == "environment.sky_zenith") return bands(e.sky_zenith);
  if (key == "environment.sky_horizon") return bands(e.sky_horizon);
  if (key == "environment.sky_ground") return bands(e.sky_ground);
  return false;
}

// ---- writing ---------------------------------------------------------------------------------------------------

Status write_tables(Database& db, const World& world) {
  for (const char* table : kTables) TRY_STATUS(db.run(table));
  TRY(Statement meta, Statement::prepare(db, "INSERT INTO meta VALUES (?1, ?2)"));
  std::map<std::string, std::string> rows = environment_text(world.environment);
  for (const auto& [key, value] : world.metadata) rows["metadata." + key] = value;
  for (const auto& [key, value] : rows) {
    meta.bind(1, key), meta.bind(2, value);
    if (meta.step() != SQLITE_DONE) return db.failed("could not be written");
    meta.reset();
  }
  TRY(Statement palette, Statement::prepare(db, "INSERT INTO palette VALUES (?1, ?2, ?3)"));
  for (size_t id = 1; id < world.palette->size(); ++id) {
    const Block& block = (*world.palette)[static_cast<BlockId>(id)];
    palette.bind(1, static_cast<int64_t>(id)), palette.bind(2, block.name), palette.bind(3, toml_from_block(block));
    if (palette.step() != SQLITE_DONE) return db.failed("could not be written");
    palette.reset();
  }
  return {};
}

Status insert_region(Database& db, Statement& insert, std::string_view layer, RegionPos r, uint64_t voxels,
                     const std::string& bytes) {
  insert.bind(1, int64_t{r.x}), insert.bind(2, int64_t{r.y}), insert.bind(3, int64_t{r.z});
  insert.bind(4, static_cast<int64_t>(voxels)), insert.bind(5, payload_hash(bytes)), insert.bind_blob(6, bytes);
  insert.bind(7, layer);
  if (insert.step() != SQLITE_DONE) return db.failed("could not be written");
  insert.reset();
  return {};
}

Status write_layers(Database& db, Statement& insert, const Store& store) {
  for (size_t i = 1; i < layer_rows().size(); ++i) {
    const FloatLayer* layer = store.find_layer(static_cast<Layer>(i));
    if (!layer) continue;
    for (const RegionPos& r : layer->regions()) {
      TRY(const std::string bytes, layer->encode_region(r));
      TRY_STATUS(insert_region(db, insert, layer_rows()[i].name, r, 0, bytes));
    }
  }
  return {};
}

Status write_regions(Database& db, const Store& store) {
  TRY(Statement insert, Statement::prepare(db, "INSERT INTO region VALUES (?7, ?1, ?2, ?3, ?4, ?5, ?6)"));
  const std::vector<RegionPos> all = store.regions();
  // Encode a batch on all threads, insert it on this one: memory stays at a batch of payloads.
  constexpr size_t kBatch = 32;
  for (size_t first = 0; first < all.size(); first += kBatch) {
    const size_t count = std::min(kBatch, all.size() - first);
    std::vector<std::optional<Result<std::string>>> payloads(count);
    parallel_for(count, [&](size_t i) { payloads[i] = encode_region(store, all[first + i]); });
    for (size_t i = 0; i < count; ++i) {
      if (!payloads[i]->ok()) return payloads[i]->error();
      const std::string& bytes = **payloads[i];
      const RegionPos r = all[first + i];
      uint64_t voxels = 0;
      for (const auto& [block, n] : store.region_census(r)) voxels += n;
      TRY_STATUS(insert_region(db, insert, "block", r, voxels, bytes));
    }
  }
  return write_layers(db, insert, store);
}

Status write_loam(const World& world, const std::filesystem::path& path) {
  return write_file_atomically(path, [&](const std::filesystem::path& temporary) -> Status {
    TRY(Database db, Database::open(temporary, true));
    // The temporary file is synced and renamed as a whole, so this one transaction needs no journal of its own.
    TRY_STATUS(
        db.run(fmt::format("PRAGMA journal_mode=OFF; PRAGMA synchronous=OFF; PRAGMA page_size=16384;"
                           "PRAGMA application_id={}; PRAGMA user_version={}; BEGIN",
                           kApplicationId, kSchemaVersion)));
    TRY_STATUS(write_tables(db, world));
    TRY_STATUS(write_regions(db, world.store));
    return db.run("COMMIT");
  });
}

// ---- reading ---------------------------------------------------------------------------------------------------

Result<int64_t> pragma_value(const Database& db, const char* sql) {
  TRY(Statement s, Statement::prepare(db, sql));
  if (s.step() != SQLITE_ROW) return db.failed("is not a readable SQLite file");
  return s.integer(0);
}

Status check_schema(const Database& db) {
  TRY(const int64_t id, pragma_value(db, "PRAGMA application_id"));
  if (id != kApplicationId)
    return db.broken("is an SQLite file, but not a Loam save: its application id is " + std::to_string(id));
  TRY(const int64_t version, pragma_value(db, "PRAGMA user_version"));
  if (version != kSchemaVersion)
    return db.broken(fmt::format("has save version {}, this program reads version {}: open it with a newer Loam",
                                 version, kSchemaVersion));
  TRY(Statement s, Statement::prepare(db, "SELECT sql FROM sqlite_schema WHERE sql IS NOT NULL ORDER BY rowid"));
  size_t rows = 0;
  for (; s.step() == SQLITE_ROW; ++rows)
    if (rows >= std::size(kTables) || s.text(0) != kTables[rows])
      return db.broken("holds a table, trigger or view that no Loam save has: \"" + s.text(0).substr(0, 80) + "\"");
  if (rows != std::size(kTables)) return db.broken("lacks a table of a Loam save");
  return {};
}

Status read_palette(const Database& db, World& world) {
  TRY(Statement s, Statement::prepare(db, "SELECT id, name, properties FROM palette ORDER BY id"));
  int code;
  while ((code = s.step()) == SQLITE_ROW) {
    if (s.integer(0) != static_cast<int64_t>(world.palette->size()))
      return db.broken("the palette skips id " + std::to_string(world.palette->size()));
    TRY_STATUS(add_blocks_from_toml(*world.palette, s.text(2), "palette entry \"" + s.text(1) + "\""));
    if (world.palette->find(s.text(1)) != static_cast<BlockId>(s.integer(0)))
      return db.broken("palette entry " + std::to_string(s.integer(0)) + " is not the block \"" + s.text(1) + "\"");
  }
  return code == SQLITE_DONE ? Status{} : Status{db.failed("could not be read")};
}

Status read_meta(const Database& db, World& world) {
  TRY(Statement s, Statement::prepare(db, "SELECT key, value FROM meta ORDER BY key"));
  int code;
  while ((code = s.step()) == SQLITE_ROW) {
    const std::string key = s.text(0);
    if (key.starts_with("metadata."))
      world.metadata[key.substr(9)] = s.text(1);
    else if (!set_environment(world.environment, key, s.text(1)))
      return db.broken("the entry \"" + key + "\" = \"" + s.text(1) + "\" is not three numbers in their range");
  }
  return code == SQLITE_DONE ? Status{} : Status{db.failed("could not be read")};
}

struct RegionRow {
  Layer layer = Layer::block;
  RegionPos pos;
  int64_t hash = 0;
  std::string bytes;
};

Status read_regions(const Database& db, World& world) {
  TRY(Statement s, Statement::prepare(db, "SELECT layer, x, y, z, hash, bytes FROM region ORDER BY layer, x, y, z"));
  constexpr size_t kBatch = 32;
  std::vector<RegionRow> rows;
  const auto adopt_rows = [&]() -> Status {
    std::vector<std::optional<Result<RegionBuilder>>> built(rows.size());
    parallel_for(rows.size(), [&](size_t i) {
      if (payload_hash(rows[i].bytes) != rows[i].hash)
        built[i] = input_error("its bytes differ from their hash");
      else if (rows[i].layer != Layer::block)
        built[i] = RegionBuilder(rows[i].pos);  // floats join their layer below, one after the other
      else
        built[i] = decode_region(rows[i].bytes, rows[i].pos, world.palette->size());
    });
    for (size_t i = 0; i < rows.size(); ++i) {
      const RegionPos p = rows[i].pos;
      if (!built[i]->ok())
        return db.broken(fmt::format("region ({}, {}, {}) is damaged: {}", p.x, p.y, p.z, built[i]->error().message));
      if (rows[i].layer == Layer::block) {
        world.store.adopt(std::move(**built[i]));
        continue;
      }
      const Status joined = world.store.make_layer(rows[i].layer).decode_region(rows[i].bytes, p);
      if (!joined.ok())
        return db.broken(fmt::format("layer {}, region ({}, {}, {}) is damaged: {}",
                                     layer_rows()[static_cast<size_t>(rows[i].layer)].name, p.x, p.y, p.z,
                                     joined.error().message));
    }
    rows.clear();
    return {};
  };
  int code;
  while ((code = s.step()) == SQLITE_ROW) {
    const std::optional<Layer> layer = layer_from_name(s.text(0));
    if (!layer) return db.broken("holds the layer \"" + s.text(0) + "\", which this program does not know");
    const int64_t at[3] = {s.integer(1), s.integer(2), s.integer(3)};
    for (int64_t c : at)
      if (c < -kWorldBorder / kRegionSize || c >= kWorldBorder / kRegionSize)
        return db.broken("holds a region outside the world's border");
    rows.push_back({*layer,
                    {static_cast<int32_t>(at[0]), static_cast<int32_t>(at[1]), static_cast<int32_t>(at[2])},
                    s.integer(4),
                    s.blob(5)});
    if (rows.size() == kBatch) TRY_STATUS(adopt_rows());
  }
  if (code != SQLITE_DONE) return db.failed("could not be read");
  return adopt_rows();
}

Result<World> read_loam(const std::filesystem::path& path, const ImportOptions&, ImportReport&) {
  TRY(Database db, Database::open(path, false));
  TRY_STATUS(check_schema(db));
  World world;
  TRY_STATUS(read_palette(db, world));
  TRY_STATUS(read_meta(db, world));
  TRY_STATUS(read_regions(db, world));
  return world;
}

}  // namespace

const Format& loam_format() {
  static const Format format = [] {
    Format f;
    f.name = "loam";
    f.extensions = {".loam"};
    f.what = "Loam's own save: SQLite, a row a 128^3 region";
    // The application id lies at byte 68 of the header, big-endian, so it reads as text.
    f.recognizes = [](const std::vector<uint8_t>& head) {
      static constexpr std::string_view magic = "SQLite format 3";
      return std::equal(magic.begin(), magic.end(), head.begin(), head.begin() + std::min(head.size(), magic.size()));
    };
    f.read = read_loam;
    f.write = write_loam;
    return f;
  }();
  return format;
}

}  // namespace world
