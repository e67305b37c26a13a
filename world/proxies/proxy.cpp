#include "world/proxies/proxy.h"

#include <algorithm>
#include <array>
#include <iostream>

#include <glm/geometric.hpp>

#include "proxy_files.h"
#include "world/base/text.h"
#include "world/base/toml_reader.h"

namespace world {

namespace {

constexpr NumberRange kInVoxel{.min = 0, .max = 1};
constexpr NumberRange kEdge{.min = -1, .max = 1};
constexpr std::array<std::string_view, kFaces> kSides = {"-x", "+x", "-y", "+y", "-z", "+z"};

std::span<float> values(Vec3f& v) { return {&v.x, 3}; }

void read_box(TomlTable& table, Proxy& proxy) {
  ProxyBox box;
  const bool low = table.require("low", values(box.low), kInVoxel);
  const bool high = table.require("high", values(box.high), kInVoxel);
  if (low && high)
    for (int a = 0; a < 3; ++a)
      if (!(box.low[a] < box.high[a])) {
        table.fail("high", "each coordinate of high must be larger than that of low");
        break;
      }
  table.read_choice("joins", box.joins, kSides);
  proxy.boxes.push_back(box);
}

void read_quad(TomlTable& table, Proxy& proxy) {
  ProxyQuad quad;
  const bool corner = table.require("corner", values(quad.corner), kInVoxel);
  const bool u = table.require("u", values(quad.u), kEdge);
  const bool v = table.require("v", values(quad.v), kEdge);
  if (corner && u && v) {
    for (const Vec3f& p : {quad.corner + quad.u, quad.corner + quad.v, quad.corner + quad.u + quad.v})
      if (glm::any(glm::lessThan(p, Vec3f(0))) || glm::any(glm::greaterThan(p, Vec3f(1)))) {
        table.fail("corner",
                   "the quad must lie in the voxel: corner, corner + u, corner + v and corner + u + v in 0..1");
        break;
      }
    if (!(glm::length(glm::cross(quad.u, quad.v)) > 1e-6f))
      table.fail("v", "u and v must span an area: they have no length or one direction");
  }
  table.read_choice("joins", quad.joins, kSides);
  proxy.quads.push_back(quad);
}

}  // namespace

void Proxy::finish() {
  may_join = 0, bounds.clear(), frames.clear();
  for (const ProxyBox& box : boxes)
    if (box.joins != kAlways) may_join = static_cast<uint8_t>(may_join | 1 << box.joins);
  for (const ProxyQuad& quad : quads) {
    if (quad.joins != kAlways) may_join = static_cast<uint8_t>(may_join | 1 << quad.joins);
    const Vec3d u(quad.u), v(quad.v), normal = cross(u, v);
    const double square = dot(normal, normal);
    frames.push_back({normal, cross(v, normal) / square, cross(normal, u) / square});
  }
  for (int joins = 0; joins < 64; ++joins) {
    Bounds all{Vec3f(2), Vec3f(-2)};
    for (const ProxyFace& face : proxy_faces(*this, static_cast<uint8_t>(joins)))
      for (const Vec3f& corner : face.corner) all.low = min(all.low, corner), all.high = max(all.high, corner);
    for (int a = 0; a < 3; ++a)
      if (!quads.empty()) all.low[a] -= 0x1p-12f, all.high[a] += 0x1p-12f;
    bounds.push_back(all);
  }
}

Result<Proxy> read_proxy(const std::string& name, std::string_view text, const std::string& file_name) {
  TRY(TomlDocument document, TomlDocument::parse(text, file_name));
  Proxy proxy;
  proxy.name = name;
  TomlTable root = document.root();
  root.require("what", proxy.what);
  for (TomlTable& table : root.array_of_tables("box")) read_box(table, proxy);
  for (TomlTable& table : root.array_of_tables("quad")) read_quad(table, proxy);
  root.read_choice("borne_by", proxy.borne_by, kSides);
  root.read("passable", proxy.passable);
  if (proxy.boxes.empty() && proxy.quads.empty()) root.fail({}, "a proxy needs at least one [[box]] or [[quad]]");
  if (proxy.boxes.size() + proxy.quads.size() > kMostProxyParts)
    root.fail({}, "a proxy has at most " + std::to_string(kMostProxyParts) + " boxes and quads");
  TRY_STATUS(document.finish());
  proxy.finish();
  return proxy;
}

std::span<const Proxy> proxies() {
  static const std::vector<Proxy> all = [] {
    std::vector<Proxy> read;
    for (const EmbeddedText* file = proxy_files; file->name; ++file) {
      const std::string_view file_name = file->name;
      auto proxy = read_proxy(std::string(file_name.substr(0, file_name.find('.'))), file->text, file->name);
      if (!proxy.ok()) std::cerr << proxy.error().message << '\n';
      CHECK(proxy.ok());
      read.push_back(std::move(*proxy));
    }
    std::sort(read.begin(), read.end(), [](const Proxy& a, const Proxy& b) { return a.name < b.name; });
    return read;
  }();
  return all;
}

const Proxy* find_proxy(std::string_view name) {
  for (const Proxy& proxy : proxies())
    if (proxy.name == name) return &proxy;
  return nullptr;
}

Status check_proxies(const BlockPalette& palette) {
  for (size_t id = 0; id < palette.size(); ++id) {
    const Block& block = palette[static_cast<BlockId>(id)];
    if (block.proxy.empty() || find_proxy(block.proxy)) continue;
    const auto nearest = std::min_element(proxies().begin(), proxies().end(), [&](const Proxy& a, const Proxy& b) {
      return edit_distance(block.proxy, a.name) < edit_distance(block.proxy, b.name);
    });
    return input_error((block.where_proxy.empty() ? "" : block.where_proxy + ": 'proxy' of ") + "block '" + block.name +
                       "': there is no proxy '" + block.proxy + "'; the nearest is '" + nearest->name + "'");
  }
  return {};
}

Result<BlockShapes> block_shapes(const BlockPalette& palette) {
  TRY_STATUS(check_proxies(palette));
  BlockShapes shapes;
  for (size_t id = 0; id < palette.size(); ++id) {
    const Block& block = palette[static_cast<BlockId>(id)];
    const Proxy* shape = block.proxy.empty() ? nullptr : find_proxy(block.proxy);
    shapes.shape.push_back(shape);
    shapes.fills.push_back(!shape && block.opaque);
  }
  return shapes;
}

std::vector<ProxyFace> proxy_faces(const Proxy& proxy, uint8_t joins) {
  std::vector<ProxyFace> faces;
  for (const ProxyBox& box : proxy.boxes) {
    if (!proxy.has_part(box.joins, joins)) continue;
    for (int f = 0; f < kFaces; ++f) {
      const int axis = face_axis(f), u = (axis + 1) % 3, v = (axis + 2) % 3;
      const bool high = face_sign(f) > 0;
      ProxyFace face;
      for (int c = 0; c < 4; ++c) {
        // u x v points along +axis: the low face goes round the other way.
        const bool second = c == 1 || c == 2, third = c >= 2;
        face.corner[c][axis] = high ? box.high[axis] : box.low[axis];
        face.corner[c][u] = (high ? second : third) ? box.high[u] : box.low[u];
        face.corner[c][v] = (high ? third : second) ? box.high[v] : box.low[v];
      }
      faces.push_back(face);
    }
  }
  for (const ProxyQuad& quad : proxy.quads)
    if (proxy.has_part(quad.joins, joins))
      faces.push_back({{quad.corner, quad.corner + quad.u, quad.corner + quad.u + quad.v, quad.corner + quad.v}});
  return faces;
}

double shown_area(const Proxy& proxy) {
  double area = 0;
  for (const ProxyFace& f : proxy_faces(proxy, 0))
    area += glm::length(cross(Vec3d(f.corner[1] - f.corner[0]), Vec3d(f.corner[3] - f.corner[0])));
  for (const ProxyQuad& q : proxy.quads)
    if (Proxy::has_part(q.joins, 0)) area += glm::length(cross(Vec3d(q.u), Vec3d(q.v)));
  return std::max(area, 1e-6);
}

}  // namespace world
