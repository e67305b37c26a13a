#include "sim/matter/pieces.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>
#include <numeric>
#include <tuple>

#include <fmt/format.h>

#include "world/base/jobs.h"

namespace sim {

using world::LeafMask;
using world::LeafPos;
using world::VoxelPos;

namespace {

constexpr LeafPos kDown{0, -1, 0};
constexpr int32_t kOneVoxel = 1 << kPieceFixedLog2;

/// The same voxels, one lower.
VoxelSet lowered(const VoxelSet& voxels) {
  std::vector<LeafPart> parts;
  for (const LeafPart& part : voxels) {
    parts.push_back({part.leaf, world::across(part.mask, world::kNoneMask, world::kFacePosY)});
    parts.push_back({part.leaf + kDown, world::across(world::kNoneMask, part.mask, world::kFacePosY)});
  }
  return joined(std::move(parts));
}

int32_t lowest_y(const VoxelSet& voxels) {
  int32_t lowest = INT32_MAX;
  for (const LeafPart& part : voxels) {
    uint64_t all = 0;
    for (const uint64_t word : part.mask.word) all |= word;
    lowest = std::min(lowest, world::voxel_from_leaf(part.leaf).y + std::countr_zero(all) / world::kLeafSize);
  }
  return lowest;
}

/// Takes a whole number off the front of a line, and the space before it.
template <class Number>
bool take(std::string_view& line, Number& out, int base = 10) {
  while (!line.empty() && line.front() == ' ') line.remove_prefix(1);
  const auto parsed = std::from_chars(line.data(), line.data() + line.size(), out, base);
  if (parsed.ec != std::errc()) return false;
  line.remove_prefix(static_cast<size_t>(parsed.ptr - line.data()));
  return true;
}

}  // namespace

void Pieces::add(Piece piece) {
  for (const LeafPart& part : piece.voxels) falling_[part.leaf] = falling(part.leaf) | part.mask;
  pieces_.push_back(std::move(piece));
}

void Pieces::refresh() {
  std::erase_if(pieces_, [](const Piece& piece) { return piece.voxels.empty(); });
  falling_.clear();
  for (const Piece& piece : pieces_)
    for (const LeafPart& part : piece.voxels) falling_[part.leaf] = falling(part.leaf) | part.mask;
}

void Pieces::follow(Cells& cells) {
  bool changed = false;
  for (size_t n = pieces_.size(); n-- > 0;) {
    std::vector<LeafPart> left = pieces_[n].voxels;
    bool damaged = false;
    for (LeafPart& part : left) {
      const LeafMask solid = part.mask & cells.closed()[cells.open(part.leaf)];
      damaged |= !(solid == part.mask);
      part.mask = solid;
    }
    if (!damaged) continue;
    changed = true;
    const Piece whole = std::move(pieces_[n]);
    pieces_[n].voxels.clear();
    for (VoxelSet& voxels : touching_parts(joined(std::move(left))))
      pieces_.push_back({std::move(voxels), whole.speed, whole.gone});
  }
  if (changed) refresh();
}

/// A grain that the piece would come down on: carried, with those under it, if they lie on the piece itself.
Pieces::Blocked Pieces::carry(Cells& cells, size_t index, VoxelPos grain, size_t& other) {
  for (VoxelPos v = grain;; --v.y) {
    const LeafPos l = world::leaf_from_voxel(v);
    const PageId p = cells.open(l);
    LeafPart part{l, {}};
    part.mask.set(world::index_in_leaf(v));
    if (cells.grain()[p].test(v)) {
      carried_.push_back(part);
      continue;
    }
    if (part_of(pieces_[index].voxels, l).test(v)) return Blocked::no;
    if (!falling(l).test(v)) return Blocked::by_ground;
    for (other = 0; !part_of(pieces_[other].voxels, l).test(v);) ++other;
    return Blocked::by_piece;
  }
}

/// What stops a piece from going a voxel down; other: the piece that does, if it is one. Lists what it carries.
Pieces::Blocked Pieces::find_way(Cells& cells, size_t index, size_t& other) {
  const VoxelSet& voxels = pieces_[index].voxels;
  Blocked blocked = Blocked::no;
  carried_.clear();
  for (const LeafPart& part : lowered(voxels)) {
    const PageId p = cells.open(part.leaf);
    if (p == kClosedPage) return Blocked::by_ground;
    const LeafMask hit = without(part.mask & cells.occupied_mask(p), part_of(voxels, part.leaf));
    if (hit.is_none()) continue;
    const LeafMask grains = hit & cells.grain()[p], falls = falling(part.leaf);
    if (!without(without(hit, grains), falls).is_none()) return Blocked::by_ground;
    bool stops = false;
    world::for_each_voxel(grains, [&](int i) {
      size_t found = 0;
      const VoxelPos v = world::voxel_from_leaf(part.leaf) + world::offset_in_leaf(i);
      const Blocked by = stops ? Blocked::by_ground : carry(cells, index, v, found);
      stops |= by == Blocked::by_ground;
      if (by == Blocked::by_piece && blocked == Blocked::no) blocked = by, other = found;
    });
    if (stops) return Blocked::by_ground;
    const LeafMask met = hit & falls;
    if (blocked == Blocked::by_piece || met.is_none()) continue;
    blocked = Blocked::by_piece;
    for (other = 0; (part_of(pieces_[other].voxels, part.leaf) & met).is_none();) ++other;
  }
  return blocked;
}

/// Moves what is in `parts`, leaves above each other from below upwards, a voxel down. Returns whether there was liquid
/// in its way.
bool Pieces::move_column(Cells& cells, std::span<const MovingPart> parts) {
  bool wet = false;
  // By x and z: what the voxels so far came through. It ends above the topmost of those that lie on each other.
  std::array<Cell, size_t{world::kLeafSize} * world::kLeafSize> passed;
  for (size_t n = 0; n < parts.size(); ++n) {
    const MovingPart& part = parts[n];
    const bool lies_on = n > 0 && parts[n - 1].leaf.y + 1 == part.leaf.y;
    const LeafMask& mask = part.mask;
    const LeafMask moves_under = world::across(mask, lies_on ? parts[n - 1].mask : world::kNoneMask, world::kFaceNegY);
    const bool bears = n + 1 < parts.size() && parts[n + 1].leaf.y == part.leaf.y + 1;
    const LeafMask moves_above = world::across(mask, bears ? parts[n + 1].mask : world::kNoneMask, world::kFacePosY);
    world::for_each_voxel(mask, [&](int i) {
      const VoxelPos at = world::offset_in_leaf(i);
      const PageId p = at.y == 0 ? part.under : part.here;
      const int below = at.y == 0 ? i + 7 * world::kLeafSize : i - world::kLeafSize;
      Cell& way = passed[static_cast<size_t>(at.x * world::kLeafSize + at.z)];
      if (!moves_under.test(i)) {
        way = cells.cell(p, below);
        wet |= cells.traits()[way.block].content == Content::liquid;
      }
      cells.put(p, below, cells.cell(part.here, i));
      if (!moves_above.test(i)) cells.put(part.here, i, way);
    });
  }
  return wet;
}

void Pieces::move_down(Cells& cells, Piece& piece, Step& step) {
  std::vector<LeafPart> moving = piece.voxels;
  moving.insert(moving.end(), carried_.begin(), carried_.end());
  const VoxelSet from = joined(std::move(moving)), to = lowered(from), voxels = lowered(piece.voxels);
  // Columns of leaves have nothing to do with each other.
  std::vector<size_t> order(from.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    const LeafPos &of_a = from[a].leaf, &of_b = from[b].leaf;
    return std::tuple(of_a.x, of_a.z, of_a.y) < std::tuple(of_b.x, of_b.z, of_b.y);
  });
  moving_.clear();
  for (const size_t n : order) {
    const LeafPart& part = from[n];
    moving_.push_back({part.leaf, part.mask, cells.open(part.leaf), cells.open(part.leaf + kDown)});
    step.voxels_moved += static_cast<uint64_t>(part.mask.count());
  }
  columns_.clear();
  for (size_t n = 0; n < moving_.size(); ++n)
    if (n == 0 || moving_[n].leaf.x != moving_[n - 1].leaf.x || moving_[n].leaf.z != moving_[n - 1].leaf.z)
      columns_.push_back(n);
  columns_.push_back(moving_.size());
  std::atomic<bool> wet{false};
  constexpr size_t kColumnsOfATask = 2;
  world::parallel_ranges(columns_.size() - 1, kColumnsOfATask, [&](size_t begin, size_t end) {
    for (size_t c = begin; c < end; ++c)
      if (move_column(cells, std::span(moving_).subspan(columns_[c], columns_[c + 1] - columns_[c]))) wet = true;
  });
  std::vector<LeafPart> changed = from;
  changed.insert(changed.end(), to.begin(), to.end());
  for (const LeafPart& part : joined(std::move(changed))) {
    const PageId p = cells.open(part.leaf);
    cells.open_around(p);
    cells.stir(p, part.mask);
    LeafMask& falls = falling_[part.leaf];
    falls = without(falls, part_of(piece.voxels, part.leaf)) | part_of(voxels, part.leaf);
  }
  piece.voxels = voxels;
  if (wet) piece.speed = std::min(piece.speed, kFastestInLiquid);
}

