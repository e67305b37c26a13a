/// What block games do, as the rival of sim/light and the reference of its tests: levels of a dense box of voxels, a
/// byte each, spread by queues, one for each level, voxel by voxel; what gets darker is first taken away, then lit
/// again from around.
///
/// source  Luanti, src/voxelalgorithms.cpp (unspread_light, spread_light, propagate_sunlight): the algorithm, not code
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "sim/light/optics.h"
#include "world/space/coords.h"

namespace tools {

class LightQueue {
 public:
  /// A box of kind 0; beyond it nothing is but, above and at the sides, the open sky.
  LightQueue(const world::VoxelBox& box, int sky_level, std::vector<sim::BlockOptics> kinds)
      : box_(box), sky_level_(sky_level), kinds_(std::move(kinds)) {
    for (int a = 0; a < 3; ++a) size_[a] = static_cast<size_t>(box.max[a] - box.min[a]) + 3;  // and a shell
    step_ = {size_[1] * size_[2], size_[2], 1};
    kinds_.push_back({.loss = 0});
    shell_ = static_cast<uint8_t>(kinds_.size() - 1);
    kind_.assign(size_[0] * step_[0], shell_);
    for (size_t x = 1; x + 1 < size_[0]; ++x)
      for (size_t y = 1; y + 1 < size_[1]; ++y)
        std::fill_n(kind_.begin() + static_cast<std::ptrdiff_t>(x * step_[0] + y * step_[1] + 1), size_[2] - 2, 0);
    for (auto& level : level_) level.assign(kind_.size(), 0);
  }

  const world::VoxelBox& box() const { return box_; }
  void put(world::VoxelPos v, uint8_t kind) { kind_[index(v)] = kind; }  // before light_all()
  int sky(world::VoxelPos v) const { return level_[0][index(v)]; }
  int lamps(world::VoxelPos v) const { return level_[1][index(v)]; }

  void light_all() {
    light_shell();
    auto& sky = level_[0];
    for (size_t x = 1; x + 1 < size_[0]; ++x)
      for (size_t y = size_[1] - 2; y >= 1; --y) {
        const size_t begin = x * step_[0] + y * step_[1] + 1, end = begin + size_[2] - 2;
        for (size_t i = begin; i < end; ++i)
          sky[i] =
              sky[i + step_[1]] == sky_level_ && kinds_[kind_[i]].passes_sky ? static_cast<uint8_t>(sky_level_) : 0;
      }
    // Sunlit voxels beside darker ones, and the shell, begin.
    for (size_t i = step_[0]; i + step_[0] < sky.size(); ++i)
      if (sky[i] == sky_level_)
        for (const size_t s : step_)
          if ((sky[i + s] < sky_level_ && kinds_[kind_[i + s]].loss) ||
              (sky[i - s] < sky_level_ && kinds_[kind_[i - s]].loss)) {
            push(i, sky_level_);
            break;
          }
    for (size_t i = 0; i < step_[0]; ++i) push_shell(i), push_shell(sky.size() - 1 - i);
    spread(0);
    auto& lamps = level_[1];
    for (size_t i = 0; i < lamps.size(); ++i)
      if ((lamps[i] = kinds_[kind_[i]].level)) push(i, lamps[i]);
    spread(1);
  }

  /// Changes one voxel and the light around it.
  void set(world::VoxelPos v, uint8_t kind) {
    const size_t at = index(v);
    kind_[at] = kind;
    for (int field = 0; field < 2; ++field) {
      auto& level = level_[static_cast<size_t>(field)];
      darken(field, at);
      if (field == 0) {
        // The column below loses the sky, or gets it.
        const size_t down = step_[1];
        const bool lit = level[at + down] == sky_level_ && kinds_[kind].passes_sky;
        for (size_t i = at; kind_[i] != shell_; i -= down) {
          if (lit ? !kinds_[kind_[i]].passes_sky : level[i] != sky_level_ && i != at) break;
          if (lit)
            raise(field, i, sky_level_);
          else if (i != at)
            darken(field, i);
        }
      } else if (kinds_[kind].level) {
        raise(field, at, kinds_[kind].level);
      }
      finish(field);
    }
  }

