#include "world/formats/vox.h"

#include <algorithm>
#include <random>
#include <set>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include "tests/world/formats/formats_support.h"

namespace world {
namespace {

// ---- building files -------------------------------------------------------------------------------------------

using Bytes = std::vector<uint8_t>;

void put(Bytes& out, const Bytes& more) { out.insert(out.end(), more.begin(), more.end()); }
Bytes ints(std::initializer_list<int64_t> values) {
  Bytes out;
  for (const int64_t v : values) {
    for (int shift = 0; shift < 32; shift += 8) out.push_back(static_cast<uint8_t>(v >> shift));
  }
  return out;
}
Bytes text(const std::string& s) {
  Bytes out = ints({static_cast<int64_t>(s.size())});
  out.insert(out.end(), s.begin(), s.end());
  return out;
}
Bytes dictionary(std::initializer_list<std::pair<std::string, std::string>> entries) {
  Bytes out = ints({static_cast<int64_t>(entries.size())});
  for (const auto& [key, value] : entries) put(out, text(key)), put(out, text(value));
  return out;
}
Bytes chunk(const std::string& id, const Bytes& content, const Bytes& children = {}) {
  Bytes out(id.begin(), id.end());
  put(out, ints({static_cast<int64_t>(content.size()), static_cast<int64_t>(children.size())}));
  put(out, content);
  put(out, children);
  return out;
}
Bytes vox_file(const Bytes& chunks) {
  Bytes out = {'V', 'O', 'X', ' '};
  put(out, ints({150}));
  put(out, chunk("MAIN", {}, chunks));
  return out;
}
Bytes join(std::initializer_list<Bytes> parts) {
  Bytes out;
  for (const Bytes& part : parts) put(out, part);
  return out;
}
Bytes model(int sx, int sy, int sz, const std::vector<std::array<int, 4>>& voxels) {
  Bytes content = ints({static_cast<int64_t>(voxels.size())});
  for (const auto& v : voxels) {
    for (const int b : v) content.push_back(static_cast<uint8_t>(b));
  }
  return join({chunk("SIZE", ints({sx, sy, sz})), chunk("XYZI", content)});
}
Bytes transform_node(int id, int child, std::initializer_list<std::pair<std::string, std::string>> frame) {
  return chunk("nTRN", join({ints({id}), dictionary({}), ints({child, -1, -1, 1}), dictionary(frame)}));
}
Bytes group_node(int id, const std::vector<int>& children) {
  Bytes content = join({ints({id}), dictionary({}), ints({static_cast<int64_t>(children.size())})});
  for (const int c : children) put(content, ints({c}));
  return chunk("nGRP", content);
}
Bytes shape_node(int id, int shown) {
  return chunk("nSHP", join({ints({id}), dictionary({}), ints({1, shown}), dictionary({})}));
}

const Bytes kOneVoxel = model(1, 1, 1, {{0, 0, 0, 7}});

/// The sentence with which parsing or placing fails, or "".
std::string failure(const Bytes& bytes) {
  const auto file = vox::parse(bytes, "some.vox");
  if (!file) return file.error().message;
  ImportReport report;
  const auto world = world_from_vox(*file, "some.vox", {}, report);
  return world ? "" : world.error().message;
}

void expect_failure(const Bytes& bytes, const std::string& words) {
  const std::string message = failure(bytes);
  EXPECT_NE(message.find("some.vox: "), std::string::npos) << message;
  EXPECT_NE(message.find(words), std::string::npos) << message;
}

// ---- facts of real files --------------------------------------------------------------------------------------

std::string model_crc(const vox::Model& model) {
  std::vector<vox::Voxel> sorted(model.voxels.begin(), model.voxels.end());
  std::sort(sorted.begin(), sorted.end(),
            [](const vox::Voxel& a, const vox::Voxel& b) { return std::tie(a.z, a.y, a.x) < std::tie(b.z, b.y, b.x); });
  uLong crc = crc32(0, nullptr, 0);
  for (const vox::Voxel& v : sorted) {
    const Bytef bytes[4] = {v.x, v.y, v.z, v.colour};
    crc = crc32(crc, bytes, 4);
  }
  return fmt::format("{:08x}", crc);
}

/// Bounds of the world in the axes of the file: (x, y, z) of the file is the voxel (x, z, -y - 1).
nlohmann::json bounds_in_file_axes(const VoxelBox& box) {
  return {{box.min.x, -box.max.z - 1, box.min.y}, {box.max.x, -box.min.z - 1, box.max.y}};
}

void expect_facts(const std::string& name, const nlohmann::json& facts) {
  SCOPED_TRACE(name);
  const auto path = shared_data(name);
  ASSERT_TRUE(path);
  const Bytes bytes = bytes_of(*path);
  const auto parsed = vox::parse(bytes, name);
  ASSERT_TRUE(parsed) << parsed.error().message;
  const vox::File& file = *parsed;

  EXPECT_EQ(file.version, facts["version"]);
  EXPECT_EQ(file.trailing_bytes, facts["trailing"]);
  EXPECT_EQ(file.has_palette, facts["rgba"]);
  EXPECT_EQ(file.index_map.has_value(), facts["imap"]);
  EXPECT_EQ(file.layers.size(), facts["LAYR"]);
  EXPECT_EQ(file.cameras.size(), facts["rCAM"]);
  EXPECT_EQ(file.render_settings.size(), facts["rOBJ"]);
  EXPECT_EQ(file.notes.size(), facts["NOTE"]);
  EXPECT_EQ(file.old_materials, facts["MATT"]);
  if (facts["MATT"] == 0) {
    EXPECT_EQ(file.materials.size(), facts["MATL"]);
  }
  EXPECT_EQ(file.pack ? nlohmann::json(*file.pack) : nlohmann::json(), facts["pack"]);
  std::set<std::string> unknown;
  for (const auto& [id, count] : file.unknown_chunks) unknown.insert(id);
  EXPECT_EQ(nlohmann::json(unknown), facts["unknown_chunks"]);
  int nodes[3] = {};
  for (const auto& [id, node] : file.nodes) ++nodes[node.kind];
  EXPECT_EQ(nodes[vox::Node::transform], facts["nTRN"]);
  EXPECT_EQ(nodes[vox::Node::group], facts["nGRP"]);
  EXPECT_EQ(nodes[vox::Node::shape], facts["nSHP"]);

  ASSERT_EQ(file.models.size(), facts["models"]);
  uint64_t voxels = 0;
  std::set<int> colours;
  for (size_t m = 0; m < file.models.size(); ++m) {
    const vox::Model& model = file.models[m];
    if (m < facts["sizes"].size()) {  // the first twelve
      EXPECT_EQ(nlohmann::json(model.size), facts["sizes"][m]) << "model " << m;
      EXPECT_EQ(model.voxels.size(), facts["counts"][m]) << "model " << m;
    }
    EXPECT_EQ(model_crc(model), facts["crc32_sorted_zyx_xyzi_per_model"][m]) << "model " << m;
    voxels += model.voxels.size();
    for (const vox::Voxel& v : model.voxels) colours.insert(v.colour);
  }
  EXPECT_EQ(voxels, facts["voxels"]);
  EXPECT_EQ(colours.size(), facts["colors_used"]);
  EXPECT_EQ(nlohmann::json({*colours.begin(), *colours.rbegin()}), facts["color_idx_minmax"]);
  std::map<std::string, int> types;
  for (const int colour : colours) {
    if (facts["MATL"] == 0) break;
    const auto material = file.materials.find(colour);
    if (material == file.materials.end()) continue;
    const auto type = material->second.find("_type");
    ++types[type == material->second.end() ? "(none)" : type->second];
  }
  EXPECT_EQ(nlohmann::json(types),
            facts["matl_types_used"].is_null() ? nlohmann::json::object() : facts["matl_types_used"]);

  const auto instances = vox::instances(file, name, -1);
  ASSERT_TRUE(instances) << instances.error().message;
  int rotated = 0, hidden = 0;
  for (const vox::Instance& i : *instances) rotated += i.transform.rotated(), hidden += i.hidden;
  EXPECT_EQ(instances->size(), facts["instances"]);
  EXPECT_EQ(rotated, facts["rotated_instances"]);
  EXPECT_EQ(hidden, facts["hidden_instances"]);

  // The world: [instanced voxels, distinct cells, min, max], all and without hidden parts.
  for (const bool visible_only : {false, true}) {
    SCOPED_TRACE(visible_only ? "visible" : "all");
    const nlohmann::json& expected = facts[visible_only ? "world_visible" : "world_all"];
    ImportReport report;
    const auto world = world_from_vox(file, name, {.visible_only = visible_only}, report);
    ASSERT_TRUE(world) << world.error().message;
    if (!visible_only) {
      EXPECT_EQ(fact(report, "instanced voxels"), expected[0].dump());
    }
    EXPECT_EQ(world->store.voxel_count(), expected[1]);
    EXPECT_EQ(bounds_in_file_axes(world->store.bounds()), nlohmann::json({expected[2], expected[3]}));
    if (!visible_only) {
      EXPECT_EQ(world->palette->size(), 1 + facts["colors_used"].get<size_t>());
    }
  }
}

TEST(Vox, FactsOfRealFilesHold) {
  if (shared_facts().is_null()) GTEST_SKIP();
  int files = 0;
  for (const auto& [name, facts] : shared_facts().items()) {
    if (!name.starts_with("vox/") || facts.contains("error")) continue;
    expect_facts(name, facts);
    ++files;
  }
  EXPECT_EQ(files, 19);
}

TEST(Vox, AFileOfAnotherKindIsRejectedInOneSentence) {
  const auto path = shared_data("vox/not_a.vox");
  if (!path) GTEST_SKIP();
  ImportReport report;
  const auto world = read_world(*path, {}, report);
  ASSERT_FALSE(world);
  EXPECT_EQ(world.error().kind, ErrorKind::input_output);
  EXPECT_NE(world.error().message.find("not_a.vox: byte 0: expected 'VOX '"), std::string::npos)
      << world.error().message;
  EXPECT_EQ(world.error().message.find('\n'), std::string::npos);
}

TEST(Vox, TheDefaultPaletteIsMagicaVoxels) {
  Bytes bytes;
  for (size_t i = 1; i <= 256; ++i) {
    const vox::Colour c = vox::default_palette()[i & 255];
    put(bytes, {c.r, c.g, c.b, c.a});
  }
  EXPECT_EQ(crc32(0, bytes.data(), static_cast<uInt>(bytes.size())), 0xdf275b0bu);
}

// ---- conventions ----------------------------------------------------------------------------------------------

TEST(Vox, FileAxesTurnIntoWorldAxesWithoutMirroring) {
  // Along x, y and z of the file from one corner: the world's x, -z and y.
  const Bytes bytes = vox_file(model(2, 2, 2, {{0, 0, 0, 1}, {1, 0, 0, 2}, {0, 1, 0, 3}, {0, 0, 1, 4}}));
  ImportReport report;
  const World world = world_from_vox(*vox::parse(bytes, "a"), "a", {}, report).value();
  const auto at = [&](int x, int y, int z) { return (*world.palette)[world.store.get({x, y, z})].name; };
  EXPECT_EQ(at(0, 0, -1), "vox:1");
  EXPECT_EQ(at(1, 0, -1), "vox:2");
  EXPECT_EQ(at(0, 0, -2), "vox:3");
  EXPECT_EQ(at(0, 1, -1), "vox:4");
}

TEST(Vox, ATransformTurnsAboutTheMiddleOfTheModel) {
  // _r 4 is the identity (columns 0 and 1), 17 = 0b0010001: rows (0 1 0), (1 0 0) with the first negative.
  for (const auto& [r, expected] :
       std::map<std::string, std::array<int64_t, 3>>{{"4", {-1, -1, 0}}, {"17", {0, -1, 0}}}) {
    const Bytes bytes = vox_file(join({model(3, 3, 1, {{0, 0, 0, 1}}), transform_node(0, 1, {{"_r", r}}),
                                       group_node(1, {2}), transform_node(2, 3, {{"_t", "0 0 0"}}), shape_node(3, 0)}));
    const auto file = vox::parse(bytes, "a");
    ASSERT_TRUE(file) << file.error().message;
    const auto placed = vox::instances(*file, "a", -1);
    ASSERT_TRUE(placed) << placed.error().message;
    EXPECT_EQ(vox::cell(placed->front().transform, file->models[0], file->models[0].voxels[0]), expected) << r;
  }
}

TEST(Vox, EveryTurnAndMirrorOfALargeModelPutsEachVoxelInItsCell) {
  std::mt19937 random(11);
  std::vector<std::array<int, 4>> voxels;
  for (int i = 0; i < 6000; ++i)
    voxels.push_back({static_cast<int>(random() % 40), static_cast<int>(random() % 33), static_cast<int>(random() % 17),
                      static_cast<int>(random() % 5)});
  int turns = 0;
  for (int bits = 0; bits < 128; ++bits) {
    const int first = bits & 3, second = bits >> 2 & 3;
    if (first == 3 || second == 3 || first == second) continue;
    ++turns;
    const Bytes bytes =
        vox_file(join({model(40, 33, 17, voxels), transform_node(0, 1, {{"_r", std::to_string(bits)}}),
                       group_node(1, {2}), transform_node(2, 3, {{"_t", "-3 1005 -77"}}), shape_node(3, 0)}));
    const auto file = vox::parse(bytes, "a");
    ASSERT_TRUE(file) << file.error().message;
    const auto placed = vox::instances(*file, "a", -1);
    ASSERT_TRUE(placed) << placed.error().message;
    std::map<VoxelPos, int> expected;  // of voxels that lie at one place, the last counts; colour 0 is none
    for (const vox::Voxel& v : file->models[0].voxels) {
      const auto [x, y, z] = vox::cell(placed->front().transform, file->models[0], v);
      if (v.colour) expected[{static_cast<int>(x), static_cast<int>(z), static_cast<int>(-y - 1)}] = v.colour;
    }
    ImportReport report;
    const World world = world_from_vox(*file, "a", {}, report).value();
    ASSERT_EQ(world.store.voxel_count(), expected.size());
    EXPECT_EQ(fact(report, "distinct voxels"), std::to_string(expected.size()));
    for (const auto& [at, colour] : expected)
      ASSERT_EQ((*world.palette)[world.store.get(at)].name, fmt::format("vox:{}", colour)) << "turn " << bits;
  }
  EXPECT_EQ(turns, 48);
}

TEST(Vox, AFrameOfAnAnimationCanBeChosen) {
  const auto path = shared_data("vox/T-Rex.vox"), deer_path = shared_data("vox/deer_frames.vox");
  if (!path || !deer_path) GTEST_SKIP();
  ImportReport report;
  EXPECT_EQ(read_world(*path, {.frame = 2}, report)->store.voxel_count(), 1287u);
  const auto beyond = read_world(*path, {.frame = 8}, report);
  ASSERT_FALSE(beyond);
  EXPECT_NE(beyond.error().message.find("no frame 8"), std::string::npos);
  // The frames of deer_frames.vox show the models 1, 2, 3, 0.
  const uint64_t voxels[] = {355, 351, 358, 351};
  for (int frame = 0; frame < 4; ++frame) {
    EXPECT_EQ(read_world(*deer_path, {.frame = frame}, report)->store.voxel_count(), voxels[frame]) << frame;
  }
}

TEST(Vox, HiddenPartsAreNamed) {
  const auto path = shared_data("vox/scene_bevy_cloud.vox");
  if (!path) GTEST_SKIP();
  ImportReport report;
  ASSERT_TRUE(read_world(*path, {}, report));
  ASSERT_EQ(report.warnings.size(), 1u);
  EXPECT_EQ(report.warnings[0], "the hidden part 'point_light' (5 voxels) was found");
}

TEST(Vox, MaterialsBecomeBlockProperties) {
  const auto material = [](int id, std::initializer_list<std::pair<std::string, std::string>> entries) {
    return chunk("MATL", join({ints({id}), dictionary(entries)}));
  };
  const Bytes bytes = vox_file(
      join({model(6, 1, 1, {{0, 0, 0, 1}, {1, 0, 0, 2}, {2, 0, 0, 3}, {3, 0, 0, 4}, {4, 0, 0, 5}, {5, 0, 0, 6}}),
            material(2, {{"_type", "_glass"}, {"_ior", "0.52"}}), material(3, {{"_type", "_media"}, {"_d", "0.2"}}),
            material(4, {{"_type", "_emit"}, {"_emit", "0.5"}, {"_flux", "1"}}),
            material(5, {{"_type", "_metal"}, {"_metal", "0.75"}, {"_rough", "0.25"}}),
            material(6, {{"_type", "_slime"}})}));
  ImportReport report;
  const World world = world_from_vox(*vox::parse(bytes, "a"), "a", {}, report).value();
  const auto block = [&](const std::string& name) { return (*world.palette)[world.palette->find(name).value()]; };
  EXPECT_TRUE(block("vox:1").opaque);
  EXPECT_FLOAT_EQ(block("vox:1").albedo.r, 0.98f);  // white, clamped
  EXPECT_FALSE(block("vox:2").opaque);
  EXPECT_FLOAT_EQ(block("vox:2").index_of_refraction, 1.52f);
  EXPECT_FALSE(block("vox:3").opaque);
  EXPECT_EQ(block("vox:3").phase, Phase::gas);
  EXPECT_FLOAT_EQ(block("vox:4").emission.r, 0.5f * 10 * 3600 * block("vox:4").albedo.r);
  EXPECT_EQ(block("vox:5").bsdf, "blinn_phong");
  EXPECT_FLOAT_EQ(block("vox:5").shininess, 0.75f);
  EXPECT_FLOAT_EQ(block("vox:5").albedo.r, 0.25f * 0.98f);
  EXPECT_FLOAT_EQ(block("vox:5").glossy.r, 0.75f * 0.98f);
  EXPECT_EQ(report.unmapped, (std::map<std::string, uint64_t>{{"material _slime", 1}}));
  const auto strict = world_from_vox(*vox::parse(bytes, "a"), "a", {.strict = true}, report);
  ASSERT_FALSE(strict);
  EXPECT_NE(strict.error().message.find("_slime"), std::string::npos);
}

// ---- damage ---------------------------------------------------------------------------------------------------

TEST(HardCaseN21, AModelSizeBeyondAnyCoordinateIsRejected) {
  expect_failure(vox_file(model(65536, 65536, 1, {{0, 0, 0, 1}})), "65536 x 65536 x 1");
  expect_failure(vox_file(model(-1, 2, 2, {{0, 0, 0, 1}})), "impossible");
}

TEST(HardCaseIO11, AVoxelOutsideOfItsModelIsRejected) {
  expect_failure(vox_file(model(1, 1, 1, {{255, 255, 255, 1}})), "byte 60: the voxel (255, 255, 255) lies outside");
}

TEST(HardCaseIO11, ASceneGraphThatContainsItselfIsRejected) {
  expect_failure(vox_file(join({kOneVoxel, transform_node(0, 1, {}), group_node(1, {0})})), "contains itself");
  expect_failure(vox_file(join({kOneVoxel, transform_node(0, 0, {})})), "contains itself");
}

TEST(HardCaseIO11, UnknownNodesAndModelsAreRejected) {
  expect_failure(vox_file(join({kOneVoxel, transform_node(0, 9, {})})), "the node 9, which does not exist");
  expect_failure(vox_file(join({kOneVoxel, transform_node(0, 1, {}), shape_node(1, 1)})),
                 "shows model 1, but the file holds 1");
  expect_failure(vox_file(join({kOneVoxel, transform_node(0, 1, {}), shape_node(1, -1)})), "shows model -1");
  expect_failure(vox_file(join({kOneVoxel, transform_node(0, 1, {}), shape_node(1, 0), shape_node(1, 0)})),
                 "exists twice");
}

TEST(HardCaseIO11, AnExplosionOfInstancesIsRejectedInBoundedTime) {
  // 40 groups, each of which holds the next one twice: 2^40 instances in 3 kB.
  Bytes chunks = join({kOneVoxel, transform_node(0, 1, {})});
  for (int level = 1; level <= 40; ++level) put(chunks, group_node(level, {level + 1, level + 1}));
  Bytes with_shape = chunks;
  put(with_shape, shape_node(41, 0));
  expect_failure(vox_file(with_shape), "more than 262144 models");
  put(chunks, group_node(41, {}));
  expect_failure(vox_file(chunks), "repeats its groups too often");
}

TEST(HardCaseIO11, DeepNestingIsRejectedBeforeTheStackEnds) {
  Bytes chunks = kOneVoxel;
  for (int level = 0; level < 100000; ++level) put(chunks, group_node(level, {level + 1}));
  put(chunks, shape_node(100000, 0));
  expect_failure(vox_file(chunks), "nested deeper than 256 levels");
}

TEST(HardCaseIO11, CountsThatTheFileCannotHoldAreRejected) {
  expect_failure(vox_file(join({chunk("SIZE", ints({1, 1, 1})), chunk("XYZI", ints({0x7fffffff}))})),
                 "voxels were announced");
  expect_failure(vox_file(join({kOneVoxel, chunk("nTRN", ints({0, -1}))})), "attributes were announced");
  expect_failure(vox_file(join({kOneVoxel, chunk("MATL", ints({1, 1, -1, 0, 0}))})), "a text of 4294967295 bytes");
  expect_failure(vox_file(join({kOneVoxel, chunk("nGRP", ints({0, 0, -1}))})), "more children");
  expect_failure(vox_file(join({kOneVoxel, chunk("NOTE", ints({-1}))})), "NOTE");
}

TEST(Vox, PlacesOutsideTheWorldAreRejected) {
  expect_failure(vox_file(join({kOneVoxel, transform_node(0, 1, {{"_t", "1073741820 0 0"}}), shape_node(1, 0)})),
                 "outside of the world's border");
  expect_failure(vox_file(join({kOneVoxel, transform_node(0, 1, {{"_t", "99999999999 0 0"}}), shape_node(1, 0)})),
                 "three whole numbers");
  expect_failure(vox_file(join({kOneVoxel, transform_node(0, 1, {{"_r", "0"}}), shape_node(1, 0)})),
                 "signed permutation");
}

TEST(Vox, ACutFileIsAnErrorThatNamesFileAndByte) {
  const auto path = shared_data("vox/placeholder-with-materials.vox");
  if (!path) GTEST_SKIP();
  for_each_truncation(bytes_of(*path), 97, [](std::span<const uint8_t> cut) {
    const auto file = vox::parse(cut, "cut.vox");
    ASSERT_FALSE(file) << cut.size();
    EXPECT_EQ(file.error().message.rfind("cut.vox: byte ", 0), 0u) << file.error().message;
  });
}

TEST(Vox, DamagedFilesNeverCrash) {
  for (const char* name :
       {"vox/placeholder-with-materials.vox", "vox/chr_knight.vox", "vox/test_multiple_model_scene.vox"}) {
    const auto path = shared_data(name);
    if (!path) GTEST_SKIP();
    int read = 0, failed = 0;
    for_each_mutation(bytes_of(*path), 2000, 700, 11, [&](std::span<const uint8_t> damaged) {
      ImportReport report;
      const auto file = vox::parse(damaged, name);
      const auto world = file ? world_from_vox(*file, name, {}, report) : Result<World>(file.error());
      ++(world ? read : failed);
      if (!world) {
        EXPECT_EQ(world.error().message.rfind(name, 0), 0u) << world.error().message;
      }
    });
    EXPECT_GT(read, 0) << name;
    EXPECT_GT(failed, 0) << name;
  }
}

}  // namespace
}  // namespace world
