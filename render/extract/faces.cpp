#include "render/extract/faces.h"

#include <algorithm>

#include "render/extract/kernels.h"

namespace render {

using namespace world;

bool LeafFaces::is_none() const {
  uint64_t any = 0;
  for (const LeafMask& mask : face)
    for (uint64_t word : mask.word) any |= word;
  return any == 0;
}

int LeafFaces::count() const { return static_cast<int>(count_faces(this, 1)); }

void ChunkFaces::clear() {
  slot.fill(kNone);
  leaf.clear();
}

bool ChunkFaces::set(int index, const LeafFaces& value) {
  const uint16_t old = slot[index];
  if (value.is_none()) {
    if (old == kNone) return false;
    // Fill the gap with the last one.
    faces[old] = faces[leaf.size() - 1];
    leaf[old] = leaf.back();
    slot[leaf[old]] = old;
    slot[index] = kNone;
    leaf.pop_back();
    return true;
  }
  if (old == kNone) {
    slot[index] = static_cast<uint16_t>(leaf.size());
    if (faces.size() == leaf.size()) faces.emplace_back();
    faces[leaf.size()] = value;
    leaf.push_back(static_cast<uint16_t>(index));
    return true;
  }
  if (faces[old] == value) return false;
  faces[old] = value;
  return true;
}

uint64_t ChunkFaces::count() const { return count_faces(faces.data(), leaf.size()); }

namespace {

const MaskRegion kEmptyRegion{};

/// A region of a volume and its six neighbours: leaves of the region and one beyond each side are found without
/// another look-up.
class RegionStar {
 public:
  RegionStar(const MaskVolume& volume, RegionPos pos) : origin_(leaf_from_region(pos)) {
    const auto get = [&](RegionPos p) {
      const MaskRegion* r = volume.region(p);
      return r ? r : &kEmptyRegion;
    };
    for (int f = 0; f < kFaces; ++f) {
      const VoxelPos s = face_step(f);
      beside_[f] = get({pos.x + s.x, pos.y + s.y, pos.z + s.z});
    }
    self_ = get(pos);
  }
  const MaskRegion& self() const { return *self_; }
  /// As MaskRegion::leaf, without branches: at a surface they are guessed wrong.
  const LeafMask& leaf(LeafPos l) const {
    static const LeafMask kUniform[2] = {kNoneMask, kAllMask};
    const MaskRegion& r = at(l.x - origin_.x, l.y - origin_.y, l.z - origin_.z);
    const int group = leaf_group(l), bit = leaf_group_bit(l);
    const uint64_t any = r.any[group] >> bit & 1, full = r.full[group] >> bit & 1;
    const auto mixed =
        reinterpret_cast<uintptr_t>(r.masks.data()) + size_t{r.slot[index_in_region(l)]} * sizeof(LeafMask);
    const auto uniform = reinterpret_cast<uintptr_t>(&kUniform[full]);
    return *reinterpret_cast<const LeafMask*>(uniform ^ ((mixed ^ uniform) & (0 - (any & ~full))));
  }
  /// `full` of the group of 4^3 leaves at (x, y, z), each -1..4 and at most one of them outside 0..3.
  uint64_t full(int x, int y, int z) const { return at(x * 4, y * 4, z * 4).full[group(x, y, z)]; }
  uint64_t any(int x, int y, int z) const { return at(x * 4, y * 4, z * 4).any[group(x, y, z)]; }

