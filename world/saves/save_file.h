/// Loam's own save: one SQLite file (design, section 3), and the one place that knows its tables.
///
///   meta     key, value                  what the world holds beside blocks and layers (surroundings.h), where it came
///                                        from, the number of the last save, a digest
///   palette  id, blocks, hash, bytes     ids as the regions use them: blocks from an id on, as TOML (palette_rows.h)
///   census   block, voxels               of the whole world, so that opening reads no region
///   region   layer, x, y, z, save,       a row a 128^3 region and layer: an OpenVDB stream in a Zstandard frame, or
///            voxels, census, codec,      what it would hold in fewer bytes (row.h); with the number of the save that
///            hash, bytes                 wrote it and an XXH3 over all of the row
///   asset    key, codec, bytes           triangles, images and densities that rows of meta name (assets.h)
///
/// Version 1 had no census, one codec, and a hash of the bytes alone; versions 1 and 2 had no assets; before version 4
/// each block was a row of text; before version 5 there were no layers of integers, no temperature, nothing of the
/// simulation, and no block said how it rests or flows. They are read as they are, and become version 5 where they are
/// opened for editing.
///
/// One transaction a save, rollback journal, synchronous=EXTRA (FULL, and the folder is synced too): after a kill or a
/// power loss at any moment the file holds exactly one complete save. Reading trusts nothing: the schema is compared
/// with the template, each row with its hash, each id with the palette.
///
/// A program that edits holds SQLite's reserved lock from open to close: a second one is refused, readers are not.
/// All calls may come from several threads; they take turns.
#pragma once

#include <functional>
#include <mutex>

#include "world/saves/database.h"
#include "world/saves/meta.h"
#include "world/saves/row.h"
#include "world/world.h"

namespace world {

class SaveFile {
 public:
  enum class Access { read, edit };
  static Result<std::unique_ptr<SaveFile>> open(const std::filesystem::path& path, Access access,
                                                const std::string& vfs = {});
  /// Makes an empty save of a file that is missing or empty, without a journal: the caller syncs and renames it.
  static Result<std::unique_ptr<SaveFile>> create(const std::filesystem::path& path);
  ~SaveFile();
  SaveFile(const SaveFile&) = delete;
  SaveFile& operator=(const SaveFile&) = delete;

  int version() const { return version_; }
  int64_t save_number() const { return save_number_; }  // of the last save; 0 in version 1
  const std::string& path() const { return db_.path(); }

  /// Palette, surroundings and metadata; no region, but that media sample their layer.
  Result<World> read_frame();
  /// All of it.
  Result<World> read_all();
  /// One row, or nothing where the file has none. Its hash has been checked.
  Result<std::optional<RegionRow>> read_row(Layer layer, RegionPos pos);
  /// Calls visit for each row in order of layer and position until it fails; rows in visits come with hashes unchecked.
  Status for_each_row(const std::function<Status(RegionRow&&)>& visit);
  /// Positions of the rows of a layer, from the index alone.
  Result<std::vector<RegionPos>> positions(Layer layer);
  /// Of the whole world. Version 1 has none: empty.
  Result<Census> census();

  /// One save, seen by others as a whole or not at all. Holds the file until it is committed or destroyed.
  class Transaction;

 private:
  friend class Transaction;
  SaveFile() = default;
  Status begin_editing();
  Status upgrade_from_1();
  Status upgrade_from_2_to_4();
  Status check_row(const RegionRow& row) const;
  Status read_meta(World& world);
  Status fill_media(World& world);

  std::recursive_mutex mutex_;
  Database db_;
  Access access_ = Access::read;
  int version_ = 0;
  int64_t save_number_ = 0;
  std::optional<Statement> find_row_;
};

class SaveFile::Transaction {
 public:
  static Result<std::unique_ptr<Transaction>> begin(SaveFile& file);
  ~Transaction();  // takes back what was not committed
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;

  /// Replaces the row; fills in its save and hash.
  Status put(RegionRow&& row);
  Status remove(Layer layer, RegionPos pos);
  /// Replaces all rows; assets that are there already are not written again, and those that no row names go.
  Status put_meta(const Meta& meta);
  /// Blocks that are new, with ids from `first` on.
  Status put_blocks(BlockId first, std::span<const Block> blocks);
  Status commit();
  uint64_t bytes() const { return bytes_; }  // of payloads written

 private:
  explicit Transaction(SaveFile& file) : file_(file), lock_(file.mutex_) {}
  Status add_census(const std::string& text, int64_t sign);
  Status put_assets(const Meta& meta);
  SaveFile& file_;
  std::unique_lock<std::recursive_mutex> lock_;
  std::optional<Statement> old_row_, put_row_;
  std::map<BlockId, int64_t> census_change_;
  uint64_t bytes_ = 0;
  bool committed_ = false;
};

}  // namespace world
