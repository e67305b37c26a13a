#include "world/saves/salvage.h"

#include <array>
#include <cstdlib>
#include <cstring>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "world/saves/assets.h"
#include "world/saves/database.h"
#include "world/saves/palette_rows.h"
#include "world/saves/schema.h"

namespace world {

namespace {

constexpr uint8_t kTableLeaf = 0x0d, kIndexLeaf = 0x0a;
constexpr uint64_t kFileHeaderBytes = 100;

uint64_t big_endian(const uint8_t* p, int bytes) {
  uint64_t v = 0;
  for (int i = 0; i < bytes; ++i) v = v << 8 | p[i];
  return v;
}

/// A value of a record: an integer, or text or a blob.
struct Value {
  enum class Kind { null, integer, real, text, blob } kind = Kind::null;
  int64_t integer = 0;
  std::string bytes;
};

/// Reads on in a range of bytes; false at its end.
struct Bytes {
  const uint8_t *at, *end;
  bool varint(uint64_t& v) {
    v = 0;
    for (int i = 0; i < 9; ++i) {
      if (at == end) return false;
      const uint8_t b = *at++;
      if (i == 8) {
        v = v << 8 | b;
        return true;
      }
      v = v << 7 | (b & 0x7f);
      if (!(b & 0x80)) return true;
    }
    return true;
  }
};

/// The columns of a record, or nothing where its sizes do not fit.
std::optional<std::vector<Value>> parse_record(const std::string& payload) {
  Bytes in{reinterpret_cast<const uint8_t*>(payload.data()),
           reinterpret_cast<const uint8_t*>(payload.data()) + payload.size()};
  const uint8_t* const start = in.at;
  uint64_t header = 0;
  if (!in.varint(header) || header > payload.size() || header < 1) return std::nullopt;
  Bytes types{in.at, start + header};
  const uint8_t* body = start + header;
  std::vector<Value> values;
  while (types.at < types.end) {
    uint64_t type = 0;
    if (!types.varint(type) || values.size() > 16) return std::nullopt;
    constexpr std::array<int, 8> kIntegerBytes = {0, 1, 2, 3, 4, 6, 8, 8};
    Value v;
    uint64_t size = 0;
    if (type <= 7) {
      size = static_cast<uint64_t>(kIntegerBytes[type]);
      v.kind = type == 0 ? Value::Kind::null : type == 7 ? Value::Kind::real : Value::Kind::integer;
    } else if (type == 8 || type == 9) {
      v.kind = Value::Kind::integer, v.integer = static_cast<int64_t>(type) - 8;
    } else if (type >= 12) {
      size = (type - 12) / 2;
      v.kind = type % 2 ? Value::Kind::text : Value::Kind::blob;
    } else {
      return std::nullopt;
    }
    if (size > static_cast<uint64_t>(in.end - body)) return std::nullopt;
    if (v.kind == Value::Kind::integer && size > 0) {
      const uint64_t raw = big_endian(body, static_cast<int>(size));
      const int unused = 64 - 8 * static_cast<int>(size);
      v.integer = static_cast<int64_t>(raw << unused) >> unused;
    } else if (v.kind == Value::Kind::text || v.kind == Value::Kind::blob) {
      v.bytes.assign(reinterpret_cast<const char*>(body), size);
    }
    body += size;
    values.push_back(std::move(v));
  }
  return values;
}

bool are(const std::vector<Value>& values, std::string_view kinds) {
  if (values.size() != kinds.size()) return false;
  for (size_t i = 0; i < kinds.size(); ++i) {
    const Value::Kind k = values[i].kind;
    const bool fits = kinds[i] == 'n'   ? k == Value::Kind::null
                      : kinds[i] == 'i' ? k == Value::Kind::integer
                      : kinds[i] == 't' ? k == Value::Kind::text
                                        : k == Value::Kind::blob;
    if (!fits) return false;
  }
  return true;
}

std::optional<RowKey> key_of(const std::vector<Value>& v) {
  const std::optional<Layer> layer = layer_from_name(v[0].bytes);
  if (!layer) return std::nullopt;
  RegionPos pos;
  for (size_t axis = 0; axis < 3; ++axis) {
    const int64_t c = v[1 + axis].integer;
    if (c < -kWorldBorder / kRegionSize || c >= kWorldBorder / kRegionSize) return std::nullopt;
    pos[static_cast<int>(axis)] = static_cast<int32_t>(c);
  }
  return RowKey{*layer, pos};
}

/// The row that the columns spell; `version` says whose columns they are.
std::optional<RegionRow> row_of(std::vector<Value>& v, int& version) {
  version = are(v, "tiiiiittib") ? 2 : are(v, "tiiiiib") ? 1 : 0;
  if (version == 0) return std::nullopt;
  const std::optional<RowKey> key = key_of(v);
  if (!key) return std::nullopt;
  RegionRow row;
  row.layer = key->first, row.pos = key->second;
  if (version == 1) {
    row.voxels = v[4].integer, row.hash = v[5].integer, row.bytes = std::move(v[6].bytes);
    return row;
  }
  const std::optional<Codec> codec = codec_from_name(v[7].bytes);
  if (!codec) return std::nullopt;
  row.save = v[4].integer, row.voxels = v[5].integer, row.census = v[6].bytes, row.codec = *codec;
  row.hash = v[8].integer, row.bytes = std::move(v[9].bytes);
  return row;
}

bool is_whole(const RegionRow& row, int version) {
  return row.hash == (version == 1 ? hash_of_bytes(row.bytes) : hash_of(row));
}

}  // namespace

std::string row_name(const RowKey& key) {
  const RegionPos p = key.second;
  return key.first == Layer::block ? fmt::format("region ({}, {}, {})", p.x, p.y, p.z)
                                   : fmt::format("layer {}, region ({}, {}, {})",
                                                 layer_rows()[static_cast<size_t>(key.first)].name, p.x, p.y, p.z);
}

/// The file as pages.
struct SalvagedRows::File {
  int fd = -1;
  uint64_t bytes = 0, page_bytes = kSavePageBytes;
  std::vector<uint8_t> page;

