#include "world/saves/check.h"

#include <algorithm>
#include <cstdlib>

#include <fmt/format.h>

#include "world/base/file.h"
#include "world/base/jobs.h"
#include "world/base/text.h"
#include "world/saves/meta.h"
#include "world/saves/palette_rows.h"
#include "world/saves/salvage.h"
#include "world/saves/save_file.h"
#include "world/saves/schema.h"
#include "world/store/snapshot.h"

namespace world {

namespace {

constexpr size_t kBatch = 32;
constexpr int kMostIntegrityLines = 20;

/// A row's blocks, or why they can't be had; its census must be what they count up to.
Result<Census> count_row(const RegionRow& row, const BlockPalette& palette, int version) {
  if (row.layer != Layer::block) {
    AnyLayer layer = empty_layer(row.layer);
    TRY_STATUS(decode_values(row, layer));
    return Census{};
  }
  TRY(const RegionBuilder builder, decode_blocks(row, palette.size()));
  const Census census = PreparedRegion(builder, palette, 0).census();
  uint64_t voxels = 0;
  for (const auto& [block, n] : census) voxels += n;
  if (voxels != static_cast<uint64_t>(row.voxels))
    return input_error("it states another number of voxels than it holds");
  if (version > 1) {
    TRY(const Census stated, parse_census(row.census));
    if (stated != census) return input_error("it states another census than it holds");
  }
  return census;
}

/// Everything that SQLite can still reach.
Status check_by_sqlite(const std::filesystem::path& path, CheckReport& report) {
  const auto problem = [&](const Error& error) {
    std::string text = error.message;
    if (text.starts_with(path.string() + ": ")) text = text.substr(path.string().size() + 2);
    report.problems.push_back(text);
  };
  Result<Database> db = Database::open(path, Database::Access::read);
  if (!db.ok()) return db.error();
  if (Result<Statement> check =
          Statement::prepare(*db, fmt::format("PRAGMA integrity_check({})", kMostIntegrityLines).c_str());
      check.ok()) {
    while (true) {
      const Result<bool> row = check->next();
      if (!row.ok()) problem(row.error());
      if (!row.ok() || !*row) break;
      if (check->text(0) != "ok") report.problems.push_back("SQLite: " + check->text(0));
    }
  } else {
    problem(check.error());
  }
  const Result<int> version = check_schema(*db);
  if (!version.ok()) {
    problem(version.error());
    return {};
  }
  report.version = *version;
  *db = Database();
  Result<std::unique_ptr<SaveFile>> file = SaveFile::open(path, SaveFile::Access::read);
  if (!file.ok()) {
    problem(file.error());
    return {};
  }
  report.saves = (*file)->save_number();
  Result<World> frame = (*file)->read_frame();
  if (!frame.ok()) {
    problem(frame.error());
    return {};
  }

  Census total;
  std::vector<RegionRow> rows;
  const auto check_rows = [&] {
    std::vector<std::optional<Result<Census>>> counted(rows.size());
    parallel_for(rows.size(), [&](size_t i) {
      const int64_t hash = report.version == 1 ? hash_of_bytes(rows[i].bytes) : hash_of(rows[i]);
      if (hash != rows[i].hash)
        counted[i] = input_error("it differs from its hash");
      else
        counted[i] = count_row(rows[i], *frame->palette, report.version);
    });
    for (size_t i = 0; i < rows.size(); ++i) {
      if (counted[i]->ok()) {
        for (const auto& [block, n] : **counted[i]) total[block] += n;
        continue;
      }
      report.problems.push_back(row_name({rows[i].layer, rows[i].pos}) + " is damaged: " + counted[i]->error().message);
    }
    rows.clear();
  };
  const Status read = (*file)->for_each_row([&](RegionRow&& row) -> Status {
    rows.push_back(std::move(row));
    if (rows.size() == kBatch) check_rows();
    return {};
  });
  check_rows();
  if (!read.ok()) problem(read.error());
  if (report.version > 1) {
    const Result<Census> stated = (*file)->census();
    if (!stated.ok()) {
      problem(stated.error());
    } else if (*stated != total) {
      if (report.problems.empty()) report.problems.push_back("its regions hold other blocks than its census says");
      for (const auto& [block, n] : *stated) {
        const uint64_t there = total[block];
        if (there < n && block < frame->palette->size())
          report.missing.push_back(
              fmt::format("{} voxels of {}", with_thousands(n - there), (*frame->palette)[block].name));
      }
    }
  }
  return {};
}

/// Refuses a file in which nothing of a save is, and whose header does not say either that it is one.
Status refuse_strangers(const std::filesystem::path& path, const Salvage& salvage) {
  if (!salvage.rows.empty() || !salvage.lost.empty() || !salvage.palette.empty() || salvage.is_marked) return {};
  return input_error(path.string() + ": nothing of a Loam save is in this file: expected SQLite pages with regions");
}

/// What the palette should hold: what was found, and names from the regions' own censuses for what was not.
Result<BlockPalette> palette_of(const std::filesystem::path& path, const Salvage& salvage, CheckReport& report) {
  TRY(SalvagedRows rows, SalvagedRows::open(path, salvage));
  int64_t highest = salvage.palette.empty() ? 0 : salvage.palette.rbegin()->first;
  std::map<BlockId, std::string> from_regions;
  for (const auto& [key, where] : salvage.rows) {
    TRY(const RegionRow row, rows.read(where));
    std::string_view text = row.census;
    while (!text.empty()) {
      const std::string_view line = text.substr(0, text.find('\n'));
      text.remove_prefix(std::min(line.size() + 1, text.size()));
      const size_t first = line.find(' '), second = line.find(' ', first + 1);
      if (second == line.npos) continue;
      const auto id = static_cast<BlockId>(std::atoi(std::string(line.substr(0, first)).c_str()));
      from_regions.try_emplace(id, line.substr(second + 1));
      highest = std::max<int64_t>(highest, id);
    }
  }
  BlockPalette palette;
  for (int64_t id = 1; id <= highest; ++id) {
    const auto found = salvage.palette.find(id);
    if (found != salvage.palette.end() &&
        add_saved_block(palette, found->second, salvage.version, fmt::format("palette entry {}", id)).ok())
      continue;
    const auto named = from_regions.find(static_cast<BlockId>(id));
    const std::string name = named == from_regions.end() ? fmt::format("lost:{}", id) : named->second;
    Block block;
    if (const auto standard = standard_blocks().find(name)) {
      block = standard_blocks()[*standard];
    } else {
      block.name = name;
      block.albedo = Ratio3{0.9f, 0.05f, 0.9f};  // nothing natural has this colour
      if (named != from_regions.end())
        report.lost.push_back(fmt::format("the properties of palette entry {} ({})", id, name));
    }
    if (!palette.add(block).ok()) {
      block.name = fmt::format("lost:{}", id);
      TRY([[maybe_unused]] const BlockId added, palette.add(block));
    }
  }
  return palette;
}

Status write_repaired(const std::filesystem::path& path, const std::filesystem::path& to, const Salvage& salvage,
                      CheckReport& report) {
  TRY(const BlockPalette palette, palette_of(path, salvage, report));
  World frame(palette);
  TRY(SalvagedRows rows, SalvagedRows::open(path, salvage));
  AssetReader assets(
      [&](int64_t key, size_t number) -> Result<std::string> {
        const auto found = salvage.assets.find(key);
        if (found != salvage.assets.end())
          for (const uint64_t where : found->second)
            if (Result<std::string> bytes = rows.read_asset(where, key, number); bytes.ok()) return bytes;
        return input_error("an asset is missing");
      },
      16 * salvage.pages * salvage.page_bytes);
  for (const auto& [key, value] : salvage.meta)
    if (!read_meta_row(frame, key, value, path.string(), assets).ok())
      report.lost.push_back(fmt::format("the entry \"{}\"", key.substr(0, 60)));
  std::vector<std::string> names;
  for (size_t id = 0; id < palette.size(); ++id) names.push_back(palette[static_cast<BlockId>(id)].name);

  TRY(const auto file, SaveFile::create(to));
  TRY(const auto transaction, SaveFile::Transaction::begin(*file));
  TRY_STATUS(transaction->put_meta(meta_of(frame)));
  std::vector<Block> blocks;
  for (size_t id = 1; id < palette.size(); ++id) blocks.push_back(palette[static_cast<BlockId>(id)]);
  TRY_STATUS(transaction->put_blocks(1, blocks));
  report.regions = report.voxels = 0;
  for (const auto& [key, where] : salvage.rows) {
    TRY(RegionRow row, rows.read(where));
    const Result<Census> census = count_row(row, palette, 1);
    if (!census.ok()) {
      report.lost.push_back(row_name(key) + ": " + census.error().message);
      continue;
    }
    row.census = census_text(*census, names);
    report.voxels += static_cast<uint64_t>(row.voxels);
    ++report.regions;
    TRY_STATUS(transaction->put(std::move(row)));
  }
  return transaction->commit();
}

}  // namespace

Result<CheckReport> check_save(const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored))
    return input_error(path.string() + ": is a folder, expected a file");
  CheckReport report;
  // First by SQLite: opening takes back what an interrupted save left in the file.
  const Status by_sqlite = check_by_sqlite(path, report);
  TRY(const Salvage salvage, salvage_save(path));
  TRY_STATUS(refuse_strangers(path, salvage));
  if (!by_sqlite.ok()) report.problems.push_back(by_sqlite.error().message);
  if (report.version == 0) report.version = salvage.version;
  report.regions = salvage.rows.size();
  TRY(SalvagedRows rows, SalvagedRows::open(path, salvage));
  for (const auto& [key, where] : salvage.rows) {
    TRY(const RegionRow row, rows.read(where));
    report.voxels += static_cast<uint64_t>(row.voxels);
  }
  if (!report.clean())
    for (const RowKey& key : salvage.lost) report.lost.push_back(row_name(key));
  // Sums tell of regions that vanished without a name; where they have one, it says more.
  if (report.lost.empty()) report.lost = report.missing;
  return report;
}

