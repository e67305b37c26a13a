#include "render/raster/mirror.h"

#include <algorithm>
#include <map>
#include <vector>

#include "render/see_through.h"

namespace render::raster {

std::optional<MirrorPlane> find_mirror_plane(const world::WorldView& view, const world::RayStream& occupied,
                                             const Camera& camera, int width, int height) {
  constexpr int kColumns = 32, kRows = 18, kLeast = kColumns * kRows / 50;
  const PixelRays picture(camera, width, height);
  std::vector<world::GridRay> rays;
  for (int y = 0; y < kRows; ++y)
    for (int x = 0; x < kColumns; ++x)
      rays.emplace_back(camera.position, picture.direction((x + 0.5) * width / kColumns, (y + 0.5) * height / kRows));
  std::vector<world::GridHit> hits(rays.size());
  occupied.first_set(rays, hits);
  const SeeThroughKinds kinds(view.palette());
  std::map<std::pair<int, int32_t>, int> met;  // by axis and plane
  for (const world::GridHit& hit : hits) {
    if (!hit.hit() || hit.face == world::kNoFace) continue;
    const world::BlockId block = view.store().get(hit.voxel);
    const bool dielectric =
        kinds.contains(block) && kinds.of(block).matte.w == static_cast<float>(shared::kSeeThroughDielectric);
    if (!dielectric && !is_mirror(view.palette()[block])) continue;
    const int axis = world::face_axis(hit.face);
    ++met[{axis, hit.voxel[axis] + (hit.face & 1)}];
  }
  const auto most = std::max_element(met.begin(), met.end(), [](auto& a, auto& b) { return a.second < b.second; });
  if (most == met.end() || most->second < kLeast) return std::nullopt;
  const auto [axis, plane] = most->first;
  return MirrorPlane{axis, plane, camera.position.voxel[axis] >= plane ? 1 : -1};
}

Camera mirrored_camera(const Camera& camera, const MirrorPlane& mirror) {
  Camera mirrored = camera;
  const int a = mirror.axis;
  double& fraction = mirrored.position.fraction[a];
  mirrored.position.voxel[a] = 2 * mirror.plane - camera.position.voxel[a] - (fraction > 0 ? 1 : 0);
  if (fraction > 0) fraction = 1 - fraction;
  mirrored.forward[a] = -camera.forward[a];
  return mirrored;
}

}  // namespace render::raster
