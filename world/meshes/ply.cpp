// Stanford .ply -> mesh: elements `vertex` (x y z, and where they are: nx ny nz, u v or s t) and `face` (a list
// vertex_indices or vertex_index); other elements and properties are passed over. ascii, binary_little_endian and
// binary_big_endian.
//
//   ply
//   format binary_little_endian 1.0
//   element vertex 8
//   property float x            ...
//   element face 12
//   property list uchar int vertex_indices
//   end_header
//   the elements, one after the other
//
// Nothing is allocated by a count of the header: each element is read before it is kept.
// source  Greg Turk. The PLY Polygon File Format. 1994
#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cctype>
#include <cstring>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>

#include <fmt/format.h>

#include "world/meshes/builder.h"
#include "world/meshes/points.h"
#include "world/units/rgb8.h"

namespace world {
namespace {

enum class Type { i8, u8, i16, u16, i32, u32, f32, f64 };
constexpr std::array<std::pair<std::string_view, Type>, 16> kTypes{{{"char", Type::i8},
                                                                    {"uchar", Type::u8},
                                                                    {"short", Type::i16},
                                                                    {"ushort", Type::u16},
                                                                    {"int", Type::i32},
                                                                    {"uint", Type::u32},
                                                                    {"float", Type::f32},
                                                                    {"double", Type::f64},
                                                                    {"int8", Type::i8},
                                                                    {"uint8", Type::u8},
                                                                    {"int16", Type::i16},
                                                                    {"uint16", Type::u16},
                                                                    {"int32", Type::i32},
                                                                    {"uint32", Type::u32},
                                                                    {"float32", Type::f32},
                                                                    {"float64", Type::f64}}};
constexpr size_t size_of(Type t) {
  constexpr size_t sizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
  return sizes[static_cast<int>(t)];
}

/// What a property says: kPlaces + axis, kNormals + axis, kTextures + axis, kBands + band.
constexpr int kPlaces = 0, kNormals = 3, kTextures = 6, kBands = 8, kCorners = 11, kNothing = 12;

int meaning_of(std::string_view name, bool list) {
  if (list) return name == "vertex_indices" || name == "vertex_index" ? kCorners : kNothing;
  constexpr std::pair<std::string_view, int> kNames[] = {
      {"x", kPlaces},       {"y", kPlaces + 1},       {"z", kPlaces + 2},
      {"nx", kNormals},     {"ny", kNormals + 1},     {"nz", kNormals + 2},
      {"u", kTextures},     {"s", kTextures},         {"v", kTextures + 1},
      {"t", kTextures + 1}, {"red", kBands},          {"green", kBands + 1},
      {"blue", kBands + 2}, {"texture_u", kTextures}, {"texture_v", kTextures + 1}};
  if (name.starts_with("diffuse_") && meaning_of(name.substr(8), false) >= kBands) name.remove_prefix(8);
  for (const auto& [known, meaning] : kNames)
    if (known == name) return meaning;
  return kNothing;
}

struct Property {
  int meaning = kNothing;  // its name is looked at once, not for every value
  Type type = Type::f32, count_type = Type::u8;
  bool list = false;
};
struct Element {
  std::string name;
  bool vertex = false, face = false;
  uint64_t count = 0;
  std::vector<Property> properties;
};
enum class Encoding { ascii, little, big };

class PlyReader {
 public:
  PlyReader(std::span<const uint8_t> bytes, std::string_view file)
      : text_(reinterpret_cast<const char*>(bytes.data()), bytes.size()), file_(file) {}

  Result<TriangleMesh> read(MeshReport& report, MeshFileFacts* facts, MeshColours* colours) {
    TRY_STATUS(read_header());
    for (const Element& element : elements_) {
      if (element.properties.empty()) continue;
      for (uint64_t i = 0; i < element.count; ++i) TRY_STATUS(read_element(element, i));
    }
    builder_.facts.vertices = builder_.positions.size();
    builder_.facts.normals = builder_.normals.size();
    builder_.facts.textures = builder_.textures.size();
    if (facts) *facts = builder_.facts;
    return std::move(builder_).finish(file_, report, colours);
  }

  Result<PointSet> read_points() {
    PointSet points;
    points_ = &points;
    TRY_STATUS(read_header());
    for (const Element& element : elements_) {
      if (element.properties.empty()) continue;
      for (uint64_t i = 0; i < element.count; ++i) TRY_STATUS(read_element(element, i));
      if (element.name == "vertex") break;  // nothing after it is wanted
    }
    if (points.positions.empty())
      return input_error(fmt::format("{}: holds no points: its vertex element is empty or missing", file_));
    return points;
  }

  Result<bool> has_faces() {
    TRY_STATUS(read_header());
    return std::any_of(elements_.begin(), elements_.end(),
                       [](const Element& e) { return e.name == "face" && e.count > 0; });
  }

 private:
  Error error(const std::string& what) const { return input_error(fmt::format("{}: byte {}: {}", file_, at_, what)); }

  // --- header ---

