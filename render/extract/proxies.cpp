#include "render/extract/proxies.h"

#include <algorithm>
#include <bit>

#include <glm/geometric.hpp>

#include "world/base/jobs.h"

namespace render {

using namespace world;

struct ShapeExtractor::Chunk : ShapeChunk {
  std::map<int, LeafShapes> leaves;  // by index_in_chunk, so that the order of records doesn't depend on history
};

namespace {

/// Whether a face of a shape lies in the side of its voxel that it looks at.
bool lies_in_side(const ShapeQuad& quad) {
  if (quad.direction == kBothSides) return false;
  return quad.corner[face_axis(quad.direction)] == (face_sign(quad.direction) > 0 ? 1.0f : 0.0f);
}

int direction_of(const Vec3f& normal) {
  for (int f = 0; f < kFaces; ++f)
    if (normal[face_axis(f)] == static_cast<float>(face_sign(f))) return f;
  return kBothSides;
}

/// Two sheets along the diagonals of what the shape takes up: what stands for it as a billboard.
std::vector<ProxyFace> crossed_sheets(const Proxy& proxy, uint8_t joins) {
  const Proxy::Bounds& b = proxy.bounds[joins];
  const Vec3f low = max(b.low, Vec3f(0)), high = min(b.high, Vec3f(1));
  return {{{{low.x, low.y, low.z}, {high.x, low.y, high.z}, {high.x, high.y, high.z}, {low.x, high.y, low.z}}},
          {{{low.x, low.y, high.z}, {high.x, low.y, low.z}, {high.x, high.y, low.z}, {low.x, high.y, high.z}}}};
}

LeafPos beside(LeafPos l, int face) {
  const VoxelPos s = face_step(face);
  return {l.x + s.x, l.y + s.y, l.z + s.z};
}

}  // namespace

ShapeExtractor::ShapeExtractor() = default;
ShapeExtractor::~ShapeExtractor() = default;

/// Voxels that have a shape.
LeafMask ShapeExtractor::scan(const LeafBlocks& blocks) const {
  if (!blocks.values) return shapes_.shape[blocks.uniform] ? kAllMask : kNoneMask;
  LeafMask mask;
  for (int x = 0; x < kLeafSize; ++x) {
    uint64_t bits = 0;
    for (int i = 0; i < 64; ++i) bits |= uint64_t{shapes_.shape[blocks.values[x * 64 + i]] != nullptr} << i;
    mask.word[x] = bits;
  }
  return mask;
}

ShapeExtractor::LeafShapes ShapeExtractor::shapes_of(StoreReader& reader, LeafPos leaf) const {
  const LeafBlocks blocks = reader.leaf(leaf);
  const LeafMask mask = scan(blocks);
  LeafShapes found;
  const VoxelPos corner = voxel_from_leaf(leaf);
  for (int x = 0; x < kLeafSize; ++x)
    for (uint64_t bits = mask.word[x]; bits; bits &= bits - 1) {
      const int index = x * 64 + std::countr_zero(bits);
      const VoxelPos voxel = corner + offset_in_leaf(index);
      Instance made{static_cast<uint16_t>(index), blocks[index], 0, 0};
      const Proxy& proxy = *shapes_.shape[made.block];
      for (int f = 0; f < kFaces; ++f) {
        const VoxelPos next = voxel + face_step(f);
        const BlockId id = leaf_from_voxel(next) == leaf ? blocks[index_in_leaf(next)] : reader.get(next);
        const auto bit = static_cast<uint8_t>(1 << f);
        if (shapes_.fills[id]) made.hidden = static_cast<uint8_t>(made.hidden | bit);
        if ((proxy.may_join & bit) && shapes_.joins(proxy, id)) made.joins = static_cast<uint8_t>(made.joins | bit);
      }
      found.push_back(made);
    }
  return found;
}

ShapeExtractor::Kind ShapeExtractor::kind_of(const Instance& instance) {
  const auto [found, fresh] = kinds_.try_emplace({instance.block, instance.joins});
  if (!fresh) return found->second;
  const Proxy& proxy = *shapes_.shape[instance.block];
  Kind& kind = found->second;
  kind.first = static_cast<uint32_t>(quads_.size());
  const bool billboard = kind_ == ProxyShapes::billboard;
  const auto faces = billboard ? crossed_sheets(proxy, instance.joins) : proxy_faces(proxy, instance.joins);
  double area = shown_area(proxy);
  if (billboard) {
    area = 0;
    for (const ProxyFace& f : faces)
      area += 2 * double{glm::length(glm::cross(f.corner[1] - f.corner[0], f.corner[3] - f.corner[0]))};
  }
  size_t box_faces = 0;  // the first ones
  if (!billboard)
    for (const ProxyBox& box : proxy.boxes) box_faces += Proxy::has_part(box.joins, instance.joins) ? kFaces : 0;
  for (size_t i = 0; i < faces.size(); ++i) {
    const ProxyFace& f = faces[i];
    ShapeQuad quad;
    quad.corner = f.corner[0], quad.u = f.corner[1] - f.corner[0], quad.v = f.corner[3] - f.corner[0];
    quad.normal = glm::normalize(glm::cross(quad.u, quad.v));
    quad.block = instance.block;
    quad.direction = i < box_faces ? direction_of(quad.normal) : kBothSides;
    quad.emission = static_cast<float>(6 / area);
    quads_.push_back(quad);
  }
  kind.count = static_cast<uint32_t>(faces.size());
  quads_[kind.first].faces = kind.count;
  return kind;
}

uint32_t ShapeExtractor::first_quad_at(StoreReader& reader, VoxelPos voxel, BlockId block) const {
  const Proxy* const shape = shapes_.shape[block];
  if (!shape) return UINT32_MAX;
  return first_quad(block, shapes_.joins_at(*shape, voxel, [&](VoxelPos v) { return reader.get(v); }));
}

void ShapeExtractor::make_records(Chunk& chunk) {
  std::vector<FaceRecord> by_direction[kShapeDirections];
  chunk.bounds = {};
  chunk.instances.clear();
  for (const auto& [leaf, instances] : chunk.leaves) {
    const VoxelPos low{(leaf >> 6) * 8, (leaf >> 3 & 7) * 8, (leaf & 7) * 8};
    for (const Instance& instance : instances) {
      const VoxelPos at = low + offset_in_leaf(instance.voxel);
      const Kind kind = kind_of(instance);
      for (uint32_t q = kind.first; q < kind.first + kind.count; ++q) {
        const ShapeQuad& quad = quads_[q];
        // What touches a cube that lets no light through, or goes on in the shape beyond, is never seen.
        if (lies_in_side(quad) && ((instance.hidden | instance.joins) >> quad.direction & 1)) continue;
        by_direction[quad.direction].push_back({static_cast<uint32_t>(at.z | at.y << 6 | at.x << 12), q});
      }
      const auto corner = [](int c) { return static_cast<uint8_t>(c); };
      chunk.bounds.include(
          {{corner(at.x), corner(at.y), corner(at.z)}, {corner(at.x + 1), corner(at.y + 1), corner(at.z + 1)}});
      chunk.instances.push_back({static_cast<uint32_t>(at.z | at.y << 6 | at.x << 12), kind.first});
    }
  }
  chunk.records.clear();
  for (size_t d = 0; d < kShapeDirections; ++d) {
    chunk.first[d] = static_cast<uint32_t>(chunk.records.size());
    chunk.records.insert(chunk.records.end(), by_direction[d].begin(), by_direction[d].end());
  }
  chunk.first[kShapeDirections] = static_cast<uint32_t>(chunk.records.size());
  chunk.version = next_version_++;
}

void ShapeExtractor::set_masks(const WorldView& view, LeafPos leaf, const LeafMask& shapes) {
  const auto without = [&](const MaskVolume& whole, MaskVolume& cubes) {
    LeafMask mask = whole.leaf(leaf);
    for (int x = 0; x < kLeafSize; ++x) mask.word[x] &= ~shapes.word[x];
    if (!(mask == cubes.leaf(leaf))) cubes.set_leaf(leaf, mask);
  };
  without(view.masks(MaskKind::occupied), occupied_);
  if (any_opaque_) without(view.masks(MaskKind::opaque), opaque_);
}

void ShapeExtractor::sort_chunks() {
  sorted_.clear();
  instances_ = 0;
  for (const auto& [pos, chunk] : chunks_) sorted_.push_back(chunk.get()), instances_ += chunk->instances.size();
  std::sort(sorted_.begin(), sorted_.end(), [](auto* a, auto* b) { return a->pos < b->pos; });
}

Status ShapeExtractor::rebuild(const WorldView& view, ProxyShapes kind) {
  kind_ = kind;
  ++rebuilds_;
  chunks_.clear(), quads_.clear(), kinds_.clear();
  occupied_ = {}, opaque_ = {};
  TRY(shapes_, block_shapes(view.palette()));
  const auto has_shapes = [&](const Census& census) {
    return std::any_of(census.begin(), census.end(), [&](const auto& row) { return shapes_.shape[row.first]; });
  };
  any_opaque_ = false;
  const Census census = view.store().census();
  for (const auto& row : census)
    if (shapes_.shape[row.first] && view.palette()[row.first].opaque) any_opaque_ = true;
  if (kind == ProxyShapes::cube || !has_shapes(census)) {
    sort_chunks();
    return {};
  }

  // Which leaves, by region; then what stands in them.
  const MaskVolume& occupied = view.masks(MaskKind::occupied);
  const std::vector<const MaskRegion*> regions = occupied.regions();
  std::vector<std::vector<std::pair<LeafPos, LeafShapes>>> found(regions.size());
  parallel_ranges(regions.size(), 1, [&](size_t begin, size_t end) {
    StoreReader reader(view.store());
    for (size_t r = begin; r < end; ++r) {
      if (!has_shapes(view.store().region_census(regions[r]->pos))) continue;
      for (int i = 0; i < kLeavesPerRegion; ++i) {
        const LeafPos leaf = leaf_from_region(regions[r]->pos) + leaf_offset_in_region(i);
        if (!regions[r]->leaf_any(leaf)) continue;
        if (LeafShapes shapes = shapes_of(reader, leaf); !shapes.empty())
          found[r].emplace_back(leaf, std::move(shapes));
      }
    }
  });
  for (const MaskRegion* region : regions) occupied_.put_region(region->pos, std::make_unique<MaskRegion>(*region));
  occupied_.finish();
  if (any_opaque_) {
    for (const MaskRegion* region : view.masks(MaskKind::opaque).regions())
      opaque_.put_region(region->pos, std::make_unique<MaskRegion>(*region));
    opaque_.finish();
  }
  for (auto& region : found)
    for (auto& [leaf, shapes] : region) {
      LeafMask mask;
      for (const Instance& i : shapes) mask.set(i.voxel);
      set_masks(view, leaf, mask);
      std::unique_ptr<Chunk>& chunk = chunks_[chunk_from_leaf(leaf)];
      if (!chunk) {
        chunk = std::make_unique<Chunk>();
        chunk->pos = chunk_from_leaf(leaf);
        chunk->origin = voxel_from_chunk(chunk->pos);
      }
      chunk->leaves[index_in_chunk(leaf)] = std::move(shapes);
    }
  sort_chunks();
  for (const ShapeChunk* chunk : sorted_) make_records(*chunks_[chunk->pos]);
  sort_chunks();
  return {};
}

Status ShapeExtractor::update(const WorldView& view, std::span<const LeafPos> dirty) {
  if (kind_ == ProxyShapes::cube || dirty.empty()) return {};
  StoreReader reader(view.store());
  if (view.palette().size() != shapes_.shape.size()) return rebuild(view, kind_);
  if (!any() || !any_opaque_)
    for (const LeafPos leaf : dirty) {
      const LeafBlocks blocks = reader.leaf(leaf);
      const LeafMask mask = scan(blocks);
      if (mask.is_none()) continue;
      // The first shape, or the first opaque one, needs masks that there are none of yet.
      bool opaque = false;
      for (int i = 0; i < kLeafVoxels && !any_opaque_; ++i) opaque |= mask.test(i) && view.palette()[blocks[i]].opaque;
      if (!any() || opaque) return rebuild(view, kind_);
    }
  if (!any()) return {};
  for (const LeafPos leaf : dirty) set_masks(view, leaf, scan(reader.leaf(leaf)));
  std::vector<LeafPos> leaves;
  for (const LeafPos leaf : dirty) {
    leaves.push_back(leaf);
    for (int f = 0; f < kFaces; ++f) leaves.push_back(beside(leaf, f));  // joins
  }
  std::sort(leaves.begin(), leaves.end());
  leaves.erase(std::unique(leaves.begin(), leaves.end()), leaves.end());
  std::vector<Chunk*> changed;
  for (const LeafPos leaf : leaves) {
    LeafShapes shapes = shapes_of(reader, leaf);
    const auto found = chunks_.find(chunk_from_leaf(leaf));
    const int index = index_in_chunk(leaf);
    if (found == chunks_.end() ? shapes.empty() : shapes.empty() && !found->second->leaves.contains(index)) continue;
    std::unique_ptr<Chunk>& chunk = chunks_[chunk_from_leaf(leaf)];
    if (!chunk) {
      chunk = std::make_unique<Chunk>();
      chunk->pos = chunk_from_leaf(leaf);
      chunk->origin = voxel_from_chunk(chunk->pos);
    }
    if (shapes.empty())
      chunk->leaves.erase(index);
    else
      chunk->leaves[index] = std::move(shapes);
    changed.push_back(chunk.get());
  }
  std::sort(changed.begin(), changed.end(), [](auto* a, auto* b) { return a->pos < b->pos; });
  changed.erase(std::unique(changed.begin(), changed.end()), changed.end());
  for (Chunk* chunk : changed) {
    if (chunk->leaves.empty())
      chunks_.erase(ChunkPos(chunk->pos));
    else
      make_records(*chunk);
  }
  if (!changed.empty()) sort_chunks();
  return {};
}

bool ShapeExtractor::has_shape(VoxelPos v) const {
  const auto found = chunks_.find(chunk_from_voxel(v));
  if (found == chunks_.end()) return false;
  const LeafPos leaf = leaf_from_voxel(v);
  const auto shapes = found->second->leaves.find(index_in_chunk(leaf));
  if (shapes == found->second->leaves.end()) return false;
  const int index = index_in_leaf(v);
  return std::any_of(shapes->second.begin(), shapes->second.end(), [&](const Instance& i) { return i.voxel == index; });
}

}  // namespace render
