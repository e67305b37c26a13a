// What a scene of light may say wrong: file, line, key and the allowed range, one sentence each.
#include <fstream>

#include <gtest/gtest.h>

#include "tests/support.h"
#include "world/proxies/proxy.h"
#include "world/scenes/scene.h"

namespace world {
namespace {

const std::string kHead = "[world]\ngenerator = \"empty\"\nsize = [16, 16, 16]\n";  // lines 1 to 3
const std::string kBlock =
    "[block.thing]\ndensity_kg_per_m3 = 1000\nheat_capacity_j_per_kg_k = 1000\nheat_conductivity_w_per_m_k = 1\n"
    "hardness_mohs = 3\n";  // lines 4 to 8

/// What loading and building a scene says, after the folder.
std::string error_of(const std::string& text, std::optional<World>* built = nullptr) {
  const TemporaryFolder folder;
  std::ofstream(folder / "a.toml") << text;
  std::ofstream(folder / "empty.obj") << "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  const std::string path = (folder / "a.toml").string(), start = path.substr(0, path.size() - 6);
  const auto told = [&](std::string message) {
    for (size_t at; (at = message.find(start)) != std::string::npos;) message.erase(at, start.size());
    return message;
  };
  const auto scene = load_scene(path);
  if (!scene.ok()) return told(scene.error().message);
  ImportReport report;
  auto world = build_world(*scene, report);
  if (!world.ok()) return told(world.error().message);
  if (!built) return "";
  *built = std::move(*world);
  const Status proxies = check_proxies(*(*built)->palette);
  return proxies.ok() ? "" : told(proxies.error().message);
}

TEST(BadLight, EachIsOneSentenceWithFileLineKeyAndRange) {
  const std::string lamp = kHead + "[[luminaire]]\nposition = [1, 2, 3]\n";  // lines 4, 5
  const std::pair<std::string, std::string> wrong[] = {
      // Negative and infinite power.
      {lamp + "kind = \"omni\"\npower_w = [1, -1, 0]\n", "a.toml:7:15: 'power_w[1]' is -1, but must be in [0, 1e+15]"},
      {lamp + "kind = \"omni\"\npower_w = [1, inf, 0]\n",
       "a.toml:7:15: 'power_w[1]' is inf, but must be in [0, 1e+15]"},
      {lamp + "kind = \"omni\"\npower_w = [nan, 0, 0]\n",
       "a.toml:7:12: 'power_w[0]' is nan, but must be in [0, 1e+15]"},
      {kHead + "[sun]\nirradiance = [1, 1, -1]\n", "a.toml:5:21: 'irradiance[2]' is -1, but must be in [0, 1e+09]"},
      {kHead + "[sky]\nzenith = [inf, 1, 1]\n", "a.toml:5:11: 'zenith[0]' is inf, but must be in [0, 1e+09]"},
      {kHead + kBlock + "albedo = [0.5, 0.5, 0.5]\nemission_w = [-1, 0, 0]\n",
       "a.toml:10:15: 'emission_w[0]' is -1, but must be at least 0"},
      {kHead + kBlock + "albedo = [0.5, 0.5, 0.5]\nemission_w = [inf, 0, 0]\n",
       "a.toml:10:15: 'emission_w[0]' is inf, but must be finite and at least 0"},
      // No size where size matters.
      {lamp + "kind = \"sphere\"\npower_w = [1, 1, 1]\nradius_m = 0\n",
       "a.toml:8:12: 'radius_m' is 0, but must be in [1e-06, 1e+06]"},
      {lamp + "kind = \"disk\"\npower_w = [1, 1, 1]\nradius_m = -2\n",
       "a.toml:8:12: 'radius_m' is -2, but must be in [1e-06, 1e+06]"},
      {lamp + "kind = \"rectangle\"\npower_w = [1, 1, 1]\nsize = [1, 0]\n",
       "a.toml:8:12: 'size[1]' is 0, but must be in [1e-06, 1e+06]"},
      // Half-angles outside 0..pi.
      {lamp + "kind = \"spot\"\npower_w = [1, 1, 1]\nhalf_angle_deg = -0.5\n",
       "a.toml:8:18: 'half_angle_deg' is -0.5, but must be in [0, 180]"},
      {lamp + "kind = \"spot\"\npower_w = [1, 1, 1]\nhalf_angle_deg = 181\n",
       "a.toml:8:18: 'half_angle_deg' is 181, but must be in [0, 180]"},
      {lamp + "kind = \"spot\"\npower_w = [1, 1, 1]\nhalf_angle_deg = 20\ninner_half_angle_deg = 200\n",
       "a.toml:9:24: 'inner_half_angle_deg' is 200, but must be in [0, 180]"},
      // Albedo outside (0, 1), indices of refraction below 1.
      {kHead + kBlock + "albedo = [0.5, 0, 0.5]\n", "a.toml:9:16: 'albedo[1]' is 0, but must be in (0, 1)"},
      {kHead + kBlock + "albedo = [1, 0.5, 0.5]\n", "a.toml:9:11: 'albedo[0]' is 1, but must be in (0, 1)"},
      {kHead + kBlock + "albedo = [0.5, 0.5, 0.5]\nindex_of_refraction = 0.9\n",
       "a.toml:10:23: 'index_of_refraction' is 0.9, but must be in [1, 5]"},
      // Empty meshes.
      {kHead + "[[mesh]]\nblock = \"sand\"\nfile = \"empty.obj\"\n",
       "a.toml:6:8: empty.obj: the mesh is empty: it has no face"},
      // Media of negative density.
      {kHead + "[[medium]]\nname = \"m\"\nkind = \"homogeneous\"\nscattering_per_m = [0.1, -0.1, 0.1]\n",
       "a.toml:7:26: 'scattering_per_m[1]' is -0.1, but must be in [0, 1e+09]"},
      {kHead + "[[medium]]\nname = \"m\"\nkind = \"homogeneous\"\nabsorption_per_m = -1\n",
       "a.toml:7:20: 'absorption_per_m' is -1, but must be in [0, 1e+09]"},
  };
  for (const auto& [text, expected] : wrong) EXPECT_EQ(error_of(text), expected) << text;
}

TEST(BadLight, AnUnknownShapeIsNamedWithTheNearest) {
  std::optional<World> world;
  EXPECT_EQ(error_of(kHead + kBlock + "albedo = [0.5, 0.5, 0.5]\nproxy = \"fenc\"\n", &world),
            "a.toml:10:9: 'proxy' of block 'thing': there is no proxy 'fenc'; the nearest is 'fence'");
  // A BSDF's name is the renderer's to judge; where it stands is kept for it.
  EXPECT_EQ(error_of(kHead + kBlock + "albedo = [0.5, 0.5, 0.5]\nbsdf = \"miror\"\n", &world), "");
  const std::string where = (*world->palette)[*world->palette->find("thing")].where_bsdf;
  EXPECT_EQ(where.substr(where.find("a.toml")), "a.toml:10:8");
}

}  // namespace
}  // namespace world
