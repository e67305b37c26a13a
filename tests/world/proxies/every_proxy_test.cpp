// Laws that hold for every shape of world/proxies, and what is said of bad ones.
#include <cmath>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include "world/proxies/proxy.h"

namespace world {

namespace {

std::string error_of(const std::string& text) {
  const auto proxy = read_proxy("bad", text, "bad.toml");
  return proxy.ok() ? "" : proxy.error().message;
}

}  // namespace

TEST(EveryProxy, IsNamedByItsFileAndSaysWhatItIs) {
  ASSERT_GE(proxies().size(), 5u);
  for (const Proxy& proxy : proxies()) {
    EXPECT_EQ(find_proxy(proxy.name), &proxy);
    EXPECT_FALSE(proxy.what.empty()) << proxy.name;
  }
  EXPECT_EQ(find_proxy("no_such"), nullptr);
}

TEST(EveryProxy, IsThereForEachBlockThatNamesOne) {
  const auto shapes = block_shapes(standard_blocks());
  ASSERT_TRUE(shapes.ok()) << shapes.error().message;
  ASSERT_EQ(shapes->shape.size(), standard_blocks().size());
  for (size_t id = 0; id < shapes->shape.size(); ++id) {
    const std::string& name = standard_blocks()[static_cast<BlockId>(id)].proxy;
    EXPECT_EQ(shapes->shape[id] ? shapes->shape[id]->name : "", name);
  }
}

TEST(EveryProxy, FacesLieInTheVoxelAndThoseOfABoxLookOutwards) {
  for (const Proxy& proxy : proxies())
    for (int joins = 0; joins < 64; ++joins) {
      const std::vector<ProxyFace> faces = proxy_faces(proxy, static_cast<uint8_t>(joins));
      size_t boxes = 0, quads = 0;
      for (const ProxyBox& box : proxy.boxes) boxes += proxy.has_part(box.joins, static_cast<uint8_t>(joins));
      for (const ProxyQuad& quad : proxy.quads) quads += proxy.has_part(quad.joins, static_cast<uint8_t>(joins));
      ASSERT_EQ(faces.size(), 6 * boxes + quads) << proxy.name;
      for (size_t i = 0; i < faces.size(); ++i) {
        const Vec3f* c = faces[i].corner;
        for (int k = 0; k < 4; ++k)
          for (int a = 0; a < 3; ++a) EXPECT_TRUE(c[k][a] >= 0 && c[k][a] <= 1) << proxy.name;
        const Vec3f normal = cross(c[1] - c[0], c[3] - c[0]);
        EXPECT_GT(length(normal), 0) << proxy.name;
        EXPECT_EQ(c[0] + (c[1] - c[0]) + (c[3] - c[0]), c[2]) << proxy.name;
        if (i >= 6 * boxes) continue;
        Vec3f middle(0);  // of the face's box
        for (size_t f = i / 6 * 6; f < i / 6 * 6 + 6; ++f)
          for (const Vec3f& corner : faces[f].corner) middle += corner / 24.0f;
        EXPECT_GT(dot(normal, c[0] - middle), 0) << proxy.name << " face " << i;
      }
    }
}

TEST(EveryProxy, BoundsHoldAllPartsThatAreThere) {
  for (const Proxy& proxy : proxies()) {
    ASSERT_EQ(proxy.bounds.size(), 64u);
    for (int joins = 0; joins < 64; ++joins)
      for (const ProxyFace& face : proxy_faces(proxy, static_cast<uint8_t>(joins)))
        for (const Vec3f& corner : face.corner)
          for (int a = 0; a < 3; ++a) {
            EXPECT_LE(proxy.bounds[joins].low[a], corner[a]) << proxy.name;
            EXPECT_GE(proxy.bounds[joins].high[a], corner[a]) << proxy.name;
          }
  }
}

TEST(EveryProxy, PartsThatJoinReachTheirSideOfTheVoxel) {
  for (const Proxy& proxy : proxies())
    for (const ProxyBox& box : proxy.boxes) {
      if (box.joins == kAlways) continue;
      const int axis = face_axis(box.joins);
      EXPECT_EQ(face_sign(box.joins) > 0 ? box.high[axis] : box.low[axis], face_sign(box.joins) > 0 ? 1 : 0)
          << proxy.name;
    }
}

TEST(Proxy, AFenceJoinsFencesAndSolidBlocksBesideItOnly) {
  const BlockPalette& blocks = standard_blocks();
  const Proxy& fence = *find_proxy("fence");
  const auto joins = [&](const char* neighbour, int face) {
    return block_shapes(blocks)->joins_at(fence, {5, 5, 5}, [&](VoxelPos v) {
      return v == VoxelPos{5, 5, 5} + face_step(face) ? *blocks.find(neighbour) : kAir;
    });
  };
  EXPECT_EQ(joins("fence_pine", kFacePosX), 1 << kFacePosX);
  EXPECT_EQ(joins("stone", kFaceNegZ), 1 << kFaceNegZ);
  EXPECT_EQ(joins("stone", kFaceNegY), 0);
  EXPECT_EQ(joins("torch", kFacePosX), 0);
  EXPECT_EQ(joins("water", kFacePosX), 0);
  EXPECT_EQ(joins("air", kFacePosX), 0);
  EXPECT_EQ(proxy_faces(fence, 0).size(), 6u);
  EXPECT_EQ(proxy_faces(fence, 1 << kFacePosX).size(), 18u);
}

TEST(Proxy, BadOnesAreOneSentenceThatSaysWhere) {
  const std::string head = "what = \"bad\"\n";
  EXPECT_EQ(error_of(head + "[[box]]\nlow = [0, 0, 0]\nhigh = [1, 1, 1]\n"), "");
  const auto expect = [&](const std::string& text, const std::string& where, const std::string& what) {
    const std::string error = error_of(head + text);
    EXPECT_EQ(error.find("bad.toml:" + where), 0u) << error;
    EXPECT_NE(error.find(what), std::string::npos) << error;
  };
  expect("[[box]]\nlow = [0, 0, 0]\nhigh = [1, 1.5, 1]\n", "4:", "high");
  expect("[[box]]\nlow = [0, 0.5, 0]\nhigh = [1, 0.5, 1]\n", "4:", "larger");
  expect("[[box]]\nlow = [0, 0, 0]\n", "2:", "high");
  expect("[[box]]\nlow = [0, 0, nan]\nhigh = [1, 1, 1]\n", "3:", "low");
  expect("[[box]]\nlow = [0, 0, 0]\nhigh = [1, 1, 1]\njoins = \"east\"\n", "5:", "joins");
  expect("[[quad]]\ncorner = [0.5, 0, 0]\nu = [0.75, 0, 0]\nv = [0, 1, 0]\n", "3:", "voxel");
  expect("[[quad]]\ncorner = [0, 0, 0]\nu = [0.5, 0, 0]\nv = [0.25, 0, 0]\n", "5:", "area");
  expect("[[box]]\nlow = [0, 0, 0]\nhigh = [1, 1, 1]\n[[sphere]]\nradius = 1\n", "5:", "sphere");
  EXPECT_NE(error_of(head).find("at least one"), std::string::npos);
  std::string many = head;
  for (size_t i = 0; i <= kMostProxyParts; ++i) many += "[[box]]\nlow = [0, 0, 0]\nhigh = [1, 1, 1]\n";
  EXPECT_NE(error_of(many).find("at most"), std::string::npos);

  BlockPalette palette;
  Block block;
  block.name = "odd", block.proxy = "fenc";
  ASSERT_TRUE(palette.add(block).ok());
  const auto shapes = block_shapes(palette);
  ASSERT_FALSE(shapes.ok());
  EXPECT_NE(shapes.error().message.find("'odd'"), std::string::npos);
  EXPECT_NE(shapes.error().message.find("'fence'"), std::string::npos);
}

}  // namespace world
