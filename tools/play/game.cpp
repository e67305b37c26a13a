#include "tools/play/game.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "tools/picture.h"

namespace tools {

using world::BlockId;
using world::EditBatch;
using world::Vec3d;
using world::VoxelPos;
using world::WorldPoint;

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kSteepest = 89.5 * kPi / 180;
constexpr double kTwiceWithinS = 0.3;           // two presses of the jump key
constexpr double kUseFirstS = 0.45;             // until a button that is held does it again, ...
constexpr double kUseEveryS = 0.22;             // ... and from then on
constexpr double kMessageS = 4, kReadS = 0.04;  // and so long for each letter
constexpr double kMostSaveS = 60;               // that leaving waits for
constexpr float kKeptHourStep = 0.25f;          // of the sun, that a crash may lose
constexpr int kBlastRadius = 4;
constexpr double kThirdPersonM = 5, kZoom = 0.25;

constexpr std::array<const char*, kSlots> kFirstSlots{"oak_planks", "cobblestone", "glass",   "brick_red", "lamp_warm",
                                                      "water",      "sand",        "oak_log", "torch"};

Vec3d forward_of(double yaw, double pitch) {
  return {std::sin(yaw) * std::cos(pitch), std::sin(pitch), -std::cos(yaw) * std::cos(pitch)};
}

}  // namespace

world::Result<std::unique_ptr<Game>> Game::make(std::unique_ptr<PlayedWorld> played, const PlaySettings& settings,
                                                const GameOptions& options) {
  std::unique_ptr<Game> game(new Game);
  world::World& world = played->world();
  TRY(game->shapes_, world::block_shapes(*world.palette));
  game->forms_ = TurnedForms(*world.palette);
  game->palette_ = *world.palette;
  game->name_ = played->name, game->scene_ = played->scene, game->path_ = played->path;
  game->own_file_ = options.own_file;
  game->environment = world.environment;
  game->fov_deg = settings.fov_deg, game->day_minutes = settings.day_minutes;
  game->picture.backend = settings.backend;
  std::map<std::string, std::string> knobs = world.knobs;
  knobs.emplace("light_model", "flood_rgb");  // lamps shine, and caves are dark
  for (const auto& [name, value] : settings.knobs)
    if (!is_of_moment(name)) knobs[name] = value;
  TRY(game->picture.knobs, resolve_knobs("usual", knobs, {}, {}));
  const Start start = start_of(world);
  game->yaw_ = start.yaw, game->pitch_ = start.pitch;
  for (size_t i = 0; i < kFirstSlots.size(); ++i)
    game->slots_[i] =
        world.palette->find(kFirstSlots[i]).value_or(world.palette->size() > 1 ? BlockId{1} : world::kAir);
  TRY(game->simulation_,
      SimThread::make(std::move(played), {.autosave_s = settings.autosave_s, .record = options.record}));
  world::World mirror = copy_of(game->simulation_->played().world());
  game->state_ = game->simulation_->state();
  game->eye_ = game->state_.now.eye();
  game->simulation_->start();
  game->pictures_ = std::make_unique<PictureMaker>(std::move(mirror), *game->simulation_);
  return game;
}

Game::~Game() {
  if (!closed_) (void)close().ok();
}

world::Status Game::close() {
  closed_ = true;
  keep_hours();
  pictures_.reset();
  const world::Status stopped = simulation_->stop(yaw_, pitch_);
  const bool changed = simulation_->state().edited;
  simulation_.reset();
  // A file that was made for a world in which nothing was done.
  std::error_code ignored;
  if (own_file_ && !changed) std::filesystem::remove(path_, ignored);
  return stopped;
}

void Game::say(const std::string& sentence) {
  if (!messages_.empty() && messages_.back().text == sentence) messages_.pop_back();
  // Long ones are read longer.
  messages_.push_back({sentence, SimThread::now_s() + kMessageS + kReadS * static_cast<double>(sentence.size())});
  while (messages_.size() > 4) messages_.pop_front();
}

void Game::send_mode(bool flies, bool passes) {
  PlayRequest request;
  request.kind = PlayRequest::Kind::mode, request.flies = flies, request.passes = passes;
  simulation_->ask(std::move(request));
}

