/// support: solids that have lost their connection to the ground come down. Called for by name only, since in a world
/// of blocks things may float; and asked only where something was taken away - dug out, burnt, melted, or grains that
/// ran off - so that what floated before goes on floating, and a world at rest costs nothing.
///
/// What stands, and what the ground is: sim/matter/structures.h. How pieces fall: sim/matter/pieces.h. The ground is
/// the lowest layer of voxels that the world had at the start of its simulation, and what is not loaded.
///
/// In a tick, after all other rules: see what has gone since the last, search from what is left beside it, make pieces
/// of what doesn't stand, and let all pieces fall.
#include <algorithm>
#include <charconv>

#include <fmt/format.h>

#include "sim/matter/matter.h"
#include "sim/matter/pieces.h"

namespace sim {

namespace {

using world::LeafMask;
using world::LeafPos;
using world::VoxelPos;

constexpr LeafPos kDown{0, -1, 0};
constexpr std::string_view kGroundLine = "ground ";

class Support final : public Rule {
 public:
  explicit Support(size_t rule) : rule_(rule) {}

  void start(Cells& cells, const MatterOptions&) override {
    const world::VoxelBox bounds = cells.store().bounds();
    structures_.build(cells.store(), cells.traits(), bounds.empty() ? 0 : bounds.min.y);
  }

  RuleReport step(Cells& cells, const Tick& tick) override {
    RuleReport report;
    AwakeSet& set = cells.awake(rule_);
    set.begin();
    pieces_.follow(cells);
    Structures::Search search;
    if (const VoxelSet suspects = take_in(cells); !suspects.empty()) {
      const auto reach = static_cast<uint64_t>(std::max(tick.options->knobs.support_reach, 1));
      search = structures_.find_fallen(suspects, reach, [&](VoxelPos v) { return below(cells, v); });
    }
    for (VoxelSet& voxels : search.fallen) {
      ++fallen_, fallen_voxels_ += voxel_count(voxels);
      for (const LeafPart& part : voxels)
        structures_.set_standing(part.leaf, without(structures_.standing(part.leaf), part.mask));
      pieces_.add({std::move(voxels), 0, 0});
    }
    given_up_ += search.given_up;
    if (!pieces_.empty()) {
      const Pieces::Step step = pieces_.step(cells);
      for (const VoxelSet& voxels : step.landed) land(cells, voxels);
      report.voxels_changed = step.voxels_moved;
    }
    cells.spread();
    pieces_.for_each_page(cells, [&](PageId p) { set.add(p); });
    report.leaves_visited = set.now().size() + search.leaves;
    report.bytes = structures_.bytes() + pieces_.bytes();
    if (fallen_ + given_up_ > 0)
      report.notes.push_back(
          fmt::format("{} pieces of {} voxels fell, {} of them in the air; {} structures of more than {} voxels were "
                      "taken to stand",
                      fallen_, fallen_voxels_, pieces_.all().size(), given_up_, tick.options->knobs.support_reach));
    return report;
  }

  std::string state() const override {
    return fmt::format("{}{}\n", kGroundLine, structures_.ground_y()) + pieces_.state();
  }

  world::Status restore(Cells& cells, std::string_view text) override {
    int32_t ground = 0;
    const std::string_view first = text.substr(0, text.find('\n'));
    const char* const end = first.data() + first.size();
    if (!first.starts_with(kGroundLine)) return damaged();
    const auto parsed = std::from_chars(first.data() + kGroundLine.size(), end, ground);
    if (parsed.ec != std::errc() || parsed.ptr != end) return damaged();
    text.remove_prefix(std::min(first.size() + 1, text.size()));
    TRY_STATUS(pieces_.restore(text, cells));
    structures_.set_ground_y(ground);
    for (const Piece& piece : pieces_.all())
      for (const LeafPart& part : piece.voxels)
        structures_.set_standing(part.leaf, without(structures_.standing(part.leaf), part.mask));
    pieces_.for_each_page(cells, [&](PageId p) { cells.awake(rule_).add(p); });
    return {};
  }

 private:
  static world::Error damaged() {
    return world::input_error("what support holds must begin with the height of the ground");
  }

  /// Follows what changed on the awake pages. Returns solids beside what has gone.
  VoxelSet take_in(Cells& cells) {
    std::vector<LeafPart> suspects;
    const auto suspect = [&](LeafPos l, const LeafMask& gone, int face) {
      const VoxelPos step = world::face_step(face);
      suspects.push_back({l, world::across(gone, world::kNoneMask, face)});
      suspects.push_back({l - LeafPos{step.x, step.y, step.z}, world::across(world::kNoneMask, gone, face)});
    };
    const std::vector<PageId>& awake = cells.awake(rule_).now();
    for (const PageId p : awake) {
      const LeafPos l = cells.pos(p);
      const LeafMask now = without(cells.closed()[p], pieces_.falling(l));
      const LeafMask gone = without(structures_.standing(l), now), come = without(now, structures_.standing(l));
      structures_.set_standing(l, now);
      if (!come.is_none()) structures_.rest(l, come, grains(cells, l), grains(cells, l + kDown));
      if (gone.is_none()) continue;
      for (int face = 0; face < world::kFaces; ++face) suspect(l, gone, face);
    }
    for (const PageId p : awake) {
      const LeafMask gone = structures_.take_grains(cells.pos(p), cells.grain()[p], cells.closed()[p]);
      if (!gone.is_none()) suspect(cells.pos(p), gone, world::kFaceNegY);
    }
    for (LeafPart& part : suspects) part.mask = part.mask & structures_.standing(part.leaf);
    return joined(std::move(suspects));
  }

  Below below(const Cells& cells, VoxelPos v) const {
    if (!world::inside_world(v)) return Below::ground;
    const LeafPos l = world::leaf_from_voxel(v);
    const int i = world::index_in_leaf(v);
    const PageId p = cells.find(l);
    switch (cells.traits()[p == kClosedPage ? cells.store().leaf(l)[i] : cells.block(p, i)].content) {
      case Content::grain:
        return Below::grain;
      case Content::closed:
        return pieces_.falling(l).test(i) ? Below::open : Below::solid;
      default:
        return Below::open;
    }
  }

  /// What has come to rest stands, and may stand on grains.
  void land(Cells& cells, const VoxelSet& voxels) {
    for (const LeafPart& part : voxels) {
      structures_.set_standing(part.leaf, structures_.standing(part.leaf) | part.mask);
      structures_.rest(part.leaf, part.mask, grains(cells, part.leaf), grains(cells, part.leaf + kDown));
    }
  }

  static LeafMask grains(Cells& cells, LeafPos l) { return cells.grain()[cells.open(l)]; }

  const size_t rule_;  // its awake set
  Structures structures_;
  Pieces pieces_;
  uint64_t fallen_ = 0, fallen_voxels_ = 0, given_up_ = 0;
};

}  // namespace

RuleInfo support_info() {
  return {.name = "support",
          .what = "solids that have lost their connection to the ground fall, each piece as one",
          .conserves = "voxels of each block, and their heat",
          .layers = "blocks, heat",
          .calls = [](const world::Block&) { return false; }};
}
std::unique_ptr<Rule> make_support_rule(size_t rule) { return std::make_unique<Support>(rule); }

}  // namespace sim