  std::string_view take_line() {
    const size_t end = std::min(text_.find('\n', at_), text_.size());
    std::string_view line = text_.substr(at_, end - at_);
    at_ = std::min(end + 1, text_.size());
    if (line.ends_with('\r')) line.remove_suffix(1);
    return line;
  }
  static std::vector<std::string_view> words(std::string_view line) {
    std::vector<std::string_view> found;
    while (!line.empty()) {
      const size_t end = std::min(line.find(' '), line.size());
      if (end > 0) found.push_back(line.substr(0, end));
      line.remove_prefix(std::min(end + 1, line.size()));
    }
    return found;
  }
  Result<Type> type_of(std::string_view name) const {
    for (const auto& [known, type] : kTypes)
      if (known == name) return type;
    return error(
        fmt::format("a property has the type \"{}\", but needs one of char, uchar, short, ushort, int, uint, "
                    "float, double",
                    name));
  }

  Status read_header() {
    if (take_line() != "ply")
      return input_error(fmt::format("{}: is no .ply file: it does not start with \"ply\"", file_));
    bool has_format = false;
    while (true) {
      if (at_ >= text_.size()) return error("the file ends inside its header, before \"end_header\"");
      const auto line = words(take_line());
      if (line.empty() || line[0] == "comment" || line[0] == "obj_info") continue;
      if (line[0] == "end_header") break;
      if (line[0] == "format" && line.size() == 3) {
        has_format = true;
        if (line[1] == "ascii")
          encoding_ = Encoding::ascii;
        else if (line[1] == "binary_little_endian")
          encoding_ = Encoding::little;
        else if (line[1] == "binary_big_endian")
          encoding_ = Encoding::big;
        else
          return error(fmt::format("the format is \"{}\", but must be ascii, binary_little_endian or binary_big_endian",
                                   line[1]));
      } else if (line[0] == "element" && line.size() == 3) {
        Element element{std::string(line[1]), line[1] == "vertex", line[1] == "face", 0, {}};
        const auto [end, bad] = std::from_chars(line[2].data(), line[2].data() + line[2].size(), element.count);
        if (bad != std::errc() || end != line[2].data() + line[2].size())
          return error(fmt::format("element {} has the count \"{}\", but needs a whole number", line[1], line[2]));
        elements_.push_back(std::move(element));
      } else if (line[0] == "property" && !elements_.empty() && line.size() >= 3 &&
                 line.size() == (line[1] == "list" ? 5u : 3u)) {
        Property property;
        property.list = line.size() == 5;
        property.meaning = meaning_of(line.back(), property.list);
        TRY(property.type, type_of(line[line.size() - 2]));
        if (property.list) {
          TRY(property.count_type, type_of(line[2]));
          if (property.count_type == Type::f32 || property.count_type == Type::f64)
            return error("a list's count must have a type of whole numbers");
        }
        elements_.back().properties.push_back(std::move(property));
      } else {
        return error(fmt::format("the header has a line of \"{}\" that .ply does not know", line[0]));
      }
    }
    if (!has_format) return error("the header has no format line");
    return {};
  }

  // --- elements ---

