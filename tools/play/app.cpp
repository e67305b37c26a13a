#include "tools/play/app.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <future>
#include <optional>

#include <fmt/format.h>
#include <imgui.h>
#include <nlohmann/json.hpp>

#include "render/image/png_exr.h"
#include "tools/interrupt.h"
#include "tools/knob_settings.h"
#include "tools/picture.h"
#include "tools/play/hud.h"
#include "tools/play/pace.h"
#include "tools/play/panel.h"
#include "tools/play/thumbnails.h"
#include "tools/play/views.h"
#include "tools/play/window.h"
#include "tools/play/worlds.h"
#include "world/base/file.h"

namespace tools {

namespace {

constexpr double kWaitForPictureS = 0.045;  // then the interface is shown with the last one
constexpr double kUnfocusedS = 0.1;
constexpr float kFirstReachM = 128;  // of a world's first picture
constexpr double kStatusEveryS = 0.1, kSettingsEveryS = 5;

struct OpenedGame {
  std::unique_ptr<Game> game;
  std::vector<std::string> warnings;
};
/// On any thread: the window stays alive meanwhile.
world::Result<OpenedGame> open_game(const WorldChoice& choice, const PlaySettings& settings,
                                    const std::filesystem::path& record) {
  TRY(OpenedWorld opened, open_world(choice));
  OpenedGame all;
  all.warnings = std::move(opened.warnings);
  TRY(all.game, Game::make(std::move(opened.played), settings, {.record = record, .own_file = opened.made_file}));
  return all;
}

enum class Over { nothing, palette, console, pause, panel, help, unsaved };

class App {
 public:
  explicit App(const PlayOptions& options) : options_(options) {}

  world::Status open();
  world::Result<int> run();

 private:
  // What comes from the window.
  void key(int code, int modifiers, bool down);
  void moved(double dx, double dy);
  void wheel(double steps, int modifiers);
  void dropped(const std::vector<std::filesystem::path>& paths);
  void act(Action action);
  void follow_gamepad(double dt);

  void start(const WorldChoice& choice);
  void follow_loading();
  /// Saves, and leaves the game; where that fails it asks first.
  void ask_to_leave(bool quit);
  void leave_game();
  void show(Over over);
  void frame();
  void draw_start();
  void draw_progress(const std::string& what);
  void draw_game();
  void draw_over();
  void draw_notice();
  void follow_pictures();
  void choose_pace(double picture_ms);
  void run_command(const std::string& line);
  void do_command(const ConsoleCommand& command);
  std::filesystem::path free_shot_path(const std::string& prefix) const;
  void take_screenshot(bool large);
  void write_window_shot();
  void write_screenshot(Picture picture);
  void bench_step(double frame_ms);
  void keep_settings();
  void write_status();
  void send_textures();
  ConsoleWords words() const;
  float scale() const { return static_cast<float>(settings_.ui_scale); }
  void apply_settings();
  void drag_split();

  PlayOptions options_;
  PlaySettings settings_;
  std::string kept_settings_;  // as the file has them
  std::string notice_;         // one sentence over the menu
  std::unique_ptr<PlayWindow> window_;
  std::unique_ptr<Game> game_;
  Over over_ = Over::nothing;
  uint32_t pad_buttons_ = 0;  // as they were; the triggers are bits 30 and 31
  bool quits_ = false;        // what ask_to_leave() was asked
  std::string unsaved_;       // why it couldn't
  bool quit_ = false, hud_ = true, dragging_ = false;
  StatisticsMode statistics_ = StatisticsMode::brief;
  std::unique_ptr<Thumbnails> thumbnails_;
  std::vector<SceneEntry> scenes_;
  std::map<std::string, Thumbnails::Made> thumbnail_pictures_;
  MenuView menu_;
  PaletteView palette_;
  ConsoleView console_;
  KnobPanel panel_;
  ConsoleWords words_;

  struct Loading {
    std::string what;
    std::future<world::Result<OpenedGame>> opened;
  };
  std::optional<Loading> loading_;

