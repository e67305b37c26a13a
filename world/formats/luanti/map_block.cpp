#include "world/formats/luanti/map_block.h"

#include <algorithm>
#include <map>

#include <fmt/format.h>
#include <sqlite3.h>
#include <zstd.h>

#include "world/base/text.h"
#include "world/formats/archive/inflate.h"
#include "world/formats/bytes.h"
#include "world/formats/nbt/nbt.h"

namespace world::luanti {
namespace {

constexpr size_t kNodeBytes = kCubeVoxels * 4;
constexpr uint64_t kMostBlockBytes = 16 << 20;  // inflated: nodes, and what chests hold
constexpr int kFirstVersion = 25, kZstdVersion = 29;
constexpr int kFirstStair = 20;  // facedir 20 to 23: upside down

/// Whether param2 of such a node changes what block it becomes.
bool turns(std::string_view name) { return name.starts_with("stairs:"); }

/// Big-endian numbers on top of a ByteReader.
uint16_t u16(ByteReader& in) {
  const auto b = in.bytes(2);
  return b.size() == 2 ? nbt::big_endian<uint16_t>(b.data()) : uint16_t{0};
}

}  // namespace

struct BlockReader::Impl {
  StateTable& states;
  MemoryBudget& budget;
  Inflater inflater;
  ZSTD_DCtx* zstd = ZSTD_createDCtx();
  std::vector<uint8_t> unpacked;  // of zstd
  std::vector<uint8_t> nodes;     // [kNodeBytes]
  int version = 0;
  bool good = false;
  std::vector<uint16_t> local;          // content id -> index in the cube, for this block
  std::vector<uint16_t> touched;        // content ids in `local` that are not free
  std::vector<std::string_view> names;  // by content id, of this block
  std::vector<uint16_t> named;
  std::array<uint16_t, kCubeVoxels> indices;
  std::array<uint8_t, kCubeVoxels> bytes;

  Impl(StateTable& s, MemoryBudget& b)
      : states(s), budget(b), inflater(b), nodes(kNodeBytes), local(65536, UINT16_MAX), names(65536) {}
  ~Impl() { ZSTD_freeDCtx(zstd); }

  std::string unpack_zstd(std::span<const uint8_t> packed) {
    ZSTD_DCtx_reset(zstd, ZSTD_reset_session_only);
    ZSTD_DCtx_setParameter(zstd, ZSTD_d_windowLogMax, 24);
    if (unpacked.size() < 64 << 10) unpacked.resize(64 << 10);
    ZSTD_inBuffer in{packed.data(), packed.size(), 0};
    ZSTD_outBuffer out{unpacked.data(), unpacked.size(), 0};
    for (;;) {
      const size_t before = out.pos;
      const size_t code = ZSTD_decompressStream(zstd, &out, &in);
      if (!budget.inflated(out.pos - before)) return "the file inflates to more than one of its size ever does";
      if (ZSTD_isError(code)) return fmt::format("its zstd data is damaged ({})", ZSTD_getErrorName(code));
      if (code == 0) break;
      if (out.pos < out.size) return "its zstd data is cut off";
      if (unpacked.size() >= kMostBlockBytes) return "inflates to more than a map block ever holds";
      unpacked.resize(unpacked.size() * 2);
      out = {unpacked.data(), unpacked.size(), out.pos};
    }
    unpacked_size = out.pos;
    return {};
  }
  size_t unpacked_size = 0;

  std::string read_names(ByteReader& in) {
    if (in.u8() != 0) return "its list of names is of an unknown version";
    for (int n = u16(in); n > 0; --n) {
      const uint16_t id = u16(in);
      const auto text = in.bytes(u16(in));
      if (in.failed()) return "it ends inside its list of names";
      names[id] = {reinterpret_cast<const char*>(text.data()), text.size()};
      named.push_back(id);
    }
    return {};
  }

