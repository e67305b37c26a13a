#include "render/extract/unit_faces.h"

#include <algorithm>
#include <span>
#include <tuple>

#include "render/extract/kernels.h"

namespace render {

using namespace world;

namespace {

/// Merges the faces of one plane to rectangles: runs along the bits, each followed down the rows while all of it goes
/// on. Parts go on sideways alone.
class PlaneMerger {
 public:
  void merge(std::span<const UnitFace> units, bool merge_faces, FunctionRef<uint32_t(uint32_t, uint32_t)> name,
             ChunkRecords& out) {
    const int face = units[0].face;
    const PlaneAxes& axes = kPlaneAxes[face_axis(face)];
    for (const UnitFace& u : units) grid_[u.row][u.bit] = cell_of(u);
    for (const UnitFace& u : units) {
      const uint64_t key = grid_[u.row][u.bit];
      if (!key) continue;
      const bool side_part = u.is_part() && axes.plane != 1;
      uint32_t width = 1, height = 1;
      if (merge_faces && !(side_part && axes.bit == 1))
        while (u.bit + width < kChunkSize && grid_[u.row][u.bit + width] == key) ++width;
      if (merge_faces && !(side_part && axes.row == 1)) {
        const auto goes_on = [&](uint32_t row) {
          for (uint32_t b = 0; b < width; ++b)
            if (grid_[row][u.bit + b] != key) return false;
          return true;
        };
        while (u.row + height < kChunkSize && goes_on(u.row + height)) ++height;
      }
      for (uint32_t r = 0; r < height; ++r)
        for (uint32_t b = 0; b < width; ++b) grid_[u.row + r][u.bit + b] = 0;
      uint32_t low[3], high[3];
      low[axes.plane] = u.plane, low[axes.row] = u.row, low[axes.bit] = u.bit;
      high[axes.plane] = u.plane, high[axes.row] = u.row + height, high[axes.bit] = u.bit + width;
      CornerBox& box = out.bounds[static_cast<size_t>(face)];
      for (size_t a = 0; a < 3; ++a) {
        const bool own = static_cast<int>(a) == axes.plane;
        const uint32_t out_of = own ? static_cast<uint32_t>(face & 1) : 0, in_voxel = own && u.is_part() ? 0 : out_of;
        box.min[a] = static_cast<uint8_t>(std::min<uint32_t>(box.min[a], low[a] + in_voxel));
        box.max[a] = static_cast<uint8_t>(std::max<uint32_t>(box.max[a], high[a] + out_of));
      }
      if (side_part && axes.row == 1) height = uint32_t{u.bottom} + 1;
      if (side_part && axes.bit == 1) width = uint32_t{u.bottom} + 1;
      FaceRecord record = make_face_record(low[0], low[1], low[2], width, height, static_cast<uint32_t>(face), 0);
      if (u.is_part()) record.word0 |= 0x40000000u;
      record.word1 |= name(u.key, u.top & 15u);
      out.records.push_back(record);
    }
  }

 private:
  static uint64_t cell_of(const UnitFace& u) { return u.key | uint64_t{u.bottom} << 32 | uint64_t{u.top} << 40; }
  uint64_t grid_[kChunkSize][kChunkSize] = {};  // zero between planes
};

auto place_of(const UnitFace& u) { return std::tie(u.face, u.plane, u.again, u.row, u.bit); }
bool same_plane(const UnitFace& a, const UnitFace& b) {
  return a.face == b.face && a.plane == b.plane && a.again == b.again;
}

}  // namespace

void merge_units(std::vector<UnitFace>& units, bool merge_faces, FunctionRef<uint32_t(uint32_t, uint32_t)> name,
                 ChunkRecords& out) {
  std::sort(units.begin(), units.end(), [](const UnitFace& a, const UnitFace& b) { return place_of(a) < place_of(b); });
  out.records.clear();
  out.bounds = {};
  out.all_bounds = {};
  out.faces = units.size();
  thread_local PlaneMerger merger;
  size_t begin = 0;
  for (size_t f = 0; f < kFaces; ++f) {
    out.first[f] = static_cast<uint32_t>(out.records.size());
    while (begin < units.size() && units[begin].face == f) {
      size_t end = begin;
      while (end < units.size() && same_plane(units[begin], units[end])) ++end;
      merger.merge({units.data() + begin, end - begin}, merge_faces, name, out);
      begin = end;
    }
    if (!out.bounds[f].empty()) out.all_bounds.include(out.bounds[f]);
  }
  out.first[kFaces] = static_cast<uint32_t>(out.records.size());
}

}  // namespace render
