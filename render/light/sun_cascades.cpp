#include "render/light/sun_cascades.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include <fmt/format.h>

#include "world/base/jobs.h"

namespace render {

using world::Vec3d;

namespace {

constexpr int kTile = 8;              // texels a side whose rays are cast together; maps move by so many
constexpr int kBeside = 20;           // texels on each side that the filter and a move may ask for
constexpr double kNear = 1;           // m, where the first split of a logarithmic row lies
constexpr size_t kMostLeaves = 4096;  // edited at once; beyond it all texels are made anew

/// To the end of the world from an eye in it. From one that is farther off, twice as far, or four times: so that it
/// seldom changes.
float reach_of(const world::MaskVolume& blocks, const world::WorldPoint& eye) {
  const world::VoxelPos low = world::voxel_from_region(blocks.min_region());
  Vec3d size, farthest;
  for (int a = 0; a < 3; ++a) {
    size[a] = world::kRegionSize * std::max(double(blocks.max_region()[a]) - double(blocks.min_region()[a]) + 1, 1.0);
    const double from = double(eye.voxel[a]) + eye.fraction[a] - low[a];
    farthest[a] = std::max(std::abs(from), std::abs(from - size[a]));
  }
  double reach = glm::length(size);
  while (reach < glm::length(farthest)) reach *= 2;
  return static_cast<float>(reach);
}

int floor_to_tile(double texel) { return static_cast<int>(std::floor(texel / kTile)) * kTile; }

}  // namespace

std::vector<double> sun_cascade_ends(int count, double near, double far, double split) {
  std::vector<double> ends;
  for (int i = 1; i <= count; ++i) {
    const double part = static_cast<double>(i) / count;
    ends.push_back(split * near * std::pow(far / near, part) + (1 - split) * (near + (far - near) * part));
  }
  return ends;
}

void SunCascades::clear() {
  if (words_.empty()) return;
  words_ = {}, cascades_ = {}, changed_ = {};
  store_ = 0, cast_ = 0;
  ++version_;
}

Vec3d SunCascades::in_light(const world::WorldPoint& p) const {
  const Vec3d from = p - world::WorldPoint{origin_, Vec3d(0.0)};
  return {glm::dot(from, u_), glm::dot(from, v_), glm::dot(from, w_)};
}

world::Status SunCascades::follow(const world::WorldView& view, const world::RayStream& opaque,
                                  const world::WorldPoint& eye, const RenderKnobs& knobs, const Vec3d& sun,
                                  std::span<const world::LeafPos> moved) {
  const int count = knobs.sun_map_cascades, side = knobs.sun_cascade_texels;
  if (!std::has_single_bit(static_cast<uint32_t>(side)))
    return world::usage_error(fmt::format("sun_cascade_texels: {} isn't a power of two", side));
  changed_.clear(), cast_ = 0;

  // The world's size by whole regions, so that an edit seldom changes it.
  const world::MaskVolume& blocks = opaque.walker().volume();
  const world::RegionPos low = blocks.min_region(), high = blocks.max_region();
  const float far = std::max(std::min(knobs.view_distance, reach_of(blocks, eye)), 2.0f);
  const std::array<float, 4> made_for{static_cast<float>(count), static_cast<float>(side), knobs.sun_map_split, far};
  const uint64_t edited = blocks.version();
  const bool fresh = store_ != view.store().identity() || sun_ != sun || made_for_ != made_for;
  std::vector<world::LeafPos> leaves;
  if (fresh) {
    if (store_ != view.store().identity()) {
      subscriber_ = view.store().subscribe();
      origin_ = world::voxel_from_region(low);
    } else {
      view.store().take_dirty(subscriber_);
    }
    store_ = view.store().identity(), sun_ = sun, made_for_ = made_for, side_ = side;
    w_ = -sun;
    u_ = glm::normalize(glm::cross(std::abs(w_.y) < 0.9 ? Vec3d(0, 1, 0) : Vec3d(1, 0, 0), w_)),
    v_ = glm::cross(w_, u_);
    frame_.u = glm::vec4(glm::vec3(u_), 0), frame_.v = glm::vec4(glm::vec3(v_), 0);
    frame_.w = glm::vec4(glm::vec3(w_), 1);
    frame_.low = glm::ivec4(origin_.x, origin_.y, origin_.z, 0);
    cascades_.assign(static_cast<size_t>(count), {});
    const std::vector<double> ends = sun_cascade_ends(count, kNear, far, knobs.sun_map_split);
    for (size_t k = 0; k < cascades_.size(); ++k)
      cascades_[k].reach = ends[k], cascades_[k].texel = ends[k] / (side / 2 - kBeside);
    words_.assign(shared::kSunCascadeDepths + cascades_.size() * static_cast<size_t>(side) * static_cast<size_t>(side),
                  1e30f);
  } else if (blocks_ != edited) {
    leaves = view.store().take_dirty(subscriber_);
    leaves.insert(leaves.end(), moved.begin(), moved.end());
    std::sort(leaves.begin(), leaves.end());
    leaves.erase(std::unique(leaves.begin(), leaves.end()), leaves.end());
  }
  blocks_ = edited;

  // Depths between which anything stands.
  first_ = 1e300, last_ = -1e300;
  for (int corner = 0; corner < 8; ++corner) {
    Vec3d p;
    for (int a = 0; a < 3; ++a)
      p[a] = world::kRegionSize * (corner >> a & 1 ? double(high[a]) + 1 : double(low[a])) - origin_[a];
    first_ = std::min(first_, glm::dot(p, w_) - 1), last_ = std::max(last_, glm::dot(p, w_) + 1);
  }

  const Vec3d at = in_light(eye);
  if (leaves.size() > kMostLeaves)
    for (Cascade& c : cascades_) c.made = false;
  else
    make_below(opaque, leaves);
  for (int k = 0; k < count; ++k) {
    const double texel = cascades_[static_cast<size_t>(k)].texel;
    move(opaque, k, floor_to_tile(at.x / texel - side / 2 + kTile / 2.0),
         floor_to_tile(at.y / texel - side / 2 + kTile / 2.0));
  }
  std::array<float, shared::kSunCascadeDepths> head{static_cast<float>(at.x), static_cast<float>(at.y),
                                                    static_cast<float>(side), static_cast<float>(count)};
  for (size_t k = 0; k < cascades_.size(); ++k) {
    head[(k + 1) * shared::kSunCascadeWords] = static_cast<float>(cascades_[k].texel);
    head[(k + 1) * shared::kSunCascadeWords + 1] = static_cast<float>(cascades_[k].reach);
  }
  if (changed_.empty() && std::equal(head.begin(), head.end(), words_.begin())) return {};
  std::copy(head.begin(), head.end(), words_.begin());
  changed_.push_back({0, head.size()});
  ++version_;
  return {};
}

/// Casts a ray through the middle of each texel, from before the world.
void SunCascades::make(const world::RayStream& opaque, int cascade, Rectangle r) {
  if (r.x0 >= r.x1 || r.y0 >= r.y1) return;
  const double texel = cascades_[static_cast<size_t>(cascade)].texel;
  const world::WorldPoint corner{origin_, Vec3d(0.0)};
  const int rows = (r.y1 - r.y0 + kTile - 1) / kTile;
  world::parallel_ranges(static_cast<size_t>(rows), 1, [&](size_t begin, size_t end) {
    std::vector<world::GridRay> rays;
    std::vector<world::GridHit> hits;
    std::vector<uint32_t> slots;
    for (size_t row = begin; row < end; ++row) {
      rays.clear(), slots.clear();
      const int y0 = r.y0 + static_cast<int>(row) * kTile, y1 = std::min(y0 + kTile, r.y1);
      for (int x0 = r.x0; x0 < r.x1; x0 += kTile)
        for (int y = y0; y < y1; ++y)
          for (int x = x0; x < std::min(x0 + kTile, r.x1); ++x) {
            world::GridRay& ray =
                rays.emplace_back(corner + (u_ * ((x + 0.5) * texel) + v_ * ((y + 0.5) * texel) + w_ * first_), w_);
            ray.t_max = last_ - first_;
            slots.push_back(shared::sun_cascade_slot(cascade, x, y, side_));
          }
      hits.resize(rays.size());
      opaque.first_set_coherent(rays, hits);
      for (size_t i = 0; i < rays.size(); ++i)
        words_[slots[i]] = hits[i].hit() ? static_cast<float>(hits[i].t + first_) : 1e30f;
    }
  });
  cast_ += static_cast<uint64_t>(r.x1 - r.x0) * static_cast<uint64_t>(r.y1 - r.y0);
  // The slots of each row: one run, or two where it goes over the map's end.
  for (int y = r.y0; y < r.y1; ++y)
    for (int x = r.x0; x < r.x1;) {
      const int to = std::min(r.x1, x + side_ - (x & (side_ - 1)));
      changed_.push_back({shared::sun_cascade_slot(cascade, x, y, side_), static_cast<size_t>(to - x)});
      x = to;
    }
}

void SunCascades::move(const world::RayStream& opaque, int cascade, int low_x, int low_y) {
  Cascade& c = cascades_[static_cast<size_t>(cascade)];
  const Rectangle now{low_x, low_y, low_x + side_, low_y + side_};
  Rectangle kept{std::max(c.low_x, now.x0), std::max(c.low_y, now.y0), std::min(c.low_x + side_, now.x1),
                 std::min(c.low_y + side_, now.y1)};
  if (!c.made || kept.x0 >= kept.x1 || kept.y0 >= kept.y1) {
    make(opaque, cascade, now);
  } else {
    make(opaque, cascade, {now.x0, now.y0, now.x1, kept.y0});
    make(opaque, cascade, {now.x0, kept.y1, now.x1, now.y1});
    make(opaque, cascade, {now.x0, kept.y0, kept.x0, kept.y1});
    make(opaque, cascade, {kept.x1, kept.y0, now.x1, kept.y1});
  }
  c.low_x = low_x, c.low_y = low_y, c.made = true;
}

/// Texels whose rays go through these leaves.
void SunCascades::make_below(const world::RayStream& opaque, std::span<const world::LeafPos> leaves) {
  // Half the size across the light of a leaf's box.
  const Vec3d half(4.0);
  const double half_u = glm::dot(glm::abs(u_), half), half_v = glm::dot(glm::abs(v_), half);
  for (const world::LeafPos leaf : leaves) {
    const world::VoxelPos low{leaf.x * 8, leaf.y * 8, leaf.z * 8};
    const Vec3d middle = in_light({low, half});
    for (int k = 0; k < count(); ++k) {
      const Cascade& c = cascades_[static_cast<size_t>(k)];
      if (!c.made) continue;
      const auto index = [&](double place) { return static_cast<int>(std::floor(place / c.texel)); };
      make(opaque, k,
           {std::max(index(middle.x - half_u), c.low_x), std::max(index(middle.y - half_v), c.low_y),
            std::min(index(middle.x + half_u) + 1, c.low_x + side_),
            std::min(index(middle.y + half_v) + 1, c.low_y + side_)});
    }
  }
}

float SunCascades::lit_in(int cascade, const glm::vec3& place, float cosine, int filter) const {
  const float texel = words_[(static_cast<size_t>(cascade) + 1) * shared::kSunCascadeWords];
  const float reach = place.z - shared::sun_map_filtered_bias(texel, cosine, filter);
  const float first = -0.5f * static_cast<float>(filter);
  float sum = 0;
  for (int j = 0; j < filter; ++j)
    for (int i = 0; i < filter; ++i) {
      const float x = place.x / texel + first + static_cast<float>(i),
                  y = place.y / texel + first + static_cast<float>(j);
      const int ix = static_cast<int>(std::floor(x)), iy = static_cast<int>(std::floor(y));
      const auto depth = [&](int dx, int dy) {
        return words_[shared::sun_cascade_slot(cascade, ix + dx, iy + dy, side_)];
      };
      sum += shared::sun_map_lit({depth(0, 0), depth(1, 0), depth(0, 1), depth(1, 1)},
                                 {x - std::floor(x), y - std::floor(y)}, reach);
    }
  return sum / static_cast<float>(filter * filter);
}

float SunCascades::lit(const world::WorldPoint& point, float cosine, int filter) const {
  if (words_.empty()) return 1;
  const world::WorldPoint corner{origin_, Vec3d(0.0)};
  const glm::vec3 place = shared::sun_map_place(frame_, glm::vec3(point - corner));
  const float distance = std::max(std::abs(place.x - words_[0]), std::abs(place.y - words_[1]));
  for (int k = 0; k < count(); ++k) {
    const float reach = words_[(static_cast<size_t>(k) + 1) * shared::kSunCascadeWords + 1];
    if (!(distance <= reach)) continue;
    const float own = lit_in(k, place, cosine, filter);
    const float next = k + 1 < count() ? shared::sun_cascade_blend(distance, reach) : 0.0f;
    return next > 0 ? glm::mix(own, lit_in(k + 1, place, cosine, filter), next) : own;
  }
  return 1;
}

}  // namespace render