 private:
  size_t index(world::VoxelPos v) const {
    return static_cast<size_t>(v.x - box_.min.x + 1) * step_[0] + static_cast<size_t>(v.y - box_.min.y + 1) * step_[1] +
           static_cast<size_t>(v.z - box_.min.z + 1);
  }
  void light_shell() {
    for (size_t x = 0; x < size_[0]; ++x)
      for (size_t y = 1; y < size_[1]; ++y)
        for (size_t z = 0; z < size_[2]; ++z)
          if (x == 0 || x + 1 == size_[0] || z == 0 || z + 1 == size_[2] || y + 1 == size_[1])
            level_[0][x * step_[0] + y * step_[1] + z] = static_cast<uint8_t>(sky_level_);
  }
  void push(size_t i, int level) { queue_[static_cast<size_t>(level)].push_back(static_cast<uint32_t>(i)); }
  void push_shell(size_t i) {
    if (level_[0][i] == sky_level_) push(i, sky_level_);
  }
  template <class Visit>
  void around(size_t i, Visit visit) const {
    for (const size_t s : step_) {
      if (i >= s) visit(i - s);
      if (i + s < kind_.size()) visit(i + s);
    }
  }
  void raise(int field, size_t i, int level) {
    uint8_t& at = level_[static_cast<size_t>(field)][i];
    if (at >= level) return;
    at = static_cast<uint8_t>(level);
    push(i, level);
  }
  void spread(int field) {
    auto& level = level_[static_cast<size_t>(field)];
    for (int l = world::kMaxLight; l >= 1; --l) {
      auto& queue = queue_[static_cast<size_t>(l)];
      for (size_t q = 0; q < queue.size(); ++q) {
        const size_t i = queue[q];
        if (level[i] != l) continue;
        around(i, [&](size_t n) {
          const int loss = kinds_[kind_[n]].loss;
          if (loss && l - loss > level[n]) {
            level[n] = static_cast<uint8_t>(l - loss);
            push(n, l - loss);
          }
        });
      }
      queue.clear();
    }
  }
  /// Takes the light of a voxel away, to be followed by finish().
  void darken(int field, size_t i) {
    uint8_t& at = level_[static_cast<size_t>(field)][i];
    if (at) dark_[at].push_back(static_cast<uint32_t>(i));
    at = 0;
    again_.push_back(static_cast<uint32_t>(i));
  }
  void finish(int field) {
    auto& level = level_[static_cast<size_t>(field)];
    for (int l = world::kMaxLight; l >= 1; --l) {
      auto& queue = dark_[static_cast<size_t>(l)];
      for (size_t q = 0; q < queue.size(); ++q)
        around(queue[q], [&](size_t n) {
          if (!level[n] || kind_[n] == shell_) return;
          // Lit by what has gone, perhaps; what gives light itself, or is sunlit, stays.
          if (level[n] < l && level[n] != own(field, n)) {
            dark_[level[n]].push_back(static_cast<uint32_t>(n));
            level[n] = static_cast<uint8_t>(own(field, n) < level[n] ? own(field, n) : 0);
            again_.push_back(static_cast<uint32_t>(n));
          }
        });
      queue.clear();
    }
    for (const uint32_t i : again_) {
      if (level[i]) push(i, level[i]);
      around(i, [&](size_t n) {
        if (level[n]) push(n, level[n]);
      });
    }
    again_.clear();
    spread(field);
  }
  int own(int field, size_t i) const { return field == 1 ? kinds_[kind_[i]].level : 0; }

  world::VoxelBox box_;
  int sky_level_;
  std::vector<sim::BlockOptics> kinds_;
  size_t size_[3];
  std::array<size_t, 3> step_;
  uint8_t shell_;
  std::vector<uint8_t> kind_;
  std::array<std::vector<uint8_t>, 2> level_;
  std::array<std::vector<uint32_t>, world::kMaxLight + 1> queue_, dark_;
  std::vector<uint32_t> again_;
};

}  // namespace tools
