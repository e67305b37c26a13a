#include "world/saves/block_code.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <vector>

namespace world {

namespace {

/// Answers to questions of yes or no, each with the chance of a yes in 2^-16, as bytes: all that may follow lies in
/// [low, high] of the fraction's next 32 bits.
class AnswerWriter {
 public:
  explicit AnswerWriter(std::string& out) : out_(out) {}
  bool answer(bool yes, uint32_t chance) {
    const uint32_t last = low_ + static_cast<uint32_t>(uint64_t{high_ - low_} * chance >> 16);
    if (yes)
      high_ = last;
    else
      low_ = last + 1;
    while ((low_ ^ high_) >> 24 == 0) {
      out_ += static_cast<char>(high_ >> 24);
      low_ <<= 8, high_ = high_ << 8 | 0xff;
    }
    return yes;
  }
  void finish() {
    for (int shift = 24; shift >= 0; shift -= 8) out_ += static_cast<char>(low_ >> shift & 0xff);
  }

 private:
  std::string& out_;
  uint32_t low_ = 0, high_ = ~uint32_t{0};
};

/// The way back: what `answer` is told does not matter. Past the end come zeros, and is_whole() says so.
class AnswerReader {
 public:
  explicit AnswerReader(std::string_view bytes) : bytes_(bytes) {
    for (int i = 0; i < 4; ++i) next();
  }
  bool answer(bool, uint32_t chance) {
    const uint32_t last = low_ + static_cast<uint32_t>(uint64_t{high_ - low_} * chance >> 16);
    const bool yes = code_ <= last;
    if (yes)
      high_ = last;
    else
      low_ = last + 1;
    while ((low_ ^ high_) >> 24 == 0) {
      low_ <<= 8, high_ = high_ << 8 | 0xff;
      next();
    }
    return yes;
  }
  /// After the last answer: every byte was needed, and none lacked.
  bool is_whole() const { return at_ == bytes_.size(); }
  bool is_past_end() const { return at_ > bytes_.size(); }

 private:
  void next() {
    code_ = code_ << 8 | (at_ < bytes_.size() ? static_cast<uint8_t>(bytes_[at_]) : 0);
    ++at_;
  }
  std::string_view bytes_;
  size_t at_ = 0;
  uint32_t low_ = 0, high_ = ~uint32_t{0}, code_ = 0;
};

constexpr uint32_t kEven = 1 << 15, kLeastChance = 16;  // the least costs 1/2800 bit where it is right
constexpr int kMostSeen = 100;  // a chance is about the mean of so many answers: of 30 to 250 the best, measured

constexpr std::array<uint32_t, kMostSeen + 1> make_steps() {
  std::array<uint32_t, kMostSeen + 1> steps{};
  for (size_t n = 0; n <= kMostSeen; ++n) steps[n] = static_cast<uint32_t>(65536 / (static_cast<double>(n) + 1.6));
  return steps;
}
constexpr std::array<uint32_t, kMostSeen + 1> kSteps = make_steps();

/// The chance of a yes, as the answers so far tell.
struct Chance {
  uint16_t yes = kEven;
  uint8_t seen = 0;
  uint8_t weight = 0;  // of the model's guesses: how often it was right of late
  void learn(bool was_yes) {
    const int32_t from = yes,
                  to = was_yes ? 65536 - static_cast<int32_t>(kLeastChance) : static_cast<int32_t>(kLeastChance);
    yes = static_cast<uint16_t>(from + (int64_t{to - from} * kSteps[seen] >> 16));
    if (seen < kMostSeen) ++seen;
  }
};
static_assert(sizeof(Chance) == 4);

/// Symbols by the three before them: x - 1, y - 1, z - 1.
class Model {
 public:
  /// Symbols are 0 .. symbols - 1.
  explicit Model(uint32_t symbols) : slots_(size_t{1} << kSlotBits), leaf_bits_(std::bit_width(symbols - 1)) {
    rest_.resize(size_t{1} << leaf_bits_);
  }

  /// Writes `symbol`, or reads one; what it was.
  template <class Answers>
  uint32_t code(Answers& answers, uint32_t x, uint32_t y, uint32_t z, uint32_t symbol) {
    const uint64_t key = (uint64_t{x} << 40 | uint64_t{y} << 20 | z) + 1;
    Slot& slot = slots_[key * 0x9e3779b97f4a7c15ull >> (64 - kSlotBits)];
    Start& start = starts_[(x == y) | (y == z) << 1 | (x == z) << 2];
    if (slot.key != key) slot = fresh(key, x, y, z, start);
    for (size_t g = 0; g < kGuesses && slot.guess[g] != kNone; ++g) {
      Chance& chance = slot.chance[g];
      const bool right = answers.answer(symbol == slot.guess[g], chance.yes);
      if (chance.seen < kYoung) start[g].learn(right);
      chance.learn(right);
      if (!right) continue;
      const uint32_t found = slot.guess[g];
      praise(slot, g);
      return found;
    }
    symbol = code_rest(answers, symbol);
    size_t g = 0;
    while (g + 1 < kGuesses && slot.guess[g] != kNone) ++g;
    slot.guess[g] = symbol, slot.chance[g].weight = 1;
    return symbol;
  }