 private:
  static int group(int x, int y, int z) { return (x & 3) << 4 | (y & 3) << 2 | (z & 3); }
  // x, y, z in leaves, relative to the region
  const MaskRegion& at(int x, int y, int z) const {
    if (((x | y | z) & ~15) == 0) return *self_;
    if (x < 0) return *beside_[kFaceNegX];
    if (x > 15) return *beside_[kFacePosX];
    if (y < 0) return *beside_[kFaceNegY];
    if (y > 15) return *beside_[kFacePosY];
    return *beside_[z < 0 ? kFaceNegZ : kFacePosZ];
  }
  LeafPos origin_;
  const MaskRegion* self_;
  const MaskRegion* beside_[kFaces];
};

LeafPos beside(LeafPos l, int face) {
  const VoxelPos s = face_step(face);
  return {l.x + s.x, l.y + s.y, l.z + s.z};
}

LeafNeighbourhood neighbourhood(const RegionStar& star, LeafPos l) {
  LeafNeighbourhood n;
  n.self = &star.leaf(l);
  for (int f = 0; f < kFaces; ++f) n.neighbour[f] = &star.leaf(beside(l, f));
  return n;
}

/// Leaves of a group all of whose neighbours are full: bit (x*4 + y)*4 + z.
uint64_t all_neighbours_full(const RegionStar& star, int x, int y, int z) {
  const uint64_t f = star.full(x, y, z);
  constexpr uint64_t kZ0 = 0x1111111111111111ull, kY0 = 0x000f000f000f000full;
  uint64_t inside = (f << 16 | star.full(x - 1, y, z) >> 48) & (f >> 16 | star.full(x + 1, y, z) << 48);
  inside &= (f << 4 & ~kY0) | (star.full(x, y - 1, z) >> 12 & kY0);
  inside &= (f >> 4 & ~(kY0 << 12)) | (star.full(x, y + 1, z) & kY0) << 12;
  inside &= (f << 1 & ~kZ0) | (star.full(x, y, z - 1) >> 3 & kZ0);
  inside &= (f >> 1 & ~(kZ0 << 3)) | (star.full(x, y, z + 1) & kZ0) << 3;
  return inside;
}

/// What lies one step towards `face` of each voxel: bit i of the result is the bit of i's neighbour.
LeafMask seen_towards(int face, const LeafMask& self, const LeafMask& next) {
  constexpr uint64_t kZ0 = 0x0101010101010101ull;
  LeafMask m;
  for (int x = 0; x < 8; ++x) {
    const uint64_t s = self.word[x], n = next.word[x];
    switch (face) {
      case kFaceNegX:
        m.word[x] = x == 0 ? next.word[7] : self.word[x - 1];
        break;
      case kFacePosX:
        m.word[x] = x == 7 ? next.word[0] : self.word[x + 1];
        break;
      case kFaceNegY:
        m.word[x] = s << 8 | n >> 56;
        break;
      case kFacePosY:
        m.word[x] = s >> 8 | n << 56;
        break;
      case kFaceNegZ:
        m.word[x] = (s & ~(kZ0 << 7)) << 1 | (n >> 7 & kZ0);
        break;
      default:
        m.word[x] = (s & ~kZ0) >> 1 | (n & kZ0) << 7;
        break;
    }
  }
  return m;
}

constexpr int kIndexStep[3] = {64, 8, 1};

/// Leaves in `touching` the voxels whose neighbour towards `face` is transparent with a smaller id.
void keep_larger_ids(LeafMask& touching, int face, const LeafBlocks& self, const LeafBlocks& next,
                     const LeafMask* equal) {
  const int axis = face_axis(face), step = kIndexStep[axis] * face_sign(face);
  const int border = face_sign(face) > 0 ? 7 : 0;
  if (!self.values && !next.values && self.uniform == next.uniform) {
    touching = LeafMask::none();
    return;
  }
  for (int x = 0; x < 8; ++x) {
    uint64_t bits = touching.word[x];
    if (equal) bits &= ~equal->word[x];
    uint64_t kept = 0;
    for (; bits != 0; bits &= bits - 1) {
      const int i = x << 6 | __builtin_ctzll(bits);
      const bool leaves = offset_in_leaf(i)[axis] == border;
      const BlockId beside_id = leaves ? next[i + step - 8 * step] : self[i + step];
      if (self[i] > beside_id) kept |= bits & -bits;
    }
    touching.word[x] = kept;
  }
}

/// Clears all but the layer of voxels next to the leaf beyond `face`.
void keep_border(int face, LeafMask& mask) {
  constexpr uint64_t kBorder[kFaces] = {
      ~0ull, ~0ull, 0xff, 0xffull << 56, 0x0101010101010101ull, 0x8080808080808080ull};
  for (int x = 0; x < 8; ++x)
    mask.word[x] &= (face == kFaceNegX && x != 0) || (face == kFacePosX && x != 7) ? 0 : kBorder[face];
}

/// Voxels of blocks that are left out.
LeafMask left_out_of(const LeafBlocks& blocks, std::span<const uint8_t> left_out) {
  if (!blocks.values) return left_out[blocks.uniform] ? kAllMask : kNoneMask;
  LeafMask mask;
  for (int i = 0; i < kLeafVoxels; ++i)
    if (left_out[blocks.values[i]]) mask.set(i);
  return mask;
}

/// Takes the faces of voxels that are left out away, and leaves in `touching` only pairs of voxels that are not:
/// a face towards one that is left out is seen.
void leave_out(const LeafBlocks& self, StoreReader& reader, LeafPos leaf, std::span<const uint8_t> left_out,
               LeafFaces& faces, LeafFaces& touching) {
  const LeafMask gone = left_out_of(self, left_out);
  for (int f = 0; f < kFaces; ++f) {
    LeafMask& touches = touching.face[f];
    for (int x = 0; x < 8; ++x) faces.face[f].word[x] &= ~gone.word[x], touches.word[x] &= ~gone.word[x];
    if (touches.is_none()) continue;
    const LeafMask seen = seen_towards(f, gone, left_out_of(reader.leaf(beside(leaf, f)), left_out));
    for (int x = 0; x < 8; ++x) {
      faces.face[f].word[x] |= touches.word[x] & seen.word[x];
      touches.word[x] &= ~seen.word[x];
    }
  }
}

/// Adds the faces of a leaf's transparent voxels.
void add_transparent_faces(const LeafNeighbourhood& occupied, const LeafNeighbourhood& opaque, StoreReader* reader,
                           LeafPos leaf, std::span<const uint8_t> left_out, LeafFaces& faces) {
  LeafFaces touching;
  const LeafFaces of_opaque = faces;
  const bool touch = transparent_faces(occupied, opaque, faces, touching);
  if (!touch && left_out.empty()) return;
  CHECK(reader != nullptr);
  const LeafBlocks self = reader->leaf(leaf);
  if (!left_out.empty()) {
    // Water and glass are most of what isn't opaque.
    if (!self.values && left_out[self.uniform]) {
      faces = of_opaque;
      return;
    }
    leave_out(self, *reader, leaf, left_out, faces, touching);
  }
  LeafBlocks next[kFaces];
  for (int f = 0; f < kFaces; ++f) {
    LeafMask& touches = touching.face[f];
    if (!self.values) keep_border(f, touches);
    if (!touches.is_none()) next[f] = reader->leaf(beside(leaf, f));
  }
  // Most voxels touch their own kind: those are taken out many at a time.
  LeafMask equal[3];
  if (self.values) {
    const BlockId* const ids[3] = {next[1].values, next[3].values, next[5].values};
    equal_neighbours(self.values, ids, equal);
  }
  for (int f = 0; f < kFaces; ++f) {
    LeafMask& touches = touching.face[f];
    if (touches.is_none()) continue;
    const LeafMask equal_below = face_sign(f) < 0 ? seen_towards(f, equal[face_axis(f)], kNoneMask) : LeafMask{};
    const LeafMask& same = face_sign(f) < 0 ? equal_below : equal[face_axis(f)];
    keep_larger_ids(touches, f, self, next[f], self.values ? &same : nullptr);
    for (int x = 0; x < 8; ++x) faces.face[f].word[x] |= touches.word[x];
  }
}

/// As !=, without a branch a word.
bool differ(const LeafMask& a, const LeafMask& b) {
  uint64_t different = 0;
  for (int x = 0; x < 8; ++x) different |= a.word[x] ^ b.word[x];
  return different != 0;
}

/// The volumes around one region.
struct Stars {
  Stars(const FaceSource& source, RegionPos pos)
      : occupied(*source.occupied, pos),
        opaque(*source.opaque, pos),
        sealed(source.sealed ? *source.sealed : *source.opaque, pos),
        has_transparent(source.occupied != source.opaque),
        has_sealed(source.sealed && !source.sealed->empty()),
        left_out(source.left_out) {}
  RegionStar occupied, opaque, sealed;
  bool has_transparent, has_sealed;
  std::span<const uint8_t> left_out;

