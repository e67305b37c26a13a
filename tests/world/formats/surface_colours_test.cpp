/// Colours of meshes and points become blocks of those colours.
#include <fstream>
#include <functional>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <png.h>

#include "tests/world/formats/formats_support.h"
#include "world/formats/surfaces/colours.h"
#include "world/units/rgb8.h"

namespace world {
namespace {

namespace fs = std::filesystem;

void write_text(const fs::path& path, const std::string& text) { std::ofstream(path, std::ios::binary) << text; }

/// RGB of 8 bits, or a palette where `palette` says so.
void write_png(const fs::path& path, uint32_t width, uint32_t height, std::vector<uint8_t> samples, bool palette) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION, image.width = width, image.height = height;
  image.format = palette ? PNG_FORMAT_RGB_COLORMAP : PNG_FORMAT_RGB;
  std::vector<uint8_t> colours = samples;
  std::vector<uint8_t> indices;
  for (uint32_t i = 0; i < width * height; ++i) indices.push_back(static_cast<uint8_t>(i));
  image.colormap_entries = palette ? width * height : 0;
  ASSERT_TRUE(png_image_write_to_file(&image, path.c_str(), 0, palette ? indices.data() : samples.data(), 0,
                                      palette ? colours.data() : nullptr));
}

World read(const fs::path& path, ImportReport& report, ImportOptions options = {}) {
  auto world = read_world(path, options, report);
  EXPECT_TRUE(world.ok()) << (world.ok() ? "" : world.error().message);
  return world.ok() ? std::move(*world) : World();
}

/// sRGB of the block at a voxel.
uint32_t colour_at(const World& world, VoxelPos v) {
  const BlockId id = world.store.get(v);
  EXPECT_NE(id, kAir) << v.x << " " << v.y << " " << v.z;
  return rgb8_from_linear((*world.palette)[id].albedo);
}

/// As kMinAlbedo and kMaxAlbedo leave it.
uint32_t kept(uint32_t rgb) {
  const Ratio3 c = linear_from_rgb8(rgb);
  const auto clamp = [](float v) { return std::clamp(v, kMinAlbedo, kMaxAlbedo); };
  return rgb8_from_linear({clamp(c.r), clamp(c.g), clamp(c.b)});
}

/// A box of 8 x 4 x 4 m from the origin as quads, six faces of an .obj from vertex 1; each line with `colour(x, y, z)`
/// behind it. `use(face)` goes before each face: -x +x -y +y -z +z.
std::string box_obj(const std::function<std::string(int, int, int)>& colour, const std::function<std::string(int)>& use,
                    const std::string& head = "") {
  std::string text = head;
  for (const int x : {0, 8})
    for (const int y : {0, 4})
      for (const int z : {0, 4}) text += fmt::format("v {} {} {}{}\n", x, y, z, colour(x, y, z));
  text += "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
  const int faces[6][4] = {{1, 2, 4, 3}, {5, 7, 8, 6}, {1, 5, 6, 2}, {3, 4, 8, 7}, {1, 3, 7, 5}, {2, 6, 8, 4}};
  for (int f = 0; f < 6; ++f) {
    text += use(f) + "f";
    for (int k = 0; k < 4; ++k) text += fmt::format(" {}/{}", faces[f][k], k + 1);
    text += "\n";
  }
  return text;
}
std::string nothing(int, int, int) { return ""; }

TEST(SurfaceColours, OfVerticesAreBlendedAcrossAnObj) {
  const TemporaryFolder folder;
  // Red on the west side, blue on the east.
  write_text(folder / "a.obj",
             box_obj([](int x, int, int) { return x == 0 ? " 1 0 0" : " 0 0 1"; }, [](int) { return ""; }));
  ImportReport report;
  const World world = read(folder / "a.obj", report, {.metres_per_voxel = 1});
  EXPECT_EQ(world.store.voxel_count(), 8u * 4 * 4);
  const uint32_t west = colour_at(world, {0, 1, 3}), east = colour_at(world, {7, 1, 3});
  EXPECT_GT(west >> 16, 200u);
  EXPECT_LT(west & 255, 120u);
  EXPECT_GT(east & 255, 200u);
  EXPECT_LT(east >> 16, 120u);
  for (int x = 1; x < 8; ++x)  // along the face the one fades into the other
    EXPECT_LE(colour_at(world, {x, 1, 3}) >> 16, colour_at(world, {x - 1, 1, 3}) >> 16) << x;
}

TEST(SurfaceColours, OfMaterialsAndTexturesOfAnObj) {
  for (const bool palette : {false, true}) {
    SCOPED_TRACE(palette);
    const TemporaryFolder folder;
    fs::create_directory(folder / "textures");
    // Four pixels: red, green above; blue, white below. v of .obj goes upwards.
    write_png(folder / "textures/four.png", 2, 2, {255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255}, palette);
    write_text(folder / "a.mtl",
               "# materials\nnewmtl plain\nKd 0.25 0.5 0.125\nd 1\n\nnewmtl other\nKd 1 1 1\n"
               "newmtl picture\nKd 1 1 1\nmap_Kd -s 1 1 1 textures\\four.png\n");
    write_text(folder / "a.obj",
               box_obj(
                   nothing, [](int f) { return f == 5   ? "usemtl picture\n"
                                               : f == 0 ? "usemtl plain\n"
                                                        : ""; },
                   "mtllib a.mtl\n"));
    ImportReport report;
    const World world = read(folder / "a.obj", report, {.metres_per_voxel = 1});
    EXPECT_TRUE(report.warnings.empty()) << report.warnings.front();
    EXPECT_EQ(fact(report, "materials"), "2, 1 with textures");
    // The face to the south is the picture: corners (0, 0), (8, 0), (8, 4), (0, 4) in x and y.
    EXPECT_EQ(colour_at(world, {2, 1, 3}), kept(0x0000ff));
    EXPECT_EQ(colour_at(world, {6, 1, 3}), kept(0xffffff));
    EXPECT_EQ(colour_at(world, {2, 2, 3}), kept(0xff0000));
    EXPECT_EQ(colour_at(world, {6, 2, 3}), kept(0x00ff00));
    // The rest is plain: its Kd is the albedo.
    const BlockId id = world.store.get({4, 3, 1});
    const Ratio3 albedo = (*world.palette)[id].albedo;
    EXPECT_EQ(rgb8_from_linear(albedo), rgb8_from_linear({0.25f, 0.5f, 0.125f}));
  }
}

TEST(SurfaceColours, WhatIsMissingIsToldAndAnErrorWhereItMustNotBe) {
  const TemporaryFolder folder;
  write_text(folder / "a.mtl", "newmtl plain\nKd 0.25 0.5 0.125\nd 0.5\nmap_Kd away.png\n");
  write_text(folder / "a.obj",
             box_obj(
                 nothing, [](int f) { return f == 0   ? "usemtl plain\n"
                                             : f == 1 ? "usemtl unknown\n"
                                                      : ""; },
                 "mtllib a.mtl\nmtllib ../outside.mtl\n"));
  write_text(folder / "../outside.mtl", "newmtl unknown\nKd 1 0 0\n");  // exists, and is not for this file to open
  ImportReport report;
  const World world = read(folder / "a.obj", report, {.metres_per_voxel = 1});
  fs::remove(folder / "../outside.mtl");
  const auto told = [&](const std::string& what) {
    return std::any_of(report.warnings.begin(), report.warnings.end(),
                       [&](const std::string& w) { return w.find(what) != w.npos; });
  };
  EXPECT_TRUE(told("outside.mtl"));
  EXPECT_TRUE(told("away.png"));
  EXPECT_TRUE(told("1 of 2 materials"));
  EXPECT_TRUE(told("let light pass"));
  ImportReport strict;
  const auto refused = read_world(folder / "a.obj", {.strict = true, .metres_per_voxel = 1}, strict);
  ASSERT_FALSE(refused.ok());
  EXPECT_TRUE(refused.error().message.starts_with((folder / "a.obj").string())) << refused.error().message;
}

TEST(SurfaceColours, OfVerticesAndFacesOfPlys) {
  const TemporaryFolder folder;
  const std::string corners[8] = {"0 0 0", "0 0 4", "0 4 0", "0 4 4", "8 0 0", "8 0 4", "8 4 0", "8 4 4"};
  const std::string faces[6] = {"0 1 3 2", "4 6 7 5", "0 4 5 1", "2 3 7 6", "0 2 6 4", "1 5 7 3"};
  std::string vertices =
      "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\n"
      "element face 6\nproperty list uchar int vertex_indices\nend_header\n";
  for (const std::string& corner : corners) vertices += corner + " 200 100 50 255\n";
  for (const std::string& face : faces) vertices += "4 " + face + "\n";
  write_text(folder / "vertices.ply", vertices);
  std::string by_face =
      "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 6\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\n"
      "property float red\nproperty float green\nproperty float blue\nend_header\n";
  for (const std::string& corner : corners) by_face += corner + "\n";
  for (int f = 0; f < 6; ++f) by_face += "4 " + faces[f] + " 2 0.5 0.5 " + (f == 5 ? "1 0 0" : "0 0.2 0") + "\n";
  write_text(folder / "faces.ply", by_face);

  ImportReport report;
  const World a = read(folder / "vertices.ply", report, {.metres_per_voxel = 1});
  EXPECT_EQ(a.store.census().size(), 1u);
  EXPECT_EQ(colour_at(a, {3, 3, 3}), 0xc86432u);
  EXPECT_EQ(colour_at(a, {4, 2, 2}), 0xc86432u) << "inside, where no face is";
  const World b = read(folder / "faces.ply", report, {.metres_per_voxel = 1});
  EXPECT_EQ(colour_at(b, {3, 1, 3}), kept(0xff0000));
  EXPECT_EQ(colour_at(b, {3, 1, 0}), kept(0x003300));
}

TEST(SurfaceColours, OfPointsOfPlyAndPcd) {
  const TemporaryFolder folder;
  write_text(folder / "a.ply",
             "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float "
             "z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n"
             "0.5 0.5 0.5 255 0 0\n3.5 0.5 0.5 0 0 255\n3.6 0.5 0.5 0 0 255\n");
  ImportReport report;
  const World ply = read(folder / "a.ply", report, {.metres_per_voxel = 1});
  EXPECT_EQ(colour_at(ply, {0, 0, -1}), kept(0xff0000));
  EXPECT_EQ(colour_at(ply, {3, 0, -1}), kept(0x0000ff));

  // 0x00c86432 as a float's bits is 1.8403043e-38, as most programs write it.
  write_text(folder / "float.pcd",
             "VERSION .7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 1\nWIDTH 2\n"
             "HEIGHT 1\nPOINTS 2\nDATA ascii\n0.5 0.5 0.5 1.8403043e-38\nnan nan nan 0\n");
  const World ascii = read(folder / "float.pcd", report, {.metres_per_voxel = 1});
  EXPECT_EQ(colour_at(ascii, {0, 0, -1}) & 0xffff00u, 0xc86400u);

  std::string binary =
      "VERSION .7\nFIELDS rgba x y z\nSIZE 4 4 4 4\nTYPE U F F F\nCOUNT 1 1 1 1\nWIDTH 2\nHEIGHT 1\n"
      "POINTS 2\nDATA binary\n";
  const auto put_point = [&](uint32_t rgba, float x) {
    const float p[3] = {x, 0.5f, 0.5f};
    binary.append(reinterpret_cast<const char*>(&rgba), 4).append(reinterpret_cast<const char*>(p), 12);
  };
  put_point(0xff204060, 0.5f), put_point(0xff806040, 2.5f);
  write_text(folder / "binary.pcd", binary);
  const World packed = read(folder / "binary.pcd", report, {.metres_per_voxel = 1});
  EXPECT_EQ(colour_at(packed, {0, 0, -1}), kept(0x204060));
  EXPECT_EQ(colour_at(packed, {2, 0, -1}), kept(0x806040));
}

TEST(SurfaceColours, BallsAroundPointsHaveTheirColours) {
  const TemporaryFolder folder;
  write_text(folder / "a.ply",
             "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float "
             "z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n"
             "0.5 0.5 0.5 255 0 0\n20.5 0.5 0.5 0 0 255\n");
  ImportReport report;
  const World world = read(folder / "a.ply", report, {.metres_per_voxel = 1, .point_radius_m = 4});
  EXPECT_GT(world.store.voxel_count(), 400u);
  for (const auto& [x, colour] : {std::pair{0, 0xff0000u}, {20, 0x0000ffu}}) {
    VoxelPos top{x, 8, -1};
    while (world.store.get(top) == kAir) --top.y;
    EXPECT_GE(top.y, 3);
    EXPECT_EQ(colour_at(world, top), kept(colour));
  }
}

TEST(SurfaceColours, TooManyAreRoundedAsLittleAsMakesThemFit) {
  std::vector<uint32_t> colours;
  for (uint32_t i = 0; i < 20000; ++i) colours.push_back(i * 797 & 0xffffff);
  BlockPalette palette;
  const auto blocks = ColourBlocks::make(colours, "rgb", 4096, palette);
  ASSERT_TRUE(blocks.ok());
  EXPECT_LE(palette.size(), 4097u);
  EXPECT_GT(palette.size(), 512u) << "one bit more would have been too many, not three";
  EXPECT_NE(blocks->approximated().find("20000 colours"), std::string::npos) << blocks->approximated();
  for (const uint32_t colour : colours) {
    const uint32_t near = rgb8_from_linear(palette[(*blocks)[colour]].albedo);
    for (const int shift : {16, 8, 0})
      EXPECT_NEAR(double(colour >> shift & 255), double(near >> shift & 255), 32) << colour;
  }
  BlockPalette few;
  const auto exact = ColourBlocks::make({0x102030, 0xffffff}, "rgb", 2, few);
  ASSERT_TRUE(exact.ok());
  EXPECT_EQ(exact->approximated(), "");
  EXPECT_EQ(few[(*exact)[0x102030]].name, "rgb:102030");
}

}  // namespace
}  // namespace world
