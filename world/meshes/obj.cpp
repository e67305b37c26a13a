// Wavefront .obj -> mesh: v, vt, vn and f; everything else (groups, materials, lines, curves) is passed over.
//
// An own reader, because tinyobjloader (2.0.0rc10) takes `v nan 0 0` and `v 1 2` for zeros, cuts faces of more than 255
// corners, and names no line.
// source  Wavefront Technologies. Advanced Visualizer Manual, appendix B1: Object Files. 1995
#include <algorithm>
#include <unordered_map>
#include <utility>
#include <charconv>
#include <cmath>
#include <string>

#include <fmt/format.h>

#include "world/meshes/builder.h"

namespace world {
namespace {

bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

/// Walks through a text line by line; a backslash at a line's end joins the next one.
class Lines {
 public:
  explicit Lines(std::string_view text) : text_(text) {}
  /// False at the end. The line is without comment.
  bool next(std::string_view& line) {
    if (at_ >= text_.size()) return false;
    number_ += taken_;
    taken_ = 1;
    line = take();
    if (line.ends_with('\\')) {
      joined_.assign(line);
      while (joined_.ends_with('\\') && at_ < text_.size()) {
        joined_.back() = ' ';
        joined_ += take();
        ++taken_;
      }
      line = joined_;
    }
    line = line.substr(0, line.find('#'));
    return true;
  }
  uint64_t number() const { return number_; }

 private:
  std::string_view take() {
    const size_t end = std::min(text_.find('\n', at_), text_.size());
    std::string_view line = text_.substr(at_, end - at_);
    at_ = end + 1;
    if (line.ends_with('\r')) line.remove_suffix(1);
    return line;
  }
  std::string_view text_;
  size_t at_ = 0;
  uint64_t number_ = 1, taken_ = 0;
  std::string joined_;
};

/// Takes the next word off the line; empty where there is none.
std::string_view take_word(std::string_view& line) {
  size_t start = 0;
  while (start < line.size() && is_space(line[start])) ++start;
  size_t end = start;
  while (end < line.size() && !is_space(line[end])) ++end;
  const std::string_view word = line.substr(start, end - start);
  line.remove_prefix(end);
  return word;
}

/// The line without spaces at its ends: names may hold spaces.
std::string_view rest_of(std::string_view line) {
  while (!line.empty() && is_space(line.front())) line.remove_prefix(1);
  while (!line.empty() && is_space(line.back())) line.remove_suffix(1);
  return line;
}

template <class Number>
bool parse(std::string_view word, Number& out) {
  if (word.starts_with('+')) word.remove_prefix(1);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), out);
  return error == std::errc() && end == word.data() + word.size();
}

class ObjReader {
 public:
  ObjReader(std::span<const uint8_t> bytes, std::string_view file)
      : lines_({reinterpret_cast<const char*>(bytes.data()), bytes.size()}), file_(file) {}

  Result<TriangleMesh> read(MeshReport& report, MeshFileFacts* facts, MeshColours* colours) {
    TRY_STATUS(read_lines());
    if (facts) *facts = builder_.facts;
    return std::move(builder_).finish(file_, report, colours);
  }

  Result<PolygonMesh> read_polygons() {
    TRY_STATUS(read_lines());
    if (builder_.face_sizes.empty()) return input_error(fmt::format("{}: the mesh is empty: it has no face", file_));
    PolygonMesh mesh;
    mesh.positions = std::move(builder_.positions);
    mesh.face_sizes = std::move(builder_.face_sizes);
    mesh.face_corners = std::move(builder_.face_corners);
    for (const Crease& crease : creases_) {
      for (const int64_t v : {crease.a, crease.b})
        if (v < 0 || v >= static_cast<int64_t>(mesh.positions.size()))
          return input_error(fmt::format("{}:{}: a crease names vertex {}, but must name one in [0, {})", file_,
                                         crease.line, v, mesh.positions.size()));
      mesh.creases.push_back({static_cast<uint32_t>(crease.a), static_cast<uint32_t>(crease.b), crease.sharpness});
    }
    return mesh;
  }

 private:
  struct Crease {
    int64_t a, b;
    float sharpness;
    uint64_t line;
  };

