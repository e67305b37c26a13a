#include "tools/play/play_log.h"

#include <map>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "commit.h"
#include "tools/picture.h"
#include "world/scenes/scene_reactions.h"

namespace tools {

using nlohmann::json;

namespace {

constexpr int kVersion = 2;
constexpr size_t kMostTicksALine = 240;

json walk_json(const WalkInput& i) {
  const int keys = (i.jump ? 1 : 0) | (i.crouch ? 2 : 0) | (i.sprint ? 4 : 0);
  return {i.east, i.south, i.fly_dm_per_s, keys};
}

WalkInput walk_from(const json& j) {
  WalkInput i;
  i.east = j.at(0).get<int16_t>(), i.south = j.at(1).get<int16_t>(), i.fly_dm_per_s = j.at(2).get<int16_t>();
  const int keys = j.at(3).get<int>();
  i.jump = keys & 1, i.crouch = keys & 2, i.sprint = keys & 4;
  return i;
}

uint64_t hash_from(const json& j) { return std::stoull(j.get<std::string>(), nullptr, 16); }

void read_line(const json& j, PlayLog& log) {
  using Kind = PlayEvent::Kind;
  PlayEvent e;
  if (j.contains("ticks")) {
    e.input = walk_from(j.at("walk"));
    size_t n = 0;
    for (const char c : j.at("ticks").get<std::string>()) {
      e.kind = c == 'm' ? Kind::matter : Kind::walk;
      e.sum.reset();
      if (c == 'm' && j.contains("sums")) e.sum = j.at("sums").at(n++).get<std::string>();
      log.events.push_back(e);
    }
    return;
  }
  if (j.contains("sum")) {
    log.events.at(log.events.size() - 1).sum = j.at("sum").get<std::string>();
    return;
  }
  if (j.contains("edit")) {
    e.kind = Kind::edit;
    for (const json& op : j.at("edit"))
      e.edit.push_back({{{op.at(0), op.at(1), op.at(2)}, {op.at(3), op.at(4), op.at(5)}}, op.at(6)});
  } else if (j.contains("undo")) {
    e.kind = Kind::undo;
  } else if (j.contains("redo")) {
    e.kind = Kind::redo;
  } else if (j.contains("back")) {
    e.kind = Kind::back;
  } else if (j.contains("mode")) {
    e.kind = Kind::mode;
    e.flies = j.at("mode").at(0).get<int>() != 0, e.passes = j.at("mode").at(1).get<int>() != 0;
  } else if (j.contains("to")) {
    e.kind = Kind::teleport;
    const json& to = j.at("to");
    e.foot = {{to.at(0), to.at(1), to.at(2)}, {to.at(3).get<double>(), to.at(4).get<double>(), to.at(5).get<double>()}};
  } else {
    e.kind = Kind::mark;
    e.tick = j.at("mark").get<uint64_t>(), e.hash = hash_from(j.at("hash"));
  }
  log.events.push_back(std::move(e));
}

/// The batch in this world's ids; fails where a block isn't in it.
world::Result<world::EditBatch> batch_of(const PlayEvent& e, const world::BlockPalette& palette) {
  world::EditBatch batch;
  for (const auto& [box, name] : e.edit) {
    const auto block = palette.find(name);
    if (!block) return world::input_error("the recording names the block \"" + name + "\", which its world lacks");
    batch.fill(box, *block);
  }
  return batch;
}

}  // namespace

uint64_t ChangeSums::bodies_hash() const {
  const sim::Bodies* bodies = play_.matter().bodies();
  return bodies ? bodies->content_hash() : 0;
}

ChangeSums::Sum ChangeSums::take() {
  Sum sum{follower_.take(), {}};
  sum.text = sum.changes.text();
  if (const uint64_t now = bodies_hash(); std::exchange(bodies_, now) != now) sum.text += "/" + hash_text(now);
  return sum;
}

world::Result<std::unique_ptr<PlayLogWriter>> PlayLogWriter::open(const std::filesystem::path& path,
                                                                  const std::string& scene, PlaySimulation& play) {
  std::unique_ptr<PlayLogWriter> writer(new PlayLogWriter(play));
  writer->out_.open(path, std::ios::binary | std::ios::trunc);
  writer->out_ << json{{"loam_play", kVersion},
                       {"scene", scene},
                       {"commit", LOAM_COMMIT},
                       {"hash", hash_text(play.hash())}}
                      .dump()
               << std::endl;
  if (!writer->ok()) return world::input_error(path.string() + ": the recording can't be written there");
  return writer;
}

PlayLogWriter::~PlayLogWriter() { end_ticks(); }

void PlayLogWriter::end_ticks() {
  if (ticks_.empty()) return;
  json line{{"walk", walk_json(input_)}, {"ticks", ticks_}};
  if (!sums_.empty()) line["sums"] = sums_;
  out_ << line.dump() << std::endl;
  ticks_.clear(), sums_.clear();
}

void PlayLogWriter::sum() {
  const std::string text = changes_.take().text;
  if (!ticks_.empty())
    sums_.push_back(text);  // of the last m: nothing follows it before its sum
  else
    out_ << json{{"sum", text}}.dump() << std::endl;
}

void PlayLogWriter::walk(const WalkInput& input) {
  if (!(input == input_) || ticks_.size() >= kMostTicksALine) end_ticks();
  input_ = input;
  ticks_ += 'w';
}
void PlayLogWriter::matter() { ticks_ += 'm'; }

void PlayLogWriter::edit(const world::EditBatch& batch, const world::BlockPalette& palette) {
  end_ticks();
  json ops = json::array();
  for (const auto& op : batch.ops())
    ops.push_back(
        {op.box.min.x, op.box.min.y, op.box.min.z, op.box.max.x, op.box.max.y, op.box.max.z, palette[op.block].name});
  out_ << json{{"edit", ops}}.dump() << std::endl;
}
void PlayLogWriter::note(const char* what) {
  end_ticks();
  out_ << json{{what, 1}}.dump() << std::endl;
}
void PlayLogWriter::mode(bool flies, bool passes) {
  end_ticks();
  out_ << json{{"mode", {flies ? 1 : 0, passes ? 1 : 0}}}.dump() << std::endl;
}
void PlayLogWriter::teleport(const world::WorldPoint& p) {
  end_ticks();
  out_ << json{{"to", {p.voxel.x, p.voxel.y, p.voxel.z, p.fraction.x, p.fraction.y, p.fraction.z}}}.dump() << std::endl;
}
void PlayLogWriter::mark() {
  end_ticks();
  out_ << json{{"mark", play_.tick()}, {"hash", hash_text(play_.hash())}}.dump() << std::endl;
}

bool is_play_log(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::string start(4096, '\0');
  in.read(start.data(), static_cast<std::streamsize>(start.size()));
  return start.substr(0, start.find('\n')).find("\"loam_play\"") != std::string::npos;
}

world::Result<PlayLog> read_play_log(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return world::input_error(path.string() + ": there is no such file, or it can't be read");
  PlayLog log;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    try {
      const json j = json::parse(line);
      if (number > 1) {
        read_line(j, log);
        continue;
      }
      if (const int version = j.at("loam_play").get<int>(); version < 1 || version > kVersion)
        return world::input_error(path.string() + ": this recording is of a later version of the program");
      log.scene = j.at("scene"), log.commit = j.at("commit"), log.hash = hash_from(j.at("hash"));
    } catch (const std::exception&) {
      // A recording that was cut off within its last line is whole up to there.
      if (in.peek() == std::ifstream::traits_type::eof() && number > 1) break;
      return world::input_error(fmt::format("{}:{}: this is no line of a recorded session", path.string(), number));
    }
  }
  if (log.scene.empty()) return world::input_error(path.string() + ": this is no recorded session");
  return log;
}

