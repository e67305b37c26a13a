#include "render/extract/greedy.h"

#include <algorithm>
#include <deque>
#include <memory>

#include "render/extract/kernels.h"

namespace render {

using namespace world;

void CornerBox::include(const CornerBox& other) {
  for (int a = 0; a < 3; ++a) {
    min[a] = std::min(min[a], other.min[a]);
    max[a] = std::max(max[a], other.max[a]);
  }
}

namespace {

/// Where each direction finds its planes. Faces of x and y share rows of z bits at [x][y]; faces of z have rows of y
/// bits at [x][z].
///
///   direction  plane  row  bit
///   x          x      y    z
///   y          y      x    z
///   z          z      x    y
struct Axes {
  int plane, row, bit;
  size_t plane_step, row_step;  // words
};
constexpr Axes kAxes[3] = {{0, 1, 2, kRowPitch, 1}, {1, 0, 2, 1, kRowPitch}, {2, 0, 1, 1, kRowPitch}};

constexpr size_t kPlanesWords = kChunkSize * kRowPitch;

struct Scratch {
  alignas(64) uint64_t faces[kFaces][kPlanesWords] = {};  // all zero between chunks: merging clears what it takes
  alignas(64) uint64_t along_bit[3][kPlanesWords];        // id equals that of the next bit; [0] serves x and y
  alignas(64) uint64_t along_row[3][kPlanesWords];        // id equals that of the same bit in the next row
  alignas(64) uint64_t rows[kFaces][kChunkSize] = {};     // bit: the row of that plane has faces
  std::array<const BlockId*, kLeavesPerChunk> ids;        // by index_in_chunk, of leaves with faces
  std::vector<std::array<LeafMask, 3>> equal;             // by slot
  std::deque<std::array<BlockId, kLeafVoxels>> uniform;   // 512 times one id
  size_t uniform_used = 0;
  std::vector<FaceRecord> records;