  /// Finds nodes and names in the blob; `nodes` is filled.
  std::string parse(std::span<const uint8_t> blob) {
    if (blob.empty()) return "it is empty";
    version = blob[0];
    if (version < kFirstVersion || version > kZstdVersion) {
      return fmt::format("it is of the version {}; {} to {} are read", version, kFirstVersion, kZstdVersion);
    }
    if (version == kZstdVersion) {
      if (const std::string problem = unpack_zstd(blob.subspan(1)); !problem.empty()) return problem;
      ByteReader in(std::span<const uint8_t>(unpacked).first(unpacked_size), "");
      in.bytes(1 + 2 + 4);  // flags, light state, time
      if (const std::string problem = read_names(in); !problem.empty()) return problem;
      const uint8_t content_width = in.u8(), params_width = in.u8();
      const auto all = in.bytes(kNodeBytes);
      if (in.failed()) return "it ends inside its nodes";
      if (content_width != 2 || params_width != 2) return "its nodes are of an unknown width";
      std::copy(all.begin(), all.end(), nodes.begin());
      return {};
    }
    ByteReader in(blob, "");
    in.bytes(version >= 27 ? 4 : 2);  // version, flags, light state
    const uint8_t content_width = in.u8(), params_width = in.u8();
    if (in.failed() || content_width != 2 || params_width != 2) return "its nodes are of an unknown width";
    size_t used = 0;
    auto packed = in.bytes(in.remaining());
    const auto all = inflater.inflate(packed, kNodeBytes + 1, &used);
    if (!all) return "its nodes: " + all.error().message;
    if (all->size() != kNodeBytes) return fmt::format("its nodes take {} bytes, expected {}", all->size(), kNodeBytes);
    std::copy(all->begin(), all->end(), nodes.begin());
    packed = packed.subspan(used);
    const auto metadata = inflater.inflate(packed, kMostBlockBytes, &used);
    if (!metadata) return "its node metadata: " + metadata.error().message;
    ByteReader rest(packed.subspan(used), "");
    rest.u8();  // version of the static objects
    for (int n = u16(rest); n > 0 && !rest.failed(); --n) {
      rest.bytes(1 + 12);  // kind, position
      rest.bytes(u16(rest));
    }
    rest.bytes(4);  // time
    if (rest.failed()) return "it ends inside its objects";
    return read_names(rest);
  }

  std::string to_cube(std::array<int, 3> pos, std::vector<Cube>& cubes) {
    Cube cube;
    cube.pos = {pos[0], pos[1], -pos[2] - 1};
    const uint8_t* const param2 = nodes.data() + kCubeVoxels * 3;
    bool turned = false;
    for (size_t i = 0; i < kCubeVoxels; ++i) {
      const uint16_t content = nbt::big_endian<uint16_t>(nodes.data() + 2 * i);
      uint16_t& index = local[content];
      if (index == UINT16_MAX) {
        if (names[content].empty()) return fmt::format("the node {} has the content {}, which has no name", i, content);
        const auto state = states.number(names[content]);
        if (!state) return "there are too many names of nodes";
        index = static_cast<uint16_t>(cube.states.size());
        touched.push_back(content);
        cube.states.push_back(*state);
        turned |= turns(names[content]);
      }
      indices[i] = index;
    }
    if (turned) {
      const std::string problem = turn_stairs(param2, cube);
      if (!problem.empty()) return problem;
    }
    const bool wide = cube.states.size() > 256;
    if (!budget.take(cube.states.size() == 1 ? 128 : wide ? 2 * kCubeVoxels : kCubeVoxels))
      return "no memory is left for it: the file claims more than one of its size ever holds";
    if (wide) {
      cube.wide = std::make_unique_for_overwrite<uint16_t[]>(kCubeVoxels);
      order_cube(CubeOrder::zyx_mirrored, indices.data(), cube.wide.get());
    } else if (cube.states.size() > 1) {
      for (size_t i = 0; i < kCubeVoxels; ++i) bytes[i] = static_cast<uint8_t>(indices[i]);
      cube.narrow = std::make_unique_for_overwrite<uint8_t[]>(kCubeVoxels);
      order_cube(CubeOrder::zyx_mirrored, bytes.data(), cube.narrow.get());
    }
    cubes.push_back(std::move(cube));
    return {};
  }

