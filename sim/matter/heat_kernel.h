/// Conduction on pages: what flows through the faces of a leaf's voxels in one step. Internal to sim/matter.
///
/// Through the face between voxels i and j flow, into i,
///   F = trunc(sign(D) * min(|D| * g + phase, |D| * share)),  D = Tj - Ti,  g = dt / unit / (Ri + Rj)
/// units of heat. F changes its sign with i and j, bit for bit, so both pages of a face find the same number, and the
/// sum of heat stays what it is. `share` is the smaller of a sixth of both capacities: no voxel gives or takes more
/// than makes it as warm as its neighbours, so that temperatures stay within those around (to one ulp of a float: 61 µK
/// below 1024 K), whatever dt is. Up to r = a dt / h^2 = 1/6 the limit changes nothing within one material; beyond it a
/// single step is stable and too slow.
///
/// `phase`, 0..63/64 by the tick in bit-reversed order, makes parts of a unit flow now and then, as often as they
/// should: without it, wood would conduct nothing below 2 K of difference. What never flows in any phase lets a page
/// sleep: differences under 6 units of the smaller capacity (0.1 K in air, 0.36 K in fire, 60 µK in stone), or under
/// 1/64 unit a step.
///
/// Each face is found once, if both pages are stepped on one thread. What a voxel is comes from a table of the
/// page's kinds, which is a register where there are at most eight. Where at most three kinds meet in and around a
/// page, g and share come from such tables too, by a face's two kinds: dividing cost as much as all the rest.
/// cost   measured by `loam bench run matter`
#pragma once

#include <cstdint>
#include <vector>

#include "sim/matter/thermal.h"

namespace sim {

/// The numbers of a ThermalVoxel, in their order.
enum ThermalField : int { kInverse, kBorn, kLow, kHigh, kResistance, kShare };

/// Whether its temperature is more than heat * inverse: no heat of 32 bits reaches limits of 1e9 K else.
inline bool is_limited(const ThermalVoxel& v) {
  return v.born != 0 || v.low > -1e9f || v.high < 1e9f || v.inverse > 0.4f;
}

/// A page that isn't of one material: what its voxels are, by number. 1.6 KB, and 24 bytes a kind; a step reads no more
/// than the first kHotBytes where there are at most three kinds.
struct ThermalKinds {
  static constexpr size_t kHotBytes = 512;
  alignas(64) float few[6][8];        // the first eight kinds, by field: as vectors
  alignas(64) uint32_t code_row[64];  // where is_coded: of a row along z, three bits a voxel
  std::vector<ThermalVoxel> all;
  bool limited = false;     // any of them
  bool born_alike = false;  // all are born equally warm, and freeze or condense there
  /// At most three kinds, with numbers 0, 1 and 3 (2 is the same as 3): their sums say which two meet.
  bool is_coded = false;
  int count = 0;  // of kinds, where is_coded
  alignas(64) uint16_t kind[world::kLeafVoxels];

  /// Tables from `kind` and `all`.
  void finish();
};

/// A page as heat sees it.
struct HeatSource {
  const int32_t* heat = nullptr;       // null: none
  const float* temperature = nullptr;  // where it is known already: instead of heat
  const ThermalKinds* kinds = nullptr;
  ThermalVoxel all = {};  // of every voxel, where there are no kinds
  bool closed = false;
  const int32_t* side = nullptr;  // where not null: heats of the 64 voxels at the face that is asked for, see copy_side
};

/// What flows through the sides of a page, 64 numbers each, on 64 bytes: into the page on the lower side of the face,
/// in the order of x, y, z. A face that two pages share is found once, by the one that comes first.
struct HeatFlows {
  int32_t* through[6] = {};
  uint8_t known = 0;  // bit face: is there already; others are written
};

struct HeatStep {
  float scale = 0;  // dt / unit, s/J
  float phase = 0;  // 0 <= phase < 1
  float limit = 1;  // of share; large: no limit
};

struct HeatResult {
  bool flows = false;         // something flowed
  bool live = false;          // something flows in this phase or another
  uint8_t sides_changed = 0;  // bit face: a voxel there is warmer or colder than it was
  uint16_t changed = 0;       // voxels that are
};

/// What a later call will read and write: asked for while this one works, line by line. A world that is larger than the
/// caches waited for memory twice as long as it worked: pages lie where they were allocated, which no processor
/// foresees, and asking for a page at once fills the queue of misses.
struct HeatAhead {
  const int32_t *own = nullptr, *high_x = nullptr, *high_y = nullptr;  // heats of the page, of sides[1] and [3]
  // Of the page, and of sides[1] and [3].
  const ThermalKinds *own_kinds = nullptr, *high_x_kinds = nullptr, *high_y_kinds = nullptr;
};

/// `sides[face]`: the pages across. `heat`: what the page holds after the step, where something flows; on 64 bytes.
HeatResult conduct(const HeatSource& page, const HeatSource* sides, const HeatStep& step, int32_t* heat);
/// The same, and `heat` may be what the page holds. Sides whose flows are known aren't looked at. Where nothing flows,
/// it is live if something within the page is: is_live() tells of all.
HeatResult conduct_in_place(const HeatSource& page, const HeatSource* sides, const HeatStep& step, int32_t* heat,
                            const HeatFlows& flows, const HeatAhead& ahead = {});
/// Whether something flows in any phase, in or into a page.
bool is_live(const HeatSource& page, const HeatSource* sides, const HeatStep& step);
/// The heats of a page's voxels at a face, in the order of x, y, z; `heat` may be null.
void copy_side(const int32_t* heat, int face, int32_t* into);
/// Whether anything may flow through one side of the page, in any phase.
bool side_is_live(const HeatSource& page, const HeatSource& beyond, int face, const HeatStep& step);
/// The temperatures of a page, above rest.
void temperatures(const HeatSource& page, float* into);

/// One sweep of the implicit scheme on a page: the temperature that balances the step where its neighbours are as in
/// `sides`, into = weight * (that - before) + before.  old: at the start of the step.
void relax(const HeatSource& page, const HeatSource* sides, const HeatStep& step, const float* old, const float* before,
           float weight, float* into);

/// 0..63/64 in bit-reversed order.
float heat_phase(uint64_t step);

}  // namespace sim