  ~File() {
    if (fd >= 0) ::close(fd);
  }
  uint64_t pages() const { return (bytes + page_bytes - 1) / page_bytes; }
  /// Page n, from 1; what lies past the end of the file reads as zeros.
  bool read(uint64_t n, std::vector<uint8_t>& out) const {
    out.assign(page_bytes, 0);
    if (n < 1 || n > pages()) return false;
    const off_t at = static_cast<off_t>((n - 1) * page_bytes);
    uint64_t done = 0;
    while (done < page_bytes) {
      const ssize_t got = ::pread(fd, out.data() + done, page_bytes - done, at + static_cast<off_t>(done));
      if (got <= 0) break;
      done += static_cast<uint64_t>(got);
    }
    return done > 0;
  }
  /// The payload of the cell at `offset` of a leaf page, its overflow pages followed.
  std::optional<std::string> payload(const std::vector<uint8_t>& leaf, uint64_t offset, bool is_table,
                                     int64_t* rowid) const {
    Bytes in{leaf.data() + offset, leaf.data() + leaf.size()};
    uint64_t size = 0, id = 0;
    if (!in.varint(size) || size > kMostPayloadBytes || size == 0) return std::nullopt;
    if (is_table && !in.varint(id)) return std::nullopt;
    if (rowid) *rowid = static_cast<int64_t>(id);
    const uint64_t usable = page_bytes, most = is_table ? usable - 35 : (usable - 12) * 64 / 255 - 23;
    const uint64_t least = (usable - 12) * 32 / 255 - 23;
    uint64_t local = size;
    if (size > most) {
      const uint64_t k = least + (size - least) % (usable - 4);
      local = k <= most ? k : least;
    }
    const uint64_t left = static_cast<uint64_t>(in.end - in.at);
    if (local > left || (local < size && local + 4 > left)) return std::nullopt;
    std::string all(reinterpret_cast<const char*>(in.at), local);
    if (local == size) return all;
    // Every page of the chain but the last is full, so its length is known: a loop ends too.
    uint64_t next = big_endian(in.at + local, 4);
    std::vector<uint8_t> page_of_chain;
    all.reserve(std::min<uint64_t>(size, bytes));
    while (all.size() < size) {
      if (!read(next, page_of_chain)) return std::nullopt;
      all.append(reinterpret_cast<const char*>(page_of_chain.data()) + 4, std::min(usable - 4, size - all.size()));
      next = big_endian(page_of_chain.data(), 4);
    }
    return all;
  }
};

Result<SalvagedRows> SalvagedRows::open(const std::filesystem::path& path, const Salvage& salvage) {
  SalvagedRows rows;
  rows.file_ = std::make_shared<File>();
  File& file = *rows.file_;
  file.fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  struct stat status {};
  if (file.fd < 0 || ::fstat(file.fd, &status) != 0)
    return input_error(fmt::format("{}: cannot open: {}", path.string(), std::strerror(errno)));
  if (!S_ISREG(status.st_mode)) return input_error(path.string() + ": is not a regular file");
  file.bytes = static_cast<uint64_t>(status.st_size);
  file.page_bytes = salvage.page_bytes;
  return rows;
}

Result<RegionRow> SalvagedRows::read(uint64_t where) {
  File& file = *file_;
  file.read(where / file.page_bytes + 1, file.page);
  int version = 0;
  if (const auto payload = file.payload(file.page, where % file.page_bytes, true, nullptr))
    if (auto values = parse_record(*payload))
      if (auto row = row_of(*values, version); row && is_whole(*row, version)) return std::move(*row);
  return input_error("a row changed while it was being read");
}

Result<std::string> SalvagedRows::read_asset(uint64_t where, int64_t key, size_t number) {
  File& file = *file_;
  file.read(where / file.page_bytes + 1, file.page);
  if (const auto payload = file.payload(file.page, where % file.page_bytes, true, nullptr))
    if (const auto values = parse_record(*payload); values && are(*values, "ntb")) {
      TRY(std::string bytes, unpack_asset((*values)[1].bytes, (*values)[2].bytes));
      if (asset_key(bytes, number) == key) return bytes;
    }
  return input_error("an asset differs from its hash");
}

/// `page_bytes`: where the header states none of SQLite's sizes.
Result<Salvage> salvage_pages(const std::filesystem::path& path, uint64_t page_bytes) {
  Salvage found;
  found.page_bytes = page_bytes;
  TRY(SalvagedRows rows, SalvagedRows::open(path, found));
  SalvagedRows::File& file = *rows.file_;
  std::vector<uint8_t>& page = file.page;
  file.read(1, page);
  const uint64_t stated = big_endian(page.data() + 16, 2);
  if (stated == 1)
    file.page_bytes = 65536;
  else if (stated >= 512 && stated <= 32768 && (stated & (stated - 1)) == 0)
    file.page_bytes = stated;
  found.page_bytes = file.page_bytes;
  found.pages = file.pages();
  const std::vector<uint8_t> header(page.begin(), page.begin() + kFileHeaderBytes);
  found.is_marked = big_endian(header.data() + 68, 4) == kApplicationId;

  struct Newest {
    int64_t save;
    uint64_t where;
  };
  std::map<RowKey, std::vector<Newest>> whole;  // by key, all that are whole: which counts is known at the end
  std::set<RowKey> named;
  const auto take_table_cell = [&](uint64_t where, std::vector<Value>& v, int64_t rowid) {
    int version = 0;
    if (auto row = row_of(v, version)) {
      const RowKey key{row->layer, row->pos};
      if (is_whole(*row, version)) {
        whole[key].push_back({row->save, where});
        found.version = std::max(found.version, version);
      } else {
        named.insert(key);
      }
    } else if (are(v, "ntti") && v[3].integer == hash_of_palette_row(rowid, v[1].bytes, v[2].bytes)) {
      found.palette[rowid] = v[2].bytes;
    } else if (are(v, "ntt") && rowid > 0 && rowid < static_cast<int64_t>(kMaxBlocks)) {
      found.palette.try_emplace(rowid, v[2].bytes);  // of version 1: no hash
    } else if (are(v, "niib")) {
      const auto blocks = read_palette_row({rowid, v[1].integer, v[2].integer, std::move(v[3].bytes)});
      for (size_t i = 0; blocks.ok() && i < blocks->size(); ++i)
        found.palette[rowid + static_cast<int64_t>(i)] = (*blocks)[i];
    } else if (are(v, "ntb")) {
      found.assets[rowid].push_back(where);
    } else if (are(v, "tt")) {
      std::string& value = found.meta[v[0].bytes];
      // A page that was given up may hold an older number.
      if (v[0].bytes != "save.number" || std::atoll(v[1].bytes.c_str()) > std::atoll(value.c_str())) value = v[1].bytes;
    }
  };
  std::vector<uint8_t> leaf;
  for (uint64_t n = 1; n <= found.pages; ++n) {
    if (!file.read(n, leaf)) continue;
    const uint64_t head = n == 1 ? kFileHeaderBytes : 0;
    const uint8_t kind = leaf[head];
    if (kind != kTableLeaf && kind != kIndexLeaf) continue;
    const uint64_t cells = big_endian(&leaf[head + 3], 2);
    for (uint64_t i = 0; i < cells; ++i) {
      const uint64_t pointer = head + 8 + 2 * i;
      if (pointer + 2 > leaf.size()) break;
      const uint64_t offset = big_endian(&leaf[pointer], 2);
      if (offset < head + 8 || offset >= leaf.size()) continue;
      int64_t rowid = 0;
      const auto payload = file.payload(leaf, offset, kind == kTableLeaf, &rowid);
      auto values = payload ? parse_record(*payload) : std::nullopt;
      if (!values) continue;
      if (kind == kTableLeaf)
        take_table_cell((n - 1) * file.page_bytes + offset, *values, rowid);
      else if (are(*values, "tiiii"))
        if (const auto key = key_of(*values)) named.insert(*key);
    }
  }
  // The header says more than rows, which are the same from version 2 on.
  if (const uint64_t version = big_endian(header.data() + 60, 4);
      found.is_marked && version >= 1 && version <= static_cast<uint64_t>(kSaveVersion))
    found.version = static_cast<int>(version);
  if (const auto number = found.meta.find("save.number"); number != found.meta.end())
    found.save_number = std::atoll(number->second.c_str());
  for (const auto& [key, candidates] : whole) {
    // Rows of a save that was never finished lie in the file beside those that count.
    const Newest* best = nullptr;
    for (const Newest& row : candidates)
      if ((!found.save_number || row.save <= *found.save_number) && (!best || row.save >= best->save)) best = &row;
    if (best) found.rows[key] = best->where;
  }
  for (const RowKey& key : named)
    if (!found.rows.contains(key)) found.lost.insert(key);
  return found;
}

Result<Salvage> salvage_save(const std::filesystem::path& path) {
  TRY(Salvage found, salvage_pages(path, kSavePageBytes));
  if (found.rows.empty() && found.palette.empty()) return salvage_pages(path, kPageBytesBefore4);
  return found;
}

}  // namespace world