void Game::jump_pressed() {
  const double now = SimThread::now_s();
  if (now - last_jump_s_ < kTwiceWithinS) {
    send_mode(!state_.now.flies, false);
    last_jump_s_ = -1;
    return;
  }
  last_jump_s_ = now;
}

void Game::press(Action action) {
  const bool was_down = std::exchange(down_[static_cast<size_t>(action)], true);
  if (was_down) return;
  using Kind = PlayRequest::Kind;
  const int slot = static_cast<int>(action) - static_cast<int>(Action::slot_1);
  if (slot >= 0 && slot < kSlots) slot_ = slot;
  const auto brush_by = [&](int by) {
    const int n = static_cast<int>(kBrushNames.size());
    brush = static_cast<BrushKind>((static_cast<int>(brush) + by + n) % n);
    corner_.reset();
    say("brush: " + brush_text());
  };
  switch (action) {
    case Action::jump:
      jump_pressed();
      break;
    case Action::fly:
      send_mode(!state_.now.flies, false);
      break;
    case Action::no_clip:
      send_mode(true, !state_.now.passes);
      break;
    case Action::break_block:
    case Action::place_block:
      use_hand(action == Action::place_block);
      next_use_s_ = SimThread::now_s() + kUseFirstS;
      break;
    case Action::pick_block:
      if (target_.hit) take_in_hand(upright_form(palette_, shapes_, target_.block));
      break;
    case Action::next_brush:
      brush_by(1);
      break;
    case Action::previous_brush:
      brush_by(-1);
      break;
    case Action::smaller_brush:
    case Action::larger_brush:
      brush_radius = std::clamp(brush_radius + (action == Action::larger_brush ? 1 : -1), 0, kMostBrushRadius);
      say(fmt::format("brush radius {}", brush_radius));
      break;
    case Action::turn:
      clipboard_ = turned(clipboard_, forms_);
      break;
    case Action::flip:
      clipboard_ = flipped(clipboard_, std::abs(std::sin(yaw_)) > 0.7 ? 0 : 2, forms_);
      break;
    case Action::mirror:
      if (mirror_) {
        mirror_.reset();
        say("mirror: off");
      } else if (target_.hit) {
        mirror_ = Mirror{std::abs(std::sin(yaw_)) > 0.7 ? 2 : 0, 0};
        mirror_->at = target_.voxel[mirror_->axis];
        say(fmt::format("mirror: at {} = {}", mirror_->axis == 0 ? "x" : "z", mirror_->at));
      }
      break;
    case Action::pour:
      if (const auto water = palette_.find("water"); water && target_.hit) {
        std::optional<VoxelPos> room;
        pictures_->with_world(
            [&](const world::World& world) { room = room_to_pour(world, shapes_, target_.beside(), *water); });
        if (!room) {
          say("there is no room for more water");
          break;
        }
        EditBatch batch;
        batch.set(*room, *water);
        edit(std::move(batch), "pour water");
      }
      break;
    case Action::ignite:
      if (const auto fire = palette_.find("fire"); fire && target_.hit) {
        EditBatch batch;
        batch.set(target_.beside(), *fire);
        edit(std::move(batch), "light a fire");
      }
      break;
    case Action::blast:
      if (target_.hit) edit(sphere_of(target_.voxel, kBlastRadius, world::kAir), "blow a hole");
      break;
    case Action::undo:
      ask(Kind::undo);
      break;
    case Action::redo:
      ask(Kind::redo);
      break;
    case Action::save:
      save();
      break;
    case Action::pause:
      pause(!state_.paused);
      break;
    case Action::tick_forward:
      ask(Kind::step);
      break;
    case Action::tick_back:
      ask(Kind::back);
      break;
    case Action::slower:
      set_speed(state_.speed_eighths / 2);
      break;
    case Action::faster:
      set_speed(state_.speed_eighths * 2);
      break;
    case Action::person:
      third_person = !third_person;
      break;
    case Action::swap_backend:
      picture.backend = picture.backend == "raster" ? "raycast" : "raster";
      say("drawn by the backend " + picture.backend);
      break;
    case Action::split:
      view = view == ViewMode::split ? ViewMode::single : ViewMode::split;
      break;
    case Action::error:
      view = view == ViewMode::error ? ViewMode::single : ViewMode::error;
      break;
    case Action::further:
    case Action::nearer: {
      const bool out = action == Action::further;
      float& distance = picture.knobs.view_distance;
      distance = std::min(distance, 4096.0f);
      distance = std::clamp(out ? distance * 2 : distance / 2, 32.0f, 1e9f);
      if (distance > 4096) distance = 1e9f;
      say(distance > 1e8f ? std::string("view distance: all") : fmt::format("view distance: {} m", distance));
      break;
    }
    default:
      break;
  }
}