  Status read_lines() {
    std::string_view line;
    while (lines_.next(line)) {
      const std::string_view keyword = take_word(line);
      if (keyword == "v") {
        const std::string_view all = line;
        TRY(const Vec3f v, numbers(line, "v", 3));
        builder_.positions.push_back(v);
        read_colour(all);
      } else if (keyword == "vn") {
        TRY(const Vec3f n, numbers(line, "vn", 3));
        builder_.normals.push_back(n);
      } else if (keyword == "vt") {
        TRY(const Vec3f t, numbers(line, "vt", 1));
        builder_.textures.emplace_back(t.x, t.y);
      } else if (keyword == "f") {
        TRY_STATUS(face(line));
      } else if (keyword == "usemtl") {
        use_material(rest_of(line));
      } else if (keyword == "mtllib") {
        builder_.colours.libraries.emplace_back(rest_of(line));
      } else if (keyword == "g" || keyword == "o") {
        ++builder_.facts.groups;
      } else if (keyword == "t") {
        TRY_STATUS(tag(line));
      }
    }
    builder_.facts.vertices = builder_.positions.size();
    builder_.facts.textures = builder_.textures.size();
    builder_.facts.normals = builder_.normals.size();
    return {};
  }

  /// Colours behind positions: "v x y z r g b", from 0 to 1; as many programs write them. All vertices have one, or
  /// none.
  void read_colour(std::string_view line) {
    if (builder_.position_colours.size() + 1 != builder_.positions.size()) return;
    uint32_t colour = 0;
    for (int i = 0; i < 6; ++i) {
      double value = 0;
      if (!parse(take_word(line), value)) return;
      if (i >= 3) colour = colour << 8 | static_cast<uint32_t>(std::lround(255 * std::clamp(value, 0.0, 1.0)));
    }
    if (take_word(line).empty()) builder_.position_colours.push_back(colour);
  }

  void use_material(std::string_view name) {
    const auto [found, added] =
        materials_.try_emplace(std::string(name), static_cast<uint32_t>(builder_.colours.materials.size()));
    if (added) builder_.colours.materials.push_back({.name = std::string(name), .texture = {}});
    builder_.material = found->second;
  }

  /// "t crease 2/1/0 a b sharpness": an edge from vertex a to vertex b, from 0, in the manner of OpenSubdiv's own
  /// files.
  Status tag(std::string_view line) {
    if (take_word(line) != "crease") return {};
    Crease crease{0, 0, 0, lines_.number()};
    if (take_word(line) != "2/1/0" || !parse(take_word(line), crease.a) || !parse(take_word(line), crease.b) ||
        !parse(take_word(line), crease.sharpness) || !(crease.sharpness >= 0))
      return error("a crease needs \"t crease 2/1/0\", two vertices, counted from 0, and a sharpness of at least 0");
    creases_.push_back(crease);
    return {};
  }

  Error error(const std::string& what) const {
    return input_error(fmt::format("{}:{}: {}", file_, lines_.number(), what));
  }

  /// Up to three numbers, at least `needed`; more (weights, colours) are passed over.
  Result<Vec3f> numbers(std::string_view line, const char* keyword, int needed) const {
    Vec3f v(0.0f);
    for (int i = 0; i < 3; ++i) {
      const std::string_view word = take_word(line);
      if (word.empty() && i >= needed) break;
      double value = 0;
      if (!parse(word, value) || !std::isfinite(static_cast<float>(value)))
        return error(word.empty() ? fmt::format("'{}' has {} numbers, but needs {}", keyword, i, needed)
                                  : fmt::format("'{}' has \"{}\", but needs a finite number", keyword, word));
      v[i] = static_cast<float>(value);
    }
    return v;
  }

  /// 1 is the first; -1 the last so far.
  Status index(std::string_view word, size_t size, const char* what, uint32_t& out) {
    int64_t value = 0;
    if (!parse(word, value)) return error(fmt::format("'f' has \"{}\", but needs the number of a {}", word, what));
    const int64_t n = static_cast<int64_t>(size), from_zero = value > 0 ? value - 1 : n + value;
    if (value == 0 || from_zero < 0 || from_zero >= n)
      return error(fmt::format("'f' names {} {}, but there are {} before it: it must be in 1..{} or -{}..-1", what,
                               value, n, n, n));
    out = static_cast<uint32_t>(from_zero);
    builder_.facts.negative_indices += value < 0;
    return {};
  }

