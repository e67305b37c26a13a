#include "world/saves/save_file.h"

#include <algorithm>
#include <set>

#include <fmt/format.h>
#include <sqlite3.h>

#include "world/base/jobs.h"
#include "world/saves/meta.h"
#include "world/saves/palette_rows.h"
#include "world/saves/schema.h"
#include "world/store/density_field.h"
#include "world/store/snapshot.h"

namespace world {

namespace {

constexpr const char* kRowColumns2 = "layer, x, y, z, save, voxels, census, codec, hash, bytes";
constexpr const char* kRowColumns1 = "layer, x, y, z, 0, voxels, '', 'stream', hash, bytes";
// What assets may take in memory: as all that is read, a multiple of the file and a constant.
constexpr uint64_t kAssetBytesPerByte = 16, kAssetBytesBeside = 256 << 20;
constexpr int kCacheKib = 4 * 1024;  // pages of a save that may stay in memory before they go to the file

std::string row_text(Layer layer, RegionPos p) {
  return layer == Layer::block ? fmt::format("region ({}, {}, {})", p.x, p.y, p.z)
                               : fmt::format("layer {}, region ({}, {}, {})",
                                             layer_rows()[static_cast<size_t>(layer)].name, p.x, p.y, p.z);
}

/// The row that a statement over kRowColumns stands on.
Result<RegionRow> row_of(const Database& db, const Statement& s) {
  RegionRow row;
  const std::optional<Layer> layer = layer_from_name(s.text(0));
  if (!layer) return db.broken("holds the layer \"" + s.text(0) + "\", which this program does not know");
  row.layer = *layer;
  for (int axis = 0; axis < 3; ++axis) {
    const int64_t c = s.integer(1 + axis);
    if (c < -kWorldBorder / kRegionSize || c >= kWorldBorder / kRegionSize)
      return db.broken("holds a region outside the world's border");
    row.pos[axis] = static_cast<int32_t>(c);
  }
  row.save = s.integer(4), row.voxels = s.integer(5), row.census = s.text(6);
  const std::optional<Codec> codec = codec_from_name(s.text(7));
  if (!codec)
    return db.broken(fmt::format("{} is packed as \"{}\", which this program does not know",
                                 row_text(row.layer, row.pos), s.text(7).substr(0, 40)));
  row.codec = *codec;
  row.hash = s.integer(8), row.bytes = s.blob(9);
  return row;
}

Error damaged(const Database& db, const RegionRow& row, const std::string& why) {
  return db.broken(row_text(row.layer, row.pos) + " is damaged: " + why);
}

/// Before version 4.
Status read_palette_of_text(const Database& db, int version, World& world) {
  TRY(Statement s, Statement::prepare(db, version == 1 ? "SELECT id, name, properties FROM palette ORDER BY id"
                                                       : "SELECT id, name, properties, hash FROM palette ORDER BY id"));
  while (true) {
    TRY(const bool there, s.next());
    if (!there) return {};
    const int64_t id = s.integer(0);
    const std::string name = s.text(1), properties = s.text(2);
    if (id != static_cast<int64_t>(world.palette->size()))
      return db.broken("the palette skips id " + std::to_string(world.palette->size()));
    if (version > 1 && s.integer(3) != hash_of_palette_row(id, name, properties))
      return db.broken(fmt::format("palette entry {} is damaged: it differs from its hash", id));
    TRY_STATUS(add_saved_block(*world.palette, properties, version, "palette entry \"" + name + "\""));
    if (world.palette->find(name) != static_cast<BlockId>(id))
      return db.broken(fmt::format("palette entry {} is not the block \"{}\"", id, name));
  }
}

Status read_palette(const Database& db, int version, World& world) {
  if (version < 4) return read_palette_of_text(db, version, world);
  TRY(Statement s, Statement::prepare(db, "SELECT id, blocks, hash, bytes FROM palette ORDER BY id"));
  while (true) {
    TRY(const bool there, s.next());
    if (!there) return {};
    const PaletteRow row{.id = s.integer(0), .blocks = s.integer(1), .hash = s.integer(2), .bytes = s.blob(3)};
    if (row.id != static_cast<int64_t>(world.palette->size()))
      return db.broken("the palette skips id " + std::to_string(world.palette->size()));
    const Result<std::vector<std::string>> blocks = read_palette_row(row);
    if (!blocks.ok())
      return db.broken(fmt::format("the palette from entry {} on is damaged: {}", row.id, blocks.error().message));
    for (const std::string& block : *blocks) {
      const Status added =
          add_saved_block(*world.palette, block, version, fmt::format("palette entry {}", world.palette->size()));
      if (!added.ok()) return db.broken(added.error().message);
    }
  }
}

Status write_palette(const Database& db, size_t first, std::span<const Block> blocks) {
  TRY(Statement s, Statement::prepare(db, "INSERT INTO palette VALUES (?1, ?2, ?3, ?4)"));
  while (!blocks.empty()) {
    const size_t count = std::min(blocks.size(), kPaletteRowBlocks);
    std::vector<std::string> texts;
    for (const Block& block : blocks.first(count)) texts.push_back(toml_from_block(block));
    TRY(const PaletteRow row, make_palette_row(first, texts));
    s.bind(1, row.id), s.bind(2, row.blocks), s.bind(3, row.hash), s.bind_blob(4, row.bytes);
    TRY_STATUS(s.finish());
    blocks = blocks.subspan(count), first += count;
  }
  return {};
}

std::vector<Block> blocks_after_air(const BlockPalette& palette) {
  std::vector<Block> blocks;
  for (size_t id = 1; id < palette.size(); ++id) blocks.push_back(palette[static_cast<BlockId>(id)]);
  return blocks;
}

Status check_digest(const Database& db) {
  TRY(Statement s, Statement::prepare(db, "SELECT value FROM meta WHERE key = 'save.digest'"));
  TRY(const bool there, s.next());
  if (!there) return db.broken("lacks the digest of its tables");
  TRY(const std::string digest, digest_of(db));
  if (digest != s.text(0)) return db.broken("its palette, census or metadata differ from their digest");
  return {};
}

Result<int64_t> read_save_number(const Database& db) {
  return db.integer("SELECT coalesce((SELECT CAST(value AS INTEGER) FROM meta WHERE key = 'save.number'), 0)");
}

}  // namespace

// ---- opening ---------------------------------------------------------------------------------------------------

Result<std::unique_ptr<SaveFile>> SaveFile::open(const std::filesystem::path& path, Access access,
                                                 const std::string& vfs) {
  std::unique_ptr<SaveFile> file(new SaveFile);
  const bool edit = access == Access::edit;
  TRY(file->db_, Database::open(path, edit ? Database::Access::edit : Database::Access::read, vfs));
  file->access_ = access;
  TRY(file->version_, check_schema(file->db_));
  TRY_STATUS(file->db_.run(fmt::format("PRAGMA cache_size=-{}", kCacheKib)));
  if (!edit) {
    TRY(file->save_number_, read_save_number(file->db_));
    return file;
  }
  TRY_STATUS(file->db_.run("PRAGMA journal_mode=DELETE; PRAGMA synchronous=EXTRA"));
  TRY_STATUS(file->begin_editing());
  if (file->version_ < kSaveVersion) {
    TRY_STATUS(file->version_ == 1 ? file->upgrade_from_1() : file->upgrade_from_2_to_4());
    TRY_STATUS(file->begin_editing());
  }
  TRY(file->save_number_, read_save_number(file->db_));
  return file;
}

Result<std::unique_ptr<SaveFile>> SaveFile::create(const std::filesystem::path& path) {
  std::unique_ptr<SaveFile> file(new SaveFile);
  TRY(file->db_, Database::open(path, Database::Access::create));
  file->access_ = Access::edit;
  file->version_ = kSaveVersion;
  TRY_STATUS(file->db_.run(
      fmt::format("PRAGMA journal_mode=OFF; PRAGMA synchronous=OFF; PRAGMA page_size={}; PRAGMA cache_size=-{};"
                  "PRAGMA application_id={}; PRAGMA user_version={}; BEGIN",
                  kSavePageBytes, kCacheKib, kApplicationId, kSaveVersion)));
  for (const char* table : tables_of_version(kSaveVersion)) TRY_STATUS(file->db_.run(table));
  return file;
}

SaveFile::~SaveFile() {
  find_row_.reset();
  if (db_.in_transaction()) (void)db_.run("ROLLBACK");  // nothing has been written since the last save
}

/// Takes the lock that keeps other editors out; readers go on.
Status SaveFile::begin_editing() {
  // Who edits holds the lock for as long as the world is open: there is no use in waiting.
  sqlite3_busy_timeout(db_.get(), 200);
  const Status begun = db_.run("BEGIN IMMEDIATE");
  sqlite3_busy_timeout(db_.get(), kBusyTimeoutMs);
  if (begun.ok()) return {};
  if ((db_.last_code() & 0xff) == SQLITE_BUSY)
    return db_.broken("is open for editing in another program: close it there first");
  return begun;
}

Status SaveFile::upgrade_from_1() {
  World frame;
  TRY_STATUS(read_palette(db_, 1, frame));
  TRY_STATUS(
      db_.run("ALTER TABLE region RENAME TO region_of_version_1;"
              "ALTER TABLE palette RENAME TO palette_of_version_1"));
  for (const char* table : tables_of_version(kSaveVersion).subspan(1)) TRY_STATUS(db_.run(table));
  TRY_STATUS(write_palette(db_, 1, blocks_after_air(*frame.palette)));
  TRY(Statement insert,
      Statement::prepare(db_, "INSERT INTO region VALUES (?1, ?2, ?3, ?4, 0, ?5, ?6, 'stream', ?7, ?8)"));
  TRY(Statement select,
      Statement::prepare(db_, fmt::format("SELECT {} FROM region_of_version_1", kRowColumns1).c_str()));
  Census total;
  std::vector<std::string> names;
  for (size_t id = 0; id < frame.palette->size(); ++id)
    names.push_back((*frame.palette)[static_cast<BlockId>(id)].name);
  while (true) {
    TRY(const bool there, select.next());
    if (!there) break;
    TRY(RegionRow row, row_of(db_, select));
    if (hash_of_bytes(row.bytes) != row.hash) return damaged(db_, row, "its bytes differ from their hash");
    if (row.layer == Layer::block) {
      const Result<RegionBuilder> builder = decode_blocks(row, frame.palette->size());
      if (!builder.ok()) return damaged(db_, row, builder.error().message);
      const Census census = PreparedRegion(*builder, *frame.palette, 0).census();
      for (const auto& [block, n] : census) total[block] += n;
      row.census = census_text(census, names);
    }
    row.hash = hash_of(row);
    insert.bind(1, layer_rows()[static_cast<size_t>(row.layer)].name);
    for (int axis = 0; axis < 3; ++axis) insert.bind(2 + axis, int64_t{row.pos[axis]});
    insert.bind(5, row.voxels), insert.bind(6, row.census), insert.bind(7, row.hash), insert.bind_blob(8, row.bytes);
    TRY_STATUS(insert.finish());
  }
  select.reset();
  TRY(Statement census, Statement::prepare(db_, "INSERT INTO census VALUES (?1, ?2)"));
  for (const auto& [block, n] : total) {
    census.bind(1, int64_t{block}), census.bind(2, static_cast<int64_t>(n));
    TRY_STATUS(census.finish());
  }
  TRY_STATUS(
      db_.run(fmt::format("DROP TABLE region_of_version_1; DROP TABLE palette_of_version_1;"
                          "INSERT INTO meta VALUES ('save.number', '0'); PRAGMA user_version={}",
                          kSaveVersion)));
  TRY(const std::string digest, digest_of(db_));
  TRY_STATUS(db_.run(fmt::format("INSERT INTO meta VALUES ('save.digest', '{}'); COMMIT", digest)));
  version_ = kSaveVersion;
  return {};
}

Status SaveFile::upgrade_from_2_to_4() {
  // A new digest must not vouch for what the old one doesn't.
  TRY_STATUS(check_digest(db_));
  World frame;
  TRY_STATUS(read_palette(db_, version_, frame));
  const auto tables = tables_of_version(kSaveVersion);
  TRY_STATUS(db_.run(fmt::format("DROP TABLE palette; {}", tables[1])));
  TRY_STATUS(write_palette(db_, 1, blocks_after_air(*frame.palette)));
  if (version_ == 2) TRY_STATUS(db_.run(tables.back()));
  TRY(const std::string digest, digest_of(db_));
  TRY_STATUS(db_.run(fmt::format(
      "UPDATE meta SET value = '{}' WHERE key = 'save.digest'; PRAGMA user_version={}; COMMIT", digest, kSaveVersion)));
  version_ = kSaveVersion;
  return {};
}

// ---- reading ---------------------------------------------------------------------------------------------------

Status SaveFile::read_meta(World& world) {
  std::optional<Statement> find_part;
  if (version_ > 2) {
    TRY(find_part, Statement::prepare(db_, "SELECT codec, bytes FROM asset WHERE key=?1"));
  }
  const auto read_part = [&](int64_t key, size_t number) -> Result<std::string> {
    const std::string name = fmt::format("the asset {:016x}", static_cast<uint64_t>(key));
    if (!find_part) return input_error(name + " is missing: saves of this version have none");
    find_part->bind(1, key);
    TRY(const bool there, find_part->next());
    if (!there) {
      find_part->reset();
      return input_error(name + " is missing");
    }
    Result<std::string> bytes = unpack_asset(find_part->text(0), find_part->blob(1));
    find_part->reset();
    if (!bytes.ok()) return input_error(name + " is damaged: " + bytes.error().message);
    if (asset_key(*bytes, number) != key) return input_error(name + " is damaged: it differs from its hash");
    return bytes;
  };
  std::error_code error;
  const uint64_t file_bytes = std::filesystem::file_size(db_.path(), error);
  AssetReader assets(read_part, kAssetBytesBeside + kAssetBytesPerByte * (error ? 0 : file_bytes));
  TRY(Statement s, Statement::prepare(db_, "SELECT key, value FROM meta ORDER BY key"));
  while (true) {
    TRY(const bool there, s.next());
    if (!there) return {};
    TRY_STATUS(read_meta_row(world, s.text(0), s.text(1), db_.path(), assets));
  }
}

/// Density grids over the world's own layer, which a World without regions doesn't have, get their field.
Status SaveFile::fill_media(World& world) {
  const bool any = std::any_of(world.media.begin(), world.media.end(),
                               [](const Medium& m) { return m.kind == "density_grid" && !m.field; });
  if (!any) return {};
  FloatLayer layer;
  TRY(const std::vector<RegionPos> regions, positions(Layer::density));
  for (const RegionPos& r : regions) {
    TRY(const std::optional<RegionRow> row, read_row(Layer::density, r));
    if (!row) continue;
    TRY(const std::string stream, stream_of(*row));
    TRY_STATUS(layer.decode_region(stream, r));
  }
  return fill_density_grids(&layer, world.media);
}

Result<World> SaveFile::read_frame() {
  const std::lock_guard lock(mutex_);
  World world;
  TRY_STATUS(read_palette(db_, version_, world));
  // Before what the digest vouches for is understood.
  if (version_ > 1) TRY_STATUS(check_digest(db_));
  TRY_STATUS(read_meta(world));
  TRY_STATUS(fill_media(world));
  return world;
}

Status SaveFile::check_row(const RegionRow& row) const {
  const int64_t hash = version_ == 1 ? hash_of_bytes(row.bytes) : hash_of(row);
  return hash == row.hash ? Status{} : Status{damaged(db_, row, "it differs from its hash")};
}

Status SaveFile::for_each_row(const std::function<Status(RegionRow&&)>& visit) {
  const std::lock_guard lock(mutex_);
  TRY(Statement s, Statement::prepare(db_, fmt::format("SELECT {} FROM region ORDER BY layer, x, y, z",
                                                       version_ == 1 ? kRowColumns1 : kRowColumns2)
                                               .c_str()));
  while (true) {
    TRY(const bool there, s.next());
    if (!there) return {};
    TRY(RegionRow row, row_of(db_, s));
    TRY_STATUS(visit(std::move(row)));
  }
}

Result<World> SaveFile::read_all() {
  const std::lock_guard lock(mutex_);
  // One read transaction, so that a save by another program cannot come between palette and regions.
  const bool own = !db_.in_transaction();
  if (own) TRY_STATUS(db_.run("BEGIN"));
  struct End {
    Database& db;
    bool own;
    ~End() {
      if (own) (void)db.run("COMMIT");
    }
  } end{db_, own};
  TRY(World world, read_frame());
  constexpr size_t kBatch = 32;
  std::vector<RegionRow> rows;
  const auto adopt_rows = [&]() -> Status {
    std::vector<std::optional<Result<RegionBuilder>>> built(rows.size());
    std::vector<Status> checked(rows.size());
    parallel_for(rows.size(), [&](size_t i) {
      checked[i] = check_row(rows[i]);
      if (checked[i].ok() && rows[i].layer == Layer::block) built[i] = decode_blocks(rows[i], world.palette->size());
    });
    for (size_t i = 0; i < rows.size(); ++i) {
      TRY_STATUS(checked[i]);
      if (rows[i].layer == Layer::block) {
        if (!built[i]->ok()) return damaged(db_, rows[i], built[i]->error().message);
        if (rows[i].voxels > 0) world.store.adopt(std::move(**built[i]));
        continue;
      }
      const Status joined = decode_values(rows[i], world.store.make_any_layer(rows[i].layer));
      if (!joined.ok()) return damaged(db_, rows[i], joined.error().message);
    }
    rows.clear();
    return {};
  };
  TRY_STATUS(for_each_row([&](RegionRow&& row) -> Status {
    rows.push_back(std::move(row));
    return rows.size() < kBatch ? Status{} : adopt_rows();
  }));
  TRY_STATUS(adopt_rows());
  if (version_ > 1) {
    // A row that vanished with a damaged index leaves no hash behind, but it is missing here.
    TRY(const Census expected, census());
    if (world.store.census() != expected)
      return db_.broken("its regions hold other blocks than its census says: `loam check FILE` says which are missing");
  }
  world.store.mark_saved();
  return world;
}

Result<std::optional<RegionRow>> SaveFile::read_row(Layer layer, RegionPos pos) {
  std::optional<RegionRow> found;
  {
    const std::lock_guard lock(mutex_);
    if (!find_row_) {
      TRY(find_row_,
          Statement::prepare(db_, fmt::format("SELECT {} FROM region WHERE layer=?1 AND x=?2 AND y=?3 AND z=?4",
                                              version_ == 1 ? kRowColumns1 : kRowColumns2)
                                      .c_str()));
    }
    Statement& s = *find_row_;
    s.bind(1, layer_rows()[static_cast<size_t>(layer)].name);
    for (int axis = 0; axis < 3; ++axis) s.bind(2 + axis, int64_t{pos[axis]});
    const auto row = [&]() -> Status {
      TRY(const bool there, s.next());
      if (!there) return {};
      TRY(found, row_of(db_, s));
      return {};
    }();
    s.reset();
    TRY_STATUS(row);
  }
  if (found) TRY_STATUS(check_row(*found));
  return found;
}

Result<std::vector<RegionPos>> SaveFile::positions(Layer layer) {
  const std::lock_guard lock(mutex_);
  TRY(Statement s, Statement::prepare(db_, "SELECT x, y, z FROM region WHERE layer=?1 ORDER BY x, y, z"));
  s.bind(1, layer_rows()[static_cast<size_t>(layer)].name);
  std::vector<RegionPos> all;
  while (true) {
    TRY(const bool there, s.next());
    if (!there) return all;
    all.push_back(
        {static_cast<int32_t>(s.integer(0)), static_cast<int32_t>(s.integer(1)), static_cast<int32_t>(s.integer(2))});
  }
}

Result<Census> SaveFile::census() {
  const std::lock_guard lock(mutex_);
  Census all;
  if (version_ == 1) return all;
  TRY(Statement s, Statement::prepare(db_, "SELECT block, voxels FROM census"));
  while (true) {
    TRY(const bool there, s.next());
    if (!there) return all;
    all[static_cast<BlockId>(s.integer(0))] = static_cast<uint64_t>(s.integer(1));
  }
}

// ---- writing ---------------------------------------------------------------------------------------------------

Result<std::unique_ptr<SaveFile::Transaction>> SaveFile::Transaction::begin(SaveFile& file) {
  CHECK(file.access_ == Access::edit);
  std::unique_ptr<Transaction> t(new Transaction(file));
  file.find_row_.reset();
  if (!file.db_.in_transaction()) {
    // An earlier save failed, and its lock went with it: make sure that nobody saved meanwhile.
    TRY_STATUS(file.begin_editing());
    TRY(const int64_t number, read_save_number(file.db_));
    if (number != file.save_number_) {
      (void)file.db_.run("ROLLBACK");
      return file.db_.broken("was saved by another program meanwhile: save this world under another name");
    }
  }
  TRY(t->old_row_, Statement::prepare(file.db_, "SELECT census FROM region WHERE layer=?1 AND x=?2 AND y=?3 AND z=?4"));
  TRY(t->put_row_,
      Statement::prepare(file.db_, "INSERT OR REPLACE INTO region VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9, ?10)"));
  return t;
}

SaveFile::Transaction::~Transaction() {
  old_row_.reset(), put_row_.reset();
  if (committed_) return;
  if (file_.db_.in_transaction()) (void)file_.db_.run("ROLLBACK");
  (void)file_.begin_editing();  // where it fails, the next save tries again
}

Status SaveFile::Transaction::add_census(const std::string& text, int64_t sign) {
  TRY(const Census census, parse_census(text));
  for (const auto& [block, n] : census) census_change_[block] += sign * static_cast<int64_t>(n);
  return {};
}

Status SaveFile::Transaction::put(RegionRow&& row) {
  const std::string_view layer = layer_rows()[static_cast<size_t>(row.layer)].name;
  row.save = file_.save_number_ + 1;
  row.hash = hash_of(row);
  if (row.layer == Layer::block) {
    Statement& old = *old_row_;
    old.bind(1, layer);
    for (int axis = 0; axis < 3; ++axis) old.bind(2 + axis, int64_t{row.pos[axis]});
    TRY(const bool there, old.next());
    const Status taken = there ? add_census(old.text(0), -1) : Status{};
    old.reset();
    TRY_STATUS(taken);
    TRY_STATUS(add_census(row.census, 1));
  }
  Statement& put = *put_row_;
  put.bind(1, layer);
  for (int axis = 0; axis < 3; ++axis) put.bind(2 + axis, int64_t{row.pos[axis]});
  put.bind(5, row.save), put.bind(6, row.voxels), put.bind(7, row.census), put.bind(8, codec_name(row.codec));
  put.bind(9, row.hash), put.bind_blob(10, row.bytes);
  bytes_ += row.bytes.size();
  return put.finish();
}

Status SaveFile::Transaction::remove(Layer layer, RegionPos pos) {
  CHECK(layer != Layer::block);  // a region that became air stays as a row without voxels
  TRY(Statement s, Statement::prepare(file_.db_, "DELETE FROM region WHERE layer=?1 AND x=?2 AND y=?3 AND z=?4"));
  s.bind(1, layer_rows()[static_cast<size_t>(layer)].name);
  for (int axis = 0; axis < 3; ++axis) s.bind(2 + axis, int64_t{pos[axis]});
  return s.finish();
}

Status SaveFile::Transaction::put_meta(const Meta& meta) {
  TRY_STATUS(file_.db_.run("DELETE FROM meta WHERE key NOT LIKE 'save.%'"));
  TRY(Statement s, Statement::prepare(file_.db_, "INSERT INTO meta VALUES (?1, ?2)"));
  for (const auto& [key, value] : meta.rows) {
    s.bind(1, key), s.bind(2, value);
    TRY_STATUS(s.finish());
  }
  return put_assets(meta);
}

Status SaveFile::Transaction::put_assets(const Meta& meta) {
  std::set<int64_t> there, named;
  {
    TRY(Statement s, Statement::prepare(file_.db_, "SELECT key FROM asset"));
    while (true) {
      TRY(const bool row, s.next());
      if (!row) break;
      there.insert(s.integer(0));
    }
  }
  TRY(Statement put, Statement::prepare(file_.db_, "INSERT INTO asset VALUES (?1, ?2, ?3)"));
  for (const auto& [parts, asset] : meta.assets) {
    named.insert(parts.begin(), parts.end());
    if (std::all_of(parts.begin(), parts.end(), [&](int64_t key) { return there.contains(key); })) continue;
    TRY_STATUS(for_each_part(asset, [&](int64_t key, const std::string& bytes) -> Status {
      if (!there.insert(key).second) return {};
      TRY(const PackedAsset packed, pack_asset(bytes));
      put.bind(1, key), put.bind(2, packed.codec), put.bind_blob(3, packed.bytes);
      bytes_ += packed.bytes.size();
      return put.finish();
    }));
  }
  TRY(Statement drop, Statement::prepare(file_.db_, "DELETE FROM asset WHERE key=?1"));
  for (const int64_t key : there) {
    if (named.contains(key)) continue;
    drop.bind(1, key);
    TRY_STATUS(drop.finish());
  }
  return {};
}

Status SaveFile::Transaction::put_blocks(BlockId first, std::span<const Block> blocks) {
  return write_palette(file_.db_, first, blocks);
}

Status SaveFile::Transaction::commit() {
  Database& db = file_.db_;
  {
    TRY(Statement s, Statement::prepare(db,
                                        "INSERT INTO census VALUES (?1, ?2) ON CONFLICT (block) DO UPDATE SET voxels "
                                        "= voxels + excluded.voxels"));
    for (const auto& [block, n] : census_change_) {
      if (n == 0) continue;
      s.bind(1, int64_t{block}), s.bind(2, n);
      TRY_STATUS(s.finish());
    }
    TRY_STATUS(db.run("DELETE FROM census WHERE voxels = 0"));
    TRY_STATUS(db.run(fmt::format("INSERT OR REPLACE INTO meta VALUES ('save.number', '{}')", file_.save_number_ + 1)));
    TRY(const std::string digest, digest_of(db));
    TRY_STATUS(db.run(fmt::format("INSERT OR REPLACE INTO meta VALUES ('save.digest', '{}')", digest)));
  }
  old_row_.reset(), put_row_.reset();
  TRY_STATUS(db.run("COMMIT"));
  committed_ = true;
  ++file_.save_number_;
  (void)file_.begin_editing();  // where it fails, the next save tries again
  return {};
}

}  // namespace world