void Game::release(Action action) { down_[static_cast<size_t>(action)] = false; }
void Game::release_all() { down_.fill(false); }

void Game::look(double right, double up) {
  const double scale = down_[static_cast<size_t>(Action::zoom)] ? kZoom : 1;
  yaw_ = std::remainder(yaw_ + right * scale, 2 * kPi);
  pitch_ = std::clamp(pitch_ + up * scale, -kSteepest, kSteepest);
}

void Game::set_yaw_pitch(double yaw, double pitch) {
  yaw_ = std::remainder(yaw, 2 * kPi), pitch_ = std::clamp(pitch, -kSteepest, kSteepest);
}

void Game::set_fly_speed(double mps) { fly_dm_per_s_ = static_cast<int>(std::clamp(mps * 10, 10.0, 10000.0)); }

void Game::walk_by(double ahead, double aside) { stick_ahead_ = ahead, stick_aside_ = aside; }

void Game::wheel(int steps, bool control) {
  if (control && state_.now.flies) {
    set_fly_speed(fly_dm_per_s_ / 10.0 * std::pow(1.25, steps));
    say(fmt::format("flies at {:.0f} m/s", fly_dm_per_s_ / 10.0));
    return;
  }
  slot_ = ((slot_ - steps) % kSlots + kSlots) % kSlots;
}

void Game::take_in_hand(BlockId block) {
  for (int i = 0; i < kSlots; ++i)
    if (slots_[static_cast<size_t>(i)] == block) {
      slot_ = i;
      return;
    }
  slots_[static_cast<size_t>(slot_)] = block;
}

void Game::ask(PlayRequest::Kind kind) {
  PlayRequest request;
  request.kind = kind;
  last_request_ = simulation_->ask(std::move(request));
}

void Game::set_speed(int eighths) {
  PlayRequest request;
  request.kind = PlayRequest::Kind::speed, request.speed_eighths = std::clamp(eighths, 1, 512);
  simulation_->ask(std::move(request));
}

void Game::pause(bool on) {
  PlayRequest request;
  request.kind = PlayRequest::Kind::pause, request.on = on;
  simulation_->ask(std::move(request));
}

void Game::go_to(const WorldPoint& foot) {
  PlayRequest request;
  request.kind = PlayRequest::Kind::teleport, request.foot = foot;
  simulation_->ask(std::move(request));
}

void Game::save() {
  keep_hours();
  PlayRequest request;
  request.kind = PlayRequest::Kind::save, request.yaw = yaw_, request.pitch = pitch_;
  simulation_->ask(std::move(request));
}

world::Status Game::save_all() {
  keep_hours();
  PlayRequest request;
  request.kind = PlayRequest::Kind::save_all, request.yaw = yaw_, request.pitch = pitch_;
  const uint64_t number = simulation_->ask(std::move(request));
  simulation_->wait_for(number, kMostSaveS);
  const PlayState state = simulation_->state();
  if (state.applied < number) return world::input_error(fmt::format("it took more than {} s", kMostSaveS));
  return state.unsaved.empty() ? world::Status{} : world::input_error(state.unsaved);
}

void Game::write_copy(const std::filesystem::path& path) {
  keep_hours();
  PlayRequest request;
  request.kind = PlayRequest::Kind::copy, request.path = path, request.yaw = yaw_, request.pitch = pitch_;
  last_request_ = simulation_->ask(std::move(request));
}

