// Chunks of a .vox file -> vox::File.
#include "world/formats/vox/vox_file.h"

#include <algorithm>
#include <charconv>
#include <cstring>

#include <fmt/format.h>

#include "world/formats/bytes.h"

namespace world::vox {
namespace {

constexpr int kMaxSize = 256;  // voxel coordinates are bytes
constexpr int64_t kMaxTranslation = int64_t{1} << 30;

/// Chunk names are four bytes of anything: show what can be printed.
std::string printable(std::span<const uint8_t> bytes) {
  std::string text;
  for (const uint8_t c : bytes) text += c >= 32 && c < 127 ? static_cast<char>(c) : '?';
  return text;
}

Result<std::string> read_string(ByteReader& in) {
  const uint64_t start = in.offset();
  const uint32_t length = in.u32_le();
  if (in.failed()) return in.end_error("a text");
  if (length > in.remaining()) {
    return byte_error(
        in.file(), start,
        fmt::format("a text of {} bytes was announced, but its chunk has {} left", length, in.remaining()));
  }
  const auto bytes = in.bytes(length);
  return std::string(bytes.begin(), bytes.end());
}

Result<Dictionary> read_dictionary(ByteReader& in) {
  const uint64_t start = in.offset();
  const uint32_t count = in.u32_le();
  if (in.failed()) return in.end_error("a list of attributes");
  if (count > in.remaining() / 8) {
    return byte_error(
        in.file(), start,
        fmt::format("{} attributes were announced, but the chunk has {} bytes left", count, in.remaining()));
  }
  Dictionary dictionary;
  for (uint32_t i = 0; i < count; ++i) {
    TRY(std::string key, read_string(in));
    TRY(std::string value, read_string(in));
    dictionary[std::move(key)] = std::move(value);
  }
  return dictionary;
}

std::optional<int64_t> integer(std::string_view text) {
  int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// "-12 3 40"
std::optional<std::array<int64_t, 3>> three_integers(std::string_view text) {
  std::array<int64_t, 3> values{};
  for (int i = 0; i < 3; ++i) {
    while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
    const size_t end = std::min(text.find(' '), text.size());
    const auto value = integer(text.substr(0, end));
    if (!value || *value > kMaxTranslation || *value < -kMaxTranslation) return std::nullopt;
    values[static_cast<size_t>(i)] = *value;
    text.remove_prefix(end);
  }
  if (text.find_first_not_of(' ') != std::string_view::npos) return std::nullopt;
  return values;
}

/// Bits 0-1 and 2-3: the columns of the first two rows; bits 4-6: a row is negative.
std::optional<Transform> rotation(std::string_view text) {
  const auto bits = integer(text);
  if (!bits || *bits < 0 || *bits > 127) return std::nullopt;
  const int first = static_cast<int>(*bits & 3), second = static_cast<int>(*bits >> 2 & 3);
  if (first == 3 || second == 3 || first == second) return std::nullopt;
  Transform transform;
  transform.column = {first, second, 3 - first - second};
  for (size_t row = 0; row < 3; ++row) transform.sign[row] = *bits >> (4 + row) & 1 ? -1 : 1;
  return transform;
}

/// The frame number "_f" of a list entry; entries without one count up.
Result<int> frame_number(const ByteReader& in, const Dictionary& attributes, int without) {
  const auto found = attributes.find("_f");
  if (found == attributes.end()) return without;
  const auto value = integer(found->second);
  if (!value || *value < 0 || *value > kMaxTranslation)
    return in.error("the frame number _f is not a whole number >= 0");
  return static_cast<int>(*value);
}

bool inside(const Voxel& v, const std::array<int32_t, 3>& size) {
  return v.x < size[0] && v.y < size[1] && v.z < size[2];
}

/// By the greatest of each coordinate: four voxels at a time, without a branch.
bool all_inside(std::span<const Voxel> voxels, const std::array<int32_t, 3>& size) {
  using Bytes16 = uint8_t __attribute__((vector_size(16)));
  Bytes16 most{};
  size_t i = 0;
  for (; i + 4 <= voxels.size(); i += 4) {
    Bytes16 four;
    std::memcpy(&four, &voxels[i], sizeof four);
    most = four > most ? four : most;
  }
  bool all = true;
  for (; i < voxels.size(); ++i) all &= inside(voxels[i], size);
  // An empty list says 0, which lies in no model of size 0.
  for (size_t k = 0; k < 16 && voxels.size() >= 4; ++k) all &= k % 4 == 3 || most[k] < size[k % 4];
  return all;
}

struct Parser {
  std::string_view name;
  File file;
  std::optional<Model> sized;  // a SIZE that waits for its XYZI
  uint64_t size_offset = 0;

  Status size(ByteReader& in) {
    if (sized) return byte_error(name, size_offset, "the chunk SIZE is not followed by XYZI");
    size_offset = in.offset();
    sized.emplace();
    uint32_t extent[3];
    for (uint32_t& e : extent) e = in.u32_le();
    if (in.failed()) return in.end_error("the chunk SIZE");
    // No byte coordinate reaches further, so a bigger size is damage: nothing is ever allocated by size.
    for (size_t axis = 0; axis < 3; ++axis) {
      if (extent[axis] > kMaxSize) {
        return byte_error(name, size_offset,
                          fmt::format("the model size {} x {} x {} is impossible; each may be 0 to {}", extent[0],
                                      extent[1], extent[2], kMaxSize));
      }
      sized->size[axis] = static_cast<int32_t>(extent[axis]);
    }
    return {};
  }

  Status voxels(ByteReader& in) {
    const uint64_t start = in.offset();
    if (!sized) return in.error("the chunk XYZI comes without a SIZE before it");
    const uint32_t count = in.u32_le();
    if (in.failed()) return in.end_error("the chunk XYZI");
    if (uint64_t{count} * 4 > in.remaining()) {
      return byte_error(
          name, start, fmt::format("{} voxels were announced, but the chunk has {} bytes left", count, in.remaining()));
    }
    const uint64_t first = in.offset();
    const auto bytes = in.bytes(size_t{count} * sizeof(Voxel));
    sized->voxels = {reinterpret_cast<const Voxel*>(bytes.data()), count};
    if (!all_inside(sized->voxels, sized->size)) {
      const auto outside = std::find_if(sized->voxels.begin(), sized->voxels.end(),
                                        [&](const Voxel& v) { return !inside(v, sized->size); });
      const uint64_t at = first + sizeof(Voxel) * static_cast<uint64_t>(outside - sized->voxels.begin());
      return byte_error(name, at,
                        fmt::format("the voxel ({}, {}, {}) lies outside of its model of {} x {} x {}", outside->x,
                                    outside->y, outside->z, sized->size[0], sized->size[1], sized->size[2]));
    }
    file.models.push_back(std::move(*sized));
    sized.reset();
    return {};
  }

  Status palette(ByteReader& in) {
    const auto bytes = in.bytes(4 * 256);
    if (in.failed()) return in.end_error("the chunk RGBA");
    // Entry i is the colour index i + 1; the last entry is unused and lands on index 0.
    for (size_t i = 0; i < 256; ++i) {
      file.palette[(i + 1) & 255] = {bytes[4 * i], bytes[4 * i + 1], bytes[4 * i + 2], bytes[4 * i + 3]};
    }
    file.has_palette = true;
    return {};
  }

  Status add_node(int32_t id, Node node) {
    const uint64_t offset = node.offset;
    if (!file.nodes.emplace(id, std::move(node)).second) {
      return byte_error(name, offset, fmt::format("the scene node {} exists twice", id));
    }
    return {};
  }

  Status transform_node(ByteReader& in) {
    Node node{.kind = Node::transform, .offset = in.offset(), .trn = {}, .grp = {}, .shp = {}};
    const int32_t id = in.i32_le();
    TRY(node.trn.attributes, read_dictionary(in));
    node.trn.child = in.i32_le();
    in.i32_le();  // reserved
    node.trn.layer = in.i32_le();
    const uint32_t frames = in.u32_le();
    if (in.failed()) return in.end_error("the chunk nTRN");
    if (frames == 0 || frames > in.remaining() / 4)
      return in.error("the number of frames of a transform is impossible");
    for (uint32_t f = 0; f < frames; ++f) {
      TRY(const Dictionary attributes, read_dictionary(in));
      Transform transform;
      if (const auto r = attributes.find("_r"); r != attributes.end()) {
        const auto turned = rotation(r->second);
        if (!turned) return in.error("the rotation _r of a transform is no signed permutation of the axes");
        transform = *turned;
      }
      if (const auto t = attributes.find("_t"); t != attributes.end()) {
        const auto moved = three_integers(t->second);
        if (!moved) return in.error("the translation _t of a transform is not three whole numbers within 2^30");
        transform.translation = *moved;
      }
      TRY(const int number, frame_number(in, attributes, static_cast<int>(f)));
      node.trn.frames.emplace_back(number, transform);
    }
    return add_node(id, std::move(node));
  }

  Status group_node(ByteReader& in) {
    Node node{.kind = Node::group, .offset = in.offset(), .trn = {}, .grp = {}, .shp = {}};
    const int32_t id = in.i32_le();
    TRY(const Dictionary attributes, read_dictionary(in));
    const uint32_t children = in.u32_le();
    if (in.failed()) return in.end_error("the chunk nGRP");
    if (children > in.remaining() / 4) return in.error("a group announces more children than its chunk can hold");
    for (uint32_t c = 0; c < children; ++c) node.grp.children.push_back(in.i32_le());
    return add_node(id, std::move(node));
  }

  Status shape_node(ByteReader& in) {
    Node node{.kind = Node::shape, .offset = in.offset(), .trn = {}, .grp = {}, .shp = {}};
    const int32_t id = in.i32_le();
    TRY(const Dictionary attributes, read_dictionary(in));
    const uint32_t models = in.u32_le();
    if (in.failed()) return in.end_error("the chunk nSHP");
    if (models == 0 || models > in.remaining() / 8) return in.error("the number of models of a shape is impossible");
    for (uint32_t m = 0; m < models; ++m) {
      const int32_t model = in.i32_le();
      TRY(const Dictionary of_model, read_dictionary(in));
      TRY(const int number, frame_number(in, of_model, static_cast<int>(m)));
      node.shp.models.emplace_back(number, model);
    }
    return add_node(id, std::move(node));
  }

  /// MATT, of files before 2018: one number for all: type, weight, then normalised values by bit.
  Status old_material(ByteReader& in) {
    const int32_t id = in.i32_le();
    const int32_t type = in.i32_le();
    const float weight = std::bit_cast<float>(in.u32_le());
    const uint32_t present = in.u32_le();
    if (in.failed()) return in.end_error("the chunk MATT");
    static constexpr const char* kTypes[] = {"_diffuse", "_metal", "_glass", "_emit"};
    static constexpr const char* kValues[] = {"_plastic", "_rough", "_spec", "_ior", "_att", "_flux", "_glow"};
    Dictionary material;
    material["_type"] = type >= 0 && type < 4 ? kTypes[type] : fmt::format("_type{}", type);
    material["_weight"] = fmt::format("{}", weight);
    if (type == 3) material["_emit"] = material["_weight"];
    for (uint32_t bit = 0; bit < 7; ++bit) {
      if (present >> bit & 1) material[kValues[bit]] = fmt::format("{}", std::bit_cast<float>(in.u32_le()));
    }
    if (in.failed()) return in.end_error("the values of the chunk MATT");
    file.materials[id & 255] = std::move(material);
    ++file.old_materials;
    return {};
  }

  Status numbered_dictionary(ByteReader& in, std::map<int32_t, Dictionary>& into, int32_t id_mask) {
    const int32_t id = in.i32_le() & id_mask;
    TRY(Dictionary dictionary, read_dictionary(in));
    into[id] = std::move(dictionary);
    return {};
  }

  Status chunk(std::string_view id, ByteReader& in) {
    if (id == "SIZE") return size(in);
    if (id == "XYZI") return voxels(in);
    if (id == "RGBA") return palette(in);
    if (id == "nTRN") return transform_node(in);
    if (id == "nGRP") return group_node(in);
    if (id == "nSHP") return shape_node(in);
    if (id == "MATT") return old_material(in);
    if (id == "MATL") return numbered_dictionary(in, file.materials, 255);
    if (id == "LAYR") return numbered_dictionary(in, file.layers, -1);
    if (id == "PACK") {
      file.pack = in.i32_le();
      if (in.failed()) return in.end_error("the chunk PACK");
    } else if (id == "rCAM") {
      in.i32_le();
      TRY(Dictionary camera, read_dictionary(in));
      file.cameras.push_back(std::move(camera));
    } else if (id == "rOBJ") {
      TRY(Dictionary settings, read_dictionary(in));
      file.render_settings.push_back(std::move(settings));
    } else if (id == "IMAP") {
      const auto bytes = in.bytes(256);
      if (in.failed()) return in.end_error("the chunk IMAP");
      file.index_map.emplace();
      std::copy(bytes.begin(), bytes.end(), file.index_map->begin());
    } else if (id == "NOTE") {
      const uint32_t count = in.u32_le();
      if (in.failed() || count > in.remaining() / 4)
        return in.error("the chunk NOTE announces more texts than it holds");
      for (uint32_t i = 0; i < count; ++i) {
        TRY(std::string note, read_string(in));
        file.notes.push_back(std::move(note));
      }
    } else {
      ++file.unknown_chunks[std::string(id)];
    }
    return {};
  }

  /// All chunks of one level; those below a chunk other than MAIN are not known to hold anything.
  Status chunks(ByteReader& in) {
    while (in.remaining() > 0) {
      const uint64_t start = in.offset();
      const std::string id = printable(in.bytes(4));
      const uint32_t content = in.u32_le(), children = in.u32_le();
      if (in.failed()) return in.end_error("the head of a chunk");
      if (uint64_t{content} + children > in.remaining()) {
        return byte_error(
            name, start,
            fmt::format("the chunk {} announces {} bytes, but {} are left; the file is damaged or cut off", id,
                        uint64_t{content} + children, in.remaining()));
      }
      ByteReader part = in.part(content);
      TRY_STATUS(chunk(id, part));
      in.bytes(children);
    }
    if (sized) return byte_error(name, size_offset, "the chunk SIZE is not followed by XYZI");
    return {};
  }
};

}  // namespace

const Palette& default_palette() {
  static const Palette palette = [] {
    Palette colours{};
    size_t next = 1;
    // The 6 x 6 x 6 cube without black, then ramps of red, green, blue and grey.
    for (int r = 255; r >= 0; r -= 51) {
      for (int g = 255; g >= 0; g -= 51) {
        for (int b = 255; b >= 0; b -= 51) {
          if (r + g + b == 0) continue;
          colours[next++] = {static_cast<uint8_t>(r), static_cast<uint8_t>(g), static_cast<uint8_t>(b), 255};
        }
      }
    }
    for (int ramp = 0; ramp < 4; ++ramp) {
      for (const uint8_t v : {0xee, 0xdd, 0xbb, 0xaa, 0x88, 0x77, 0x55, 0x44, 0x22, 0x11}) {
        const auto band = [&](int own) { return ramp == own || ramp == 3 ? v : uint8_t{0}; };
        colours[next++] = {band(0), band(1), band(2), 255};
      }
    }
    return colours;
  }();
  return palette;
}

Result<File> parse(std::span<const uint8_t> bytes, std::string_view name) {
  ByteReader in(bytes, name);
  const auto magic = in.bytes(4);
  if (in.failed() || std::string_view(reinterpret_cast<const char*>(magic.data()), 4) != "VOX ") {
    return byte_error(name, 0, "expected 'VOX ' at the start; this is no MagicaVoxel file");
  }
  Parser parser{.name = name, .file = {}, .sized = {}};
  parser.file.version = in.i32_le();
  const uint64_t start = in.offset();
  const std::string id = printable(in.bytes(4));
  const uint32_t content = in.u32_le(), children = in.u32_le();
  if (in.failed()) return in.end_error("the head of the main chunk");
  if (id != "MAIN") return byte_error(name, start, fmt::format("expected the chunk MAIN, found {}", id));
  if (uint64_t{content} + children > in.remaining()) {
    return byte_error(name, start,
                      fmt::format("the chunk MAIN announces {} bytes, but {} are left; the file is damaged or cut off",
                                  uint64_t{content} + children, in.remaining()));
  }
  in.bytes(content);
  ByteReader part = in.part(children);
  TRY_STATUS(parser.chunks(part));
  parser.file.trailing_bytes = in.remaining();
  if (parser.file.models.empty())
    return byte_error(name, start, "the file holds no model; expected SIZE and XYZI chunks");
  return std::move(parser.file);
}

}  // namespace world::vox