  Status face(std::string_view line) {
    corners_.clear();
    for (std::string_view word = take_word(line); !word.empty(); word = take_word(line)) {
      MeshCorner corner;
      const size_t first = std::min(word.find('/'), word.size());
      TRY_STATUS(index(word.substr(0, first), builder_.positions.size(), "vertex", corner.position));
      builder_.facts.max_index = std::max(builder_.facts.max_index, uint64_t{corner.position} + 1);
      std::string_view rest = word.substr(std::min(first + 1, word.size()));
      const size_t second = std::min(rest.find('/'), rest.size());
      if (second > 0)
        TRY_STATUS(index(rest.substr(0, second), builder_.textures.size(), "texture vertex", corner.texture));
      if (second < rest.size())
        TRY_STATUS(index(rest.substr(second + 1), builder_.normals.size(), "normal", corner.normal));
      corners_.push_back(corner);
    }
    if (corners_.size() < 3) return error(fmt::format("'f' has {} corners, but needs 3", corners_.size()));
    if (!builder_.add_face(corners_))
      return error(fmt::format("'f' has {} corners; a face that is not convex may have {}", corners_.size(),
                               MeshBuilder::kMostCorners));
    return {};
  }

  Lines lines_;
  std::string_view file_;
  MeshBuilder builder_;
  std::vector<MeshCorner> corners_;
  std::vector<Crease> creases_;
  std::unordered_map<std::string, uint32_t> materials_;
};

}  // namespace

Result<TriangleMesh> read_obj(std::span<const uint8_t> bytes, std::string_view file, MeshReport& report,
                              MeshFileFacts* facts, MeshColours* colours) {
  return ObjReader(bytes, file).read(report, facts, colours);
}

Status read_mtl(std::span<const uint8_t> bytes, std::string_view file, MeshColours& colours, MtlReport& report) {
  std::unordered_map<std::string_view, MeshColours::Material*> wanted;
  for (MeshColours::Material& material : colours.materials)
    if (!material.found) wanted.emplace(material.name, &material);
  Lines lines({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  MeshColours::Material* material = nullptr;
  bool clear = false, shining = false;  // the material at hand, counted once
  std::string_view line;
  while (lines.next(line)) {
    const std::string_view keyword = take_word(line);
    const auto numbers = [&](std::span<double> out) -> Status {
      for (double& value : out) {
        const std::string_view word = take_word(line);
        if (!parse(word, value) || !std::isfinite(value))
          return input_error(fmt::format("{}:{}: '{}' has \"{}\", but needs numbers", file, lines.number(), keyword,
                                         word.substr(0, 32)));
      }
      return {};
    };
    if (keyword == "newmtl") {
      const auto found = wanted.find(rest_of(line));
      material = found == wanted.end() ? nullptr : found->second;
      if (material) material->found = true;
      clear = shining = false;
    } else if (!material) {
      continue;
    } else if (keyword == "Kd" && !line.starts_with(" spectral") && !line.starts_with(" xyz")) {
      double v[3];
      TRY_STATUS(numbers(v));
      const auto band = [](double value) { return static_cast<float>(std::clamp(value, 0.0, 1.0)); };
      material->diffuse = {band(v[0]), band(v[1]), band(v[2])};
    } else if (keyword == "map_Kd") {
      // Options come first, the file last; its name may hold spaces, where there are no options.
      std::string_view name = rest_of(line);
      if (name.starts_with('-')) name = name.substr(std::min(name.find_last_of(" \t") + 1, name.size()));
      material->texture = name;
    } else if (keyword == "d" || keyword == "Tr") {
      double v[1];
      TRY_STATUS(numbers(v));
      if (!std::exchange(clear, clear || (keyword == "d" ? v[0] < 1 : v[0] > 0))) report.clear += clear;
    } else if (keyword == "Ke" && !line.starts_with(" spectral") && !line.starts_with(" xyz")) {
      double v[3];
      TRY_STATUS(numbers(v));
      if (!std::exchange(shining, shining || std::max({v[0], v[1], v[2]}) > 0)) report.shining += shining;
    }
  }
  return {};
}

Result<PolygonMesh> read_obj_polygons(std::span<const uint8_t> bytes, std::string_view file) {
  return ObjReader(bytes, file).read_polygons();
}

}  // namespace world
