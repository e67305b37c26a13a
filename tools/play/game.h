/// A world being played: what the player's hands do, from keys and a mouse to requests of the simulation, and what the
/// next picture shows. No window and no interface: those tell it what was pressed and show what it says.
#pragma once

#include <array>
#include <deque>

#include "tools/play/brush.h"
#include "tools/play/controls.h"
#include "tools/play/day_clock.h"
#include "tools/play/picture_maker.h"
#include "tools/play/pick.h"
#include "tools/play/settings.h"
#include "tools/play/sim_thread.h"

namespace tools {

constexpr double kReach = 6, kBrushReach = 64;  // m that hands and brushes reach
constexpr int kSlots = 9;

struct GameOptions {
  std::filesystem::path record;
  bool own_file = false;  // the world's file was made for this, and goes where nothing was changed
};

class Game {
 public:
  static world::Result<std::unique_ptr<Game>> make(std::unique_ptr<PlayedWorld> played, const PlaySettings& settings,
                                                   const GameOptions& options);
  ~Game();

  /// Saves all, and waits for it. Says what went wrong; the game goes on as before.
  world::Status save_all();
  /// Ends the simulation and saves. Says what went wrong.
  world::Status close();

  // ---- hands ----
  void press(Action action);
  void release(Action action);
  void release_all();                        // the window lost the keyboard
  void look(double right, double up);        // radians
  void walk_by(double ahead, double aside);  // of a stick, [-1, 1] each; beside the keys
  void wheel(int steps, bool control);
  void take_in_hand(world::BlockId block);
  void set_slot(int slot) { slot_ = slot; }
  void set_yaw_pitch(double yaw, double pitch);
  void set_fly_speed(double mps);  // 1 .. 1000; kSprintFlight times as fast for who runs

  /// Once a frame: `dt` seconds after the last. Moves what is held on, asks the simulation for edits.
  void update(double dt);
  /// The request for the picture of now.
  PictureRequest picture_request(int width, int height);
  void took(const Picture& picture);

  // ---- requests ----
  uint64_t edit(world::EditBatch batch, const std::string& what);
  void ask(PlayRequest::Kind kind);
  void go_to(const world::WorldPoint& foot);
  void set_speed(int eighths);
  void pause(bool on);
  void set_time_of_day(double hours);
  /// Of pictures; those of the moment are saved with the world.
  world::Status set_knob(const std::string& name, const std::string& value);
  void set_accuracy(world::Accuracy accuracy);  // all others but those of the moment
  void save();
  void write_copy(const std::filesystem::path& path);
  void say(const std::string& sentence);

  // ---- reading ----
  const world::BlockPalette& palette() const { return palette_; }
  const PlayState& state() const { return state_; }  // as of update()
  const Pick& target() const { return target_; }
  render::Camera camera() const;
  world::WorldPoint eye() const { return eye_; }
  double yaw() const { return yaw_; }
  double pitch() const { return pitch_; }
  const std::array<world::BlockId, kSlots>& slots() const { return slots_; }
  int slot() const { return slot_; }
  world::BlockId in_hand() const { return slots_[static_cast<size_t>(slot_)]; }
  const std::string& name() const { return name_; }
  const std::string& scene() const { return scene_; }
  const std::filesystem::path& path() const { return path_; }
  /// The voxels that the brush would change now: their bounds; empty where it would do nothing.
  world::VoxelBox brush_bounds() const;
  std::string brush_text() const;
  PictureMaker& pictures() { return *pictures_; }
  const PictureMaker& pictures() const { return *pictures_; }
  struct Message {
    std::string text;
    double until_s = 0;
  };
  const std::deque<Message>& messages() const { return messages_; }

  // What pictures are made by; the interface changes them.
  PictureSettings picture;
  std::optional<PictureSettings> other;  // null: the other backend, with the same knobs
  ViewMode view = ViewMode::single;
  double split_at = 0.5;
  bool third_person = false;
  double fov_deg = 70;
  double day_minutes = 0;  // of the world's time, where it has hours; 0: the sun stands still
  world::Environment environment;
  BrushKind brush = BrushKind::single;
  int brush_radius = 3;

 private:
  Game() = default;
  void follow_player(double dt);
  void follow_sun();
  void keep_hours();  // with the world
  void aim();
  void use_hand(bool places);
  void place_single(bool places);
  void apply_brush(bool places);
  world::EditBatch shape(bool places, world::VoxelPos at) const;
  bool blocks_player(const world::EditBatch& batch) const;
  void jump_pressed();
  void send_mode(bool flies, bool passes);
  world::VoxelPos brush_at(bool places) const;

  std::string name_, scene_;
  std::filesystem::path path_;
  bool own_file_ = false, closed_ = false;
  world::BlockPalette palette_;
  world::BlockShapes shapes_;
  TurnedForms forms_;
  std::unique_ptr<SimThread> simulation_;  // outlives the pictures, which follow it
  std::unique_ptr<PictureMaker> pictures_;

  PlayState state_;
  double yaw_ = 0, pitch_ = 0, eye_height_ = kEyeHeight;
  world::WorldPoint eye_;
  std::array<bool, static_cast<size_t>(Action::count)> down_{};
  double stick_ahead_ = 0, stick_aside_ = 0;
  double last_jump_s_ = -1, next_use_s_ = 0;
  int fly_dm_per_s_ = 109;
  Pick target_;
  std::array<world::BlockId, kSlots> slots_{};
  int slot_ = 0;
  std::optional<world::VoxelPos> corner_;  // the first of two, of brushes that take two
  Clipboard clipboard_;
  DayClock day_clock_;
  float kept_hours_ = -1;  // as the world's file will say
  struct Mirror {
    int axis = 0;
    int32_t at = 0;
  };
  std::optional<Mirror> mirror_;
  uint64_t last_request_ = 0, messages_seen_ = 0;
  std::deque<Message> messages_;
};

}  // namespace tools
