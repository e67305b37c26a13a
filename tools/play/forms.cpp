#include "tools/play/forms.h"

#include <algorithm>
#include <string_view>
#include <utility>

namespace tools {

using world::BlockId;
using world::BlockPalette;
using world::BlockShapes;
using world::EditBatch;
using world::VoxelBox;
using world::VoxelPos;

namespace {

/// Whether a block bears what stands on it, or leans on it, where it lies on `face` of that.
bool bears(const BlockPalette& palette, const BlockShapes& shapes, BlockId bearer, int face) {
  if (face == world::kFaceNegY && !is_replaceable(palette, shapes, bearer)) return true;
  const world::Phase phase = palette[bearer].phase;
  return bearer != world::kAir && !shapes.shape[bearer] &&
         (phase == world::Phase::solid || phase == world::Phase::granular);
}

/// What the batch writes there last.
std::optional<BlockId> written(const EditBatch& batch, VoxelPos v) {
  for (auto op = batch.ops().rbegin(); op != batch.ops().rend(); ++op)
    if (op->box.contains(v)) return op->block;
  return std::nullopt;
}

// ---- names ----

using Words = std::vector<std::pair<std::string_view, std::string_view>>;
const Words kQuarter{{"east", "south"}, {"south", "west"}, {"west", "north"},
                     {"north", "east"}, {"x", "z"},        {"z", "x"}};
const Words kFlips[3] = {{{"east", "west"}, {"west", "east"}, {"left", "right"}, {"right", "left"}},
                         {{"top", "bottom"}, {"bottom", "top"}, {"up", "down"}, {"down", "up"}},
                         {{"north", "south"}, {"south", "north"}, {"left", "right"}, {"right", "left"}}};

/// Two sides in one word ("south_east") have one order.
void order_sides(std::vector<std::string>& words) {
  constexpr std::string_view kOrder[] = {"north", "south", "east", "west"};
  const auto place = [&](const std::string& word) { return std::find(kOrder, kOrder + 4, word) - kOrder; };
  for (size_t i = 0; i + 1 < words.size(); ++i)
    if (place(words[i]) < 4 && place(words[i + 1]) < place(words[i])) std::swap(words[i], words[i + 1]);
}

/// Words between underlines, each as the table says. A lone letter is an axis where it is a property's value alone.
std::string exchanged(std::string_view text, const Words& table, bool is_value) {
  std::vector<std::string> words;
  for (size_t at = 0; at <= text.size();) {
    const size_t end = std::min(text.find('_', at), text.size());
    std::string_view word = text.substr(at, end - at);
    if (word.size() > 1 || is_value)
      for (const auto& [from, to] : table)
        if (word == from) {
          word = to;
          break;
        }
    words.emplace_back(word);
    at = end + 1;
  }
  order_sides(words);
  std::string out = words[0];
  for (size_t i = 1; i < words.size(); ++i) out += "_" + words[i];
  return out;
}

/// "name[key=value,...]", with the keys in the order of the alphabet.
std::string exchanged_name(const std::string& name, const Words& table) {
  const size_t open = name.find('[');
  if (open == std::string::npos || name.back() != ']') return exchanged(name, table, false);
  std::vector<std::string> properties;
  for (size_t at = open + 1; at < name.size();) {
    const size_t end = std::min(name.find(',', at), name.size() - 1);
    const std::string_view property = std::string_view(name).substr(at, end - at);
    const size_t equals = std::min(property.find('='), property.size());
    std::string changed = exchanged(property.substr(0, equals), table, false);
    if (equals < property.size()) changed += "=" + exchanged(property.substr(equals + 1), table, true);
    properties.push_back(std::move(changed));
    at = end + 1;
  }
  std::sort(properties.begin(), properties.end());
  std::string out = name.substr(0, open);
  for (size_t i = 0; i < properties.size(); ++i) out += (i ? "," : "[") + properties[i];
  return out + "]";
}

}  // namespace

BlockId upright_form(const BlockPalette& palette, const BlockShapes& shapes, BlockId block) {
  const world::Proxy* shape = shapes.shape[block];
  if (!shape || shape->borne_by == world::kAlways || shape->borne_by == world::kFaceNegY) return block;
  const std::string& name = palette[block].name;
  return palette.find(name.substr(0, name.rfind('_'))).value_or(block);
}

std::optional<BlockId> form_beside(const world::World& world, const BlockShapes& shapes, BlockId block,
                                   const Pick& target) {
  const BlockPalette& palette = *world.palette;
  const BlockId upright = upright_form(palette, shapes, block);
  if (!shapes.shape[upright] || shapes.shape[upright]->borne_by == world::kAlways) return block;
  const auto form_at = [&](int face) -> std::optional<BlockId> {
    const BlockId bearer = world.store.get(target.beside() + world::face_step(face));
    if (!bears(palette, shapes, bearer, face)) return std::nullopt;
    for (const char* side : {"", "_east", "_north", "_south", "_west"})
      if (const auto form = palette.find(palette[upright].name + side);
          form && shapes.shape[*form] && shapes.shape[*form]->borne_by == face)
        return form;
    return std::nullopt;
  };
  if (!target.replaceable)
    if (const auto form = form_at(world::opposite_face(target.face))) return form;
  for (const int face : {world::kFaceNegY, world::kFacePosX, world::kFaceNegZ, world::kFacePosZ, world::kFaceNegX})
    if (const auto form = form_at(face)) return form;
  return std::nullopt;
}

EditBatch with_what_falls(const world::World& world, const BlockShapes& shapes, EditBatch batch) {
  const BlockPalette& palette = *world.palette;
  // By block, the face on which what bears it lies.
  std::vector<int> borne_by(palette.size(), world::kAlways);
  bool any = false;
  for (size_t id = 0; id < shapes.shape.size(); ++id)
    if (const world::Proxy* shape = shapes.shape[id]) {
      borne_by[id] = shape->borne_by;
      any |= shape->borne_by != world::kAlways;
    }
  VoxelBox changed;
  for (const EditBatch::Op& op : batch.ops()) changed.include(op.box);
  if (!any || changed.empty()) return batch;

  // What stands in the batch's bounds, or beside them, and needs a bearer.
  std::vector<std::pair<VoxelPos, int>> borne;
  const VoxelPos one{1, 1, 1};
  const world::LeafPos low = world::leaf_from_voxel(changed.min - one),
                       high = world::leaf_from_voxel(changed.max + one);
  world::StoreReader reader(world.store);
  world::LeafPos leaf;
  for (leaf.x = low.x; leaf.x <= high.x; ++leaf.x)
    for (leaf.y = low.y; leaf.y <= high.y; ++leaf.y)
      for (leaf.z = low.z; leaf.z <= high.z; ++leaf.z) {
        const world::LeafBlocks blocks = reader.leaf(leaf);
        if (!blocks.values && borne_by[blocks.uniform] == world::kAlways) continue;
        for (int i = 0; i < world::kLeafVoxels; ++i)
          if (const int face = borne_by[blocks[i]]; face != world::kAlways)
            borne.emplace_back(world::voxel_from_leaf(leaf) + world::offset_in_leaf(i), face);
      }
  // What falls may have borne something itself.
  for (bool more = true; more;) {
    more = false;
    for (auto& [voxel, face] : borne) {
      if (face == world::kAlways) continue;
      const auto bearer = written(batch, voxel + world::face_step(face));
      if (!bearer || bears(palette, shapes, *bearer, face)) continue;
      face = world::kAlways;
      if (written(batch, voxel)) continue;
      batch.set(voxel, world::kAir);
      more = true;
    }
  }
  return batch;
}

TurnedForms::TurnedForms(const BlockPalette& palette) {
  const auto fill = [&](std::vector<BlockId>& forms, const Words& table) {
    for (size_t id = 0; id < palette.size(); ++id)
      forms.push_back(palette.find(exchanged_name(palette[static_cast<BlockId>(id)].name, table))
                          .value_or(static_cast<BlockId>(id)));
  };
  fill(turned, kQuarter);
  for (size_t axis = 0; axis < 3; ++axis) fill(flipped[axis], kFlips[axis]);
}

}  // namespace tools
