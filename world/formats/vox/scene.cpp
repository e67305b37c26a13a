// Where the models of a .vox file stand: its scene graph, flattened.
#include "world/formats/vox/vox_file.h"

#include <set>

#include <fmt/format.h>

#include "world/formats/bytes.h"

namespace world::vox {
namespace {

constexpr size_t kMaxNameBytes = 64;

/// The entry that shows at `frame`: the last that began; the first entry where none has begun, or frame is negative.
template <class Value>
const Value& at_frame(const std::vector<std::pair<int, Value>>& entries, int frame) {
  const std::pair<int, Value>* shown = &entries.front();
  if (frame < 0) return shown->second;
  bool begun = shown->first <= frame;
  for (const auto& entry : entries) {
    if (entry.first <= frame && (!begun || entry.first >= shown->first)) shown = &entry, begun = true;
  }
  return shown->second;
}

bool is_hidden(const Dictionary& attributes) {
  const auto found = attributes.find("_hidden");
  return found != attributes.end() && found->second == "1";
}

struct Walk {
  const File& file;
  std::string_view name;
  int frame;
  std::vector<Instance> found;
  std::set<int32_t> open;  // nodes on the way from the root
  size_t steps = 0;

  Status visit(int32_t id, const Transform& transform, bool hidden, const std::string& label, uint64_t parent_offset) {
    const auto at = file.nodes.find(id);
    if (at == file.nodes.end()) {
      return byte_error(name, parent_offset, fmt::format("the scene refers to the node {}, which does not exist", id));
    }
    const Node& node = at->second;
    if (open.size() >= static_cast<size_t>(kMaxDepth)) {
      return byte_error(name, node.offset, fmt::format("the scene is nested deeper than {} levels", kMaxDepth));
    }
    // Counting steps, not only instances, bounds the time that empty groups inside groups can take.
    if (++steps > 8 * kMaxInstances) return byte_error(name, node.offset, "the scene repeats its groups too often");
    if (!open.insert(id).second) {
      return byte_error(name, node.offset, fmt::format("the scene node {} contains itself", id));
    }
    Status status;
    if (node.kind == Node::transform) {
      const Transform inner = compose(transform, at_frame(node.trn.frames, frame));
      bool below = hidden || is_hidden(node.trn.attributes);
      if (const auto layer = file.layers.find(node.trn.layer); layer != file.layers.end())
        below |= is_hidden(layer->second);
      const auto own = node.trn.attributes.find("_name");
      // Cut, so that thousands of copies of one long name cost little.
      const std::string next = own == node.trn.attributes.end() ? label : own->second.substr(0, kMaxNameBytes);
      status = visit(node.trn.child, inner, below, next, node.offset);
    } else if (node.kind == Node::group) {
      for (const int32_t child : node.grp.children) {
        status = visit(child, transform, hidden, label, node.offset);
        if (!status) break;
      }
    } else {
      status = shape(node, transform, hidden, label);
    }
    open.erase(id);
    return status;
  }

  Status shape(const Node& node, const Transform& transform, bool hidden, const std::string& label) {
    for (const auto& [number, model] : node.shp.models) {
      if (model < 0 || static_cast<size_t>(model) >= file.models.size()) {
        return byte_error(name, node.offset,
                          fmt::format("the scene shows model {}, but the file holds {}", model, file.models.size()));
      }
    }
    if (found.size() >= kMaxInstances) {
      return byte_error(name, node.offset, fmt::format("the scene shows more than {} models", kMaxInstances));
    }
    found.push_back({at_frame(node.shp.models, frame), transform, hidden, label});
    return {};
  }
};

}  // namespace

Transform compose(const Transform& outer, const Transform& inner) {
  Transform both;
  for (size_t row = 0; row < 3; ++row) {
    const size_t through = static_cast<size_t>(outer.column[row]);
    both.column[row] = inner.column[through];
    both.sign[row] = outer.sign[row] * inner.sign[through];
    both.translation[row] = outer.sign[row] * inner.translation[through] + outer.translation[row];
  }
  return both;
}

std::array<int64_t, 3> cell(const Transform& transform, const Model& model, const Voxel& voxel) {
  const int64_t v[3] = {voxel.x, voxel.y, voxel.z};
  std::array<int64_t, 3> result;
  for (size_t row = 0; row < 3; ++row) {
    const size_t from = static_cast<size_t>(transform.column[row]);
    // Twice the centre of the voxel, an odd number: halves stay exact, and >> rounds down.
    const int64_t twice = transform.sign[row] * (2 * (v[from] - model.size[from] / 2) + 1);
    result[row] = ((twice - 1) >> 1) + transform.translation[row];
  }
  return result;
}

Result<std::vector<Instance>> instances(const File& file, std::string_view name, int frame) {
  if (file.nodes.empty()) {
    std::vector<Instance> all;
    for (size_t m = 0; m < file.models.size(); ++m) {
      const Model& model = file.models[m];
      Transform in_place;  // undoes the centring: a voxel stays at its own coordinates
      for (size_t axis = 0; axis < 3; ++axis) in_place.translation[axis] = model.size[axis] / 2;
      if (frame < 0 || static_cast<size_t>(frame) == m) all.push_back({static_cast<int32_t>(m), in_place, false, ""});
    }
    if (all.empty())
      return input_error(fmt::format("{}: has no frame {}; it holds {} models", name, frame, file.models.size()));
    return all;
  }
  // The root is the first node; nothing else is reachable.
  Walk walk{file, name, frame, {}, {}};
  TRY_STATUS(walk.visit(file.nodes.begin()->first, Transform{}, false, "", 0));
  return std::move(walk.found);
}

}  // namespace world::vox