void Game::set_time_of_day(double hours) {
  hours -= 24 * std::floor(hours / 24);
  (void)set_knob("time_of_day", fmt::format("{:.3f}", hours)).ok();
  if (day_minutes <= 0) say("the sun stands still; /day 20 lets a day pass in 20 minutes");
}

world::Status Game::set_knob(const std::string& name, const std::string& value) {
  TRY_STATUS(render::render_knobs().set(picture.knobs, name, value));
  if (!is_of_moment(name)) return {};
  if (other) other->knobs = at_moment_of(picture.knobs, other->knobs);
  // Of the world, and kept with it.
  PlayRequest request;
  request.kind = PlayRequest::Kind::knob, request.name = name, request.value = value;
  simulation_->ask(std::move(request));
  return {};
}

void Game::set_accuracy(world::Accuracy accuracy) {
  picture.knobs = at_moment_of(picture.knobs, render::render_knobs().preset(accuracy));
}

uint64_t Game::edit(EditBatch batch, const std::string& what) {
  if (batch.empty()) return last_request_;
  for (const EditBatch::Op& op : batch.ops())
    if (!world::inside_world(op.box.min) || !world::inside_world(op.box.max)) {
      say("the world ends there: " + what + " was not done");
      return last_request_;
    }
  if (mirror_) batch = mirrored(batch, mirror_->axis, mirror_->at, forms_);
  pictures_->with_world([&](const world::World& world) { batch = with_what_falls(world, shapes_, std::move(batch)); });
  PlayRequest request;
  request.kind = PlayRequest::Kind::edit, request.edit = std::move(batch);
  return last_request_ = simulation_->ask(std::move(request));
}

bool Game::blocks_player(const EditBatch& batch) const {
  const WorldPoint low = state_.now.foot + Vec3d(-sim::kPlayerWidth / 2, 0.001, -sim::kPlayerWidth / 2);
  const double height = state_.now.crouches ? sim::kCrouchedHeight : sim::kPlayerHeight;
  const WorldPoint high = state_.now.foot + Vec3d(sim::kPlayerWidth / 2, height - 0.001, sim::kPlayerWidth / 2);
  if (state_.now.passes) return false;
  for (const EditBatch::Op& op : batch.ops()) {
    const world::Phase phase = palette_[op.block].phase;
    if (op.block == world::kAir || phase == world::Phase::gas || phase == world::Phase::liquid) continue;
    if (const world::Proxy* shape = shapes_.shape[op.block]; shape && !shape->stops_bodies()) continue;
    bool meets = true;
    for (int a = 0; a < 3; ++a) meets &= op.box.min[a] <= high.voxel[a] && op.box.max[a] >= low.voxel[a];
    if (meets) return true;
  }
  return false;
}

void Game::place_single(bool places) {
  if (!target_.hit) return;
  EditBatch batch;
  if (places && in_hand() == world::kAir) return;
  if (places) {
    std::optional<BlockId> form;
    pictures_->with_world([&](const world::World& world) { form = form_beside(world, shapes_, in_hand(), target_); });
    if (!form) return say("that needs a block below it, or a wall that bears it");
    batch.set(target_.beside(), *form);
  } else {
    batch.set(target_.voxel, world::kAir);
  }
  if (places && blocks_player(batch)) return;
  edit(std::move(batch), places ? "place" : "break");
}

VoxelPos Game::brush_at(bool places) const { return places ? target_.beside() : target_.voxel; }

EditBatch Game::shape(bool places, VoxelPos at) const {
  const BlockId block = places ? in_hand() : world::kAir;
  switch (brush) {
    case BrushKind::sphere:
      return sphere_of(at, brush_radius, block);
    case BrushKind::box:
      return box_of(*corner_, at, block);
    case BrushKind::line:
      return line_of(*corner_, at, block);
    default:
      return {};
  }
}

