#include "tests/fuzz/targets.h"

#include <algorithm>
#include <cstring>
#include <fstream>

#include <sqlite3.h>
#include <zlib.h>
#include <zstd.h>

#include "tests/fuzz/field_targets.h"
#include "tests/fuzz/own_targets.h"
#include "world/base/file.h"
#include "world/formats/archive/inflate.h"
#include "world/formats/format.h"
#include "world/formats/luanti/map_block.h"
#include "world/formats/mca/anvil.h"
#include "world/formats/nbt/nbt.h"

namespace world {
extern const char* const kSourceFolder;
}

namespace world::fuzz {
namespace {

constexpr size_t kMostSeedBytes = 200'000;

Bytes bytes_of(const std::string& text) { return {text.begin(), text.end()}; }
void put_big(Bytes& out, uint64_t value, int bytes) {
  for (int shift = bytes * 8 - 8; shift >= 0; shift -= 8) out.push_back(static_cast<uint8_t>(value >> shift));
}
void put_little(Bytes& out, uint64_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) out.push_back(static_cast<uint8_t>(value >> (8 * i)));
}
void put(Bytes& out, std::span<const uint8_t> more) { out.insert(out.end(), more.begin(), more.end()); }

Bytes identity(std::span<const uint8_t> bytes) { return {bytes.begin(), bytes.end()}; }

Bytes deflated(std::span<const uint8_t> bytes) {
  Bytes out(compressBound(bytes.size()));
  uLongf size = out.size();
  compress2(out.data(), &size, bytes.data(), bytes.size(), 1);
  out.resize(size);
  return out;
}

/// Files of ../shared/data/folder that end so and are small.
std::vector<Bytes> shared_files(const std::string& folder, const std::string& end) {
  std::vector<Bytes> found;
  std::error_code error;
  const auto path = std::filesystem::path(kSourceFolder) / "../shared/data" / folder;
  for (std::filesystem::directory_iterator at(path, error), stop; !error && at != stop; at.increment(error))
    if (at->path().string().ends_with(end))
      if (auto bytes = read_file(at->path(), uint64_t{8} << 20)) found.push_back(std::move(*bytes));
  std::sort(found.begin(), found.end());
  return found;
}
std::vector<Bytes> small_shared_files(const std::string& folder, const std::string& end) {
  std::vector<Bytes> all = shared_files(folder, end);
  std::erase_if(all, [](const Bytes& b) { return b.size() > kMostSeedBytes; });
  return all;
}
std::vector<Bytes> inflated_shared_files(const std::string& folder, const std::string& end) {
  std::vector<Bytes> all;
  for (const Bytes& packed : shared_files(folder, end)) {
    MemoryBudget budget(packed.size());
    Inflater inflater(budget);
    if (const auto tree = inflater.inflate(packed); tree && tree->size() <= kMostSeedBytes)
      all.emplace_back(tree->begin(), tree->end());
  }
  return all;
}

// ---- seeds made by hand ----------------------------------------------------------------------------------------

Bytes small_schem() {
  nbt::Writer out;
  out.open("Schematic");
  out.int_number("Version", 2);
  out.int_number("DataVersion", 2860);
  out.short_number("Width", 2), out.short_number("Height", 3), out.short_number("Length", 2);
  out.int_array("Offset", std::vector<int32_t>{1, 2, 3});
  out.open("Palette");
  out.int_number("minecraft:air", 0);
  out.int_number("minecraft:oak_stairs[facing=east,half=top]", 1);
  out.int_number("loam:lamp_warm", 200);
  out.close();
  out.byte_array("BlockData", Bytes{0, 1, 0xc8, 1, 1, 1, 1, 0, 0, 0, 1, 1, 0xc8, 1});
  out.list("BlockEntities", nbt::Type::compound, 0);
  out.open("Metadata");
  out.open("Loam");
  out.int_array("Origin", std::vector<int32_t>{-4, 5, 6});
  out.list("Blocks", nbt::Type::text, 0);
  out.close();
  out.close();
  out.close();
  return bytes_of(out.bytes);
}

Bytes small_schematic() {
  nbt::Writer out;
  out.open("Schematic");
  out.short_number("Width", 2), out.short_number("Height", 2), out.short_number("Length", 1);
  out.text("Materials", "Alpha");
  out.byte_array("Blocks", Bytes{1, 17, 53, 255});
  out.byte_array("Data", Bytes{0, 5, 3, 15});
  out.byte_array("AddBlocks", Bytes{0x10, 0x0f});
  out.open("SchematicaMapping");
  out.short_number("mod:thing", 4095);
  out.close();
  out.close();
  return bytes_of(out.bytes);
}

Bytes small_litematic() {
  nbt::Writer out;
  out.open("");
  out.int_number("Version", 5);
  out.int_number("MinecraftDataVersion", 2584);
  out.open("Regions");
  out.open("main");
  const auto vector = [&](const char* name, int x, int y, int z) {
    out.open(name);
    out.int_number("x", x), out.int_number("y", y), out.int_number("z", z);
    out.close();
  };
  vector("Position", 3, 0, -2);
  vector("Size", -3, 4, -3);
  out.list("BlockStatePalette", nbt::Type::compound, 5);
  for (const char* name : {"air", "stone", "glass", "oak_log", "water"}) {
    out.text("Name", std::string("minecraft:") + name);
    out.close();
  }
  out.long_array("BlockStates", std::vector<uint64_t>{0x06620cc419883310, 0xcc41988331});
  out.close();
  out.close();
  out.close();
  return bytes_of(out.bytes);
}

Bytes small_chunk(int version) {
  nbt::Writer out;
  out.open("");
  if (version) out.int_number("DataVersion", version);
  const bool new_layout = version >= 2844;
  if (!new_layout) out.open("Level");
  out.text("Status", "full");
  out.list(new_layout ? "sections" : "Sections", nbt::Type::compound, 2);
  for (int y = 0; y < 2; ++y) {
    out.byte_number("Y", static_cast<int8_t>(y - 1));
    if (version == 0) {
      out.byte_array("Blocks", Bytes(4096, 17));
      out.byte_array("Data", Bytes(2048, 0x51));
    } else {
      if (new_layout) out.open("block_states");
      out.list(new_layout ? "palette" : "Palette", nbt::Type::compound, 17);
      for (int i = 0; i < 17; ++i) {
        out.text("Name", i ? "minecraft:block" + std::to_string(i) : "minecraft:stone");
        out.close();
      }
      out.long_array(new_layout ? "data" : "BlockStates",
                     std::vector<uint64_t>(packed_words(5, version < 2529), 0x0842108421084210));
      if (new_layout) out.close();
    }
    out.byte_array("SkyLight", Bytes(2048, 0xff));
    out.close();
  }
  if (!new_layout) out.close();
  out.close();
  return bytes_of(out.bytes);
}

/// A region file with one chunk, stored as it is.
Bytes region_of_chunk(std::span<const uint8_t> tree) {
  Bytes out;
  put_big(out, 2 << 8 | std::min<uint64_t>(255, tree.size() / 4096 + 1), 4);
  out.resize(8192);
  put_big(out, tree.size() + 1, 4);
  out.push_back(3);
  put(out, tree);
  return out;
}

std::vector<Bytes> chunk_seeds() {
  std::vector<Bytes> all = {small_chunk(0), small_chunk(1631), small_chunk(2566), small_chunk(3465)};
  for (const char* folder : {"1.8.9", "1.13.2", "1.16", "1.18.2", "1.21.1"}) {
    std::error_code error;
    const auto path = std::filesystem::path(kSourceFolder) / "../shared/data/mca" / folder;
    for (std::filesystem::directory_iterator at(path, error), stop; !error && at != stop; at.increment(error)) {
      const auto region = mca::open_region(at->path());
      if (!region) continue;
      MemoryBudget budget(region->bytes.size());
      StateTable states(budget);
      mca::ChunkReader reader(states, budget);
      for (size_t i = 0; i < region->chunks.size(); i += 97)
        if (const auto tree = reader.inflate(region->chunks[i]); tree && tree->size() <= kMostSeedBytes)
          all.emplace_back(tree->begin(), tree->end());
    }
  }
  return all;
}

std::vector<Bytes> region_seeds() {
  std::vector<Bytes> all;
  Bytes packed = region_of_chunk(small_chunk(3465));
  const Bytes small = deflated(small_chunk(3465));
  Bytes zlib(packed.begin(), packed.begin() + 8192);
  put_big(zlib, small.size() + 1, 4);
  zlib.push_back(2);
  put(zlib, small);
  all.push_back(std::move(packed));
  all.push_back(std::move(zlib));
  return all;
}

/// 2 bytes: how many of those that follow are the header; the rest is packed by zlib, as the nodes of an .mts are.
Bytes mts_of_parts(std::span<const uint8_t> bytes) {
  if (bytes.size() < 2) return identity(bytes);
  const size_t header = std::min<size_t>(bytes[0] << 8 | bytes[1], bytes.size() - 2);
  Bytes out = identity(bytes.subspan(2, header));
  put(out, deflated(bytes.subspan(2 + header)));
  return out;
}
Bytes small_mts() {
  Bytes header = bytes_of("MTSM");
  for (const int n : {4, 2, 1, 2}) put_big(header, static_cast<uint64_t>(n), 2);
  header.push_back(127);
  put_big(header, 2, 2);
  for (const std::string name : {"air", "stairs:stair_wood"}) {
    put_big(header, name.size(), 2);
    put(header, bytes_of(name));
  }
  Bytes out;
  put_big(out, header.size(), 2);
  put(out, header);
  put(out, Bytes{0, 0, 0, 1, 0, 1, 0, 0});  // contents
  put(out, Bytes{127, 127, 0, 255});
  put(out, Bytes{0, 3, 21, 0});
  return out;
}
std::vector<Bytes> mts_seeds() {
  std::vector<Bytes> all = {small_mts()};
  for (const Bytes& file : shared_files("luanti", ".mts"))
    for (size_t at = 12; at + 2 < file.size(); ++at) {
      if (!looks_like_zlib(std::span(file).subspan(at))) continue;
      MemoryBudget budget(file.size());
      Inflater inflater(budget);
      const auto nodes = inflater.inflate(std::span(file).subspan(at));
      if (!nodes) continue;
      Bytes parts;
      put_big(parts, at, 2);
      put(parts, std::span(file).first(at));
      put(parts, *nodes);
      all.push_back(std::move(parts));
      break;
    }
  return all;
}

/// A database with one block, of version 29: the bytes are what its zstd frame holds.
Bytes database_of_block(std::span<const uint8_t> inner) {
  Bytes blob = {29};
  Bytes frame(ZSTD_compressBound(inner.size()));
  frame.resize(ZSTD_compress(frame.data(), frame.size(), inner.data(), inner.size(), 1));
  put(blob, frame);
  sqlite3* db = nullptr;
  sqlite3_open(":memory:", &db);
  sqlite3_exec(db, "PRAGMA page_size=4096; CREATE TABLE blocks (pos INT PRIMARY KEY, data BLOB)", nullptr, nullptr,
               nullptr);
  sqlite3_stmt* insert = nullptr;
  sqlite3_prepare_v2(db, "INSERT INTO blocks VALUES (16777217, ?)", -1, &insert, nullptr);
  sqlite3_bind_blob(insert, 1, blob.data(), static_cast<int>(blob.size()), SQLITE_STATIC);
  sqlite3_step(insert);
  sqlite3_finalize(insert);
  sqlite3_int64 size = 0;
  uint8_t* const image = sqlite3_serialize(db, "main", &size, 0);
  Bytes out(image, image + size);
  sqlite3_free(image);
  sqlite3_close(db);
  return out;
}
Bytes small_block() {
  Bytes out = {0, 0, 0, 0, 0, 0, 0, 0};  // flags, light, time, version of the names
  put_big(out, 3, 2);
  int id = 0;
  for (const std::string name : {"air", "default:stone", "stairs:stair_wood"}) {
    put_big(out, static_cast<uint64_t>(id++), 2);
    put_big(out, name.size(), 2);
    put(out, bytes_of(name));
  }
  put(out, Bytes{2, 2});
  for (int i = 0; i < 4096; ++i) put_big(out, static_cast<uint64_t>(i % 3), 2);
  out.insert(out.end(), 8192, 15);
  return out;
}

Bytes small_qb(bool compressed) {
  Bytes out = {1, 1, 0, 0};
  for (const int n : {0, 1, compressed ? 1 : 0, 0, 1}) put_little(out, static_cast<uint64_t>(n), 4);
  out.push_back(3);
  put(out, bytes_of("arm"));
  for (const int n : {2, 2, 2, -1, 0, 5}) put_little(out, static_cast<uint32_t>(n), 4);
  for (int z = 0; z < 2; ++z) {
    if (compressed) {
      for (const uint32_t n : {2u, 3u, 0xff0000ffu, 0u, 6u}) put_little(out, n, 4);
    } else {
      for (int i = 0; i < 4; ++i) put_little(out, 0xff00ff00u * static_cast<uint32_t>(i & 1), 4);
    }
  }
  return out;
}

Bytes small_vox() {
  Bytes out = bytes_of("VOX ");
  put_little(out, 150, 4);
  const auto chunk = [](const char* id, const Bytes& content) {
    Bytes c = bytes_of(id);
    put_little(c, content.size(), 4);
    put_little(c, 0, 4);
    put(c, content);
    return c;
  };
  const auto numbers = [](std::initializer_list<int> all) {
    Bytes b;
    for (const int n : all) put_little(b, static_cast<uint32_t>(n), 4);
    return b;
  };
  Bytes inner = chunk("SIZE", numbers({2, 2, 2}));
  Bytes voxels = numbers({2});
  put(voxels, Bytes{0, 0, 0, 1, 1, 1, 1, 200});
  put(inner, chunk("XYZI", voxels));
  Bytes transform = numbers({0, 0, 1, -1, -1, 1, 1, 2});
  put(transform, bytes_of("_r"));
  put(transform, numbers({2}));
  put(transform, bytes_of("17"));
  put(inner, chunk("nTRN", transform));
  put(inner, chunk("nGRP", numbers({1, 0, 1, 2})));
  put(inner, chunk("nTRN", numbers({2, 0, 3, -1, -1, 1, 0})));
  put(inner, chunk("nSHP", numbers({3, 0, 1, 0, 0})));
  put(inner, chunk("RGBA", Bytes(1024, 90)));
  put(out, bytes_of("MAIN"));
  put_little(out, 0, 4);
  put_little(out, inner.size(), 4);
  put(out, inner);
  return out;
}

std::vector<Bytes> with(std::vector<Bytes> first, std::vector<Bytes> more) {
  std::move(more.begin(), more.end(), std::back_inserter(first));
  return first;
}

}  // namespace