  Status read_number(Type type, double& out) {
    if (encoding_ == Encoding::ascii) {
      while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_]))) ++at_;
      if (at_ >= text_.size()) return end_error();
      size_t end = at_;
      while (end < text_.size() && !std::isspace(static_cast<unsigned char>(text_[end]))) ++end;
      std::string_view word = text_.substr(at_, end - at_);
      if (word.starts_with('+')) word.remove_prefix(1);
      const auto [stop, bad] = std::from_chars(word.data(), word.data() + word.size(), out);
      if (bad != std::errc() || stop != word.data() + word.size())
        return error(fmt::format("expected a number, not \"{}\"", word));
      at_ = end;
      return {};
    }
    const size_t size = size_of(type);
    if (text_.size() - at_ < size) return end_error();
    std::array<char, 8> raw{};
    std::copy_n(text_.data() + at_, size, raw.begin());
    if (encoding_ == Encoding::big) std::reverse(raw.begin(), raw.begin() + static_cast<ptrdiff_t>(size));
    at_ += size;
    const auto as = [&](auto value) {
      std::memcpy(&value, raw.data(), sizeof value);
      out = static_cast<double>(value);
    };
    static_assert(std::endian::native == std::endian::little);
    switch (type) {
      case Type::i8:
        as(int8_t{});
        break;
      case Type::u8:
        as(uint8_t{});
        break;
      case Type::i16:
        as(int16_t{});
        break;
      case Type::u16:
        as(uint16_t{});
        break;
      case Type::i32:
        as(int32_t{});
        break;
      case Type::u32:
        as(uint32_t{});
        break;
      case Type::f32:
        as(float{});
        break;
      case Type::f64:
        as(double{});
        break;
    }
    return {};
  }
  Error end_error() const {
    return input_error(fmt::format("{}: byte {}: the file ends inside its {} elements; it is damaged or cut off", file_,
                                   text_.size(), element_->name));
  }

  /// 0 to 255 of a band; floats count from 0 to 1.
  static uint32_t byte_of(Type type, double value) {
    if (type == Type::f32 || type == Type::f64) value *= 255;
    if (type == Type::u16) value *= 255.0 / 65535;
    return value > 0 ? static_cast<uint32_t>(std::lround(std::min(value, 255.0))) : 0;
  }
  /// Faces with a colour have a material a colour.
  void use_colour(uint32_t colour) {
    const auto [found, added] =
        materials_.try_emplace(colour, static_cast<uint32_t>(builder_.colours.materials.size()));
    if (added)
      builder_.colours.materials.push_back(
          {.name = fmt::format("{:06X}", colour), .diffuse = linear_from_rgb8(colour), .texture = {}, .found = true});
    builder_.material = found->second;
  }

  Status read_element(const Element& element, uint64_t index) {
    element_ = &element;
    const bool vertex = element.vertex, face = element.face;
    const double none = std::nan("");
    double values[kBands] = {none, none, none, none, none, none, none, none};  // by meaning
    uint32_t colour = 0, bands = 0;                                            // bands: a bit for each that is there
    for (const Property& property : element.properties) {
      double value = 0;
      if (property.list) {
        TRY_STATUS(read_number(property.count_type, value));
        TRY_STATUS(read_list(property, value, face && property.meaning == kCorners));
        continue;
      }
      TRY_STATUS(read_number(property.type, value));
      if (property.meaning < kBands) {
        values[property.meaning] = value;
      } else if (property.meaning < kCorners) {
        const int band = property.meaning - kBands;
        colour |= byte_of(property.type, value) << (16 - 8 * band);
        bands |= 1u << band;
      }
    }
    const Vec3d position(values[kPlaces], values[kPlaces + 1], values[kPlaces + 2]),
        normal(values[kNormals], values[kNormals + 1], values[kNormals + 2]);
    const glm::dvec2 texture(values[kTextures], values[kTextures + 1]);
    if (face && !points_) return add_face(bands == 7 ? std::optional(colour) : std::nullopt);
    if (!vertex) return {};
    if (points_) {
      if (std::isfinite(position.x + position.y + position.z)) {
        points_->positions.push_back(position);
        if (bands == 7) points_->colours.push_back(colour);
      } else {
        ++points_->not_finite;
      }
      return {};
    }
    for (int a = 0; a < 3; ++a)
      if (!std::isfinite(static_cast<float>(position[a])))
        return error(fmt::format("vertex {} has no finite {}", index, "xyz"[a]));
    builder_.positions.emplace_back(position);
    if (bands == 7) builder_.position_colours.push_back(colour);
    if (std::isfinite(normal.x + normal.y + normal.z) && builder_.normals.size() == index)
      builder_.normals.emplace_back(normal);
    if (std::isfinite(texture.x + texture.y) && builder_.textures.size() == index)
      builder_.textures.emplace_back(texture);
    return {};
  }

  Status read_list(const Property& property, double count, bool corners) {
    if (!(count >= 0)) return error(fmt::format("a list has {} entries", count));
    if (corners) corners_.clear();
    for (double i = 0; i < count; ++i) {
      double value = 0;
      TRY_STATUS(read_number(property.type, value));
      if (!corners) continue;
      const double vertices = static_cast<double>(builder_.positions.size());
      if (!(value >= 0 && value < vertices && value == std::floor(value)))
        return error(fmt::format("a face names vertex {}, but must name one in [0, {})", value, vertices));
      MeshCorner corner;
      corner.position = static_cast<uint32_t>(value);
      if (corner.position < builder_.normals.size()) corner.normal = corner.position;
      if (corner.position < builder_.textures.size()) corner.texture = corner.position;
      corners_.push_back(corner);
    }
    has_corners_ |= corners;
    return {};
  }

  Status add_face(std::optional<uint32_t> colour) {
    if (!std::exchange(has_corners_, false)) return {};
    if (colour) use_colour(*colour);
    if (corners_.size() < 3) return error(fmt::format("a face has {} corners, but needs 3", corners_.size()));
    if (!builder_.add_face(corners_))
      return error(fmt::format("a face has {} corners; one that is not convex may have {}", corners_.size(),
                               MeshBuilder::kMostCorners));
    return {};
  }

  std::string_view text_, file_;
  size_t at_ = 0;
  const Element* element_ = nullptr;  // that is being read
  Encoding encoding_ = Encoding::ascii;
  std::vector<Element> elements_;
  MeshBuilder builder_;
  std::vector<MeshCorner> corners_;  // of the face that is being read
  bool has_corners_ = false;
  std::unordered_map<uint32_t, uint32_t> materials_;  // colour of faces -> material
  PointSet* points_ = nullptr;                        // where only points are wanted
};

}  // namespace

Result<bool> ply_has_faces(std::span<const uint8_t> bytes, std::string_view file) {
  return PlyReader(bytes, file).has_faces();
}

Result<PointSet> read_ply_points(std::span<const uint8_t> bytes, std::string_view file) {
  return PlyReader(bytes, file).read_points();
}

Result<TriangleMesh> read_ply(std::span<const uint8_t> bytes, std::string_view file, MeshReport& report,
                              MeshFileFacts* facts, MeshColours* colours) {
  return PlyReader(bytes, file).read(report, facts, colours);
}

}  // namespace world
