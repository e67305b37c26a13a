// World -> .vox. Each cube of 256^3 that holds anything becomes a model as tight as its voxels, put in its place by a
// transform, so that a world of any extent comes back voxel by voxel. Axes are turned as on the way in: a voxel (x, y,
// z) becomes (x, -z - 1, y). A block becomes a colour and a material; "vox:N" keeps the index N. What a material can't
// say goes beside it as
// "_loam", which other programs skip and ours reads: so blocks come back too. The palette has 255 colours: where a
// world holds more kinds of block, those that look alike share one, and where that isn't enough it can't be written.
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>

#include <fmt/format.h>

#include "world/formats/vox.h"

namespace world {
namespace {

constexpr int kModelLog2 = 8;  // 256 voxels, two regions
constexpr int kColours = 255;
constexpr uint64_t kMostBytes = INT32_MAX;  // the main chunk says its size in 32 bits
constexpr int kPositionLimit = 1 << 30;     // what our own reader takes

uint8_t srgb_from_linear(float linear) {
  const double l = std::clamp<double>(linear, 0, 1);
  const double s = l <= 0.0031308 ? 12.92 * l : 1.055 * std::pow(l, 1 / 2.4) - 0.055;  // IEC 61966-2-1
  return static_cast<uint8_t>(std::lround(s * 255));
}

struct Entry {
  vox::Colour colour{0, 0, 0, 255};
  vox::Dictionary material;
  friend bool operator<(const Entry& a, const Entry& b) {
    const auto key = [](const Entry& e) { return std::tuple(e.colour.r, e.colour.g, e.colour.b, e.material); };
    return key(a) < key(b);
  }
};

/// How a block looks in a .vox file; what make_block of vox.cpp turns back.
Entry entry_of(const Block& block) {
  Entry entry;
  Ratio3 seen = block.albedo;
  vox::Dictionary& material = entry.material;
  material["_type"] = "_diffuse";
  const auto put = [&](const char* key, double value) { material[key] = fmt::format("{:.9g}", value); };
  if (block.bsdf == "blinn_phong" || block.bsdf == "mirror") {
    seen = block.albedo + block.glossy;
    material["_type"] = "_metal";
    put("_metal", std::clamp(block.glossy.max() / std::max(seen.max(), 1e-6f), 0.0f, 1.0f));
    put("_rough", 1 - block.shininess);
  } else if (block.phase == Phase::gas) {
    material["_type"] = "_media";
    const float absorbed = std::max(block.absorption.r / std::max(1 - block.albedo.r, 1e-3f), 0.0f);
    put("_d", absorbed / 10);
  } else if (!block.opaque && block.bsdf == "dielectric") {
    material["_type"] = "_glass";
    put("_ri", block.index_of_refraction);
    put("_trans", 0);
  }
  if (block.emission.max() > 0) {
    const double emit = block.emission.max() / std::max(block.albedo.max(), 1e-3f) / kVoxEmittedWatts;
    int flux = 0;
    while (flux < 4 && emit > std::pow(10.0, flux)) ++flux;
    if (material["_type"] == "_diffuse") material["_type"] = "_emit";
    put("_emit", emit / std::pow(10.0, flux));
    put("_flux", flux);
  }
  entry.colour = {srgb_from_linear(seen.r), srgb_from_linear(seen.g), srgb_from_linear(seen.b), 255};
  return entry;
}

/// N of "vox:N", or 0.
int own_index(const Block& block) {
  int index = 0;
  if (!block.name.starts_with("vox:")) return 0;
  const char* const end = block.name.data() + block.name.size();
  const auto [at, error] = std::from_chars(block.name.data() + 4, end, index);
  return error == std::errc() && at == end && index >= 1 && index <= kColours ? index : 0;
}

struct Palette {
  std::array<Entry, kColours + 1> entries;
  std::vector<uint8_t> colour_of;  // by block id; 0 is air
  int used = 0;
  size_t sharing = 0;  // blocks that share a colour with one that looks the same
  bool fits = true;
};

Palette make_palette(const World& world) {
  Palette out;
  out.colour_of.resize(world.palette->size());
  const Census census = world.store.census();
  std::array<bool, kColours + 1> taken{};
  taken[0] = true;
  const auto give = [&](BlockId id, int index, Entry entry) {
    const Block& block = (*world.palette)[id];
    if (toml_from_block(block_of_colour(index, entry.colour, entry.material)) != toml_from_block(block))
      entry.material["_loam"] = toml_from_block(block);
    taken[static_cast<size_t>(index)] = true;
    out.colour_of[id] = static_cast<uint8_t>(index);
    out.entries[static_cast<size_t>(index)] = std::move(entry);
    ++out.used;
  };
  for (const auto& [id, count] : census)
    if (const int own = own_index((*world.palette)[id])) give(id, own, entry_of((*world.palette)[id]));
  const bool must_share = census.size() > static_cast<size_t>(kColours);
  std::map<Entry, int> shared;
  int next = 1;
  for (const auto& [id, count] : census) {
    if (out.colour_of[id]) continue;
    Entry entry = entry_of((*world.palette)[id]);
    if (must_share) {
      if (const auto found = shared.find(entry); found != shared.end()) {
        out.colour_of[id] = static_cast<uint8_t>(found->second);
        ++out.sharing;
        continue;
      }
    }
    while (next <= kColours && taken[static_cast<size_t>(next)]) ++next;
    if (next > kColours) {
      out.fits = false;
      return out;
    }
    if (must_share) shared.emplace(entry, next);
    give(id, next, std::move(entry));
  }
  return out;
}

struct ModelCell {
  VoxelBox box;
  uint64_t voxels = 0;
};
using Cells = std::map<std::array<int32_t, 3>, ModelCell>;

/// Calls visit(position, block) for every voxel of a leaf that is not air.
template <class Visit>
void for_each_voxel(LeafPos at, const LeafBlocks& leaf, Visit visit) {
  if (!leaf.values && leaf.uniform == kAir) return;
  const VoxelPos base = voxel_from_leaf(at);
  for (int i = 0; i < kLeafVoxels; ++i)
    if (leaf[i] != kAir) visit(base + offset_in_leaf(i), leaf[i]);
}

Cells find_cells(const Store& store) {
  Cells cells;
  for (const RegionPos region : store.regions())
    for (int l = 0; l < kLeavesPerRegion; ++l) {
      const LeafPos at = leaf_from_region(region) + leaf_offset_in_region(l);
      const VoxelPos corner = voxel_from_leaf(at);
      ModelCell* cell = nullptr;
      for_each_voxel(at, store.leaf(at), [&](VoxelPos v, BlockId) {
        if (!cell) cell = &cells[{corner.x >> kModelLog2, corner.y >> kModelLog2, corner.z >> kModelLog2}];
        cell->box.include(v);
        ++cell->voxels;
      });
    }
  return cells;
}

void put32(std::string& out, int64_t value) {
  for (int shift = 0; shift < 32; shift += 8) out += static_cast<char>(value >> shift & 0xff);
}
void put_text(std::string& out, const std::string& text) { put32(out, static_cast<int64_t>(text.size())), out += text; }
void put_dictionary(std::string& out, const vox::Dictionary& dictionary) {
  put32(out, static_cast<int64_t>(dictionary.size()));
  for (const auto& [key, value] : dictionary) put_text(out, key), put_text(out, value);
}
std::string chunk(const char* id, const std::string& content) {
  std::string out = id;
  put32(out, static_cast<int64_t>(content.size()));
  put32(out, 0);
  return out + content;
}
std::string transform(int id, int child, const vox::Dictionary& frame) {
  std::string c;
  put32(c, id);
  put_dictionary(c, {});
  for (const int v : {child, -1, -1, 1}) put32(c, v);
  put_dictionary(c, frame);
  return chunk("nTRN", c);
}

/// The scene graph and the palette: all but the models.
std::string graph_and_palette(const Cells& cells, const Palette& palette) {
  std::string out = transform(0, 1, {});
  std::string group;
  put32(group, 1);
  put_dictionary(group, {});
  put32(group, static_cast<int64_t>(cells.size()));
  for (size_t m = 0; m < cells.size(); ++m) put32(group, static_cast<int64_t>(2 + 2 * m));
  out += chunk("nGRP", group);
  int model = 0;
  for (const auto& [place, cell] : cells) {
    const VoxelPos low = cell.box.min, size = cell.box.max - low + VoxelPos{1, 1, 1};
    out += transform(
        2 + 2 * model, 3 + 2 * model,
        {{"_t", fmt::format("{} {} {}", low.x + size.x / 2, -cell.box.max.z - 1 + size.z / 2, low.y + size.y / 2)}});
    std::string shape;
    put32(shape, 3 + 2 * model);
    put_dictionary(shape, {});
    put32(shape, 1);
    put32(shape, model);
    put_dictionary(shape, {});
    out += chunk("nSHP", shape);
    ++model;
  }
  std::string colours;
  for (size_t i = 1; i <= 256; ++i) {
    const vox::Colour c = i <= kColours ? palette.entries[i].colour : vox::Colour{0, 0, 0, 0};
    for (const uint8_t byte : {c.r, c.g, c.b, c.a}) colours += static_cast<char>(byte);
  }
  out += chunk("RGBA", colours);
  for (int i = 1; i <= kColours; ++i) {
    const vox::Dictionary& material = palette.entries[static_cast<size_t>(i)].material;
    if (material.empty()) continue;
    std::string content;
    put32(content, i);
    put_dictionary(content, material);
    out += chunk("MATL", content);
  }
  return out;
}

}  // namespace

std::vector<std::string> vox_losses(const World& world) {
  const Palette palette = make_palette(world);
  std::vector<std::string> lost;
  if (palette.sharing)
    lost.push_back(fmt::format("{} kinds of block look like others and share their colour: a palette holds {}",
                               palette.sharing, kColours));
  for (const auto& more : {lost_layers(world), lost_surroundings(world)})
    lost.insert(lost.end(), more.begin(), more.end());
  return lost;
}

Status write_vox(const World& world, const std::filesystem::path& path) {
  const std::string name = path.string();
  const Palette palette = make_palette(world);
  if (!palette.fits) {
    return input_error(
        fmt::format("{}: the world holds more looks of blocks than the {} colours of a .vox; save it as "
                    ".loam or .schem",
                    name, kColours));
  }
  Cells cells = find_cells(world.store);
  if (cells.empty()) cells[{0, 0, 0}].box = {{0, 0, 0}, {0, 0, 0}};  // a file without any model is none
  for (const auto& [place, cell] : cells)
    for (int a = 0; a < 3; ++a)
      if (cell.box.min[a] <= -kPositionLimit + 512 || cell.box.max[a] >= kPositionLimit - 512)
        return input_error(fmt::format("{}: the world reaches further than positions in a .vox", name));
  const std::string rest = graph_and_palette(cells, palette);
  uint64_t bytes = rest.size();
  for (const auto& [place, cell] : cells) bytes += 12 + 12 + 12 + 4 + cell.voxels * 4;
  if (bytes > kMostBytes) {
    return input_error(fmt::format("{}: its {} voxels would take {} bytes, but a .vox holds {}; save it as .loam", name,
                                   world.store.voxel_count(), bytes, kMostBytes));
  }

  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  std::string piece = "VOX ";
  put32(piece, 150);
  piece += "MAIN";
  put32(piece, 0);
  put32(piece, static_cast<int64_t>(bytes));
  out << piece;
  for (const auto& [place, cell] : cells) {
    const VoxelPos low = cell.box.min, size = cell.box.max - low + VoxelPos{1, 1, 1};
    std::string extent;
    for (const int s : {size.x, size.z, size.y}) put32(extent, s);
    piece = chunk("SIZE", extent) + "XYZI";
    put32(piece, static_cast<int64_t>(4 + cell.voxels * 4));
    put32(piece, 0);
    put32(piece, static_cast<int64_t>(cell.voxels));
    const LeafPos first = leaf_from_voxel(low), last = leaf_from_voxel(cell.box.max);
    for (int lx = first.x; lx <= last.x && cell.voxels; ++lx)
      for (int ly = first.y; ly <= last.y; ++ly)
        for (int lz = first.z; lz <= last.z; ++lz)
          for_each_voxel({lx, ly, lz}, world.store.leaf({lx, ly, lz}),
                         [&, far = cell.box.max.z](VoxelPos v, BlockId block) {
                           for (const int c : {v.x - low.x, far - v.z, v.y - low.y}) piece += static_cast<char>(c);
                           piece += static_cast<char>(palette.colour_of[block]);
                         });
    out << piece;
  }
  out << rest;
  out.flush();
  return out ? Status{} : input_error(fmt::format("{}: cannot write; is the disk full?", name));
}

}  // namespace world
