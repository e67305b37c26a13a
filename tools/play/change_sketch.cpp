#include "tools/play/change_sketch.h"

#include <algorithm>
#include <bit>
#include <charconv>

#include <fmt/format.h>

#include "world/base/random.h"
#include "world/store/leaf_sets.h"

namespace tools {

namespace {

constexpr size_t kDigitsOfWord = 8, kDigitsOfPlace = 2;

/// Its low half is the check of a cell.
uint64_t hash_of(const VoxelEntry& entry) {
  return world::random_bits(entry.value, entry.pos.x, entry.pos.y, entry.pos.z, static_cast<uint64_t>(entry.layer));
}

/// Takes so many hexadecimal digits off the front; false where they aren't there.
template <class T>
bool take_word(std::string_view& text, size_t digits, T& into) {
  if (text.size() < digits) return false;
  const auto parsed = std::from_chars(text.data(), text.data() + digits, into, 16);
  if (parsed.ec != std::errc{} || parsed.ptr != text.data() + digits) return false;
  text.remove_prefix(digits);
  return true;
}

}  // namespace

uint32_t name_hash(std::string_view block_name) {
  uint64_t hash = 0;
  for (const char c : block_name) hash = world::hash_combine(hash, static_cast<unsigned char>(c));
  return static_cast<uint32_t>(hash);
}

int ChangeSketch::cell_of(int table, uint64_t entry_hash) {
  const uint64_t hash = world::hash_combine(entry_hash, static_cast<uint64_t>(table));
  const int level = std::min(std::countr_zero(hash | uint64_t{1} << (kLevels - 1)), kLevels - 1);
  const auto high = static_cast<int>(hash >> 32);
  if (level == 0) return high & (kCellsOfFirst - 1);
  return kCellsOfFirst + (level - 1) * kCellsOfOthers + (high & (kCellsOfOthers - 1));
}

void ChangeSketch::toggle(const VoxelEntry& entry) {
  const uint64_t hash = hash_of(entry);
  const Cell words{static_cast<uint32_t>(entry.pos.x), static_cast<uint32_t>(entry.pos.y),
                   static_cast<uint32_t>(entry.pos.z), entry.value, static_cast<uint32_t>(hash)};
  for (int table = 0; table < kTables; ++table) {
    Cell& cell = cells_[static_cast<size_t>(table)][static_cast<size_t>(cell_of(table, hash))];
    for (size_t w = 0; w < cell.size(); ++w) cell[w] ^= words[w];
  }
}

void ChangeSketch::toggle(const ChangeSketch& other) {
  for (size_t table = 0; table < kTables; ++table)
    for (size_t c = 0; c < kCells; ++c)
      for (size_t w = 0; w < Cell{}.size(); ++w) cells_[table][c][w] ^= other.cells_[table][c][w];
}

bool ChangeSketch::empty() const {
  return std::all_of(cells_.begin(), cells_.end(), [](const auto& table) {
    return std::all_of(table.begin(), table.end(), [](const Cell& cell) { return cell == Cell{}; });
  });
}

/// The entry that is alone in its cell, where one is.
std::optional<VoxelEntry> ChangeSketch::read(int table, int cell, const Cell& from) {
  VoxelEntry entry{.pos = {static_cast<int32_t>(from[0]), static_cast<int32_t>(from[1]), static_cast<int32_t>(from[2])},
                   .value = from[3]};
  for (size_t layer = 0; layer < world::layer_rows().size(); ++layer) {
    entry.layer = static_cast<world::Layer>(layer);
    const uint64_t hash = hash_of(entry);
    if (static_cast<uint32_t>(hash) == from[4] && cell_of(table, hash) == cell) return entry;
  }
  return {};
}

std::vector<VoxelEntry> ChangeSketch::entries() const {
  std::vector<VoxelEntry> found;
  ChangeSketch rest = *this;
  for (bool any = true; any;) {
    any = false;
    for (int table = 0; table < kTables; ++table)
      for (int c = 0; c < kCells; ++c) {
        const Cell& cell = rest.cells_[static_cast<size_t>(table)][static_cast<size_t>(c)];
        if (cell == Cell{}) continue;
        const std::optional<VoxelEntry> entry = read(table, c, cell);
        if (!entry || found.size() >= size_t{kTables} * kCells) continue;
        found.push_back(*entry);
        rest.toggle(*entry);
        any = true;
      }
  }
  std::sort(found.begin(), found.end());
  return found;
}

std::string ChangeSketch::text() const {
  std::string text;
  for (size_t table = 0; table < kTables; ++table)
    for (size_t c = 0; c < kCells; ++c) {
      const Cell& cell = cells_[table][c];
      if (cell == Cell{}) continue;
      text += fmt::format("{:02x}", table * kCells + c);
      for (const uint32_t word : cell) text += fmt::format("{:08x}", word);
    }
  return text;
}

std::optional<ChangeSketch> ChangeSketch::from(std::string_view text) {
  static_assert(kTables * kCells <= 256, "a cell's place takes two digits");
  ChangeSketch sketch;
  while (!text.empty()) {
    size_t place = 0;
    if (!take_word(text, kDigitsOfPlace, place) || place >= size_t{kTables} * kCells) return {};
    for (uint32_t& word : sketch.cells_[place / kCells][place % kCells])
      if (!take_word(text, kDigitsOfWord, word)) return {};
  }
  return sketch;
}

ChangeFollower::ChangeFollower(const world::World& world)
    : world_(world), subscriber_(world.store.subscribe()), known_(world.store) {
  for (size_t id = 0; id < world.palette->size(); ++id)
    names_.push_back(name_hash((*world.palette)[static_cast<world::BlockId>(id)].name));
  layers_ = sketch_of_layers();
}

ChangeSketch ChangeFollower::sketch_of_layers() const {
  ChangeSketch sketch;
  std::array<int32_t, world::kLeafVoxels> value;
  world::LeafMask active;
  for (const world::LayerRow& row : world::layer_rows()) {
    if (!row.is_integer) continue;
    const world::Layer layer = *world::layer_from_name(row.name);
    const world::IntLayer* values = world_.store.find_int_layer(layer);
    if (!values) continue;
    for (const world::LeafPos& l : values->leaves()) {
      if (!values->read_leaf(l, value, active)) continue;
      world::for_each_voxel(active, [&](int i) {
        sketch.toggle({layer, world::voxel_from_leaf(l) + world::offset_in_leaf(i),
                       static_cast<uint32_t>(value[static_cast<size_t>(i)])});
      });
    }
  }
  return sketch;
}

ChangeSketch ChangeFollower::take() {
  ChangeSketch changes = sketch_of_layers();
  changes.toggle(layers_);
  layers_.toggle(changes);
  KnownBlocks::Blocks scratch, now;
  for (const world::LeafPos& l : world_.store.take_dirty(subscriber_)) {
    const KnownBlocks::Blocks& before = known_.leaf(l, scratch);
    const world::LeafBlocks leaf = world_.store.leaf(l);
    bool changed = false;
    for (int i = 0; i < world::kLeafVoxels; ++i) {
      const auto n = static_cast<size_t>(i);
      now[n] = leaf[i];
      if (now[n] == before[n]) continue;
      changed = true;
      const world::VoxelPos v = world::voxel_from_leaf(l) + world::offset_in_leaf(i);
      for (const world::BlockId block : {before[n], now[n]}) changes.toggle({world::Layer::block, v, names_[block]});
    }
    if (changed) known_.learn(l, now);
  }
  return changes;
}

}  // namespace tools
