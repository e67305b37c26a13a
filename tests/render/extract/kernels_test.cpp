/// Each inner loop of extraction gives what a loop over single bits gives, at every SIMD level.

#include "render/extract/kernels.h"

#include <array>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "world/base/random.h"
#include "world/base/simd.h"

namespace render {
namespace {

using namespace world;

/// Dense, sparse, empty and full masks by turns.
LeafMask random_mask(int i, uint64_t stream) {
  LeafMask mask;
  for (int w = 0; w < 8; ++w) {
    const auto bits = [&](int k) { return random_bits(7, i, w, k, 0, stream); };
    const uint64_t word[6] = {bits(0), bits(0) & bits(1) & bits(2), bits(0) | bits(1) | bits(2), 0,
                              ~0ull,   bits(0) & ~bits(1)};
    mask.word[w] = word[i % 6];
  }
  return mask;
}

template <class Body>
void at_every_simd_level(Body body) {
  for (const SimdLevel& level : simd_levels()) {
    const SimdChoice choice(level);
    SCOPED_TRACE(level.name);
    body();
    if (testing::Test::HasFatalFailure()) return;
  }
}

TEST(ExtractKernels, FacesAreCounted) {
  at_every_simd_level([] {
    for (size_t count : {0u, 1u, 3u, 17u}) {
      std::vector<LeafFaces> faces(count);
      uint64_t expected = 0;
      auto* words = reinterpret_cast<uint64_t*>(faces.data());
      const size_t masks = count * sizeof(LeafFaces) / sizeof(LeafMask);
      for (size_t m = 0; m < masks; ++m) {
        const LeafMask mask = random_mask(static_cast<int>(m), 1);
        std::copy(mask.word, mask.word + 8, words + m * 8);
        expected += static_cast<uint64_t>(mask.count());
      }
      ASSERT_EQ(count_faces(faces.data(), count), expected);
    }
  });
}

TEST(ExtractKernels, EqualNeighboursAreThoseOfABruteForceLoop) {
  at_every_simd_level([] {
    for (int i = 0; i < 60; ++i) {
      const auto leaf_of_ids = [&](uint64_t stream) {
        std::array<BlockId, kLeafVoxels> ids;
        for (int v = 0; v < kLeafVoxels; ++v) {
          const uint64_t bits = random_bits(8, i, v, 0, 0, stream);
          // Few ids so that neighbours are often equal; ids that differ in the high byte only, too.
          ids[static_cast<size_t>(v)] = static_cast<BlockId>((bits & 1) | (bits >> 8 & 1) << 15);
        }
        return ids;
      };
      const auto ids = leaf_of_ids(0), x = leaf_of_ids(1), y = leaf_of_ids(2), z = leaf_of_ids(3);
      const BlockId* const next[3] = {i % 4 == 1 ? nullptr : x.data(), i % 4 == 2 ? nullptr : y.data(),
                                      i % 4 == 3 ? nullptr : z.data()};
      LeafMask out[3];
      equal_neighbours(ids.data(), next, out);
      for (int v = 0; v < kLeafVoxels; ++v)
        for (int axis = 0; axis < 3; ++axis) {
          VoxelPos neighbour = offset_in_leaf(v);
          const bool outside = ++neighbour[axis] == kLeafSize;
          const size_t index = static_cast<size_t>(index_in_leaf(neighbour));
          const bool equal = outside ? next[axis] && next[axis][index] == ids[static_cast<size_t>(v)]
                                     : ids[index] == ids[static_cast<size_t>(v)];
          ASSERT_EQ(out[axis].test(v), equal) << "leaf " << i << ", voxel " << v << ", axis " << axis;
        }
    }
  });
}

/// Random faces and equalities of a chunk; `leaves` of its 512 leaves have faces.
struct RandomChunk {
  ChunkFaces faces;
  std::vector<std::array<LeafMask, 3>> equal;
  RandomChunk(int seed, size_t leaves) {
    for (size_t n = 0; n < leaves; ++n) {
      const int index = static_cast<int>(random_bits(31, seed, static_cast<int64_t>(n), 0) % kLeavesPerChunk);
      LeafFaces value;
      for (int f = 0; f < kFaces; ++f) value.face[f] = random_mask(index + f + seed, 4);
      faces.set(index, value);
    }
    for (size_t n = 0; n < faces.leaf.size(); ++n) {
      const int i = static_cast<int>(n);
      equal.push_back({random_mask(i, 5), random_mask(i + 1, 6), random_mask(i + 2, 7)});
    }
  }
  const LeafMask (*masks() const)[3] { return reinterpret_cast<const LeafMask(*)[3]>(equal.data()); }
};

TEST(ExtractKernels, PlanesHoldEachBitOfTheLeavesAtItsPlace) {
  at_every_simd_level([] {
    for (const size_t leaves : {1u, 2u, 30u, 300u, 2000u}) {
      const RandomChunk chunk(static_cast<int>(leaves), leaves);
      const auto planes = std::make_unique<ChunkPlanes>();
      gather_planes(chunk.faces, chunk.masks(), *planes);
      uint64_t wrong = 0;
      for (int f = 0; f < kFaces; ++f) {
        const PlaneAxes& axes = kPlaneAxes[face_axis(f)];
        for (int plane = 0; plane < 64; ++plane)
          for (int row = 0; row < 64; ++row) {
            uint64_t bits = 0, along_bit = 0, along_row = 0;
            for (int bit = 0; bit < 64; ++bit) {
              VoxelPos v;
              v[axes.plane] = plane, v[axes.row] = row, v[axes.bit] = bit;
              const uint16_t slot =
                  chunk.faces.slot[static_cast<size_t>(index_in_leaf({v.x >> 3, v.y >> 3, v.z >> 3}))];
              if (slot == ChunkFaces::kNone) continue;
              const auto& equal = chunk.equal[slot];
              bits |= uint64_t{chunk.faces.faces[slot].face[f].test(v)} << bit;
              along_bit |= uint64_t{equal[static_cast<size_t>(axes.bit)].test(v)} << bit;
              along_row |= uint64_t{equal[static_cast<size_t>(axes.row)].test(v)} << bit;
            }
            const size_t at = static_cast<size_t>(plane) * axes.plane_step + static_cast<size_t>(row) * axes.row_step;
            const int axis = face_axis(f);
            wrong += planes->faces[f][at] != bits;
            wrong += (planes->rows[f][plane] >> row & 1) != (bits != 0);
            // The rest is only looked at where faces are.
            if (bits == 0) continue;
            wrong += planes->along_bit[axis == 2 ? 2 : 0][at] != along_bit;
            wrong += planes->along_row[axis][at] != along_row;
          }
      }
      ASSERT_EQ(wrong, 0u) << leaves;
    }
  });
}

TEST(ExtractKernels, RectanglesAndTheirBlocksAreTheSameAtEveryLevel) {
  std::vector<std::array<BlockId, kLeafVoxels>> ids(kLeavesPerChunk);
  std::array<const BlockId*, kLeavesPerChunk> pointers;
  for (size_t l = 0; l < ids.size(); ++l) {
    for (size_t i = 0; i < ids[l].size(); ++i)
      ids[l][i] = static_cast<BlockId>(random_bits(12, int64_t(l), int64_t(i), 0));
    pointers[l] = ids[l].data();
  }
  for (const size_t leaves : {1u, 40u, 2000u}) {
    const RandomChunk chunk(static_cast<int>(leaves), leaves);
    std::vector<FaceRecord> first;
    at_every_simd_level([&] {
      const auto planes = std::make_unique<ChunkPlanes>();
      gather_planes(chunk.faces, chunk.masks(), *planes);
      std::vector<FaceRecord> records(chunk.faces.count() + kMergeSlack);
      FaceRecord* end = records.data();
      for (int f = 0; f < kFaces; ++f) {
        DirectionExtent extent;
        end = merge_direction(*planes, f, end, extent);
      }
      uint64_t left = 0, covered = 0;
      for (const auto& plane : planes->faces)
        for (const uint64_t word : plane) left |= word;
      ASSERT_EQ(left, 0u);
      for (const FaceRecord* r = records.data(); r != end; ++r) covered += face_width(r->word0) * face_height(r->word0);
      ASSERT_EQ(covered, chunk.faces.count());
      add_blocks(records.data(), end, pointers.data());
      records.resize(static_cast<size_t>(end - records.data()));
      for (const FaceRecord& r : records) {
        const uvec3 p = face_voxel(r.word0);
        const VoxelPos v{static_cast<int>(p.x), static_cast<int>(p.y), static_cast<int>(p.z)};
        ASSERT_EQ(face_block(r.word1), ids[static_cast<size_t>(index_in_leaf({v.x >> 3, v.y >> 3, v.z >> 3}))]
                                          [static_cast<size_t>(index_in_leaf(v))]);
      }
      if (first.empty()) first = records;
      ASSERT_EQ(records, first);
    });
  }
}

TEST(ExtractKernels, FacesOfALeafAreThoseOfALoopOverItsVoxels) {
  at_every_simd_level([] {
    for (int i = 0; i < 40; ++i) {
      LeafMask opaque[7], occupied[7];
      LeafNeighbourhood p, o;
      for (int n = 0; n < 7; ++n) {
        opaque[n] = random_mask(i + n, 8), occupied[n] = random_mask(i / 2 + n, 9);
        for (int x = 0; x < 8; ++x) occupied[n].word[x] |= opaque[n].word[x];
        (n == 6 ? p.self : p.neighbour[n]) = &opaque[n];
        (n == 6 ? o.self : o.neighbour[n]) = &occupied[n];
      }
      LeafFaces faces, touching;
      const bool any = opaque_faces(&p, 1, &faces) != 0;
      ASSERT_EQ(any, !faces.is_none());
      const LeafFaces of_opaque = faces;
      const bool any_touching = transparent_faces(o, p, faces, touching);
      ASSERT_EQ(any_touching, !touching.is_none());
      LeafFaces without = faces;
      remove_faces_towards(p, without);
      for (int v = 0; v < kLeafVoxels; ++v)
        for (int f = 0; f < kFaces; ++f) {
          const VoxelPos beside = offset_in_leaf(v) + face_step(f);
          const bool outside = ((beside.x | beside.y | beside.z) & ~7) != 0;
          const bool beside_opaque = opaque[outside ? f : 6].test(beside);
          const bool beside_occupied = occupied[outside ? f : 6].test(beside);
          const bool transparent = occupied[6].test(v) && !opaque[6].test(v);
          const bool is_opaque_face = opaque[6].test(v) && !beside_opaque;
          ASSERT_EQ(of_opaque.face[f].test(v), is_opaque_face) << v << ' ' << f;
          ASSERT_EQ(faces.face[f].test(v), is_opaque_face || (transparent && !beside_occupied)) << v << ' ' << f;
          ASSERT_EQ(touching.face[f].test(v), transparent && beside_occupied && !beside_opaque) << v << ' ' << f;
          ASSERT_EQ(without.face[f].test(v), faces.face[f].test(v) && !beside_opaque) << v << ' ' << f;
        }
    }
  });
}

/// What can be reached from `seeds` through faces within `open`.
LeafMask breadth_first(const LeafMask& open, const LeafMask& seeds) {
  LeafMask reached;
  std::vector<VoxelPos> work;
  const auto visit = [&](VoxelPos v) {
    if (v.x < 0 || v.y < 0 || v.z < 0 || v.x > 7 || v.y > 7 || v.z > 7 || !open.test(v) || reached.test(v)) return;
    reached.set(index_in_leaf(v));
    work.push_back(v);
  };
  for (int i = 0; i < kLeafVoxels; ++i)
    if (seeds.test(i)) visit(offset_in_leaf(i));
  while (!work.empty()) {
    const VoxelPos v = work.back();
    work.pop_back();
    for (int f = 0; f < kFaces; ++f) visit(v + face_step(f));
  }
  return reached;
}

TEST(ExtractKernels, FloodReachesWhatABreadthFirstSearchReaches) {
  at_every_simd_level([] {
    for (int i = 0; i < 240; ++i) {
      const LeafMask open = random_mask(i, 3);
      LeafMask first, then;
      for (int w = 0; w < 8; ++w) {
        const auto bits = [&](int k) { return random_bits(9, i, w, k); };
        first.word[w] = i % 7 == 0 ? 0 : bits(0) & bits(1) & bits(2) & bits(3) & bits(4);
        then.word[w] = i % 5 == 0 ? 0 : bits(5) & bits(6) & bits(7) & bits(8) & bits(9);
      }
      LeafMask reached, seeds;
      ASSERT_EQ(flood_leaf(open, first, reached), !breadth_first(open, first).is_none()) << i;
      ASSERT_EQ(reached, breadth_first(open, first)) << i;
      const LeafMask before = reached;
      for (int w = 0; w < 8; ++w) seeds.word[w] = first.word[w] | then.word[w];
      const bool changed = flood_leaf(open, then, reached);
      ASSERT_EQ(reached, breadth_first(open, seeds)) << i;
      ASSERT_EQ(changed, !(reached == before)) << i;
    }
  });
}

}  // namespace
}  // namespace render