 private:
  static constexpr int kSlotBits = 14;  // 512 KiB: a quarter of a core's second-level cache; a .mca needs 3000 slots
  static constexpr size_t kGuesses = 3;
  static constexpr uint32_t kNone = ~uint32_t{0};
  static constexpr int kYoung = 4;
  using Start = std::array<Chance, kGuesses>;

  /// What followed the same three symbols before, the most frequent first.
  struct Slot {
    uint64_t key = 0;
    std::array<uint32_t, kGuesses> guess;
    std::array<Chance, kGuesses> chance;
  };
  static_assert(sizeof(Slot) == 32);

  /// Where the three were never seen together, one of them is likely: first the one that two are.
  static Slot fresh(uint64_t key, uint32_t x, uint32_t y, uint32_t z, const Start& start) {
    Slot slot{.key = key, .guess = {kNone, kNone, kNone}, .chance = {}};
    size_t n = 0;
    for (const uint32_t s : {x == z ? x : y, x, z, y})
      if (std::find(slot.guess.begin(), slot.guess.begin() + n, s) == slot.guess.begin() + n) slot.guess[n++] = s;
    for (size_t g = 0; g < kGuesses; ++g) slot.chance[g].yes = start[g].yes;
    return slot;
  }

  /// Moves a guess that was right before one that was right less often.
  static void praise(Slot& slot, size_t g) {
    if (slot.chance[g].weight == 255)
      for (Chance& c : slot.chance) c.weight /= 2;
    ++slot.chance[g].weight;
    if (g == 0 || slot.chance[g].weight <= slot.chance[g - 1].weight) return;
    std::swap(slot.guess[g], slot.guess[g - 1]);
    std::swap(slot.chance[g].weight, slot.chance[g - 1].weight);
  }

  /// A symbol that nothing led to expect, bit by bit from the highest.
  template <class Answers>
  uint32_t code_rest(Answers& answers, uint32_t symbol) {
    size_t node = 1;
    for (int bit = leaf_bits_ - 1; bit >= 0; --bit) {
      const bool yes = answers.answer(symbol >> bit & 1, rest_[node].yes);
      rest_[node].learn(yes);
      node = 2 * node + yes;
    }
    return static_cast<uint32_t>(node - (size_t{1} << leaf_bits_));
  }

