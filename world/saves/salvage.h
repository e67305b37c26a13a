/// Finds what is left of a damaged save by its pages alone, with no help from SQLite: every leaf page of a table is
/// read by itself, and a row counts where its own hash vouches for it. So damage costs the rows that it touches, and
/// no others, wherever it lies: in the header, the schema, the trees' inner pages, or the end that was cut off.
/// source  SQLite. Database File Format, sections 1.3 to 2.1. https://www.sqlite.org/fileformat2.html
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <set>

#include "world/saves/row.h"

namespace world {

/// Layer and position of a row.
using RowKey = std::pair<Layer, RegionPos>;

struct Salvage {
  int version = 0;  // of the rows found; 0 where none was
  std::optional<int64_t> save_number;
  bool is_marked = false;  // the header carries the application id of a save
  uint64_t pages = 0, page_bytes = 0;
  std::map<RowKey, uint64_t> rows;         // the newest whole row of each key: where its cell lies in the file
  std::set<RowKey> lost;                   // named by the index or by a damaged row, but not whole anywhere
  std::map<int64_t, std::string> palette;  // id -> the block as TOML
  std::map<std::string, std::string> meta;
  std::map<int64_t, std::vector<uint64_t>> assets;  // key -> where cells lie; not checked against it yet
};

/// Memory is bounded by the number of rows and one row's payload. Fails only where the file cannot be read.
Result<Salvage> salvage_save(const std::filesystem::path& path);

/// Reads the rows that a Salvage found. The hash is checked again.
class SalvagedRows {
 public:
  static Result<SalvagedRows> open(const std::filesystem::path& path, const Salvage& salvage);
  Result<RegionRow> read(uint64_t where);
  /// A part of an asset, checked against its key.
  Result<std::string> read_asset(uint64_t where, int64_t key, size_t number);

 private:
  friend Result<Salvage> salvage_pages(const std::filesystem::path& path, uint64_t page_bytes);
  struct File;
  std::shared_ptr<File> file_;
};

std::string row_name(const RowKey& key);  // "region (1, -2, 3)"

}  // namespace world
