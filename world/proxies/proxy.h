/// Shapes that stand for a block inside its voxel, finer than the grid: one file each, world/proxies/<name>.toml, which
/// a block names as its `proxy`. Voxels keep the simulation; only what is seen, hit and shaded changes.
///
///   what = "A post with rails to what it joins"
///   [[box]]                      solid, axis-aligned
///   low = [0.375, 0, 0.375]      corners in the unit voxel, 0 <= low < high <= 1
///   high = [0.625, 1, 0.625]
///   joins = "+x"                 optional: there only where the neighbour on that side joins (see BlockShapes::joins)
///   [[quad]]                     flat, seen from both sides: corner, corner + u, corner + u + v, corner + v
///   corner = [0.125, 0, 0.125]
///   u = [0.75, 0, 0.75]
///   v = [0, 1, 0]
///   borne_by = "-y"              optional: the side on which the block that bears it is, where one is placed by hand
///   passable = true              optional: bodies pass through it, as they do where there are quads alone
/// Coordinates are floats, so that shared planes are shared bit by bit, here, in a ray caster and on a GPU.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "world/base/errors.h"
#include "world/blocks/block.h"
#include "world/space/world_point.h"

namespace world {

constexpr int kAlways = -1;  // in place of a Face: whatever is beside
constexpr size_t kMostProxyParts = 32;

struct ProxyBox {
  Vec3f low{0}, high{1};
  int joins = kAlways;  // the Face towards the neighbour that must join
};

/// A parallelogram; |u x v| > 0.
struct ProxyQuad {
  Vec3f corner{0}, u{0}, v{0};
  int joins = kAlways;
};

struct Proxy {
  std::string name, what;
  std::vector<ProxyBox> boxes;
  std::vector<ProxyQuad> quads;
  int borne_by = kAlways;  // a Face; kAlways: it needs none
  bool passable = false;

  bool stops_bodies() const { return !passable && !boxes.empty(); }

  // Derived by finish() from the parts.
  uint8_t may_join = 0;  // bit f: some part is there only where Face f joins
  struct Bounds {
    Vec3f low, high;  // of all parts; 2^-12 wider where those are flat, so that rounding loses no quad
  };
  std::vector<Bounds> bounds;  // by joins, 64
  struct Frame {
    Vec3d normal, along_u, along_v;  // normal = u x v; p - corner has the coordinates dot(p, along_u), dot(p, along_v)
  };
  std::vector<Frame> frames;  // by quad

  void finish();
  static bool has_part(int part_joins, uint8_t joins) { return part_joins == kAlways || (joins >> part_joins & 1); }
};

/// All shapes of world/proxies, sorted by name.
std::span<const Proxy> proxies();
/// Null where there is none of that name.
const Proxy* find_proxy(std::string_view name);
Result<Proxy> read_proxy(const std::string& name, std::string_view text, const std::string& file_name);

/// What stands in the voxels of a palette's blocks.
struct BlockShapes {
  std::vector<const Proxy*> shape;  // by block id; null: the cube
  std::vector<uint8_t> fills;       // by block id; 1: a cube that lets no light through

  /// Whether a shape reaches to a neighbour of this block: one of the same shape, or one that fills its voxel.
  bool joins(const Proxy& proxy, BlockId neighbour) const {
    return shape[neighbour] == &proxy || (fills[neighbour] != 0);
  }
  /// Bit f: the neighbour across Face f joins. `block_at(VoxelPos)` gives a BlockId; it is asked only for sides on
  /// which the shape may join anything.
  template <class BlockAt>
  uint8_t joins_at(const Proxy& proxy, VoxelPos voxel, BlockAt block_at) const {
    uint8_t all = 0;
    for (int f = 0; f < kFaces; ++f)
      if ((proxy.may_join >> f & 1) && joins(proxy, block_at(voxel + face_step(f))))
        all = static_cast<uint8_t>(all | 1 << f);
    return all;
  }
};
/// Fails where a block names a proxy that there is none of; the message names both, where that stands, and the nearest
/// name there is.
Status check_proxies(const BlockPalette& palette);
/// Fails where check_proxies() does.
Result<BlockShapes> block_shapes(const BlockPalette& palette);

/// One face of the shape as it is with these joins: corners counter-clockwise seen from its front; a quad has one face.
struct ProxyFace {
  Vec3f corner[4];
};
std::vector<ProxyFace> proxy_faces(const Proxy& proxy, uint8_t joins);
/// m^2 that a shape shows where it joins nothing; sheets on both sides.
double shown_area(const Proxy& proxy);

}  // namespace world