void Game::apply_brush(bool places) {
  if (!target_.hit) return;
  const VoxelPos at = brush_at(places);
  const bool takes_two = brush == BrushKind::box || brush == BrushKind::line || brush == BrushKind::copy;
  const VoxelPos here = brush == BrushKind::copy ? target_.voxel : at;
  if (takes_two && !corner_) {
    corner_ = here;
    say("first corner set; click the other");
    return;
  }
  if (brush == BrushKind::copy) {
    std::optional<Clipboard> copy;
    pictures_->with_world([&](const world::World& world) { copy = copy_box(world.store, *corner_, here); });
    corner_.reset();
    if (!copy) return say("that is too large to copy");
    clipboard_ = std::move(*copy);
    brush = BrushKind::paste;
    return say(fmt::format("copied {} x {} x {}; the brush pastes now", clipboard_.size.x, clipboard_.size.y,
                           clipboard_.size.z));
  }
  if (brush == BrushKind::paste) {
    if (clipboard_.empty()) return say("nothing has been copied");
    const VoxelPos low = at - VoxelPos{clipboard_.size.x / 2, 0, clipboard_.size.z / 2};
    edit(paste_of(clipboard_, low), "paste");
    return;
  }
  if (brush == BrushKind::fill || brush == BrushKind::replace) {
    std::optional<EditBatch> batch;
    pictures_->with_world([&](const world::World& world) {
      if (brush == BrushKind::fill)
        batch = fill_of(world.store, places ? at : target_.voxel, places ? in_hand() : world::kAir);
      else
        batch = replace_of(world.store, target_.voxel, brush_radius, target_.block, places ? in_hand() : world::kAir);
    });
    if (!batch) return say("that is not closed: it would fill more than 65,536 voxels");
    edit(std::move(*batch), "fill");
    return;
  }
  EditBatch batch = shape(places, at);
  corner_.reset();
  if (batch.ops().size() == 1 && batch.ops()[0].box.volume() > (uint64_t{1} << 24))
    return say("that box is larger than 16 million voxels");
  edit(std::move(batch), "build");
}

void Game::use_hand(bool places) {
  aim();
  if (brush == BrushKind::single)
    place_single(places);
  else
    apply_brush(places);
}

std::string Game::brush_text() const {
  std::string text(kBrushNames[static_cast<size_t>(brush)]);
  if (brush == BrushKind::sphere || brush == BrushKind::replace) text += fmt::format(", radius {}", brush_radius);
  if (corner_) text += ", second corner";
  if (mirror_) text += fmt::format(", mirrored at {} = {}", mirror_->axis == 0 ? "x" : "z", mirror_->at);
  return text;
}

world::VoxelBox Game::brush_bounds() const {
  if (!target_.hit || brush == BrushKind::single) return {};
  const VoxelPos at = brush_at(true);
  world::VoxelBox box;
  if (brush == BrushKind::sphere || brush == BrushKind::replace) {
    const VoxelPos c = brush == BrushKind::sphere ? at : target_.voxel, r{brush_radius, brush_radius, brush_radius};
    box = {c - r, c + r};
  } else if (brush == BrushKind::paste && !clipboard_.empty()) {
    const VoxelPos low = at - VoxelPos{clipboard_.size.x / 2, 0, clipboard_.size.z / 2};
    box = {low, low + clipboard_.size - VoxelPos{1, 1, 1}};
  } else {
    box.include(brush == BrushKind::copy ? target_.voxel : at);
    if (corner_) box.include(*corner_);
  }
  return box;
}

void Game::aim() {
  const double reach = brush == BrushKind::single && !state_.now.flies ? kReach
                       : brush == BrushKind::single                    ? kReach * 2
                                                                       : kBrushReach;
  pictures_->with_world(
      [&](const world::World& world) { target_ = pick(world, shapes_, eye_, forward_of(yaw_, pitch_), reach); });
}

void Game::follow_player(double dt) {
  state_ = simulation_->state();
  // Between the last two ticks of the player.
  const double part = std::clamp((SimThread::now_s() - state_.tick_begun_s) / kWalkTick.seconds(), 0.0, 1.0);
  WorldPoint foot = state_.now.foot;
  if (!state_.jumped) {
    const Vec3d way = state_.now.foot - state_.before.foot;
    if (glm::length(way) < 64) foot = state_.before.foot + way * part;
  }
  // The eye follows steps and crouching within a tenth of a second.
  eye_height_ += (state_.now.eye_height - eye_height_) * std::clamp(dt / 0.06, 0.0, 1.0);
  eye_ = foot + Vec3d(0, eye_height_, 0);
}