/// Makes one piece of two, in the place of `other`.
void Pieces::join(size_t index, size_t other) {
  Piece &from = pieces_[index], &into = pieces_[other];
  const auto voxels = static_cast<int64_t>(voxel_count(from.voxels)),
             more = static_cast<int64_t>(voxel_count(into.voxels));
  into.speed = static_cast<int32_t>((voxels * from.speed + more * into.speed) / (voxels + more));
  std::vector<LeafPart> both = std::move(from.voxels);
  both.insert(both.end(), into.voxels.begin(), into.voxels.end());
  into.voxels = joined(std::move(both));
  from.voxels.clear();
}

Pieces::Step Pieces::step(Cells& cells) {
  Step step;
  // Those below first.
  std::vector<std::tuple<int32_t, LeafPos, size_t>> keys;
  for (size_t n = 0; n < pieces_.size(); ++n)
    keys.emplace_back(lowest_y(pieces_[n].voxels), pieces_[n].voxels[0].leaf, n);
  std::sort(keys.begin(), keys.end());
  // Fall freely through the tick.
  std::vector<int> left(pieces_.size());
  for (size_t n = 0; n < pieces_.size(); ++n) {
    Piece& piece = pieces_[n];
    piece.gone += piece.speed + kPieceGravity / 2;
    piece.speed = std::min(piece.speed + kPieceGravity, kFastestPiece);
    left[n] = piece.gone >> kPieceFixedLog2;
    piece.gone &= kOneVoxel - 1;
  }
  // Go voxel by voxel.
  for (bool going = true; going;) {
    going = false;
    for (const auto& key : keys) {
      const size_t n = std::get<size_t>(key);
      Piece& piece = pieces_[n];
      if (left[n] == 0 || piece.voxels.empty()) continue;
      size_t other = 0;
      switch (find_way(cells, n, other)) {
        case Blocked::no:
          move_down(cells, piece, step);
          going |= --left[n] > 0;
          break;
        case Blocked::by_piece:
          join(n, other);
          left[n] = 0;
          break;
        case Blocked::by_ground:
          for (const LeafPart& part : piece.voxels) {
            LeafMask& falls = falling_[part.leaf];
            falls = without(falls, part.mask);
          }
          step.landed.push_back(std::move(piece.voxels));
          piece.voxels.clear();
          break;
      }
    }
  }
  refresh();
  return step;
}

