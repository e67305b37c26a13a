#include "tools/bench/format_files.h"

#include <bit>
#include <cmath>
#include <cstring>

#include <fmt/format.h>
#include <zlib.h>
#include <zstd.h>

#include "tools/bench/benchmark.h"
#include "world/base/random.h"
#include "world/formats/nbt/nbt.h"
#include "world/saves/database.h"

namespace tools {

namespace {

using world::BlockId;
using world::VoxelBox;
using world::VoxelPos;

constexpr std::array<const char*, 8> kMinecraft = {"minecraft:air",   "minecraft:stone",     "minecraft:dirt",
                                                   "minecraft:sand",  "minecraft:water",     "minecraft:gravel",
                                                   "minecraft:glass", "minecraft:snow_block"};
constexpr std::array<const char*, 8> kLuanti = {"air",           "default:stone",        "default:dirt",
                                                "default:sand",  "default:water_source", "default:gravel",
                                                "default:glass", "default:snowblock"};

uint16_t place_of(BlockId id) { return static_cast<uint16_t>(id == world::kAir ? 0 : 1 + id % 7); }

VoxelPos size_of(const VoxelBox& box) { return box.max - box.min + VoxelPos{1, 1, 1}; }

void put_u16(std::string& out, size_t v) {
  out += static_cast<char>(v >> 8 & 0xff);
  out += static_cast<char>(v & 0xff);
}

Bytes deflated(const std::string& content, int window_bits) {
  z_stream stream{};
  deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, window_bits, 8, Z_DEFAULT_STRATEGY);
  Bytes out(deflateBound(&stream, content.size()));
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(content.data()));
  stream.avail_in = static_cast<uInt>(content.size());
  stream.next_out = out.data(), stream.avail_out = static_cast<uInt>(out.size());
  deflate(&stream, Z_FINISH);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return out;
}

float wave(int x, int z) {
  return 20 + 12 * std::sin(static_cast<float>(x) * 0.05f) * std::cos(static_cast<float>(z) * 0.037f);
}

std::string point_values(int count) {
  std::string values;
  for (int64_t i = 0; i < 3 * int64_t{count}; ++i) {
    const auto v = static_cast<float>(256 * world::uniform01_double(world::random_bits(5, i, 0, 0)));
    values.append(reinterpret_cast<const char*>(&v), sizeof v);
  }
  return values;
}

}  // namespace

FormatFile litematic_file(const world::Store& store, const VoxelBox& box) {
  const VoxelPos size = size_of(box);
  constexpr unsigned kBits = 3;
  std::vector<uint64_t> words((box.volume() * kBits + 63) / 64);
  world::StoreReader reader(store);
  uint64_t bit = 0;
  for (int y = box.min.y; y <= box.max.y; ++y)
    for (int z = box.min.z; z <= box.max.z; ++z)
      for (int x = box.min.x; x <= box.max.x; ++x, bit += kBits) {
        const uint64_t place = place_of(reader.get({x, y, z}));
        words[bit / 64] |= place << bit % 64;
        if (bit % 64 > 64 - kBits) words[bit / 64 + 1] |= place >> (64 - bit % 64);
      }
  world::nbt::Writer out;
  const auto vector = [&](const char* name, VoxelPos v) {
    out.open(name);
    out.int_number("x", v.x), out.int_number("y", v.y), out.int_number("z", v.z);
    out.close();
  };
  out.open("");
  out.int_number("MinecraftDataVersion", 3955), out.int_number("Version", 6);
  out.open("Regions");
  out.open("all");
  vector("Position", {0, 0, 0}), vector("Size", size);
  out.list("BlockStatePalette", world::nbt::Type::compound, kMinecraft.size());
  for (const char* name : kMinecraft) out.text("Name", name), out.close();
  out.long_array("BlockStates", words);
  for (int i = 0; i < 3; ++i) out.close();
  FormatFile file{.packed = {deflated(out.bytes, 15 + 16)}, .largest_content = out.bytes.size()};
  file.bytes.assign(file.packed[0].begin(), file.packed[0].end());
  file.work = static_cast<double>(box.volume());
  return file;
}

FormatFile mts_file(const world::Store& store, const VoxelBox& box) {
  const VoxelPos size = size_of(box);
  std::string nodes;
  world::StoreReader reader(store);
  for (int z = box.max.z; z >= box.min.z; --z)
    for (int y = box.min.y; y <= box.max.y; ++y)
      for (int x = box.min.x; x <= box.max.x; ++x) put_u16(nodes, place_of(reader.get({x, y, z})));
  nodes.append(box.volume(), '\x7f');
  nodes.append(box.volume(), '\0');
  FormatFile file{.packed = {deflated(nodes, 15)}, .largest_content = nodes.size()};
  file.bytes = "MTSM";
  put_u16(file.bytes, 4);
  for (int a = 0; a < 3; ++a) put_u16(file.bytes, static_cast<size_t>(size[a]));
  file.bytes.append(static_cast<size_t>(size.y), '\x7f');
  put_u16(file.bytes, kLuanti.size());
  for (const char* name : kLuanti) put_u16(file.bytes, std::strlen(name)), file.bytes += name;
  file.bytes.append(file.packed[0].begin(), file.packed[0].end());
  file.work = static_cast<double>(box.volume());
  return file;
}