void Game::follow_sun() {
  const auto hours = day_clock_.advance(picture.knobs.time_of_day, state_.tick, day_minutes);
  if (!hours) return;
  picture.knobs.time_of_day = *hours;
  if (other) other->knobs.time_of_day = *hours;
  if (std::abs(*hours - kept_hours_) >= kKeptHourStep) keep_hours();
}

void Game::keep_hours() {
  const float hours = picture.knobs.time_of_day;
  if (hours < 0 || hours == kept_hours_) return;
  kept_hours_ = hours;
  PlayRequest request;
  request.kind = PlayRequest::Kind::knob, request.name = "time_of_day", request.value = fmt::format("{:.3f}", hours);
  simulation_->ask(std::move(request));
}

void Game::update(double dt) {
  follow_player(dt);
  follow_sun();
  if (state_.message_number != messages_seen_) {
    messages_seen_ = state_.message_number;
    say(state_.message);
  }
  const double now = SimThread::now_s();
  while (!messages_.empty() && messages_.front().until_s < now) messages_.pop_front();
  const auto held = [&](Action a) { return down_[static_cast<size_t>(a)]; };
  const double ahead = (held(Action::forward) ? 1 : 0) - (held(Action::back) ? 1 : 0) + stick_ahead_;
  const double aside = (held(Action::right) ? 1 : 0) - (held(Action::left) ? 1 : 0) + stick_aside_;
  double east = std::sin(yaw_) * ahead + std::cos(yaw_) * aside,
         south = -std::cos(yaw_) * ahead + std::sin(yaw_) * aside;
  const double length = std::sqrt(east * east + south * south);
  if (length > 1) east /= length, south /= length;
  WalkInput input;
  input.east = static_cast<int16_t>(std::lround(east * 1024)),
  input.south = static_cast<int16_t>(std::lround(south * 1024));
  input.fly_dm_per_s = static_cast<int16_t>(fly_dm_per_s_);
  input.jump = held(Action::jump), input.crouch = held(Action::crouch), input.sprint = held(Action::sprint);
  simulation_->set_input(input);
  aim();
  for (const Action action : {Action::break_block, Action::place_block})
    if (held(action) && now >= next_use_s_ && brush == BrushKind::single) {
      use_hand(action == Action::place_block);
      next_use_s_ = now + kUseEveryS;
    }
}

render::Camera Game::camera() const {
  render::Camera camera;
  camera.position = eye_;
  camera.forward = forward_of(yaw_, pitch_);
  const double zoom = down_[static_cast<size_t>(Action::zoom)] ? kZoom : 1;
  camera.vertical_fov = fov_deg * zoom * kPi / 180;
  if (!third_person) return camera;
  Pick behind;
  pictures_->with_world(
      [&](const world::World& world) { behind = pick(world, shapes_, eye_, -camera.forward, kThirdPersonM); });
  const double back = behind.hit ? std::max(0.0, behind.distance - 0.3) : kThirdPersonM;
  camera.position = eye_ + -camera.forward * back;
  return camera;
}

PictureRequest Game::picture_request(int width, int height) {
  PictureRequest request;
  request.camera = camera();
  request.environment = environment;
  set_cloud_drift(request.environment, state_.tick);
  request.settings = picture;
  request.mode = view;
  request.split_at = split_at;
  request.width = width, request.height = height;
  request.after_request = last_request_;
  if (other) {
    request.other = *other;
  } else if (view == ViewMode::error) {
    request.other = {"raycast", at_moment_of(picture.knobs, render::render_knobs().preset(world::Accuracy::exact))};
    request.other.knobs.light_model = picture.knobs.light_model;
  } else {
    request.other = {picture.backend == "raster" ? "raycast" : "raster", picture.knobs};
  }
  return request;
}

void Game::took(const Picture& picture_made) {
  if (picture_made.error.empty()) return;
  if (picture_made.device_failed && picture.backend == "raster") {
    // A device that is lost each time it is opened must not leave the player in the dark.
    picture.backend = "raycast", view = ViewMode::single;
    say(picture_made.error + "; rays draw the pictures from here on");
  } else {
    say(picture_made.error);
  }
}

}  // namespace tools
