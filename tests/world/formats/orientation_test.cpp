/// No world comes in mirrored, upside-down or moved: positions that another program worked out, things that hang on
/// what is behind them, and small files whose three directions differ. Other kinds prove it beside their facts: regions
/// by the heights that the game stored (games_facts_test), .vox by parts that would overlap (vox_test), elevation by
/// posts and by a crater that opens to the north (hgt_test, heights_test), grids, meshes and points by their bounds.
#include <array>
#include <fstream>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include "tests/world/formats/formats_support.h"
#include "world/formats/translation/translation.h"

namespace world {
namespace {

using nlohmann::json;

/// The blocks of a file as schematic4j's own tests keep them: a list of positions and states.
json blocks_of_peer(const char* snapshot) {
  const auto path = shared_data(std::string("gt/") + snapshot);
  if (!path) return {};
  std::ifstream in(*path);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const size_t begin = text.find('=') + 1, end = text.find("\n]", begin);
  return json::parse(text.substr(begin, end + 2 - begin))[0];
}

VoxelPos position(const json& block) {
  return {block["left"]["x"].get<int>(), block["left"]["y"].get<int>(), block["left"]["z"].get<int>()};
}

World read(const std::string& name) {
  ImportReport report;
  auto world = read_world(*shared_data(name), {}, report);
  EXPECT_TRUE(world.ok()) << (world.ok() ? "" : world.error().message);
  return world.ok() ? std::move(*world) : World();
}

TEST(Orientation, OfASpongeSchematicIsThatOfAnotherProgramsBlockForBlock) {
  const json blocks = blocks_of_peer("schematic4j_SpongeParserTest.snap");
  if (blocks.is_null()) GTEST_SKIP();
  const World world = read("schem/issue-1.schem");
  ASSERT_EQ(blocks.size(), 369u);
  for (const json& block : blocks) {
    BlockState state{block["right"]["block"], {}};
    for (const auto& [key, value] : block["right"]["states"].items())
      state.properties[key] = value.is_string() ? value.get<std::string>() : value.dump();
    const auto expected = translate(translation_table("minecraft"), state);
    ASSERT_TRUE(expected) << state_text(state);
    const VoxelPos v = position(block);
    EXPECT_EQ((*world.palette)[world.store.get(v)].name, expected->block.name)
        << v.x << " " << v.y << " " << v.z << " " << state_text(state);
  }
}

TEST(Orientation, OfANumericSchematicIsThatOfAnotherPrograms) {
  const json blocks = blocks_of_peer("schematic4j_SchematicaParserTest.snap");
  if (blocks.is_null()) GTEST_SKIP();
  const World world = read("schem/9383.schematic");
  ASSERT_EQ(blocks.size(), 4998u);
  // Names of the two differ by age, so a block of ours stands for one name of theirs, everywhere. Those that are
  // another one's: some that look alike to us; and most, where the world were mirrored.
  const auto others = [&](std::array<bool, 3> mirrored) {
    const VoxelPos last{13, 16, 20};
    std::map<BlockId, std::map<std::string, int>> names;
    for (const json& block : blocks) {
      VoxelPos v = position(block);
      for (int axis = 0; axis < 3; ++axis)
        if (mirrored[static_cast<size_t>(axis)]) v[axis] = last[axis] - v[axis];
      ++names[world.store.get(v)][block["right"]["name"]];
    }
    int other = 0;
    for (const auto& [id, of_id] : names) {
      int most = 0, sum = 0;
      for (const auto& [name, count] : of_id) most = std::max(most, count), sum += count;
      other += sum - most;
    }
    return other;
  };
  const int as_read = others({false, false, false});
  EXPECT_LT(as_read, 150);
  EXPECT_GT(others({true, false, false}), 4 * as_read);
  EXPECT_GT(others({false, true, false}), 4 * as_read);
  EXPECT_GT(others({false, false, true}), 4 * as_read);
  for (const json& block : blocks)
    EXPECT_EQ(world.store.get(position(block)) == kAir, block["right"]["name"] == "minecraft:air");
}

TEST(Orientation, LaddersHangOnWhatIsBehindThem) {
  static const std::map<std::string, VoxelPos> kBehind = {
      {"east", {-1, 0, 0}}, {"west", {1, 0, 0}}, {"south", {0, 0, -1}}, {"north", {0, 0, 1}}};
  int files = 0;
  for (const char* name : {"schem/house_39.litematic", "schem/smallhouse1.schem", "schem/9383.schematic"}) {
    if (!shared_data(name)) continue;
    SCOPED_TRACE(name);
    ++files;
    const World world = read(name);
    int hanging = 0, ladders = 0;
    const VoxelBox box = world.store.bounds();
    for (int x = box.min.x; x <= box.max.x; ++x)
      for (int y = box.min.y; y <= box.max.y; ++y)
        for (int z = box.min.z; z <= box.max.z; ++z) {
          const BlockState state = parse_state((*world.palette)[world.store.get({x, y, z})].name);
          const auto facing = state.properties.find("facing");
          if (state.name != "minecraft:ladder" || facing == state.properties.end()) continue;
          const BlockId behind = world.store.get(VoxelPos{x, y, z} + kBehind.at(facing->second));
          ++ladders;
          hanging +=
              behind != kAir && (*world.palette)[behind].name != (*world.palette)[world.store.get({x, y, z})].name;
        }
    EXPECT_GE(ladders, 2);
    EXPECT_EQ(hanging, ladders);
  }
  if (files == 0) GTEST_SKIP();
}

TEST(Orientation, OfLuantisSchematics) {
  // East is x, up y, north z; ours is south. Nodes at the corner and one step in each direction.
  const TemporaryFolder folder;
  const int size[3] = {4, 3, 2};
  const char* names[] = {"air", "default:stone", "default:sand", "default:dirt", "default:gravel"};
  std::string nodes(4 * 24, '\0');
  const auto put = [&](int x, int y, int z, int content) {
    nodes[static_cast<size_t>((z * size[1] + y) * size[0] + x) * 2 + 1] = static_cast<char>(content);
  };
  put(0, 0, 0, 1), put(3, 0, 0, 2), put(0, 2, 0, 3), put(0, 0, 1, 4);
  std::string file = "MTSM";
  const auto put16 = [&](size_t v) { file += {static_cast<char>(v >> 8), static_cast<char>(v & 255)}; };
  put16(4);
  for (const int s : size) put16(static_cast<size_t>(s));
  file += std::string(3, '\x7f');
  put16(5);
  for (const std::string name : names) put16(name.size()), file += name;
  for (size_t i = 48; i < 72; ++i) nodes[i] = '\x7f';
  std::string packed(compressBound(nodes.size()), '\0');
  uLongf packed_size = packed.size();
  ASSERT_EQ(compress(reinterpret_cast<Bytef*>(packed.data()), &packed_size,
                     reinterpret_cast<const Bytef*>(nodes.data()), nodes.size()),
            Z_OK);
  std::ofstream(folder / "a.mts", std::ios::binary) << file << packed.substr(0, packed_size);
  ImportReport report;
  const auto world = read_world(folder / "a.mts", {}, report);
  ASSERT_TRUE(world.ok()) << world.error().message;
  const auto at = [&](VoxelPos v) { return (*world->palette)[world->store.get(v)].name; };
  EXPECT_EQ(world->store.voxel_count(), 4u);
  EXPECT_EQ(at({0, 0, -1}), "stone");
  EXPECT_EQ(at({3, 0, -1}), "sand") << "east";
  EXPECT_EQ(at({0, 2, -1}), "dirt") << "up";
  EXPECT_EQ(at({0, 0, -2}), "gravel") << "north is -z";
}

TEST(Orientation, OfQubiclesTwoKindsOfAxes) {
  for (const uint32_t right_handed : {0u, 1u}) {
    SCOPED_TRACE(right_handed);
    const TemporaryFolder folder;
    std::string file;
    const auto put32 = [&](uint32_t v) { file.append(reinterpret_cast<const char*>(&v), 4); };
    put32(257), put32(0), put32(right_handed), put32(0), put32(0), put32(1);
    file += std::string("\1m", 2);
    for (const uint32_t s : {4u, 3u, 2u}) put32(s);
    for (const uint32_t p : {10u, 20u, 30u}) put32(p);
    for (uint32_t z = 0; z < 2; ++z)
      for (uint32_t y = 0; y < 3; ++y)
        for (uint32_t x = 0; x < 4; ++x) {
          const bool red = x == 3 && y == 0 && z == 0, green = x == 0 && y == 2 && z == 0,
                     blue = x == 0 && y == 0 && z == 1;
          put32(red ? 0xff0000ff : green ? 0xff00ff00 : blue ? 0xffff0000 : 0);
        }
    std::ofstream(folder / "a.qb", std::ios::binary) << file;
    ImportReport report;
    const auto world = read_world(folder / "a.qb", {}, report);
    ASSERT_TRUE(world.ok()) << world.error().message;
    const auto at = [&](VoxelPos v) { return (*world->palette)[world->store.get(v)].name; };
    const int near = right_handed ? 30 : -31, far = right_handed ? 31 : -32;
    EXPECT_EQ(at({13, 20, near}), "qb:FF0000");
    EXPECT_EQ(at({10, 22, near}), "qb:00FF00");
    EXPECT_EQ(at({10, 20, far}), "qb:0000FF");
  }
}

TEST(Orientation, OfScannersAndMeshes) {
  const TemporaryFolder folder;
  // Points: z upwards, unless the options say y.
  std::ofstream(folder / "a.ply")
      << "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty "
         "float z\nend_header\n0.5 0.5 0.5\n3.5 0.5 0.5\n0.5 2.5 0.5\n0.5 0.5 5.5\n";
  ImportReport report;
  const auto up_z = read_world(folder / "a.ply", {.metres_per_voxel = 1}, report);
  ASSERT_TRUE(up_z.ok()) << up_z.error().message;
  for (const VoxelPos v : {VoxelPos{0, 0, -1}, {3, 0, -1}, {0, 0, -3}, {0, 5, -1}}) EXPECT_NE(up_z->store.get(v), kAir);
  ImportOptions options{.metres_per_voxel = 1};
  options.up = ImportOptions::Up::y;
  const auto up_y = read_world(folder / "a.ply", options, report);
  ASSERT_TRUE(up_y.ok()) << up_y.error().message;
  for (const VoxelPos v : {VoxelPos{0, 0, 0}, {3, 0, 0}, {0, 2, 0}, {0, 0, 5}}) EXPECT_NE(up_y->store.get(v), kAir);
  // A tetrahedron with a corner far out on each axis.
  std::ofstream(folder / "a.obj") << "v 0 0 0\nv 12 0 0\nv 0 8 0\nv 0 0 4\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
  const auto mesh = read_world(folder / "a.obj", {.metres_per_voxel = 1}, report);
  ASSERT_TRUE(mesh.ok()) << mesh.error().message;
  const VoxelBox box = mesh->store.bounds();
  EXPECT_EQ(box.min, (VoxelPos{0, 0, 0}));
  EXPECT_GT(box.max.x, box.max.y);
  EXPECT_GT(box.max.y, box.max.z);
}

}  // namespace
}  // namespace world
