// Targets of Loam's own files: text that people pass on, and saves, whose hashes anybody can make.
#include "tests/fuzz/own_targets.h"

#include <algorithm>
#include <fstream>

#include <unistd.h>
#include <zstd.h>

#include "world/base/file.h"
#include "world/formats/translation/translation.h"
#include "world/saves/block_code.h"
#include "world/saves/check.h"
#include "world/saves/row.h"
#include "world/saves/session.h"
#include "world/scenes/scene.h"
#include "world/store/region_stream.h"
#include "world/store/snapshot.h"

namespace world {
extern const char* const kSourceFolder;
}

namespace world::fuzz {
namespace {

constexpr size_t kPaletteSize = 40;  // of rows that stand alone
constexpr RegionPos kRegion{-1, 0, 2};

Bytes identity(std::span<const uint8_t> bytes) { return {bytes.begin(), bytes.end()}; }
Bytes bytes_of(const std::string& text) { return {text.begin(), text.end()}; }

// ---- text ------------------------------------------------------------------------------------------------------

/// The text files of a folder of the sources that name no other file.
std::vector<Bytes> texts_of(const std::string& folder, size_t most_bytes) {
  std::vector<Bytes> all;
  std::error_code error;
  for (std::filesystem::directory_iterator at(std::filesystem::path(kSourceFolder) / folder, error), stop;
       !error && at != stop; at.increment(error)) {
    if (at->path().extension() != ".toml") continue;
    auto bytes = read_file(at->path());
    if (!bytes || bytes->size() > most_bytes) continue;
    const std::string text(bytes->begin(), bytes->end());
    if (text.find("file = ") == text.npos && text.find("image = ") == text.npos) all.push_back(std::move(*bytes));
  }
  std::sort(all.begin(), all.end());
  return all;
}

Status parse_scene_file(const std::filesystem::path& path) {
  const Result<Scene> scene = load_scene(path.string());
  return scene ? Status() : Status(scene.error());
}

/// Parses a scene whose only table is the given one, with the file at its end.
Status parse_scene_around(const std::filesystem::path& path, const std::string& table) {
  const std::filesystem::path scene = path.parent_path() / "scene.toml";
  std::ofstream(scene) << table << "\nfile = \"" << path.filename().string() << "\"\n";
  return parse_scene_file(scene);
}

Result<std::string> text_of(const std::filesystem::path& path) {
  TRY(const std::vector<uint8_t> bytes, read_file(path));
  return std::string(bytes.begin(), bytes.end());
}
Status parse_blocks(const std::filesystem::path& path) {
  TRY(const std::string text, text_of(path));
  BlockPalette palette;
  return add_blocks_from_toml(palette, text, path.string());
}
Status parse_table(const std::filesystem::path& path) {
  TRY(const std::string text, text_of(path));
  return check_translation_table(text, path.string());
}

std::vector<Bytes> bpt_seeds() {
  std::string text = "1\n3 3\n";
  for (int i = 0; i < 16; ++i)
    text += std::to_string(i % 4) + " " + std::to_string(i / 4) + " " + (i % 5 == 0 ? "1.5" : "-0.25") + "\n";
  return {bytes_of(text)};
}

std::vector<Bytes> cage_seeds() {
  return {
      bytes_of("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\nf 4 3 2 1\nf 5 6 7 8\n"
               "f 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\nt crease 2/1/0 0 1 3\n")};
}

Bytes small_vol() {
  Bytes out = bytes_of("VOL\x03");
  const auto put = [&](auto value) {
    const auto* bytes = reinterpret_cast<const uint8_t*>(&value);
    out.insert(out.end(), bytes, bytes + sizeof value);
  };
  for (const int32_t n : {1, 3, 2, 2, 1}) put(n);
  for (const float f : {0.f, 0.f, 0.f, 1.f, 1.f, 1.f}) put(f);
  for (int i = 0; i < 12; ++i) put(0.125f * static_cast<float>(i));
  return out;
}

// ---- saves -----------------------------------------------------------------------------------------------------

World small_world() {
  World world(standard_blocks());
  EditBatch batch;
  batch.fill({{-100, 3, 300}, {-30, 20, 310}}, 3);
  for (int i = 0; i < 40; ++i)
    batch.set({-128 + i * 3, i * i % 50, 256 + i}, static_cast<BlockId>(1 + i % (int{kPaletteSize} - 1)));
  (void)world.store.apply(batch);
  FloatLayer& density = world.store.make_layer(Layer::density);
  IntLayer& liquid = world.store.make_int_layer(Layer::liquid);
  for (int i = 0; i < 30; ++i) {
    density.set({-100 + i, 5, 300}, 0.5f + static_cast<float>(i));
    liquid.set({-100 + i, 5, 300}, 100 * i - 1000);
  }
  world.simulation = {3, {"rain"}, {{"liquid_rule", "pipes"}}};
  world.metadata["seed"] = "17";
  return world;
}

/// Calls use(path) with a path for one file, which is gone afterwards.
template <class Use>
std::vector<Bytes> made_file(const char* name, Use use) {
  std::string folder = (std::filesystem::temp_directory_path() / "loam-seed-XXXXXX").string();
  if (!mkdtemp(folder.data())) return {};
  const auto path = std::filesystem::path(folder) / name;
  use(path);
  auto bytes = read_file(path);
  std::filesystem::remove_all(folder);
  return bytes ? std::vector<Bytes>{std::move(*bytes)} : std::vector<Bytes>();
}

std::vector<Bytes> save_seeds() {
  std::vector<Bytes> all;
  for (const Codec codec : {Codec::zstd, Codec::stream, Codec::context}) {
    auto made = made_file("a.loam", [&](const std::filesystem::path& path) {
      (void)write_new_save(small_world(), path, {.codec = codec});
    });
    std::move(made.begin(), made.end(), std::back_inserter(all));
  }
  return all;
}

std::vector<Bytes> region_seeds() {
  std::vector<Bytes> all;
  const World world = small_world();
  for (const StreamCompression compression : {StreamCompression::none, StreamCompression::blosc})
    all.push_back(bytes_of(encode_region(world.store, kRegion, compression).value()));
  return all;
}
std::vector<Bytes> layer_seeds(Layer layer) {
  std::vector<Bytes> all;
  const World world = small_world();
  for (const StreamCompression compression : {StreamCompression::none, StreamCompression::blosc})
    all.push_back(bytes_of(std::visit([&](const auto& values) { return values.encode_region(kRegion, compression); },
                                      *world.store.find_any_layer(layer))
                               .value()));
  return all;
}
std::vector<Bytes> frame_seeds() {
  std::vector<Bytes> all;
  for (const Bytes& stream : region_seeds()) {
    Bytes frame(ZSTD_compressBound(stream.size()));
    frame.resize(ZSTD_compress(frame.data(), frame.size(), stream.data(), stream.size(), 1));  // no checksum
    all.push_back(std::move(frame));
  }
  return all;
}

std::vector<Bytes> context_seeds() {
  const World world = small_world();
  const StoreSnapshot snapshot = world.store.snapshot(std::vector{kRegion});
  return {bytes_of(encode_block_code(*snapshot.packed(0)))};
}

/// The file's bytes as those of a row whose hash is right.
Status decode_row(const std::filesystem::path& path, Codec codec) {
  RegionRow row;
  row.pos = kRegion;
  row.codec = codec;
  TRY(row.bytes, text_of(path));
  const Result<RegionBuilder> region = decode_blocks(row, kPaletteSize);
  return region ? Status() : Status(input_error(path.string() + ": " + region.error().message));
}
Status decode_layer(const std::filesystem::path& path, Layer layer) {
  TRY(const std::string bytes, text_of(path));
  AnyLayer any = empty_layer(layer);
  const Status decoded = std::visit([&](auto& values) { return values.decode_region(bytes, kRegion); }, any);
  return decoded ? decoded : Status(input_error(path.string() + ": " + decoded.error().message));
}

/// `loam check --repair`; what was repaired must load.
Status repair(const std::filesystem::path& path) {
  const Result<CheckReport> found = check_save(path);
  Result<CheckReport> repaired = repair_save(path);
  if (!repaired) return repaired.error();
  std::error_code ignored;
  if (!repaired->backup.empty()) std::filesystem::remove(repaired->backup, ignored);
  ImportReport report;
  const Result<World> rest = read_world(path, {}, report);
  if (!rest || !found) {
    std::cerr << "a save that was repaired does not load: " << (rest ? found.error() : rest.error()).message << '\n';
    std::abort();
  }
  return {};
}

}  // namespace

std::vector<Bytes> grid_stream_seeds() {
  std::vector<Bytes> all = region_seeds();
  for (const Layer layer : {Layer::density, Layer::liquid}) {
    std::vector<Bytes> layers = layer_seeds(layer);
    std::move(layers.begin(), layers.end(), std::back_inserter(all));
  }
  return all;
}

std::vector<Target> own_targets() {
  const auto scenes = [] {
    std::vector<Bytes> all = texts_of("world/scenes", 20'000);
    all.push_back(
        bytes_of("what = \"a\"\n[world]\ngenerator = \"flat\"\nsize = [8, 8, 8]\n[[luminaire]]\nkind = \"spot\"\n"
                 "position = [1, 2, 3]\ndirection = [0, -1, 0]\npower_w = [1, 2, 3]\nhalf_angle_deg = 30\n"
                 "[clouds]\ncover = 0.5\nheight_m = 800\nthickness_m = 90\nsize_m = 300\nextinction_per_m = 0.1\n"
                 "drift_mps = [1, -2]\nseed = 4\n"
                 "[[camera]]\nname = \"a\"\nposition = [0, 0, 0]\nyaw_deg = 30\n[knobs]\nx = \"y\"\n"
                 "[simulation]\nseed = 3\neffects = [\"rain\"]\n[simulation.knobs]\na = \"b\"\n"));
    return all;
  };
  return {
      {"scene", "a.toml", identity, scenes, parse_scene_file},
      {"blocks", "a.toml", identity, [] { return texts_of("world/blocks", 20'000); }, parse_blocks},
      {"translation", "a.toml", identity, [] { return texts_of("world/formats/translation", 60'000); }, parse_table},
      {"spline_patch", "a.bpt", identity, bpt_seeds,
       [](const auto& path) {
         return parse_scene_around(path, "[[source]]\nkind = \"spline_patch\"\nblock = \"stone\"");
       }},
      {"subdivision", "a.obj", identity, cage_seeds,
       [](const auto& path) {
         return parse_scene_around(path, "[[source]]\nkind = \"subdivision\"\nblock = \"stone\"\nlevels = 2");
       }},
      {"vol", "a.vol", identity, [] { return std::vector<Bytes>{small_vol()}; },
       [](const auto& path) {
         return parse_scene_around(path,
                                   "[world]\ngenerator = \"flat\"\nsize = [8, 8, 8]\n[[medium]]\n"
                                   "name = \"a\"\nkind = \"density_grid\"\nscattering_per_m = [1, 1, 1]");
       }},
      {"loam", "a.loam", identity, save_seeds},
      {"loam_repair", "a.loam", identity, save_seeds, repair},
      {"loam_region", "a.row", identity, region_seeds,
       [](const auto& path) { return decode_row(path, Codec::stream); }},
      {"loam_frame", "a.row", identity, frame_seeds, [](const auto& path) { return decode_row(path, Codec::zstd); }},
      {"loam_context", "a.row", identity, context_seeds,
       [](const auto& path) { return decode_row(path, Codec::context); }},
      {"loam_layer", "a.row", identity, [] { return layer_seeds(Layer::density); },
       [](const auto& path) { return decode_layer(path, Layer::density); }},
      {"loam_int_layer", "a.row", identity, [] { return layer_seeds(Layer::liquid); },
       [](const auto& path) { return decode_layer(path, Layer::liquid); }},
  };
}

}  // namespace world::fuzz