  /// Adds to the opaque faces of a leaf what is left to do. True where that may have changed them.
  bool finish(StoreReader* reader, LeafPos leaf, const LeafNeighbourhood& around, LeafFaces& faces) const {
    const bool transparent = has_transparent && differ(occupied.leaf(leaf), *around.self);
    if (transparent) add_transparent_faces(neighbourhood(occupied, leaf), around, reader, leaf, left_out, faces);
    if (has_sealed) remove_faces_towards(neighbourhood(sealed, leaf), faces);
    return transparent || has_sealed;
  }
};

}  // namespace

uint64_t extract_chunk_faces(const FaceSource& source, StoreReader* reader, ChunkPos chunk, ChunkFaces& out) {
  out.clear();
  const RegionPos region{chunk.x >> 1, chunk.y >> 1, chunk.z >> 1};
  const Stars stars(source, region);
  uint64_t looked_at = 0;
  thread_local LeafNeighbourhood around[64];
  for (int g = 0; g < 8; ++g) {
    const int gx = (chunk.x & 1) * 2 + (g >> 2), gy = (chunk.y & 1) * 2 + (g >> 1 & 1),
              gz = (chunk.z & 1) * 2 + (g & 1);
    uint64_t todo = stars.occupied.any(gx, gy, gz);
    if (todo == 0) continue;
    // A voxel surrounded by opaque ones shows nothing, nor does a leaf in opaque leaves.
    todo &= ~all_neighbours_full(stars.opaque, gx, gy, gz) | ~stars.opaque.full(gx, gy, gz);
    const LeafPos first{region.x * 16 + gx * 4, region.y * 16 + gy * 4, region.z * 16 + gz * 4};
    LeafPos leaves[64];
    size_t count = 0;
    for (; todo != 0; todo &= todo - 1, ++count) {
      const int bit = __builtin_ctzll(todo);
      leaves[count] = {first.x + (bit >> 4), first.y + (bit >> 2 & 3), first.z + (bit & 3)};
      around[count] = neighbourhood(stars.opaque, leaves[count]);
    }
    const size_t begin = out.leaf.size();
    if (out.faces.size() < begin + count) out.faces.resize(begin + count);
    const uint64_t not_none = opaque_faces(around, count, out.faces.data() + begin);
    for (size_t i = 0; i < count; ++i) {
      LeafFaces& faces = out.faces[begin + i];
      const bool changed = stars.finish(reader, leaves[i], around[i], faces);
      if (changed ? faces.is_none() : !(not_none >> i & 1)) continue;
      const size_t kept = out.leaf.size();
      if (kept != begin + i) out.faces[kept] = faces;
      const int index = index_in_chunk(leaves[i]);
      out.slot[index] = static_cast<uint16_t>(kept);
      out.leaf.push_back(static_cast<uint16_t>(index));
    }
    looked_at += count;
  }
  return looked_at;
}

LeafFaces extract_leaf_faces(const FaceSource& source, StoreReader* reader, LeafPos leaf) {
  const Stars stars(source, region_from_leaf(leaf));
  const LeafNeighbourhood around = neighbourhood(stars.opaque, leaf);
  LeafFaces faces;
  opaque_faces(&around, 1, &faces);
  stars.finish(reader, leaf, around, faces);
  return faces;
}

void add_skirts(const MaskVolume& opaque, LeafPos leaf, LeafFaces& faces) {
  const int at[3] = {leaf.x & 7, leaf.y & 7, leaf.z & 7};
  LeafMask near;
  for (int x = 0; x < 8; ++x)
    for (int f = 0; f < kFaces; ++f) near.word[x] |= faces.face[f].word[x];
  if (near.is_none()) return;
  for (int step = 0; step < 2; ++step) {
    LeafMask grown;
    for (int x = 0; x < 8; ++x) {
      const uint64_t w = near.word[x];
      grown.word[x] = w | w << 8 | w >> 8 | (w << 1 & ~0x0101010101010101ull) | (w >> 1 & ~0x8080808080808080ull) |
                      (x > 0 ? near.word[x - 1] : 0) | (x < 7 ? near.word[x + 1] : 0);
    }
    near = grown;
  }
  const LeafMask& solid = opaque.leaf(leaf);
  for (int f = 0; f < kFaces; ++f) {
    if (at[face_axis(f)] != (face_sign(f) < 0 ? 0 : 7)) continue;
    LeafMask skirt;
    for (int x = 0; x < 8; ++x) skirt.word[x] = near.word[x] & solid.word[x];
    keep_border(f, skirt);
    for (int x = 0; x < 8; ++x) faces.face[f].word[x] |= skirt.word[x];
  }
}

std::vector<ChunkPos> occupied_chunks(const MaskVolume& occupied) {
  std::vector<ChunkPos> chunks;
  for (const MaskRegion* region : occupied.regions()) {
    for (int c = 0; c < 8; ++c) {
      const int x = (c >> 2) * 2, y = (c >> 1 & 1) * 2, z = (c & 1) * 2;
      uint64_t any = 0;
      for (int g = 0; g < 8; ++g) any |= region->any[(x + (g >> 2)) << 4 | (y + (g >> 1 & 1)) << 2 | (z + (g & 1))];
      if (any)
        chunks.push_back({region->pos.x * 2 + (c >> 2), region->pos.y * 2 + (c >> 1 & 1), region->pos.z * 2 + (c & 1)});
    }
  }
  std::sort(chunks.begin(), chunks.end());
  return chunks;
}

FaceTotals count_visible_faces(const FaceSource& source) {
  FaceTotals totals;
  std::unique_ptr<StoreReader> reader;
  if (source.store) reader = std::make_unique<StoreReader>(*source.store);
  ChunkFaces faces;
  for (const ChunkPos chunk : occupied_chunks(*source.occupied)) {
    totals.leaves += extract_chunk_faces(source, reader.get(), chunk, faces);
    totals.faces += faces.count();
    totals.voxels_dense += uint64_t{kChunkSize} * kChunkSize * kChunkSize;
  }
  return totals;
}

}  // namespace render
