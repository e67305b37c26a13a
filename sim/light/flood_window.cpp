#include "sim/light/flood_window.h"

#include <algorithm>

#include "world/base/errors.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "sim/light/flood_window.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace sim {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Words = hn::CappedTag<uint64_t, 8>;

void SpreadLevel(FloodWindow& w, int level) {
  if (!w.any_front(level + 1)) return;
  const Words d;
  const size_t lanes = hn::Lanes(d);
  const int ny = w.size[1];
  const size_t step_y = static_cast<size_t>(w.size[0]) * 8, step_z = step_y * static_cast<size_t>(ny);
  const uint64_t* from = w.got(level + 1);
  uint64_t* to = w.got(level);
  const uint32_t* front = w.front_of(level + 1);
  uint32_t* reached = w.front_of(level);
  const auto low_z = hn::Set(d, 0x0101010101010101ull), high_z = hn::Set(d, 0x8080808080808080ull);

  for (int z = 1; z < w.size[2] - 1; ++z)
    for (int row = w.row(1, z); row < w.row(ny - 1, z); ++row) {
      const uint32_t f = front[row];
      uint32_t near = (f | f << 1 | f >> 1 | front[row - 1] | front[row + 1] | front[row - ny] | front[row + ny]) &
                      w.openable[static_cast<size_t>(row)];
      for (; near; near &= near - 1) {
        const int x = std::countr_zero(near);
        const size_t leaf = w.leaf(x, row), at = leaf * 8;
        uint64_t* open = w.open_of(leaf);
        uint64_t* bits = w.bits_of(leaf);
        const uint32_t bit = 1u << x;
        const bool first = !(w.touched[static_cast<size_t>(row)] & bit);
        auto any_got = hn::Zero(d), any_open = hn::Zero(d);
        for (size_t i = 0; i < 8; i += lanes) {
          const uint64_t* p = from + at + i;
          const auto self = hn::Load(d, p);
          const auto along_x = hn::Or(hn::LoadU(d, p - 1), hn::LoadU(d, p + 1));
          const auto up = hn::Or(hn::ShiftLeft<8>(self), hn::ShiftRight<56>(hn::Load(d, p - step_y)));
          const auto down = hn::Or(hn::ShiftRight<8>(self), hn::ShiftLeft<56>(hn::Load(d, p + step_y)));
          const auto far = hn::Or(hn::AndNot(low_z, hn::ShiftLeft<1>(self)),
                                  hn::And(low_z, hn::ShiftRight<7>(hn::Load(d, p - step_z))));
          const auto near_side = hn::Or(hn::AndNot(high_z, hn::ShiftRight<1>(self)),
                                        hn::And(high_z, hn::ShiftLeft<7>(hn::Load(d, p + step_z))));
          const auto gathered = hn::Or(hn::Or(along_x, hn::Or(up, down)), hn::Or(far, near_side));
          const auto was_open = hn::Load(d, open + i);
          const auto got = hn::And(gathered, was_open);
          const auto still_open = hn::AndNot(gathered, was_open);
          any_got = hn::Or(any_got, got);
          any_open = hn::Or(any_open, still_open);
          hn::Store(got, d, to + at + i);
          hn::Store(still_open, d, open + i);
        }
        if (hn::AllTrue(d, hn::Eq(any_got, hn::Zero(d)))) continue;
        reached[row] |= bit;
        w.moving |= 1u << level;
        w.touched[static_cast<size_t>(row)] |= bit;
        if (hn::AllTrue(d, hn::Eq(any_open, hn::Zero(d)))) w.openable[static_cast<size_t>(row)] &= ~bit;
        for (size_t k = 0; k < 4; ++k) {
          const bool set = (level >> k & 1) != 0;
          if (!set && !first) continue;
          for (size_t i = 0; i < 8; i += lanes) {
            auto b = first ? hn::Zero(d) : hn::Load(d, bits + k * 8 + i);
            if (set) b = hn::Or(b, hn::Load(d, to + at + i));
            hn::Store(b, d, bits + k * 8 + i);
          }
        }
      }
    }
}

