#include "render/raster/triangle_tree.h"

#include <algorithm>
#include <array>
#include <numeric>

#include "world/base/errors.h"

namespace render::raster {

namespace {

constexpr int kSlices = 16;
constexpr int kDeepest = 60;  // below it, halves by number: no order of triangles makes recursion deep

float half_surface(const TriangleBox& b) {
  const glm::vec3 size = glm::max(b.high - b.low, glm::vec3(0));
  return size.x * size.y + size.y * size.z + size.z * size.x;
}

class Builder {
 public:
  Builder(std::span<const TriangleBox> boxes, TriangleTree& tree) : boxes_(boxes), tree_(tree) {}

  void build(uint32_t begin, uint32_t end, int depth) {
    const auto index = static_cast<uint32_t>(tree_.nodes.size());
    tree_.nodes.emplace_back();
    tree_.first.push_back(begin);
    TriangleBox box;
    for (uint32_t i = begin; i < end; ++i) box.include(boxes_[tree_.order[i]]);
    uint32_t leaf = begin << kNodeLeafBits | (end - begin);
    if (end - begin > kMostInLeaf) {
      const uint32_t middle = split(begin, end, depth);
      leaf = 0;
      build(begin, middle, depth + 1);
      build(middle, end, depth + 1);
    }
    tree_.nodes[index] = {box.low, static_cast<uint32_t>(tree_.nodes.size()), box.high, leaf};
  }

 private:
  glm::vec3 middle_of(uint32_t box) const { return 0.5f * (boxes_[box].low + boxes_[box].high); }

  uint32_t split(uint32_t begin, uint32_t end, int depth) {
    TriangleBox middles;
    for (uint32_t i = begin; i < end; ++i) middles.include(middle_of(tree_.order[i]));
    const glm::vec3 size = middles.high - middles.low;
    float least = 1e38f;
    int best_axis = -1, best_slice = 0;
    const auto slice_of = [&](uint32_t box, int axis) {
      const float at = (middle_of(box)[axis] - middles.low[axis]) / size[axis];
      return std::clamp(static_cast<int>(at * kSlices), 0, kSlices - 1);
    };
    for (int axis = 0; axis < 3 && depth < kDeepest; ++axis) {
      if (!(size[axis] > 0)) continue;
      std::array<TriangleBox, kSlices> slices;
      std::array<uint32_t, kSlices> counts{};
      for (uint32_t i = begin; i < end; ++i) {
        const auto s = static_cast<size_t>(slice_of(tree_.order[i], axis));
        slices[s].include(boxes_[tree_.order[i]]), ++counts[s];
      }
      std::array<float, kSlices> above{};  // of the slices from each on
      TriangleBox box;
      uint32_t count = 0;
      for (size_t s = kSlices; s-- > 1;) {
        box.include(slices[s]), count += counts[s];
        above[s] = count ? half_surface(box) * static_cast<float>(count) : 0;
      }
      box = {}, count = 0;
      for (size_t s = 1; s < kSlices; ++s) {
        box.include(slices[s - 1]), count += counts[s - 1];
        const float cost = (count ? half_surface(box) * static_cast<float>(count) : 0) + above[s];
        if (count > 0 && count < end - begin && cost < least)
          least = cost, best_axis = axis, best_slice = static_cast<int>(s);
      }
    }
    const uint32_t half = begin + (end - begin) / 2;
    if (best_axis < 0) return half;  // all in one place
    const auto from = tree_.order.begin();
    const auto middle =
        std::partition(from + begin, from + end, [&](uint32_t box) { return slice_of(box, best_axis) < best_slice; });
    return static_cast<uint32_t>(middle - from);
  }

  std::span<const TriangleBox> boxes_;
  TriangleTree& tree_;
};

}  // namespace

TriangleTree triangle_tree(std::span<const TriangleBox> boxes) {
  CHECK_LT(boxes.size(), size_t{1} << (32 - kNodeLeafBits));
  TriangleTree tree;
  tree.order.resize(boxes.size());
  std::iota(tree.order.begin(), tree.order.end(), 0u);
  if (!boxes.empty()) Builder(boxes, tree).build(0, static_cast<uint32_t>(boxes.size()), 0);
  tree.first.push_back(static_cast<uint32_t>(boxes.size()));
  return tree;
}

}  // namespace render::raster
