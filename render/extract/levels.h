/// A world at coarser levels, for what is far: cells of 2^k voxels, each level with faces of its own. A cell is solid
/// where at least half of its eight children are; its block is the one that most of its columns have on top. So its
/// surfaces lie at most half a cell from those of the level below.
///
/// Cells are kept of the whole world, packed; faces of the chunks in a range alone.
///
/// Shapes (render/extract/proxies.h) count as air. Levels follow edits leaf by leaf.
/// cost  an eighth of the world's memory for level 1, an eighth of that for the next
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "render/extract/extractor.h"

namespace render {

constexpr int kMostLevels = 8;

class CoarseLevels {
 public:
  CoarseLevels();
  ~CoarseLevels();
  /// Of level k: which of its chunks have faces, in its cells.
  using RangeOf = std::function<ChunkRange(int k)>;
  static ChunkRange everything(int) { return {}; }
  /// Levels 1 to `count`, from the world's cubes; `shapes` as in Extractor.
  void rebuild(const world::WorldView& view, const ShapeExtractor* shapes, int count, const ExtractKnobs& knobs,
               const RangeOf& range_of = everything);
  /// Follows a place, see Extractor::follow().
  void follow(const RangeOf& range_of);
  /// Follows edits; equal to rebuild(), but for cavities as in Extractor::update().
  void update(const world::WorldView& view, std::span<const world::LeafPos> dirty);

  int count() const { return static_cast<int>(levels_.size()); }
  /// Of level 1 <= k <= count(). Positions are cells: voxels / 2^k.
  const Extractor& level(int k) const;
  size_t bytes() const;

 private:
  struct Level;
  const ShapeExtractor* shapes_ = nullptr;
  std::vector<std::unique_ptr<Level>> levels_;
};

}  // namespace render