namespace {

const char* name_of(PlayEvent::Kind kind) {
  using Kind = PlayEvent::Kind;
  switch (kind) {
    case Kind::matter:
      return "a tick";
    case Kind::edit:
      return "an edit";
    case Kind::undo:
      return "an undo";
    case Kind::redo:
      return "a redo";
    case Kind::back:
      return "a step back";
    default:
      return "what was done";
  }
}

/// The entries of two runs that only one of them has, by voxel: what this world has there was found.
std::vector<PlayedDifference> differences_in(const world::World& world, const std::vector<VoxelEntry>& entries) {
  std::map<uint32_t, std::string> names;
  for (size_t id = 0; id < world.palette->size(); ++id) {
    const std::string& name = (*world.palette)[static_cast<world::BlockId>(id)].name;
    names[name_hash(name)] = name;
  }
  std::map<std::pair<world::Layer, world::VoxelPos>, PlayedDifference> voxels;
  for (const VoxelEntry& entry : entries) {
    PlayedDifference& voxel = voxels[{entry.layer, entry.pos}];
    voxel.layer = world::layer_rows()[static_cast<size_t>(entry.layer)].name, voxel.pos = entry.pos;
    if (entry.layer == world::Layer::block) {
      const std::string& found = (*world.palette)[world.store.get(entry.pos)].name;
      voxel.found = found;
      if (entry.value == name_hash(found)) continue;
      const auto known = names.find(entry.value);
      voxel.expected = known == names.end() ? "a block that this world lacks" : known->second;
      continue;
    }
    const world::IntLayer* values = world.store.find_int_layer(entry.layer);
    if (values && values->active(entry.pos)) voxel.found = std::to_string(values->get(entry.pos));
    const std::string value = std::to_string(static_cast<int32_t>(entry.value));
    if (voxel.found != value) voxel.expected = value;
  }
  std::vector<PlayedDifference> all;
  for (auto& [at, voxel] : voxels) all.push_back(std::move(voxel));
  return all;
}

}  // namespace

