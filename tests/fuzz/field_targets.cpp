// Targets of fields, heights, surfaces and points.
#include "tests/fuzz/field_targets.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>

#include <zlib.h>

#include "tests/fuzz/own_targets.h"
#include "tests/world/formats/nvdb_support.h"
#include "world/base/file.h"
#include "world/formats/format.h"
#include "world/formats/heights/picture.h"

namespace world {
extern const char* const kSourceFolder;
}

namespace world::fuzz {
namespace {

Bytes identity(std::span<const uint8_t> bytes) { return {bytes.begin(), bytes.end()}; }
Bytes bytes_of(const std::string& text) { return {text.begin(), text.end()}; }
template <class T>
void put(Bytes& out, T value) {
  const auto* bytes = reinterpret_cast<const uint8_t*>(&value);
  out.insert(out.end(), bytes, bytes + sizeof value);
}

/// A file of ../shared/data, at most so many bytes of it; none where it is missing.
std::vector<Bytes> shared_file(const std::string& name, size_t most) {
  auto bytes = read_file(std::filesystem::path(kSourceFolder) / "../shared/data" / name);
  if (!bytes) return {};
  bytes->resize(std::min(bytes->size(), most));
  return {std::move(*bytes)};
}
std::vector<Bytes> with(std::vector<Bytes> first, std::vector<Bytes> more) {
  std::move(more.begin(), more.end(), std::back_inserter(first));
  return first;
}

std::vector<Bytes> obj_seeds() {
  return with({bytes_of("# a corner\no thing\nv 0 0 0\nv 1 0 0 1\nv 0 1e0 0\nv +0 0 .5\nvt 0 1\nvn 0 0 1\nf 1 2 3\n"
                        "f 1/1/1 -1/1 \\\n 2//1 3\nt crease 2/1/0 0 1 3\n")},
              shared_file("gt/mitsuba/meshes/cbox/smallbox.obj", 4000));
}

std::vector<Bytes> ply_seeds() {
  Bytes binary = bytes_of(
      "ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
      "property double z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n");
  for (const auto& [x, y, z] : {std::array{0.f, 0.f, 0.f}, {1.f, 0.f, 0.f}, {0.f, 1.f, 0.f}, {0.f, 0.f, 1.f}})
    put(binary, x), put(binary, y), put(binary, static_cast<double>(z));
  for (const auto& face : {std::array{0, 1, 2}, {0, 2, 3}}) {
    put(binary, uint8_t{3});
    for (const int v : face) put(binary, v);
  }
  return {binary,
          bytes_of("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float "
                   "z\nproperty uchar red\nend_header\n0 0 0 1\n1 2 3 4\n5 5 nan 255\n")};
}

std::vector<Bytes> pcd_seeds() {
  const std::string head =
      "VERSION .7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH 2\nHEIGHT 1\n"
      "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ";
  Bytes binary = bytes_of(head + "binary\n"), packed = bytes_of(head + "binary_compressed\n");
  for (int i = 0; i < 8; ++i) put(binary, 0.25f * static_cast<float>(i));
  put(packed, uint32_t{1 + 4 + 2 + 1 + 20}), put(packed, uint32_t{32});
  packed.push_back(3);
  put(packed, 1.5f);
  packed.push_back(0xc0), packed.push_back(3);  // eight bytes from four back
  packed.push_back(19);
  for (int i = 0; i < 5; ++i) put(packed, 2.0f);
  return {bytes_of(head + "ascii\n1 2 3 0\n4 5 6 7\n"), binary, packed};
}

/// The head and the first profiles of the real file, which says so.
std::vector<Bytes> dem_seeds() {
  std::vector<Bytes> all = shared_file("dem/SainteHelens.dem", 1024 * 4);
  for (Bytes& dem : all) std::memcpy(&dem[858], "     2", 6);
  return all;
}

std::vector<Bytes> png_seeds() {
  HeightPicture picture;
  picture.width = 9, picture.height = 7;
  for (int i = 0; i < 63; ++i) picture.samples.push_back(static_cast<uint16_t>(i * 900));
  picture.texts["loam:metres_per_level"] = "0.5";
  const auto bytes = write_height_png(picture, "seed");
  return {bytes_of(bytes.value())};
}

/// A grey picture without its checksums and compression: width, height, bits and colour type (one byte each), then
/// rows.
Bytes png_of_rows(std::span<const uint8_t> bytes) {
  Bytes out = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  const auto big = [](Bytes& to, uint32_t value) {
    for (int shift = 24; shift >= 0; shift -= 8) to.push_back(static_cast<uint8_t>(value >> shift));
  };
  const auto chunk = [&](const char* type, const Bytes& content) {
    Bytes body(type, type + 4);
    body.insert(body.end(), content.begin(), content.end());
    big(out, static_cast<uint32_t>(content.size()));
    out.insert(out.end(), body.begin(), body.end());
    big(out, static_cast<uint32_t>(crc32(0, body.data(), static_cast<uInt>(body.size()))));
  };
  const auto at = [&](size_t i) { return i < bytes.size() ? bytes[i] : uint8_t{0}; };
  Bytes head;
  big(head, at(0)), big(head, at(1));
  head.insert(head.end(), {at(2), at(3), 0, 0, static_cast<uint8_t>(at(4) & 1)});
  chunk("IHDR", head);
  const auto rows = bytes.subspan(std::min<size_t>(5, bytes.size()));
  Bytes packed(compressBound(rows.size()));
  uLongf size = packed.size();
  compress2(packed.data(), &size, rows.data(), rows.size(), 1);
  packed.resize(size);
  chunk("IDAT", packed);
  chunk("IEND", {});
  return out;
}
std::vector<Bytes> row_seeds() {
  Bytes grey = {4, 3, 16, 0, 0}, rgb = {3, 2, 8, 2, 0};
  for (int row = 0; row < 3; ++row) {
    grey.push_back(static_cast<uint8_t>(row));
    for (int i = 0; i < 8; ++i) grey.push_back(static_cast<uint8_t>(i * 30));
  }
  for (int row = 0; row < 2; ++row) {
    rgb.push_back(0);
    for (int i = 0; i < 9; ++i) rgb.push_back(static_cast<uint8_t>(i % 3 ? 9 * i : 1));
  }
  return {grey, rgb};
}

/// Empty where the file is missing.
const Bytes& torus() {
  static const Bytes plain = [] {
    const std::vector<Bytes> files = shared_file("nvdb/derived_torus01_zip.nvdb", SIZE_MAX);
    return files.empty() ? Bytes() : plain_torus(files[0]);
  }();
  return plain;
}
/// Writes four bytes at each of the places that the input names by four; in a grid of 650 kB chance would hit values
/// only.
Bytes nvdb_with_edits(std::span<const uint8_t> edits) {
  Bytes out = torus();
  for (; edits.size() >= 8 && out.size() > 4; edits = edits.subspan(8)) {
    uint32_t at = 0;
    std::memcpy(&at, edits.data(), 4);
    std::memcpy(&out[at % (out.size() - 4)], edits.data() + 4, 4);
  }
  return out;
}
/// Edits of the grid's long name, behind its end; of the head, the root and its table where they stay as they are.
std::vector<Bytes> edit_seeds() {
  const Bytes& plain = torus();
  if (plain.empty()) return {};
  uint32_t name = 0;
  std::memcpy(&name, &plain[16 + 136], 4);
  Bytes edits;
  for (const uint32_t in_grid : {200u, 640u, 648u, 672u, 696u, 704u, 736u, 760u, 768u, 800u, 832u}) {
    const uint32_t at = 16 + 176 + name + in_grid;
    put(edits, at);
    edits.insert(edits.end(), plain.begin() + at, plain.begin() + at + 4);
  }
  return {edits};
}

// ---- elevation -------------------------------------------------------------------------------------------------

constexpr size_t kTilePosts = 1201 * 1201;

/// A tile whose heights are the bytes, again and again: no other size is an elevation tile.
Bytes tile_of_heights(std::span<const uint8_t> bytes) {
  Bytes out(2 * kTilePosts);
  for (size_t i = 0; !bytes.empty() && i < out.size(); ++i) out[i] = bytes[i % bytes.size()];
  return out;
}
std::vector<Bytes> height_seeds() {
  Bytes slope;
  for (int i = 0; i < 1201; ++i)
    slope.push_back(static_cast<uint8_t>(i >> 9)), slope.push_back(static_cast<uint8_t>(i));
  Bytes voids = slope;
  for (size_t i = 100; i < 120; ++i) voids[i] = i % 2 ? 0 : 0x80;
  return {slope, voids};
}
Status read_window(const std::filesystem::path& path) {
  ImportReport report;
  const auto world = read_world(path, {.window = {600, 600, 32, 32}}, report);
  return world ? Status() : Status(world.error());
}

/// An archive of one stored or deflated file.
Bytes zip_of(const std::string& name, const Bytes& content, bool pack) {
  Bytes body = content;
  if (pack) {
    z_stream z{};
    deflateInit2(&z, 9, Z_DEFLATED, -MAX_WBITS, 9, Z_DEFAULT_STRATEGY);
    body.resize(deflateBound(&z, content.size()));
    z.next_in = const_cast<Bytef*>(content.data()), z.avail_in = static_cast<uInt>(content.size());
    z.next_out = body.data(), z.avail_out = static_cast<uInt>(body.size());
    deflate(&z, Z_FINISH);
    body.resize(z.total_out);
    deflateEnd(&z);
  }
  Bytes out;
  const auto put16 = [&](size_t v) { put(out, static_cast<uint16_t>(v)); };
  const auto put32 = [&](size_t v) { put(out, static_cast<uint32_t>(v)); };
  const auto common = [&] {
    put16(20), put16(0), put16(pack ? 8 : 0), put16(0), put16(0);
    put32(crc32(0, content.data(), static_cast<uInt>(content.size())));
    put32(body.size()), put32(content.size()), put16(name.size()), put16(0);
  };
  put32(0x04034b50), common();
  out.insert(out.end(), name.begin(), name.end());
  out.insert(out.end(), body.begin(), body.end());
  const size_t directory = out.size();
  put32(0x02014b50), put16(20), common(), put16(0), put16(0), put16(0), put32(0), put32(0);
  out.insert(out.end(), name.begin(), name.end());
  const size_t size = out.size() - directory;
  put32(0x06054b50), put16(0), put16(0), put16(1), put16(1), put32(size), put32(directory), put16(0);
  return out;
}
std::vector<Bytes> zip_seeds() { return {zip_of("N42E001.hgt", tile_of_heights(Bytes{1, 2, 3, 4}), true)}; }

#if LOAM_HAS_GDAL
/// A GeoTIFF of 16-bit heights in degrees.
std::vector<Bytes> tif_seeds() {
  constexpr uint16_t kWidth = 6, kHeight = 5;
  Bytes out = bytes_of("II*");
  out.push_back(0);
  put(out, uint32_t{8});
  struct Row {
    uint16_t tag, type;
    uint32_t count, value;
  };
  const uint32_t after = 8 + 2 + 13 * 12 + 4, strip = after + 24 + 48 + 24;
  const Row rows[] = {{256, 3, 1, kWidth},
                      {257, 3, 1, kHeight},
                      {258, 3, 1, 16},
                      {259, 3, 1, 1},
                      {262, 3, 1, 1},
                      {273, 4, 1, strip},
                      {277, 3, 1, 1},
                      {278, 3, 1, kHeight},
                      {279, 4, 1, 2 * kWidth * kHeight},
                      {339, 3, 1, 2},
                      {33550, 12, 3, after},
                      {33922, 12, 6, after + 24},
                      {34735, 3, 12, after + 24 + 48}};
  put(out, static_cast<uint16_t>(std::size(rows)));
  for (const Row& r : rows) put(out, r.tag), put(out, r.type), put(out, r.count), put(out, r.value);
  put(out, uint32_t{0});
  for (const double d : {0.001, 0.001, 0.0, 0.0, 0.0, 0.0, 7.5, 46.25, 0.0}) put(out, d);
  for (const uint16_t key : {1, 1, 0, 2, 1024, 0, 1, 2, 2048, 0, 1, 4326}) put(out, key);
  for (int i = 0; i < kWidth * kHeight; ++i) put(out, static_cast<int16_t>(i * 37));
  return {out};
}
#endif

/// Real files, and our own streams, which hold no compressed parts.
std::vector<Bytes> vdb_seeds() { return with(grid_stream_seeds(), shared_file("vdb/torus01.vdb", SIZE_MAX)); }

}  // namespace

std::vector<Target> field_targets() {
  return {
    {"obj", "a.obj", identity, obj_seeds}, {"ply", "a.ply", identity, ply_seeds}, {"pcd", "a.pcd", identity, pcd_seeds},
        {"dem", "a.dem", identity, dem_seeds}, {"png", "a.png", identity, png_seeds},
        {"png_rows", "a.png", png_of_rows, row_seeds},
        {"nvdb", "a.nvdb", identity, [] { return shared_file("nvdb/derived_torus01_zip.nvdb", SIZE_MAX); }},
        {"nvdb_tree", "a.nvdb", nvdb_with_edits, edit_seeds}, {"vdb", "a.vdb", identity, vdb_seeds},
        {"hgt", "N42E001.hgt", tile_of_heights, height_seeds, read_window},
        {"hgt_zip", "N42E001.hgt.zip", identity, zip_seeds, read_window},
#if LOAM_HAS_GDAL
        {"tif", "a.tif", identity, tif_seeds},
#endif
  };
}

}  // namespace world::fuzz
