/// Brushes: shapes of many voxels as one edit, which is undone as one.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "tools/play/forms.h"
#include "world/world.h"

namespace tools {

enum class BrushKind { single, box, sphere, line, fill, replace, copy, paste };
constexpr std::array<std::string_view, 8> kBrushNames{"single", "box",     "sphere", "line",
                                                      "fill",   "replace", "copy",   "paste"};
constexpr int kMostBrushRadius = 32;
constexpr size_t kMostFill = size_t{1} << 16;        // voxels that a fill may take
constexpr uint64_t kMostCopied = uint64_t{1} << 22;  // voxels of a copy

/// All voxels between the corners, both included.
world::EditBatch box_of(world::VoxelPos a, world::VoxelPos b, world::BlockId block);
/// Voxels whose middles lie within radius + 1/2 of the middle of `centre`: radius 0 is one voxel.
world::EditBatch sphere_of(world::VoxelPos centre, int radius, world::BlockId block);
/// The voxels that the segment between the middles passes, so that each shares a face with the next.
world::EditBatch line_of(world::VoxelPos a, world::VoxelPos b, world::BlockId block);
/// All voxels of the kind at `start` that are connected with it by faces and lie no higher: a hollow fills like a
/// basin. Nothing where there are more than kMostFill of them: it is open.
std::optional<world::EditBatch> fill_of(const world::Store& store, world::VoxelPos start, world::BlockId block);
/// Voxels of `from` in the sphere become `to`.
world::EditBatch replace_of(const world::Store& store, world::VoxelPos centre, int radius, world::BlockId from,
                            world::BlockId to);

/// Blocks of a box that was copied, by (x * size.y + y) * size.z + z.
struct Clipboard {
  world::VoxelPos size{0, 0, 0};
  std::vector<world::BlockId> blocks;
  bool empty() const { return blocks.empty(); }
};
/// Nothing where the box is larger than kMostCopied.
std::optional<Clipboard> copy_box(const world::Store& store, world::VoxelPos a, world::VoxelPos b);
/// By a quarter about the vertical: what looked along x looks along z.
Clipboard turned(const Clipboard& clipboard, const TurnedForms& forms);
Clipboard flipped(const Clipboard& clipboard, int axis, const TurnedForms& forms);
/// Its lowest corner goes to `low`; air leaves what is there.
world::EditBatch paste_of(const Clipboard& clipboard, world::VoxelPos low);

/// The batch, and after it the same mirrored at the plane through the middle of the voxels at `at` along x or z.
world::EditBatch mirrored(const world::EditBatch& batch, int axis, int32_t at, const TurnedForms& forms);

}  // namespace tools