void Pieces::for_each_page(Cells& cells, world::FunctionRef<void(PageId)> visit) const {
  for (const Piece& piece : pieces_)
    for (const LeafPart& part : piece.voxels) visit(cells.open(part.leaf));
}

std::string Pieces::state() const {
  // In an order that doesn't depend on what they went through.
  std::vector<const Piece*> sorted;
  for (const Piece& piece : pieces_) sorted.push_back(&piece);
  const auto key = [](const Piece* piece) {
    const auto& words = piece->voxels[0].mask.word;
    return std::tuple(piece->voxels[0].leaf, std::to_array(words));
  };
  std::sort(sorted.begin(), sorted.end(), [&](const Piece* a, const Piece* b) { return key(a) < key(b); });
  std::string text;
  for (const Piece* piece : sorted) {
    text += fmt::format("piece {} {}\n", piece->speed, piece->gone);
    for (const LeafPart& part : piece->voxels) {
      text += fmt::format("leaf {} {} {}", part.leaf.x, part.leaf.y, part.leaf.z);
      for (const uint64_t word : part.mask.word) text += fmt::format(" {:x}", word);
      text += '\n';
    }
  }
  return text;
}

world::Status Pieces::restore(std::string_view text, Cells& cells) {
  std::vector<Piece> pieces;
  std::vector<std::vector<LeafPart>> parts;
  while (!text.empty()) {
    const size_t end = text.find('\n');
    const std::string line(text.substr(0, end));
    std::string_view rest = line;
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    const auto damaged = [&](const char* what) {
      return world::input_error(fmt::format("falling pieces: \"{}\" {}", line.substr(0, 40), what));
    };
    if (rest.starts_with("piece")) {
      rest.remove_prefix(5);
      Piece piece;
      if (!take(rest, piece.speed) || !take(rest, piece.gone) || !rest.empty() || piece.speed < 0 ||
          piece.speed > kFastestPiece || piece.gone < 0 || piece.gone >= kOneVoxel)
        return damaged("must be a speed from 0 to 262144 and a part of a voxel from 0 to 65535");
      pieces.push_back(std::move(piece));
      parts.emplace_back();
      continue;
    }
    if (!rest.starts_with("leaf") || pieces.empty())
      return damaged("must begin with \"piece\", or \"leaf\" after that");
    rest.remove_prefix(4);
    LeafPart part;
    bool read = true;
    for (int a = 0; a < 3; ++a) read = read && take(rest, part.leaf[a]);
    for (uint64_t& word : part.mask.word) read = read && take(rest, word, 16);
    constexpr int32_t kBorder = world::kWorldBorder / world::kLeafSize;
    for (int a = 0; a < 3; ++a) read = read && part.leaf[a] >= -kBorder && part.leaf[a] < kBorder;
    if (!read || !rest.empty()) return damaged("must be a place and eight words of bits");
    const PageId p = cells.open(part.leaf);
    if (!without(part.mask, cells.closed()[p]).is_none() || p == kClosedPage)
      return damaged("names voxels that aren't solid");
    parts.back().push_back(part);
  }
  Pieces read;
  for (size_t n = 0; n < pieces.size(); ++n) {
    pieces[n].voxels = joined(std::move(parts[n]));
    for (const LeafPart& part : pieces[n].voxels)
      if (!(part.mask & read.falling(part.leaf)).is_none())
        return world::input_error("falling pieces: two of them hold the same voxel");
    if (!pieces[n].voxels.empty()) read.add(std::move(pieces[n]));
  }
  *this = std::move(read);
  return {};
}

size_t Pieces::bytes() const {
  size_t all = pieces_.capacity() * sizeof(Piece) + falling_.size() * (sizeof(LeafPos) + sizeof(LeafMask) + 32);
  for (const Piece& piece : pieces_) all += piece.voxels.capacity() * sizeof(LeafPart);
  return all;
}

}  // namespace sim