  Picture picture_;  // as it is shown
  render::Camera picture_camera_, asked_camera_;
  bool has_picture_ = false;
  double last_s_ = 0, last_status_s_ = 0, last_settings_s_ = 0, begun_s_ = 0;
  int devices_lost_ = 0;
  Pace pace_;
  bool said_simpler_ = false, paused_for_panel_ = false;
  HudNumbers numbers_;
  struct Shot {
    bool asked = false, under_way = false;
    bool large = false;
    std::filesystem::path path;
    uint64_t copy_request = 0;
  } shot_;
  struct Bench {
    double until_s = 0, began_s = 0, yaw = 0;
    std::vector<double> ms;
  };
  std::optional<Bench> bench_;
};

double now_s() { return SimThread::now_s(); }

world::Status App::open() {
  TRY(settings_, read_settings(settings_path()));
  if (!options_.backend.empty()) settings_.backend = options_.backend;
  bool known = false;
  for (const render::BackendInfo& info : render::backends()) known |= info.name == settings_.backend;
  if (!known) return make_backend(settings_.backend).error();
  for (const std::string& setting : options_.settings) {
    render::RenderKnobs check;
    TRY_STATUS(set_knobs(render::render_knobs(), check, {setting}, &settings_.knobs));
  }
  WindowEvents events;
  events.key = [this](int code, int modifiers, bool down) { key(code, modifiers, down); };
  events.mouse_moved = [this](double dx, double dy) { moved(dx, dy); };
  events.wheel = [this](double steps, int modifiers) { wheel(steps, modifiers); };
  events.dropped = [this](const std::vector<std::filesystem::path>& paths) { dropped(paths); };
  events.focus = [this](bool focused) {
    if (!game_ || focused) return;
    game_->release_all();
    if (over_ == Over::nothing) show(Over::pause);
  };
  TRY(window_, PlayWindow::make(options_.width, options_.height, settings_.vertical_sync, !options_.no_vulkan,
                                std::move(events)));
  numbers_.shown_by = window_->presenter().name();
  if (!window_->why_not_vulkan().empty()) {
    notice_ = window_->why_not_vulkan() + ". Pictures are made by the ray caster.";
    settings_.backend = "raycast";
  }
  ImGui::GetStyle().WindowRounding = 6;
  ImGui::GetStyle().FrameRounding = 4;
  apply_settings();
  for (const std::string& name : world::scene_names()) {
    const auto scene = world::load_scene(name);
    scenes_.push_back({name, scene ? scene->what : "", nullptr});
  }
  std::error_code ignored;
  if (!options_.world.empty())
    start({.scene = options_.world, .generator = {}, .name = {}, .keep = options_.keep});
  else if (!options_.menu && !settings_.last_world.empty() && std::filesystem::exists(settings_.last_world, ignored))
    start({.scene = settings_.last_world, .generator = {}, .name = {}, .keep = options_.keep});
  return {};
}

void App::apply_settings() {
  ImGui::GetIO().FontGlobalScale = scale();
  window_->presenter().set_vertical_sync(settings_.vertical_sync);
  if (game_) game_->fov_deg = settings_.fov_deg, game_->day_minutes = settings_.day_minutes;
}

void App::show(Over over) {
  // What is measured stands still: else the reference would have to be made anew for each picture.
  if (game_ && over == Over::panel && !game_->state().paused) {
    game_->pause(true), paused_for_panel_ = true;
  } else if (game_ && over != Over::panel && std::exchange(paused_for_panel_, false)) {
    game_->pause(false);
  }
  over_ = over;
  if (game_) game_->release_all();
  if (over == Over::palette) palette_.open();
  if (over == Over::console) console_.open();
  window_->capture_mouse(game_ && over == Over::nothing && window_->focused());
}

// ---- input ----

void App::key(int code, int modifiers, bool down) {
  if (menu_.waiting_for_key() && down) {
    if (code != kMouseButton) {  // that one presses the button itself
      const Action action = *menu_.waiting_for_key();
      const bool is_modifier = key_name({code, 0}).ends_with("shift") || key_name({code, 0}).ends_with("control") ||
                               key_name({code, 0}).ends_with("alt");
      if (settings_.bindings.set(action, key_name({code, is_modifier ? 0 : modifiers & 7})).ok()) menu_.got_key();
    }
    return;
  }
  if (!down) {
    if (dragging_ && code == kMouseButton) dragging_ = false;
    if (game_)
      for (const ActionRow& row : action_rows())
        if (settings_.bindings.has_code(row.action, code)) game_->release(row.action);
    return;
  }
  if (!game_) return;
  const auto action = settings_.bindings.find(code, modifiers);
  if (over_ != Over::nothing) {
    // Escape and the key that opened a window close it; typing goes into it.
    const bool types = ImGui::GetIO().WantTextInput;
    if (action == Action::menu) return show(Over::nothing);
    if (types && code < 256) return;
    if (over_ == Over::panel && action == Action::panel) return show(Over::nothing);
    if (over_ == Over::help && action == Action::help) return show(Over::nothing);
    if (over_ == Over::palette && action == Action::palette && !types) return show(Over::nothing);
    if (code >= kMouseButton) return;
    if (action && (over_ == Over::panel || action == Action::window_shot) && row_of(*action).group == "view")
      act(*action);
    return;
  }
  if (!window_->mouse_captured() && code >= kMouseButton) {
    // The first click in the window only takes the mouse; beside the line of a split view it drags that.
    window_->capture_mouse(true);
    return;
  }
  if (action) act(*action);
}

void App::act(Action action) {
  switch (action) {
    case Action::menu:
      return show(Over::pause);
    case Action::palette:
      return show(Over::palette);
    case Action::console:
      return show(Over::console);
    case Action::panel:
      return show(Over::panel);
    case Action::help:
      return show(Over::help);
    case Action::hud:
      hud_ = !hud_;
      return;
    case Action::statistics:
      statistics_ = static_cast<StatisticsMode>((static_cast<int>(statistics_) + 1) % 3);
      return;
    case Action::full_screen:
      return window_->set_full_screen(!window_->full_screen());
    case Action::screenshot:
    case Action::large_screenshot:
      return take_screenshot(action == Action::large_screenshot);
    case Action::window_shot:
      return window_->presenter().keep_next();
    default:
      game_->press(action);
  }
}

void App::moved(double dx, double dy) {
  if (!game_) return;
  const double radians = 0.0022 * settings_.mouse_speed;
  game_->look(dx * radians, (settings_.invert_mouse ? dy : -dy) * radians);
}

void App::wheel(double steps, int modifiers) {
  if (game_ && over_ == Over::nothing) game_->wheel(steps > 0 ? 1 : -1, (modifiers & kControl) != 0);
}

void App::dropped(const std::vector<std::filesystem::path>& paths) {
  if (paths.empty()) return;
  std::filesystem::path path = paths.front();
  if (path.extension() == ".png") {
    // A picture that F2 took has its world beside it.
    auto png = render::read_png(path);
    if (png && png->text.contains("loam_world")) {
      const std::filesystem::path kept = path.parent_path() / png->text["loam_world"];
      const std::filesystem::path own = free_world_path(kept.stem().string());
      std::error_code failed;
      std::filesystem::copy_file(kept, own, failed);
      if (failed) {
        notice_ = "the world of this picture is missing: " + kept.string();
        if (game_) game_->say(notice_);
        return;
      }
      path = own;
    }
  }
  start({.scene = path.string(), .generator = {}, .name = {}, .keep = options_.keep});
}

void App::follow_gamepad(double dt) {
  const std::optional<Gamepad> pad = window_->gamepad();
  if (!pad || !window_->focused()) return;
  constexpr uint32_t kLeftTrigger = 1u << 30, kRightTrigger = 1u << 31;
  uint32_t now = pad->buttons;
  if (pad->left_trigger > 0.5) now |= kLeftTrigger;
  if (pad->right_trigger > 0.5) now |= kRightTrigger;
  const uint32_t before = std::exchange(pad_buttons_, now);
  if (!game_) return;  // the menu's
  const bool plays = over_ == Over::nothing;
  game_->walk_by(plays ? -pad->left_y : 0, plays ? pad->left_x : 0);
  if (plays) {
    // Finer near the middle: the square of the stick's way.
    constexpr double kTurnPerS = 3.5;
    const auto eased = [](double x) { return x * std::abs(x); };
    const double turn = kTurnPerS * settings_.mouse_speed * dt;
    game_->look(eased(pad->right_x) * turn, eased(settings_.invert_mouse ? pad->right_y : -pad->right_y) * turn);
  }
  // GLFW's buttons: 0 A, 1 B, 2 X, 3 Y, 4 and 5 bumpers, 6 back, 7 start, 9 and 10 thumbs.
  static constexpr std::pair<uint32_t, Action> kButtons[] = {{1u << 0, Action::jump},
                                                             {1u << 1, Action::crouch},
                                                             {1u << 2, Action::undo},
                                                             {1u << 3, Action::palette},
                                                             {1u << 7, Action::menu},
                                                             {1u << 9, Action::sprint},
                                                             {1u << 10, Action::pick_block},
                                                             {kLeftTrigger, Action::place_block},
                                                             {kRightTrigger, Action::break_block}};
  for (const auto& [bit, action] : kButtons) {
    if ((now & bit) && !(before & bit)) {
      if (plays)
        act(action);
      else if (action == Action::menu || action == Action::crouch)
        show(Over::nothing);
    }
    if (!(now & bit) && (before & bit) && game_) game_->release(action);
    if (!game_) return;
  }
  for (const auto& [bit, by] : {std::pair{1u << 4, 1}, {1u << 5, -1}})
    if (plays && (now & bit) && !(before & bit)) game_->wheel(by, false);
}

// ---- worlds ----

void App::start(const WorldChoice& choice) {
  leave_game();
  notice_.clear();
  Loading loading;
  loading.what = choice.scene.empty() ? choice.name : std::filesystem::path(choice.scene).stem().string();
  loading.opened = std::async(std::launch::async, [choice, settings = settings_, record = options_.record] {
    return open_game(choice, settings, record);
  });
  options_.record.clear();  // of the first world alone
  loading_.emplace(std::move(loading));
  begun_s_ = now_s();
}

void App::follow_loading() {
  if (!loading_ || loading_->opened.wait_for(std::chrono::milliseconds(0)) != std::future_status::ready) return;
  auto opened = loading_->opened.get();
  loading_.reset();
  if (!opened) {
    notice_ = opened.error().message;
    return;
  }
  game_ = std::move(opened->game);
  const std::filesystem::path path = game_->path();
  if (game_->picture.backend == "raster") pace_.simplify(game_->picture.knobs);
  words_ = words();
  has_picture_ = false;
  if (!path.empty()) settings_.note_world(path.string());
  for (const std::string& warning : opened->warnings) game_->say(warning);
  window_->set_title("Loam: " + game_->name());
  if (thumbnails_) thumbnails_->pause(true);
  keep_settings();
  show(settings_.seen_help ? Over::nothing : Over::help);
}

void App::ask_to_leave(bool quit) {
  quits_ = quit;
  if (const world::Status saved = game_->save_all(); !saved.ok()) {
    unsaved_ = saved.error().message;
    return show(Over::unsaved);
  }
  quit_ = quit;
  leave_game();
}

void App::leave_game() {
  if (!game_) return;
  const std::string name = game_->name();
  const std::filesystem::path path = game_->path();
  const world::Status closed = game_->close();
  game_.reset();
  over_ = Over::nothing, paused_for_panel_ = false;
  window_->capture_mouse(false);
  window_->set_title("Loam");
  std::error_code ignored;
  if (!path.empty() && !std::filesystem::exists(path, ignored)) {
    std::erase(settings_.recent, path.string());
    if (settings_.last_world == path.string())
      settings_.last_world = settings_.recent.empty() ? "" : settings_.recent[0];
  }
  if (!closed.ok()) notice_ = name + " could not be saved: " + closed.error().message;
  if (thumbnails_) thumbnails_->pause(false);
}

// ---- pictures ----

void App::choose_pace(double ms) {
  if (settings_.picture_scale > 0 || !pace_.took(ms)) return;
  if (game_->picture.backend != "raster") return;
  pace_.simplify(game_->picture.knobs);
  if (!std::exchange(said_simpler_, true))
    game_->say("drawn more simply, to be fast enough here; " + settings_.bindings.text(Action::panel) +
               " shows what each option costs");
}

void App::follow_pictures() {
  PictureMaker& maker = game_->pictures();
  if (!maker.busy() && !window_->minimized()) {
    if (settings_.picture_scale > 0) pace_.set_scale(settings_.picture_scale);
    int width = std::max(1, static_cast<int>(std::lround(window_->width() * pace_.scale())));
    int height = std::max(1, static_cast<int>(std::lround(window_->height() * pace_.scale())));
    // Multiples of 8, so that a picture is not made anew for each pixel of the scale.
    if (pace_.scale() < 1) width = std::max(8, width / 8 * 8), height = std::max(8, height / 8 * 8);
    if (shot_.asked) {
      const int times = shot_.large ? 4 : 1;
      width = std::min(window_->width() * times, 8192), height = std::min(window_->height() * times, 8192);
    }
    PictureRequest request = game_->picture_request(width, height);
    // What is near is there in a second; what is far takes as long again, and may come into a picture that is seen.
    float& reach = request.settings.knobs.view_distance;
    if (!has_picture_ && request.mode == ViewMode::single) reach = std::min(reach, kFirstReachM);
    if (shot_.asked) {
      request.keep_linear = true, request.mode = ViewMode::single;
      shot_.asked = false, shot_.under_way = true;
    } else if (over_ == Over::panel) {
      request.measured = panel_.next_to_measure(request);
    }
    asked_camera_ = request.camera;
    maker.begin(std::move(request));
  }
  auto made = maker.take(kWaitForPictureS);
  if (!made) return;
  game_->took(*made);
  if (shot_.under_way && made->linear.width > 0) {
    shot_.under_way = false;
    write_screenshot(std::move(*made));
    return;
  }
  if (!made->error.empty()) return;
  if (over_ == Over::panel) panel_.took(*made);
  numbers_.pictures.add(made->ms);
  if (game_->view == ViewMode::single && !made->measured) choose_pace(made->ms);
  picture_camera_ = asked_camera_;
  const world::Status sent =
      window_->presenter().set_texture(kPictureTexture, made->width, made->height, made->rgba, true);
  if (!sent.ok()) game_->say(sent.error().message);
  has_picture_ = true;
  picture_ = std::move(*made);
  numbers_.last = picture_;
  numbers_.last.rgba.clear();
}

/// DATA/screenshots/PREFIX NAME_TIME.png, that no file has.
std::filesystem::path App::free_shot_path(const std::string& prefix) const {
  std::error_code ignored;
  const std::filesystem::path folder = data_folder() / "screenshots";
  std::filesystem::create_directories(folder, ignored);
  const std::time_t now = std::time(nullptr);
  char stamp[40];
  std::strftime(stamp, sizeof stamp, "%Y-%m-%d_%H-%M-%S", std::localtime(&now));
  const std::string base = prefix + game_->name() + "_" + stamp;
  std::filesystem::path path = folder / (base + ".png");
  for (int n = 2; std::filesystem::exists(path, ignored); ++n) path = folder / fmt::format("{}-{}.png", base, n);
  return path;
}

void App::take_screenshot(bool large) {
  shot_.path = free_shot_path("");
  shot_.asked = true, shot_.large = large;
  // The moment itself: the whole world beside the picture.
  std::filesystem::path world = shot_.path;
  game_->write_copy(world.replace_extension(".loam"));
}

void App::write_screenshot(Picture picture) {
  world::Scene scene;
  scene.name = game_->scene();
  const PlayState& state = game_->state();
  render::RenderKnobs knobs = game_->picture.knobs;
  knobs.exposure += static_cast<float>(picture.eye_ev);
  render::PictureText text =
      picture_text(scene, "play", asked_camera_, knobs, game_->picture.backend, state.copied_hash);
  text["tick"] = std::to_string(state.tick);
  std::filesystem::path world = shot_.path;
  text["loam_world"] = world.replace_extension(".loam").filename().string();
  world::Status written = write_picture(shot_.path.string(), picture.linear, knobs, text);
  std::string what = shot_.path.string();
  if (written.ok() && shot_.large) {
    std::filesystem::path exr = shot_.path;
    exr.replace_extension(".exr");
    written = write_picture(exr.string(), picture.linear, knobs, text);
    what += " and .exr";
  }
  game_->say(written.ok() ? "picture: " + what : written.error().message);
}

void App::write_window_shot() {
  const Screenshot shot = window_->presenter().take_kept();
  if (shot.rgba.empty()) return;
  render::Image8 image{shot.width, shot.height, {}};
  for (size_t i = 0; i + 3 < shot.rgba.size(); i += 4)
    image.pixels.insert(image.pixels.end(), {shot.rgba[i], shot.rgba[i + 1], shot.rgba[i + 2]});
  const std::filesystem::path path = free_shot_path("window_");
  const world::Status written = render::write_png(path, image, {});
  game_->say(written.ok() ? "picture: " + path.string() : written.error().message);
}

void App::send_textures() {
  if (window_->devices_lost() != devices_lost_) {
    devices_lost_ = window_->devices_lost();
    numbers_.shown_by = window_->presenter().name();
    has_picture_ = false, begun_s_ = now_s();
    for (auto& [name, made] : thumbnail_pictures_)
      for (SceneEntry& entry : scenes_)
        if (entry.name == name) entry.texture = nullptr;
    if (game_) game_->say("the graphics device was lost and has been opened again; the world is as it was");
  }
  if (thumbnails_)
    for (Thumbnails::Made& made : thumbnails_->take()) thumbnail_pictures_[made.scene] = std::move(made);
  if (game_) return;
  for (size_t i = 0; i < scenes_.size(); ++i) {
    const auto made = thumbnail_pictures_.find(scenes_[i].name);
    if (scenes_[i].texture || made == thumbnail_pictures_.end()) continue;
    const render::Image8& image = made->second.image;
    std::vector<uint8_t> rgba;
    for (size_t p = 0; p + 2 < image.pixels.size(); p += 3)
      rgba.insert(rgba.end(), {image.pixels[p], image.pixels[p + 1], image.pixels[p + 2], 255});
    const uint32_t id = kFirstThumbnail + static_cast<uint32_t>(i);
    if (window_->presenter().set_texture(id, image.width, image.height, rgba, true).ok())
      scenes_[i].texture = window_->presenter().texture(id);
  }
}

// ---- what is drawn ----

void App::draw_notice() {
  if (notice_.empty()) return;
  const ImGuiIO& io = ImGui::GetIO();
  ImGui::SetNextWindowPos({io.DisplaySize.x / 2, io.DisplaySize.y - 16}, ImGuiCond_Always, {0.5f, 1});
  ImGui::SetNextWindowSize({std::min(700 * scale(), io.DisplaySize.x - 20), 0});
  bool open = true;
  ImGui::Begin("notice", &open,
               ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
                   ImGuiWindowFlags_NoCollapse);
  ImGui::TextWrapped("%s", notice_.c_str());
  ImGui::End();
  if (!open) notice_.clear();
}

/// In the middle, while there is nothing else to see: what is done, since when, and a bar that moves.
void App::draw_progress(const std::string& what) {
  const ImGuiIO& io = ImGui::GetIO();
  const double since_s = now_s() - begun_s_;
  const std::string text = fmt::format("{} ... {:.0f} s", what, std::floor(since_s));
  const ImVec2 e = ImGui::CalcTextSize(text.c_str());
  ImDrawList* list = ImGui::GetBackgroundDrawList();
  const float x = io.DisplaySize.x / 2, y = io.DisplaySize.y / 2, half = 120 * scale();
  list->AddText({x - e.x / 2, y - 1.5f * e.y}, IM_COL32_WHITE, text.c_str());
  list->AddRectFilled({x - half, y}, {x + half, y + 4 * scale()}, IM_COL32(255, 255, 255, 60));
  const float at = x - half + 1.5f * half * static_cast<float>(0.5 - 0.5 * std::cos(since_s * 3));
  list->AddRectFilled({at, y}, {at + half / 2, y + 4 * scale()}, IM_COL32(255, 255, 255, 220));
}

void App::draw_start() {
  const ImGuiIO& io = ImGui::GetIO();
  if (loading_) {
    draw_progress("Opening " + loading_->what);
    return;
  }
  if (!thumbnails_) thumbnails_ = std::make_unique<Thumbnails>();
  const PlaySettings before = settings_;
  const MenuChoice choice = menu_.draw_start(scenes_, settings_, io.DisplaySize.x, io.DisplaySize.y, scale());
  apply_settings();
  draw_notice();
  if (over_ == Over::help) {
    if (draw_help(settings_.bindings, io.DisplaySize.x, io.DisplaySize.y, scale())) over_ = Over::nothing;
  } else if (choice.help) {
    over_ = Over::help;
  }
  if (choice.quit) quit_ = true;
  if (choice.play) {
    WorldChoice play = *choice.play;
    play.keep = options_.keep;
    start(play);
  }
}

void App::drag_split() {
  // The line of a split view can be drawn along while the mouse is free, and with Alt while it isn't.
  const ImGuiIO& io = ImGui::GetIO();
  const float x = static_cast<float>(game_->split_at) * io.DisplaySize.x;
  ImDrawList* list = ImGui::GetBackgroundDrawList();
  list->AddLine({x, 0}, {x, io.DisplaySize.y}, IM_COL32(0, 0, 0, 200), 4);
  list->AddLine({x, 0}, {x, io.DisplaySize.y}, IM_COL32(255, 255, 255, 255), 2);
  list->AddCircleFilled({x, io.DisplaySize.y / 2}, 9, IM_COL32(255, 255, 255, 230));
  const PictureRequest request = game_->picture_request(1, 1);
  const std::string left = request.settings.backend, right = request.other.backend;
  list->AddText({x - 12 - ImGui::CalcTextSize(left.c_str()).x, io.DisplaySize.y * 0.75f}, IM_COL32_WHITE, left.c_str());
  list->AddText({x + 12, io.DisplaySize.y * 0.75f}, IM_COL32_WHITE, right.c_str());
  if (window_->mouse_captured()) return;
  if (ImGui::IsMouseClicked(0) && std::abs(io.MousePos.x - x) < 16 && !io.WantCaptureMouse) dragging_ = true;
  if (!ImGui::IsMouseDown(0)) dragging_ = false;
  if (dragging_) game_->split_at = std::clamp(static_cast<double>(io.MousePos.x / io.DisplaySize.x), 0.0, 1.0);
}

void App::draw_game() {
  const ImGuiIO& io = ImGui::GetIO();
  const float width = io.DisplaySize.x, height = io.DisplaySize.y;
  if (has_picture_)
    ImGui::GetBackgroundDrawList()->AddImage(window_->presenter().texture(kPictureTexture), {0, 0}, {width, height});
  else
    draw_progress("Drawing " + game_->name());
  if (game_->view == ViewMode::split) drag_split();
  if (hud_ && has_picture_) {
    draw_outline(*game_, picture_camera_, width, height);
    draw_hud(*game_, settings_.bindings, width, height, scale());
    draw_statistics(*game_, numbers_, statistics_, scale());
    if (game_->view == ViewMode::error && picture_.difference) {
      const std::string text =
          fmt::format("difference to {}: FLIP {:.4f}, {:.2f} % of pixels within 1/255; dark is none, yellow 64/255",
                      game_->picture_request(1, 1).other.backend, picture_.difference->flip,
                      100 * picture_.difference->fraction_within_1);
      ImGui::GetBackgroundDrawList()->AddText({width / 2 - ImGui::CalcTextSize(text.c_str()).x / 2, 34 * scale()},
                                              IM_COL32_WHITE, text.c_str());
    }
  }
  if (over_ != Over::help) draw_messages(*game_, width, height, scale());
  draw_over();
}

void App::draw_over() {
  const ImGuiIO& io = ImGui::GetIO();
  const float width = io.DisplaySize.x, height = io.DisplaySize.y;
  bool close = false;
  switch (over_) {
    case Over::nothing:
      break;
    case Over::palette:
      if (const auto block = palette_.draw(*game_, scale(), close)) game_->take_in_hand(*block);
      break;
    case Over::console:
      if (const auto line = console_.draw(words_, height, scale(), close)) run_command(*line);
      break;
    case Over::panel:
      close = panel_.draw(*game_, numbers_, settings_, scale());
      break;
    case Over::help:
      close = draw_help(settings_.bindings, width, height, scale());
      if (close) settings_.seen_help = true;
      break;
    case Over::pause: {
      const MenuChoice choice = menu_.draw_pause(settings_, *game_, width, height, scale());
      apply_settings();
      if (choice.save) game_->save();
      if (choice.resume) close = true;
      if (choice.help) return show(Over::help);
      if (choice.quit || choice.leave) return ask_to_leave(choice.quit);
      break;
    }
    case Over::unsaved: {
      const MenuChoice choice = MenuView::draw_unsaved(game_->name(), unsaved_, width, height, scale());
      if (choice.save) return ask_to_leave(quits_);
      if (choice.lose) {
        quit_ = quits_;
        return leave_game();
      }
      close = choice.resume;
      break;
    }
  }
  if (close) show(Over::nothing);
}

// ---- commands ----

ConsoleWords App::words() const {
  ConsoleWords words;
  for (size_t id = 0; id < game_->palette().size(); ++id)
    words.blocks.push_back(game_->palette()[static_cast<world::BlockId>(id)].name);
  words.scenes = world::scene_names();
  for (const auto& row : render::render_knobs().rows()) words.knobs.push_back(row.name);
  for (const render::BackendInfo& info : render::backends()) words.backends.push_back(info.name);
  words.values_of = [](const std::string& knob) {
    for (const auto& row : render::render_knobs().rows())
      if (row.name == knob)
        return row.choices.empty() ? std::vector<std::string>{row.fast, row.usual, row.exact} : row.choices;
    return std::vector<std::string>{};
  };
  return words;
}

void App::run_command(const std::string& line) {
  const auto command = read_command(line, words_, game_->state().now.foot);
  if (!command) return console_.print(command.error().message);
  // Its answer is to be read; where there is none, what it did is to be seen.
  const size_t lines = console_.lines();
  do_command(*command);
  if (game_ && over_ == Over::console && console_.lines() == lines) show(Over::nothing);
}

void App::do_command(const ConsoleCommand& command) {
  Game& game = *game_;
  if (const auto* go = std::get_if<GoTo>(&command)) game.go_to(go->place);
  if (const auto* time = std::get_if<TimeOfDay>(&command)) game.set_time_of_day(time->hours);
  if (const auto* day = std::get_if<DayLength>(&command)) game.day_minutes = settings_.day_minutes = day->minutes;
  if (const auto* set = std::get_if<SetKnob>(&command)) {
    const world::Status done = game.set_knob(set->name, set->value);
    console_.print(done.ok() ? set->name + " = " + set->value : done.error().message);
  }
  if (const auto* fill = std::get_if<FillBox>(&command))
    game.edit(box_of(fill->from, fill->to, *game.palette().find(fill->block)), "fill");
  if (const auto* give = std::get_if<GiveBlock>(&command)) game.take_in_hand(*game.palette().find(give->block));
  if (const auto* speed = std::get_if<SpeedTo>(&command)) game.set_speed(speed->eighths);
  if (const auto* drawn = std::get_if<DrawnBy>(&command)) game.picture.backend = drawn->backend;
  if (const auto* bind = std::get_if<BindKey>(&command)) {
    const world::Status done = settings_.bindings.set(bind->action, bind->keys);
    if (!done.ok()) return console_.print(done.error().message);
    for (const Bindings::Conflict& c : settings_.bindings.conflicts())
      console_.print(key_name(c.key) + " does two things now: " + std::string(row_of(c.a).name) + " and " +
                     std::string(row_of(c.b).name));
  }
  if (const auto* press = std::get_if<PressAction>(&command)) {
    show(Over::nothing);
    act(press->action);
    if (game_) game_->release(press->action);
    return;
  }
  if (const auto* bench = std::get_if<RunBench>(&command)) {
    bench_ = Bench{now_s() + bench->seconds, now_s(), game.yaw(), {}};
    show(Over::nothing);
  }
  if (std::get_if<ListCommands>(&command)) {
    for (const CommandRow& row : command_rows())
      console_.print("/" + std::string(row.name) + " " + std::string(row.arguments) + ": " + std::string(row.what));
    console_.print("and every action by its name: /pause, /undo, /no_clip, ...");
  }
  if (const auto* scene = std::get_if<OpenScene>(&command))
    return start({.scene = scene->scene, .generator = {}, .name = {}, .keep = options_.keep});
  if (const auto* seed = std::get_if<NewSeed>(&command))
    return start({.scene = {},
                  .generator = "valley",
                  .name = fmt::format("valley-{}", seed->seed),
                  .seed = seed->seed,
                  .keep = options_.keep});
}

void App::bench_step(double frame_ms) {
  if (!bench_) return;
  bench_->ms.push_back(frame_ms);
  const double part = (now_s() - bench_->began_s) / (bench_->until_s - bench_->began_s);
  game_->set_yaw_pitch(bench_->yaw + part * 2 * 3.14159265358979, game_->pitch());
  if (part < 1) return;
  std::sort(bench_->ms.begin(), bench_->ms.end());
  const auto at = [&](double share) {
    return bench_->ms[static_cast<size_t>(share * static_cast<double>(bench_->ms.size() - 1))];
  };
  const std::string result =
      fmt::format("{} frames, {:.1f} a second; half in {:.1f} ms, 95 % in {:.1f}, 99 % in {:.1f}, the longest {:.1f}",
                  bench_->ms.size(), static_cast<double>(bench_->ms.size()) / (bench_->until_s - bench_->began_s),
                  at(0.5), at(0.95), at(0.99), bench_->ms.back());
  game_->say(result);
  console_.print(result);
  bench_.reset();
}

/// Where they changed: nobody knows how this ends.
void App::keep_settings() {
  last_settings_s_ = now_s();
  std::string text = settings_text(settings_);
  if (text == kept_settings_) return;
  kept_settings_ = std::move(text);
  const world::Status kept = write_settings(settings_, settings_path());
  if (!kept.ok() && game_) game_->say("settings are not kept: " + kept.error().message);
}

void App::write_status() {
  if (options_.status.empty() || now_s() - last_status_s_ < kStatusEveryS) return;
  last_status_s_ = now_s();
  nlohmann::json j{{"screen", game_      ? "play"
                              : loading_ ? "loading"
                                         : "menu"},
                   {"over", static_cast<int>(over_)},
                   {"captured", window_->mouse_captured()},
                   {"width", window_->width()},
                   {"height", window_->height()},
                   {"frames", numbers_.frames.count()},
                   {"notice", notice_},
                   {"shown_by", numbers_.shown_by},
                   {"validation", window_->presenter().messages().size()}};
  if (game_) {
    const PlayState& s = game_->state();
    const world::WorldPoint& p = s.now.foot;
    j["at"] = {p.voxel.x + p.fraction.x, p.voxel.y + p.fraction.y, p.voxel.z + p.fraction.z};
    j["flies"] = s.now.flies, j["tick"] = s.tick, j["settled"] = s.settled, j["paused"] = s.paused;
    j["undo"] = s.undo_steps, j["redo"] = s.redo_steps, j["saves"] = s.saves, j["applied"] = s.applied;
    j["backend"] = picture_.backend, j["picture"] = picture_.number, j["ms"] = picture_.ms;
    j["view"] = static_cast<int>(game_->view);
    j["yaw"] = game_->yaw(), j["pitch"] = game_->pitch(), j["slot"] = game_->slot();
    j["in_hand"] = game_->palette()[game_->in_hand()].name;
    const Pick& t = game_->target();
    j["target"] = t.hit ? nlohmann::json{t.voxel.x, t.voxel.y, t.voxel.z} : nlohmann::json();
    j["target_block"] = t.hit ? game_->palette()[t.block].name : "";
    j["message"] = game_->messages().empty() ? "" : game_->messages().back().text;
    j["path"] = game_->path().string();
  }
  (void)world::write_bytes_atomically(options_.status, j.dump()).ok();
}

void App::frame() {
  const double now = now_s(), dt = last_s_ > 0 ? now - last_s_ : 0;
  last_s_ = now;
  follow_loading();
  follow_gamepad(dt);
  if (game_) {
    game_->update(std::min(dt, 0.25));
    follow_pictures();
  }
  send_textures();
  numbers_.frames.add(dt * 1000);
  bench_step(dt * 1000);
  window_->begin_frame();
  if (game_)
    draw_game();
  else
    draw_start();
  const world::Status shown = window_->end_frame();
  if (game_) write_window_shot();
  if (now_s() - last_settings_s_ > kSettingsEveryS) keep_settings();
  if (!shown.ok()) {
    notice_ = shown.error().message;
    quit_ = true;
  }
  write_status();
}

world::Result<int> App::run() {
  const StopOnInterrupt interrupt;
  kept_settings_ = settings_text(settings_);
  while (!quit_ && !interrupt.asked()) {
    const bool idle = !window_->focused() || window_->minimized();
    window_->poll(idle ? kUnfocusedS : game_ || loading_ ? 0 : 0.016);
    if (window_->wants_close()) {
      if (!game_) break;
      window_->clear_close();
      ask_to_leave(true);
    }
    frame();
  }
  leave_game();
  const world::Status kept = write_settings(settings_, settings_path());
  if (!notice_.empty()) std::fprintf(stderr, "%s\n", notice_.c_str());
  TRY_STATUS(kept);
  return 0;
}

}  // namespace

world::Result<int> run_play(const PlayOptions& options) {
  App app(options);
  TRY_STATUS(app.open());
  return app.run();
}

}  // namespace tools