Result<CheckReport> repair_save(const std::filesystem::path& path) {
  TRY(CheckReport report, check_save(path));
  if (report.clean()) return report;
  TRY(const Salvage salvage, salvage_save(path));
  if (salvage.rows.empty() && salvage.palette.empty())
    return input_error(path.string() + ": nothing whole is left in this save, so there is nothing to keep of it");
  // A name that is free: a backup never replaces another.
  std::filesystem::path backup;
  for (int n = 1;; ++n) {
    backup = path;
    backup.replace_extension(fmt::format(".damaged-{}{}", n, path.extension().string()));
    std::error_code ignored;
    if (!std::filesystem::exists(backup, ignored)) break;
  }
  std::filesystem::path repaired = path;
  repaired.replace_extension(".repaired" + path.extension().string());
  TRY_STATUS(write_file_atomically(repaired, [&](const std::filesystem::path& temporary) {
    return write_repaired(path, temporary, salvage, report);
  }));
  std::error_code error;
  std::filesystem::rename(path, backup, error);
  // A journal that SQLite could not use must not meet the repaired file.
  std::filesystem::path journal = path;
  journal += "-journal";
  std::error_code ignored;
  if (!error && std::filesystem::exists(journal, ignored)) {
    std::filesystem::path journal_backup = backup;
    journal_backup += "-journal";
    std::filesystem::rename(journal, journal_backup, error);
  }
  if (!error) std::filesystem::rename(repaired, path, error);
  if (error)
    return input_error(fmt::format("{}: the repaired world is {}, but could not take its place: {}", path.string(),
                                   repaired.string(), error.message()));
  report.backup = backup;
  report.repaired = path;
  return report;
}

}  // namespace world