world::Result<FormatFile> write_luanti_map(const world::Store& store, const VoxelBox& box,
                                           const std::filesystem::path& path) {
  constexpr int kSide = 16, kVolume = kSide * kSide * kSide;
  TRY(world::Database db, world::Database::open(path, world::Database::Access::create));
  TRY_STATUS(db.run("CREATE TABLE blocks (pos INT PRIMARY KEY, data BLOB); BEGIN"));
  TRY(world::Statement insert, world::Statement::prepare(db, "INSERT INTO blocks VALUES (?1, ?2)"));
  FormatFile file{.work = static_cast<double>(box.volume())};
  world::StoreReader reader(store);
  for (int x = box.min.x / kSide; x * kSide < box.max.x; ++x)
    for (int y = box.min.y / kSide; y * kSide < box.max.y; ++y)
      for (int z = box.min.z / kSide; z * kSide < box.max.z; ++z) {
        std::string content(1 + 2 + 4 + 1, '\0');  // flags, light, time, version of the list of names
        put_u16(content, kLuanti.size());
        for (size_t i = 0; i < kLuanti.size(); ++i)
          put_u16(content, i), put_u16(content, std::strlen(kLuanti[i])), content += kLuanti[i];
        content += "\x02\x02";  // widths
        for (int dz = 0; dz < kSide; ++dz)
          for (int dy = 0; dy < kSide; ++dy)
            for (int dx = 0; dx < kSide; ++dx)
              put_u16(content, place_of(reader.get({kSide * x + dx, kSide * y + dy, kSide * z + dz})));
        content.append(2 * kVolume, '\0');              // param1, param2
        content += std::string("\0\0\0\0\x0a\0\0", 7);  // no metadata, no objects, no timers
        Bytes frame(ZSTD_compressBound(content.size()));
        frame.resize(ZSTD_compress(frame.data(), frame.size(), content.data(), content.size(), 3));
        file.largest_content = std::max(file.largest_content, content.size());
        std::string blob = "\x1d";
        blob.append(frame.begin(), frame.end());
        file.packed.push_back(std::move(frame));
        insert.bind(1, x + int64_t{4096} * y + int64_t{4096} * 4096 * z), insert.bind_blob(2, blob);
        TRY_STATUS(insert.finish());
      }
  TRY_STATUS(db.run("COMMIT"));
  return file;
}

FormatFile hgt_file(int posts_a_side) {
  FormatFile file{.work = double(posts_a_side) * posts_a_side};
  for (int z = 0; z < posts_a_side; ++z)
    for (int x = 0; x < posts_a_side; ++x)
      put_u16(file.bytes, static_cast<size_t>(std::lround(400 + 10 * wave(x, z) + (x + z) / 8)));
  return file;
}

FormatFile obj_file(int points_a_side) {
  FormatFile file{.work = 2.0 * (points_a_side - 1) * (points_a_side - 1)};
  for (int z = 0; z < points_a_side; ++z)
    for (int x = 0; x < points_a_side; ++x) file.bytes += fmt::format("v {} {:.6f} {}\n", x, wave(x, z), z);
  for (int z = 0; z + 1 < points_a_side; ++z)
    for (int x = 0; x + 1 < points_a_side; ++x) {
      const int a = z * points_a_side + x + 1, b = a + points_a_side;
      file.bytes += fmt::format("f {} {} {}\nf {} {} {}\n", a, b, a + 1, a + 1, b, b + 1);
    }
  return file;
}

FormatFile ply_mesh_file(int points_a_side) {
  FormatFile file{.work = 2.0 * (points_a_side - 1) * (points_a_side - 1)};
  file.bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
      "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
      points_a_side * points_a_side, static_cast<int64_t>(file.work));
  const auto put = [&](auto v) { file.bytes.append(reinterpret_cast<const char*>(&v), sizeof v); };
  for (int z = 0; z < points_a_side; ++z)
    for (int x = 0; x < points_a_side; ++x) put(static_cast<float>(x)), put(wave(x, z)), put(static_cast<float>(z));
  for (int z = 0; z + 1 < points_a_side; ++z)
    for (int x = 0; x + 1 < points_a_side; ++x) {
      const int a = z * points_a_side + x, b = a + points_a_side;
      put(uint8_t{3}), put(a), put(b), put(a + 1);
      put(uint8_t{3}), put(a + 1), put(b), put(b + 1);
    }
  return file;
}

FormatFile ply_points_file(int count) {
  FormatFile file{.work = double(count)};
  file.bytes = fmt::format(
                   "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\n"
                   "property float z\nend_header\n",
                   count) +
               point_values(count);
  return file;
}

FormatFile pcd_file(int count) {
  FormatFile file{.work = double(count)};
  file.bytes = fmt::format(
                   "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {}\nHEIGHT 1\n"
                   "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {}\nDATA binary\n",
                   count, count) +
               point_values(count);
  return file;
}

bool unpack_alone(const FormatFile& file) {
  Bytes out(file.largest_content);
  for (const Bytes& packed : file.packed) {
    if (packed.size() > 3 && packed[0] == 0x28 && packed[1] == 0xb5) {
      if (ZSTD_isError(ZSTD_decompress(out.data(), out.size(), packed.data(), packed.size()))) return false;
    } else {
      z_stream stream{};
      if (inflateInit2(&stream, 15 + 32) != Z_OK) return false;  // zlib or gzip
      stream.next_in = const_cast<Bytef*>(packed.data()), stream.avail_in = static_cast<uInt>(packed.size());
      stream.next_out = out.data(), stream.avail_out = static_cast<uInt>(out.size());
      const int code = inflate(&stream, Z_FINISH);
      inflateEnd(&stream);
      if (code != Z_STREAM_END) return false;
    }
    keep(out[0]);
  }
  return true;
}

}  // namespace tools