int PackLeaf(const uint64_t* bits, world::LightLeaf& into) {
  const Words d;
  const size_t lanes = hn::Lanes(d);
  int level = 0;
  bool alike = true;
  for (size_t k = 0; k < 4; ++k) {
    auto all = hn::Set(d, ~0ull), any = hn::Zero(d);
    for (size_t i = 0; i < 8; i += lanes) {
      const auto b = hn::Load(d, bits + k * 8 + i);
      all = hn::And(all, b), any = hn::Or(any, b);
    }
    const bool is_all = hn::AllTrue(d, hn::Eq(all, hn::Set(d, ~0ull)));
    alike &= is_all || hn::AllTrue(d, hn::Eq(any, hn::Zero(d)));
    level |= is_all ? 1 << k : 0;
  }
  if (alike) return level;
  for (size_t i = 0; i < 8; i += lanes)
    hn::StoreInterleaved4(hn::Load(d, bits + i), hn::Load(d, bits + 8 + i), hn::Load(d, bits + 16 + i),
                          hn::Load(d, bits + 24 + i), d, &into.word[i][0]);
  return -1;
}

}  // namespace HWY_NAMESPACE
}  // namespace sim
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sim {

HWY_EXPORT(SpreadLevel);
HWY_EXPORT(PackLeaf);

void spread_level(FloodWindow& window, int level) { HWY_DYNAMIC_DISPATCH(SpreadLevel)(window, level); }
int pack_leaf(const uint64_t* bits, world::LightLeaf& into) { return HWY_DYNAMIC_DISPATCH(PackLeaf)(bits, into); }

void FloodWindow::begin(int leaves_x, int leaves_y, int leaves_z) {
  size[0] = leaves_x + 2, size[1] = leaves_y + 2, size[2] = leaves_z + 2;
  for (const int n : size) CHECK(n >= 3 && n <= kMostLeaves);
  rows = size[1] * size[2];
  const size_t leaves = static_cast<size_t>(rows) * static_cast<size_t>(size[0]);
  if (open.size() < leaves) open.resize(leaves), bits.resize(leaves * 4);
  const size_t r = static_cast<size_t>(rows);
  openable.assign(r, 0);
  touched.assign(r, 0);
  front.assign(r * (world::kMaxLight + 1), 0);
  set_most_loss(1);
}

void FloodWindow::set_most_loss(int most_loss) {
  plane_count = static_cast<size_t>(most_loss) + 1;
  // Planes stay zero between windows, so that they need only grow.
  const size_t leaves = static_cast<size_t>(rows) * static_cast<size_t>(size[0]) + 2 * kGuard;
  for (size_t p = 0; p < plane_count; ++p)
    if (planes[p].size() < leaves) planes[p].resize(leaves);
}

void FloodWindow::zero_front(int level) {
  if (!any_front(level)) return;
  moving &= ~(1u << level);
  uint32_t* f = front_of(level);
  world::LeafMask* plane = &planes[static_cast<size_t>(level) % plane_count][kGuard];
  for (int r = 0; r < rows; ++r) {
    for (uint32_t some = f[r]; some; some &= some - 1) plane[leaf(std::countr_zero(some), r)] = world::LeafMask();
    f[r] = 0;
  }
}

void FloodWindow::clear_plane_for(int level) {
  const int before = level + static_cast<int>(plane_count);
  if (before <= world::kMaxLight) zero_front(before);
}

void FloodWindow::end() {
  while (moving) zero_front(std::countr_zero(moving));
}

void FloodWindow::mark(int x, int row, int level, const uint64_t* voxels) {
  uint64_t* b = bits_of(leaf(x, row));
  const uint32_t bit = 1u << x;
  if (!(touched[static_cast<size_t>(row)] & bit)) {
    std::fill_n(b, 4 * kLeafWords, 0);
    touched[static_cast<size_t>(row)] |= bit;
  }
  for (int k = 0; k < 4; ++k)
    if (level >> k & 1)
      for (int i = 0; i < kLeafWords; ++i) b[k * kLeafWords + i] |= voxels[i];
}

void FloodWindow::give(int x, int row, int level, const uint64_t* voxels) {
  mark(x, row, level, voxels);
  inject(x, row, level, voxels);
}

uint64_t FloodWindow::dark(int x, int row, int slice) {
  if (!(touched[static_cast<size_t>(row)] >> x & 1)) return ~0ull;
  const uint64_t* b = bits_of(leaf(x, row)) + slice;
  return ~(b[0] | b[kLeafWords] | b[2 * kLeafWords] | b[3 * kLeafWords]);
}

void FloodWindow::inject(int x, int row, int level, const uint64_t* voxels) {
  uint64_t* to = got(level) + leaf(x, row) * 8;
  uint64_t any = 0;
  for (int i = 0; i < 8; ++i) to[i] |= voxels[i], any |= voxels[i];
  if (!any) return;
  front_of(level)[row] |= 1u << x;
  moving |= 1u << level;
}

void FloodWindow::gather(int x, int row, int level, uint64_t* into) {
  const uint64_t* p = got(level) + leaf(x, row) * 8;
  const size_t step_y = static_cast<size_t>(size[0]) * 8, step_z = step_y * static_cast<size_t>(size[1]);
  constexpr uint64_t kLowZ = 0x0101010101010101ull, kHighZ = kLowZ << 7;
  for (int i = 0; i < 8; ++i, ++p)
    into[i] = p[-1] | p[1] | p[0] << 8 | *(p - step_y) >> 56 | p[0] >> 8 | p[step_y] << 56 | (p[0] << 1 & ~kLowZ) |
              (*(p - step_z) >> 7 & kLowZ) | (p[0] >> 1 & ~kHighZ) | (p[step_z] << 7 & kHighZ);
}

}  // namespace sim
#endif  // HWY_ONCE