  /// Nodes whose param2 matters get a state for each of its values.
  std::string turn_stairs(const uint8_t* param2, Cube& cube) {
    std::vector<bool> is_stair;
    for (const StateNumber state : cube.states) is_stair.push_back(turns(states.text(state)));
    std::map<std::pair<uint16_t, uint8_t>, uint16_t> made;
    for (size_t i = 0; i < kCubeVoxels; ++i) {
      if (!is_stair[indices[i]]) continue;
      const auto key = std::pair{indices[i], param2[i]};
      auto found = made.find(key);
      if (found == made.end()) {
        const auto state = states.number(node_state(states.text(cube.states[indices[i]]), param2[i]));
        if (!state) return "there are too many names of nodes";
        found = made.emplace(key, static_cast<uint16_t>(cube.states.size())).first;
        cube.states.push_back(*state);
      }
      indices[i] = found->second;
    }
    return {};
  }
};

BlockReader::BlockReader(StateTable& states, MemoryBudget& budget) : impl_(std::make_unique<Impl>(states, budget)) {}
BlockReader::~BlockReader() = default;

std::string BlockReader::read(std::span<const uint8_t> blob, std::array<int, 3> pos, std::vector<Cube>& cubes) {
  impl_->good = false;
  std::string problem = impl_->parse(blob);
  if (problem.empty()) problem = impl_->to_cube(pos, cubes);
  for (const uint16_t content : impl_->touched) impl_->local[content] = UINT16_MAX;
  for (const uint16_t id : impl_->named) impl_->names[id] = {};
  impl_->touched.clear();
  impl_->named.clear();
  impl_->good = problem.empty();
  return problem;
}

std::span<const uint8_t> BlockReader::light() const {
  return impl_->good ? std::span<const uint8_t>(impl_->nodes).subspan(kCubeVoxels * 2, kCubeVoxels)
                     : std::span<const uint8_t>();
}
int BlockReader::version() const { return impl_->version; }

std::string node_state(std::string_view name, uint8_t param2) {
  if (!turns(name)) return std::string(name);
  // Of facedir 0 the step rises towards Luanti's +z, which is our north.
  static constexpr const char* kUpright[] = {"north", "east", "south", "west"};
  static constexpr const char* kHung[] = {"north", "west", "south", "east"};
  const int facing = param2 & 3;
  const bool hung = (param2 & 31) >= kFirstStair;
  return fmt::format("{}[facing={},half={}]", name, hung ? kHung[facing] : kUpright[facing], hung ? "top" : "bottom");
}

// ---- the database ----------------------------------------------------------------------------------------------

namespace {

struct CloseDatabase {
  void operator()(sqlite3* db) const { sqlite3_close_v2(db); }
};
struct FinalizeStatement {
  void operator()(sqlite3_stmt* s) const { sqlite3_finalize(s); }
};

constexpr int kMostBlobBytes = 32 << 20;
constexpr int kMostBlocks = 1 << 25;

/// pos = x + 4096 y + 16777216 z, each a signed number of 12 bits.
std::array<int, 3> split(int64_t pos) {
  std::array<int, 3> out{};
  for (int a = 0; a < 3; ++a) {
    int64_t low = pos & 4095;
    if (low >= 2048) low -= 4096;
    out[static_cast<size_t>(a)] = static_cast<int>(low);
    pos = (pos - low) / 4096;
  }
  return out;
}

}  // namespace

Result<std::vector<StoredBlock>> read_rows(const std::filesystem::path& path, MemoryBudget& budget) {
  const std::string name = path.string();
  sqlite3* raw = nullptr;
  const int opened = sqlite3_open_v2(name.c_str(), &raw, SQLITE_OPEN_READONLY, nullptr);
  const std::unique_ptr<sqlite3, CloseDatabase> db(raw);
  const auto failed = [&](const char* what) {
    return input_error(fmt::format("{}: {}: {}", name, what, one_line(raw ? sqlite3_errmsg(raw) : "out of memory")));
  };
  if (opened != SQLITE_OK) return failed("could not be opened");
  sqlite3_db_config(raw, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_limit(raw, SQLITE_LIMIT_LENGTH, kMostBlobBytes);
  if (sqlite3_exec(raw,
                   "PRAGMA trusted_schema=OFF; PRAGMA cell_size_check=ON; PRAGMA mmap_size=0; PRAGMA cache_size=-2000",
                   nullptr, nullptr, nullptr) != SQLITE_OK)
    return failed("is no database of SQLite, or damaged");
  const auto prepare = [&](const char* sql) {
    sqlite3_stmt* statement = nullptr;
    sqlite3_prepare_v2(raw, sql, -1, &statement, nullptr);
    return std::unique_ptr<sqlite3_stmt, FinalizeStatement>(statement);
  };
  // A table and nothing else: a view or a virtual table of that name would run what its author likes.
  const auto schema = prepare("SELECT sql FROM sqlite_schema WHERE name = 'blocks' AND type = 'table'");
  if (!schema) return failed("is no database of SQLite, or damaged");
  if (sqlite3_step(schema.get()) != SQLITE_ROW)
    return input_error(name + ": has no table 'blocks'; it is no map of Luanti (map.sqlite)");
  const auto* const text = reinterpret_cast<const char*>(sqlite3_column_text(schema.get(), 0));
  if (!text || sqlite3_strnicmp(text, "CREATE TABLE", 12) != 0)
    return input_error(name + ": its 'blocks' is no ordinary table; it is no map of Luanti");
  auto rows = prepare("SELECT x, y, z, data FROM blocks");
  const bool split_columns = rows != nullptr;
  if (!rows) rows = prepare("SELECT pos, data FROM blocks");
  if (!rows) return failed("its table 'blocks' has neither the columns pos, data nor x, y, z, data");

  std::vector<StoredBlock> all;
  int code;
  while ((code = sqlite3_step(rows.get())) == SQLITE_ROW) {
    const int column = split_columns ? 3 : 1;
    const auto* const bytes = static_cast<const uint8_t*>(sqlite3_column_blob(rows.get(), column));
    const auto size = static_cast<size_t>(sqlite3_column_bytes(rows.get(), column));
    StoredBlock block;
    if (split_columns) {
      for (int a = 0; a < 3; ++a)
        block.pos[static_cast<size_t>(a)] =
            static_cast<int>(std::clamp<int64_t>(sqlite3_column_int64(rows.get(), a), -65536, 65535));
    } else {
      block.pos = split(sqlite3_column_int64(rows.get(), 0));
    }
    if (all.size() >= kMostBlocks || !budget.take(size + sizeof(StoredBlock)))
      return input_error(name + ": its blocks take more memory than a file of this size ever needs");
    if (size) block.bytes.assign(bytes, bytes + size);
    all.push_back(std::move(block));
  }
  if (code != SQLITE_DONE) {
    if (all.empty()) return failed("its blocks could not be read");
    all.emplace_back();  // the caller reports it: what could be read stands
    all.back().pos = {INT32_MAX, 0, 0};
  }
  std::sort(all.begin(), all.end(), [](const StoredBlock& a, const StoredBlock& b) { return a.pos < b.pos; });
  return all;
}

Status read_map_light(const std::filesystem::path& path,
                      FunctionRef<void(std::array<int, 3>, std::span<const uint8_t>)> visit) {
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  MemoryBudget budget(error ? 0 : size);
  TRY(const std::vector<StoredBlock> rows, read_rows(path, budget));
  StateTable states(budget);
  BlockReader reader(states, budget);
  std::vector<Cube> cubes;
  for (const StoredBlock& row : rows) {
    cubes.clear();
    const std::string problem = reader.read(row.bytes, row.pos, cubes);
    if (!problem.empty())
      return input_error(
          fmt::format("{}: block ({}, {}, {}): {}", path.string(), row.pos[0], row.pos[1], row.pos[2], problem));
    for (const Cube& cube : cubes) budget.give_back(cube.wide ? 2 * kCubeVoxels : cube.narrow ? kCubeVoxels : 128);
    visit(row.pos, reader.light());
  }
  return {};
}

}  // namespace world::luanti