world::Result<PlayReplay> replay_play(const PlayLog& log) {
  using Kind = PlayEvent::Kind;
  TRY(const world::Scene scene, world::load_scene(log.scene));
  world::ImportReport report;
  TRY(world::World world, build_picture_world(scene, report));
  TRY_STATUS(world::add_scene_reactions(log.scene, world));
  TRY(const auto play, PlaySimulation::make(world));
  PlayReplay result;
  const auto compare = [&](uint64_t recorded) {
    result.hash = play->hash(), result.recorded = recorded;
    ++result.marks;
    result.equal = result.hash == recorded;
    (result.equal ? result.same_until : result.differs_by) = play->tick();
    return result.equal;
  };
  if (!compare(log.hash)) return result;
  ChangeSums changes(*play);
  for (const PlayEvent& e : log.events) {
    if (e.kind == Kind::walk) play->walk(e.input);
    if (e.kind == Kind::matter) play->step_matter();
    if (e.kind == Kind::undo) play->undo();
    if (e.kind == Kind::redo) play->redo();
    if (e.kind == Kind::back) play->step_back();
    if (e.kind == Kind::mode) play->set_mode(e.flies, e.passes);
    if (e.kind == Kind::teleport) play->teleport(e.foot);
    if (e.kind == Kind::edit) {
      TRY(const world::EditBatch batch, batch_of(e, *world.palette));
      TRY_STATUS(play->edit(batch));
    }
    if (e.kind == Kind::mark && !compare(e.hash)) break;
    if (!e.sum) continue;
    ChangeSums::Sum sum = changes.take();
    if (sum.text == *e.sum) {
      result.same_until = play->tick();
      continue;
    }
    result.equal = false, result.differs_by = play->tick(), result.differs_in = name_of(e.kind);
    const auto recorded = ChangeSketch::from(std::string_view(*e.sum).substr(0, e.sum->find('/')));
    if (!recorded)
      return world::input_error(fmt::format("the sum of {} before tick {} is none", name_of(e.kind), play->tick()));
    sum.changes.toggle(*recorded);
    result.voxels = differences_in(world, sum.changes.entries());
    break;
  }
  return result;
}

}  // namespace tools