const std::vector<Target>& targets() {
  static const std::vector<Target> all = [] {
    std::vector<Target> targets = {
        {"mca_chunk", "r.0.0.mca", region_of_chunk, chunk_seeds},
        {"mca_file", "r.0.0.mca", identity, region_seeds},
        {"schem", "a.schem", identity, [] { return with({small_schem()}, inflated_shared_files("schem", ".schem")); }},
        {"schematic", "a.schematic", identity,
         [] { return with({small_schematic()}, inflated_shared_files("schem", ".schematic")); }},
        {"litematic", "a.litematic", identity,
         [] { return with({small_litematic()}, inflated_shared_files("schem", ".litematic")); }},
        {"gzip", "a.schem", identity, [] { return small_shared_files("schem", ".schem"); }},
        {"luanti_block", "a.sqlite", database_of_block, [] { return std::vector<Bytes>{small_block()}; }},
        {"luanti_file", "a.sqlite", identity, [] { return std::vector<Bytes>{database_of_block(small_block())}; }},
        {"mts", "a.mts", mts_of_parts, mts_seeds},
        {"qb", "a.qb", identity,
         [] {
           return with({small_qb(false), small_qb(true)}, small_shared_files("qb", ".qb"));
         }},
        {"vox", "a.vox", identity,
         [] {
           std::vector<Bytes> files = small_shared_files("vox", ".vox");
           std::erase_if(files, [](const Bytes& b) { return b.size() < 4 || b[0] != 'V'; });  // one is no .vox at all
           return with({small_vox()}, std::move(files));
         }},
    };
    for (std::vector<Target> more : {field_targets(), own_targets()})
      std::move(more.begin(), more.end(), std::back_inserter(targets));
    return targets;
  }();
  return all;
}

std::string run(const Target& target, std::span<const uint8_t> bytes, const std::filesystem::path& folder) {
  const std::filesystem::path path = folder / target.file_name;
  const Bytes file = target.wrap(bytes);
  {
    std::ofstream out(path, std::ios::binary | std::ios::trunc);
    out.write(reinterpret_cast<const char*>(file.data()), static_cast<std::streamsize>(file.size()));
  }
  const Status status = [&]() -> Status {
    if (target.read) return target.read(path);
    ImportReport report;
    const auto world = read_world(path, {}, report);
    return world ? Status() : Status(world.error());
  }();
  if (status) return "";
  const std::string& message = status.error().message;
  const bool named = message.find(target.file_name) != std::string::npos ||
                     message.find("scene.toml") != std::string::npos;  // that some targets put around their file
  if (!named || message.find('\n') != std::string::npos || status.error().kind != ErrorKind::input_output) {
    std::cerr << "not one sentence that names the file: " << message << '\n';
    std::abort();
  }
  return message;
}

}  // namespace world::fuzz