  const BlockId* uniform_ids(BlockId id) {
    for (size_t i = 0; i < uniform_used; ++i)
      if (uniform[i][0] == id) return uniform[i].data();
    if (uniform_used == uniform.size()) uniform.emplace_back();
    uniform[uniform_used].fill(id);
    return uniform[uniform_used++].data();
  }
};

/// Adds the eight rows' flags of one line of leaves: byte p of `flags` belongs to plane first_plane + p.
void add_rows(uint64_t* rows, int first_plane, int first_row, uint64_t flags) {
  for (int p = 0; p < 8; ++p) rows[first_plane + p] |= (flags >> (8 * p) & 255) << first_row;
}

/// Lays out faces and equalities of a line of eight leaves along z, for the faces of x and y.
void lay_line_z(const ChunkFaces& faces, const int slots[8], int lx, int ly, Scratch& s) {
  const LeafMask* line[8];
  const auto lay = [&](auto&& mask_of, uint64_t* planes) {
    for (int k = 0; k < 8; ++k) line[k] = slots[k] < 0 ? &kNoneMask : &mask_of(slots[k]);
    return rows_from_leaves(line, planes + static_cast<size_t>(lx) * 8 * kRowPitch + static_cast<size_t>(ly) * 8);
  };
  uint64_t any[4];
  for (int f = 0; f < 4; ++f) {
    any[f] = lay([&](int slot) -> const LeafMask& { return faces.faces[slot].face[f]; }, s.faces[f]);
    if (f < 2) {
      add_rows(s.rows[f], lx * 8, ly * 8, any[f]);
    } else {
      add_rows(s.rows[f], ly * 8, lx * 8, transpose_8x8(any[f]));
    }
  }
  if (any[0] | any[1] | any[2] | any[3])
    lay([&](int slot) -> const LeafMask& { return s.equal[slot][2]; }, s.along_bit[0]);
  if (any[0] | any[1]) lay([&](int slot) -> const LeafMask& { return s.equal[slot][1]; }, s.along_row[0]);
  if (any[2] | any[3]) lay([&](int slot) -> const LeafMask& { return s.equal[slot][0]; }, s.along_row[1]);
}

/// The same of a line of eight leaves along y, with y and z swapped, for the faces of z.
void lay_line_y(const ChunkFaces& faces, const int slots[8], int lx, int lz, Scratch& s) {
  LeafMask swapped[8];
  const LeafMask* line[8];
  const auto lay = [&](auto&& mask_of, uint64_t* planes) {
    uint64_t any = 0;
    for (int k = 0; k < 8; ++k) {
      line[k] = &kNoneMask;
      if (slots[k] < 0 || mask_of(slots[k]).is_none()) continue;
      swap_yz(mask_of(slots[k]), swapped[k]);
      line[k] = &swapped[k];
      any = 1;
    }
    if (!any) return any;
    return rows_from_leaves(line, planes + static_cast<size_t>(lx) * 8 * kRowPitch + static_cast<size_t>(lz) * 8);
  };
  uint64_t any = 0;
  for (int f = 4; f < 6; ++f) {
    const uint64_t flags = lay([&](int slot) -> const LeafMask& { return faces.faces[slot].face[f]; }, s.faces[f]);
    add_rows(s.rows[f], lz * 8, lx * 8, transpose_8x8(flags));
    any |= flags;
  }
  if (!any) return;
  lay([&](int slot) -> const LeafMask& { return s.equal[slot][1]; }, s.along_bit[2]);
  lay([&](int slot) -> const LeafMask& { return s.equal[slot][0]; }, s.along_row[2]);
}

void gather(const ChunkFaces& faces, ChunkBlocks blocks, Scratch& s) {
  s.uniform_used = 0;
  s.equal.resize(faces.leaf.size());
  for (size_t i = 0; i < faces.leaf.size(); ++i)
    s.ids[faces.leaf[i]] = blocks[i].values ? blocks[i].values : s.uniform_ids(blocks[i].uniform);
  // Compare ids with those of the next voxels along x, y and z.
  for (size_t i = 0; i < faces.leaf.size(); ++i) {
    const int index = faces.leaf[i];
    const BlockId* next[3] = {};
    constexpr int kStep[3] = {64, 8, 1};
    for (int a = 0; a < 3; ++a)
      if (offset_in_leaf(index)[a] < 7 && faces.slot[index + kStep[a]] != ChunkFaces::kNone)
        next[a] = s.ids[index + kStep[a]];
    equal_neighbours(s.ids[index], next, s.equal[i].data());
  }
  // Lay leaves side by side to rows of 64 bits.
  for (int i = 0; i < 64; ++i) {
    int along_z[8], along_y[8];
    bool any_z = false, any_y = false;
    for (int k = 0; k < 8; ++k) {
      const uint16_t z = faces.slot[i * 8 + k], y = faces.slot[(i >> 3) * 64 + k * 8 + (i & 7)];
      along_z[k] = z == ChunkFaces::kNone ? -1 : z, any_z |= along_z[k] >= 0;
      along_y[k] = y == ChunkFaces::kNone ? -1 : y, any_y |= along_y[k] >= 0;
    }
    if (any_z) lay_line_z(faces, along_z, i >> 3, i & 7, s);
    if (any_y) lay_line_y(faces, along_y, i >> 3, i & 7, s);
  }
}

/// What a direction covers, in planes, rows and bits.
struct Extent {
  uint64_t rows = 0, bits = 0;
  int first_plane = kChunkSize, last_plane = -1;
  CornerBox box(int face) const {
    CornerBox box;
    if (last_plane < 0) return box;
    const Axes& axes = kAxes[face_axis(face)];
    const auto set = [&](int axis, int low, int high) {
      box.min[axis] = static_cast<uint8_t>(low), box.max[axis] = static_cast<uint8_t>(high);
    };
    set(axes.plane, first_plane + (face & 1), last_plane + (face & 1));
    set(axes.row, __builtin_ctzll(rows), 64 - __builtin_clzll(rows));
    set(axes.bit, __builtin_ctzll(bits), 64 - __builtin_clzll(bits));
    return box;
  }
};

/// Merges one plane, whose rows with faces are `rows`; clears it. Returns the end of the records written.
FaceRecord* merge_plane(Scratch& s, int face, int plane, FaceRecord* out, Extent& extent) {
  const int axis = face_axis(face);
  const Axes& axes = kAxes[axis];
  const size_t step = axes.row_step, begin = static_cast<size_t>(plane) * axes.plane_step;
  uint64_t* const bits = s.faces[face] + begin;
  const uint64_t* const along_bit = s.along_bit[axis == 2 ? 2 : 0] + begin;
  const uint64_t* const along_row = s.along_row[axis] + begin;
  const uint32_t plane_word = static_cast<uint32_t>(plane) << (6 * axes.plane);
  for (uint64_t rows = s.rows[face][plane]; rows != 0; rows &= rows - 1) {
    const int row = __builtin_ctzll(rows);
    const uint64_t here = bits[row * step];
    if (here == 0) continue;  // taken by a rectangle from above
    bits[row * step] = 0;
    extent.bits |= here;
    // Runs of equal ids: the first and the last bit of each.
    const uint64_t joined = along_bit[row * step] & here & (here >> 1);
    uint64_t firsts = here & ~(joined << 1), lasts = here & ~joined;
    for (; firsts != 0; firsts &= firsts - 1, lasts &= lasts - 1) {
      const uint64_t first = firsts & (0 - firsts), last = lasts & (0 - lasts);
      const uint64_t run = (last << 1) - first;
      int end = row + 1;
      for (; end < kChunkSize; ++end) {
        const uint64_t below = bits[end * step];
        if ((below & along_row[(end - 1) * step] & run) != run) break;
        bits[end * step] = below & ~run;
      }
      const int low = __builtin_ctzll(first), width = __builtin_ctzll(last) - low + 1;
      const uint32_t row_and_bit = static_cast<uint32_t>(row) << (6 * axes.row) | static_cast<uint32_t>(low)
                                                                                      << (6 * axes.bit);
      const uint32_t word0 = plane_word | row_and_bit;
      const uint32_t x = word0 & 63, y = word0 >> 6 & 63, z = word0 >> 12 & 63;
      const BlockId* ids = s.ids[(x >> 3) << 6 | (y >> 3) << 3 | z >> 3];
      out->word0 = word0 | static_cast<uint32_t>(width - 1) << 18 | static_cast<uint32_t>(end - row - 1) << 24;
      out->word1 = ids[(x & 7) << 6 | (y & 7) << 3 | (z & 7)] | static_cast<uint32_t>(face) << 16;
      ++out;
    }
  }
  return out;
}

}  // namespace

void merge_faces(const ChunkFaces& faces, ChunkBlocks blocks, ChunkRecords& out) {
  thread_local const std::unique_ptr<Scratch> scratch = std::make_unique<Scratch>();
  Scratch& s = *scratch;
  gather(faces, blocks, s);
  constexpr size_t kMostPerPlane = kChunkSize * kChunkSize;
  size_t used = 0;
  out.all_bounds = {};
  for (int f = 0; f < kFaces; ++f) {
    out.first[f] = static_cast<uint32_t>(used);
    Extent extent;
    for (int plane = 0; plane < kChunkSize; ++plane) {
      if (s.rows[f][plane] == 0) continue;
      extent.first_plane = std::min(extent.first_plane, plane), extent.last_plane = plane;
      extent.rows |= s.rows[f][plane];
      if (s.records.size() < used + kMostPerPlane) s.records.resize(2 * used + kMostPerPlane);
      used = static_cast<size_t>(merge_plane(s, f, plane, s.records.data() + used, extent) - s.records.data());
      s.rows[f][plane] = 0;
    }
    out.bounds[f] = extent.box(f);
    out.all_bounds.include(out.bounds[f]);
  }
  out.first[kFaces] = static_cast<uint32_t>(used);
  out.records.assign(s.records.begin(), s.records.begin() + static_cast<std::ptrdiff_t>(used));
  out.faces = faces.count();
}

void list_faces(const ChunkFaces& faces, ChunkBlocks blocks, ChunkRecords& out) {
  out.records.clear();
  out.all_bounds = {};
  for (int f = 0; f < kFaces; ++f) {
    out.first[f] = static_cast<uint32_t>(out.records.size());
    CornerBox& box = out.bounds[f];
    box = {};
    // Leaves in the order of their positions, whatever their slots.
    for (int index = 0; index < kLeavesPerChunk; ++index) {
      const uint16_t slot = faces.slot[index];
      if (slot == ChunkFaces::kNone) continue;
      const LeafMask& mask = faces.faces[slot].face[f];
      for (int word = 0; word < 8; ++word) {
        for (uint64_t bits = mask.word[word]; bits != 0; bits &= bits - 1) {
          const int i = word << 6 | __builtin_ctzll(bits);
          const VoxelPos leaf = offset_in_leaf(index), in_leaf = offset_in_leaf(i);
          uint32_t at[3];
          for (int a = 0; a < 3; ++a) {
            at[a] = static_cast<uint32_t>(leaf[a] * 8 + in_leaf[a]);
            const uint32_t low = at[a] + (a == face_axis(f) ? f & 1 : 0),
                           high = at[a] + (a == face_axis(f) ? f & 1 : 1);
            box.min[a] = static_cast<uint8_t>(std::min<uint32_t>(box.min[a], low));
            box.max[a] = static_cast<uint8_t>(std::max<uint32_t>(box.max[a], high));
          }
          out.records.push_back(make_face_record(at[0], at[1], at[2], 1, 1, static_cast<uint32_t>(f), blocks[slot][i]));
        }
      }
    }
    out.all_bounds.include(box);
  }
  out.first[kFaces] = static_cast<uint32_t>(out.records.size());
  out.faces = out.records.size();
}

}  // namespace render