  std::vector<Slot> slots_;
  std::array<Start, 8> starts_;
  std::vector<Chance> rest_;
  int leaf_bits_;
};

/// One leaf in symbols, and before it on each axis the layer that touches it.
struct Window {
  static constexpr int kX = 81, kY = 9;
  std::array<uint16_t, 729> at{};
  static constexpr int index(int x, int y, int z) { return (x + 1) * kX + (y + 1) * kY + z + 1; }
};
using Layer64 = std::array<uint16_t, 64>;

/// Codes a whole region. leaf(i, values) gives the symbol of a uniform leaf, or `symbols` and the 512 values, where
/// answers are written, and is not called where they are read; done(i, kind, values) is called in either case, and
/// ends all where it says false.
template <class Answers, class Leaf, class Done>
void code_region(Answers& answers, uint32_t symbols, Leaf leaf, Done done) {
  Model kinds(symbols + 1), voxels(symbols);
  // What lies before a leaf: the layers of those at x - 1, y - 1 and z - 1 that touch it. Outside the region is
  // symbol 0, which is air where the region has any.
  std::vector<Layer64> before_x(256), before_y(16);
  Layer64 before_z;
  std::array<uint32_t, kLeavesPerRegion> kind_of{};
  Window window;
  std::array<uint16_t, kLeafVoxels> values;
  for (int i = 0; i < kLeavesPerRegion; ++i) {
    const auto at = static_cast<size_t>(i);
    if ((i & 15) == 0) before_z.fill(0);
    if ((i & 255) == 0) std::fill(before_y.begin(), before_y.end(), Layer64{});
    Layer64 &layer_x = before_x[at & 255], &layer_y = before_y[at & 15], &layer_z = before_z;
    const uint32_t kind = kinds.code(answers, i >= 256 ? kind_of[at - 256] : 0, (i & 255) >= 16 ? kind_of[at - 16] : 0,
                                     (i & 15) > 0 ? kind_of[at - 1] : 0, leaf(i, values));
    kind_of[at] = kind;
    if (kind != symbols) {
      const auto same = static_cast<uint16_t>(kind);
      layer_x.fill(same), layer_y.fill(same), layer_z.fill(same);
    } else {
      for (int a = 0; a < 8; ++a)
        for (int b = 0; b < 8; ++b) {
          const auto ab = static_cast<size_t>(8 * a + b);
          window.at[static_cast<size_t>(Window::index(-1, a, b))] = layer_x[ab];
          window.at[static_cast<size_t>(Window::index(a, -1, b))] = layer_y[ab];
          window.at[static_cast<size_t>(Window::index(a, b, -1))] = layer_z[ab];
        }
      size_t v = 0;
      for (int x = 0; x < 8; ++x)
        for (int y = 0; y < 8; ++y) {
          uint16_t* const row = &window.at[static_cast<size_t>(Window::index(x, y, 0))];
          for (int z = 0; z < 8; ++z, ++v)
            row[z] = values[v] = static_cast<uint16_t>(
                voxels.code(answers, row[z - Window::kX], row[z - Window::kY], row[z - 1], values[v]));
        }
      for (int a = 0; a < 8; ++a)
        for (int b = 0; b < 8; ++b) {
          const auto ab = static_cast<size_t>(8 * a + b);
          layer_x[ab] = window.at[static_cast<size_t>(Window::index(7, a, b))];
          layer_y[ab] = window.at[static_cast<size_t>(Window::index(a, 7, b))];
          layer_z[ab] = window.at[static_cast<size_t>(Window::index(a, b, 7))];
        }
    }
    if (!done(i, kind, values)) return;
  }
}

uint16_t u16_at(std::string_view bytes, size_t at) {
  return static_cast<uint16_t>(static_cast<uint8_t>(bytes[at]) | static_cast<uint8_t>(bytes[at + 1]) << 8);
}

void append_u16(std::string& bytes, size_t value) {
  bytes += static_cast<char>(value & 0xff);
  bytes += static_cast<char>(value >> 8 & 0xff);
}

}  // namespace

std::string encode_block_code(const PackedRegion& region) {
  // Number the region's blocks.
  std::vector<uint16_t> symbol_of(kMaxBlocks, 0);
  std::array<BlockId, kLeafVoxels> ids;
  for (int i = 0; i < kLeavesPerRegion; ++i) {
    if (!region.is_mixed(i)) {
      symbol_of[region.uniform_block(i)] = 1;
      continue;
    }
    region.unpack(i, ids.data());
    for (const BlockId id : ids) symbol_of[id] = 1;
  }
  std::string bytes(2, '\0');
  uint32_t symbols = 0;
  for (size_t id = 0; id < kMaxBlocks; ++id)
    if (symbol_of[id]) {
      append_u16(bytes, id);
      symbol_of[id] = static_cast<uint16_t>(symbols++);
    }
  bytes[0] = static_cast<char>((symbols - 1) & 0xff), bytes[1] = static_cast<char>((symbols - 1) >> 8 & 0xff);

  AnswerWriter answers(bytes);
  code_region(
      answers, symbols,
      [&](int i, std::array<uint16_t, kLeafVoxels>& values) -> uint32_t {
        if (!region.is_mixed(i)) return symbol_of[region.uniform_block(i)];
        region.unpack(i, ids.data());
        for (size_t v = 0; v < kLeafVoxels; ++v) values[v] = symbol_of[ids[v]];
        return symbols;
      },
      [](int, uint32_t, const auto&) { return true; });
  answers.finish();
  return bytes;
}

Result<RegionBuilder> decode_block_code(std::string_view bytes, RegionPos pos, size_t palette_size) {
  const uint32_t symbols = bytes.size() < 2 ? 0 : uint32_t{u16_at(bytes, 0)} + 1;
  if (symbols == 0 || bytes.size() < 2 + 2 * size_t{symbols})
    return input_error("its block code is shorter than it states");
  std::vector<BlockId> ids;
  for (size_t s = 0; s < symbols; ++s) {
    const uint16_t id = u16_at(bytes, 2 + 2 * s);
    if (id >= palette_size) return input_error("block id " + std::to_string(id) + " is not in the palette");
    if (!ids.empty() && id <= ids.back()) return input_error("the ids of its block code do not ascend");
    ids.push_back(id);
  }
  RegionBuilder builder(pos);
  AnswerReader answers(bytes.substr(2 + 2 * size_t{symbols}));
  bool ended_early = false, all_known = true;
  std::array<BlockId, kLeafVoxels> leaf;
  code_region(
      answers, symbols, [](int, const auto&) { return uint32_t{0}; },
      [&](int i, uint32_t kind, const std::array<uint16_t, kLeafVoxels>& values) {
        ended_early = answers.is_past_end();
        if (ended_early) return false;
        if (kind < symbols) {
          if (ids[kind] != kAir) builder.set_uniform(i, ids[kind]);
          return true;
        }
        all_known =
            kind == symbols && std::all_of(values.begin(), values.end(), [&](uint16_t s) { return s < symbols; });
        if (!all_known) return false;
        for (size_t v = 0; v < kLeafVoxels; ++v) leaf[v] = ids[values[v]];
        builder.set_leaf(i, leaf);
        return true;
      });
  if (!all_known) return input_error("its block code names a block that it does not list");
  if (ended_early || !answers.is_whole()) return input_error("its block code does not end where its bytes do");
  return builder;
}

}  // namespace world
