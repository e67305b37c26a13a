/// What a player feels, without the window: pictures while flying over the valley and building in it, with the
/// simulation beside them; how long an edit takes to be seen; how long the start takes.
#include <algorithm>
#include <cmath>

#include "tools/bench/benchmark.h"
#include "tools/play/game.h"
#include "tools/play/worlds.h"

namespace tools {

namespace {

constexpr int kWidth = 640, kHeight = 360;
constexpr double kPatienceS = 20;

/// The valley, played, with the settings that draw 256 m; nothing is kept.
Result<std::unique_ptr<Game>> play_valley() {
  TRY(OpenedWorld opened, open_world({.scene = "valley", .generator = {}, .name = {}, .keep = false}));
  PlaySettings settings;
  settings.autosave_s = 0;
  TRY(std::unique_ptr<Game> game, Game::make(std::move(opened.played), settings, {}));
  game->set_accuracy(world::Accuracy::fast);
  return game;
}

/// One picture of now, from the request to its pixels; NaN where it fails.
double draw(Game& game, Picture* picture = nullptr) {
  const double start = SimThread::now_s();
  game.pictures().begin(game.picture_request(kWidth, kHeight));
  auto made = game.pictures().take(kPatienceS);
  if (!made || !made->error.empty()) return std::nan("");
  const double ms = (SimThread::now_s() - start) * 1e3;
  if (picture) *picture = std::move(*made);
  return ms;
}

/// Times of the frames of a flight at 30 m/s above the woods, with an edit now and then.
std::vector<double> fly(Game& game, double seconds) {
  game.set_yaw_pitch(0.6, -0.35);
  if (!game.state().now.flies) game.press(Action::fly), game.release(Action::fly);
  game.set_fly_speed(30 / kSprintFlight);
  game.press(Action::forward), game.press(Action::sprint);
  std::vector<double> ms;
  const double start = SimThread::now_s();
  double last = start;
  for (int n = 0; SimThread::now_s() - start < seconds; ++n) {
    game.update(SimThread::now_s() - last);
    last = SimThread::now_s();
    if (n % 20 == 10) game.press(Action::blast), game.release(Action::blast);
    ms.push_back(draw(game));
  }
  game.release_all();
  return ms;
}

double at_share(std::vector<double> values, double share) {
  if (values.empty() || std::any_of(values.begin(), values.end(), [](double v) { return std::isnan(v); }))
    return std::nan("");
  std::sort(values.begin(), values.end());
  return values[static_cast<size_t>(share * static_cast<double>(values.size() - 1) + 0.5)];
}

Result<Prepared> prepare_flight(BenchContext& context, double share) {
  TRY(std::shared_ptr<Game> game, play_valley());
  draw(*game);  // what is made once: extraction, pipelines
  const double seconds = context.quick() ? 1.5 : 8;
  return Prepared{.ours = {"loam", [=] {
                             game->go_to({{-200, 120, 200}, world::Vec3d(0.5)});
                             return at_share(fly(*game, seconds), share);
                           }}};
}

Result<Prepared> prepare_edit(BenchContext& context) {
  TRY(std::shared_ptr<Game> game, play_valley());
  draw(*game);
  const int edits = context.quick() ? 4 : 24;
  return Prepared{.ours = {"loam", [=] {
                             std::vector<double> ms;
                             for (int n = 0; n < edits; ++n) {
                               game->update(0.016);
                               world::EditBatch batch;
                               batch.set(game->eye().voxel + world::VoxelPos{n % 5, 1, -3}, world::BlockId(1 + n % 3));
                               const double start = SimThread::now_s();
                               const uint64_t number = game->edit(batch, "place");
                               Picture picture;
                               do {
                                 if (std::isnan(draw(*game, &picture))) return std::nan("");
                               } while (picture.applied < number);
                               ms.push_back((SimThread::now_s() - start) * 1e3);
                             }
                             return at_share(ms, 0.5);
                           }}};
}

Result<Prepared> prepare_start(BenchContext&) {
  return Prepared{.ours = {"loam", [] {
                             const double start = SimThread::now_s();
                             auto game = play_valley();
                             if (!game || std::isnan(draw(**game))) return std::nan("");
                             return (SimThread::now_s() - start) * 1e3;
                           }}};
}

}  // namespace

void add_suite_play(Registry& registry) {
  const auto add = [&](const char* name, const char* what, std::optional<Reach> reach,
                       std::function<Result<Prepared>(BenchContext&)> prepare) {
    registry.add({.name = name,
                  .what = what,
                  .unit = "ms",
                  .better = Better::lower,
                  .timing = Timing::reported,
                  .clock = Clock::wall,
                  .repetitions = 3,
                  .reach = std::move(reach),
                  .prepare = std::move(prepare)});
  };
  add("flight_median", "pictures of 640x360, 256 m far, while flying over the valley and blowing holes: the median",
      std::nullopt, [](BenchContext& c) { return prepare_flight(c, 0.5); });
  add("flight_99", "the same: 99 of 100 pictures are as fast", Reach{50, "the sandbox's aim: no hitch above 50 ms"},
      [](BenchContext& c) { return prepare_flight(c, 0.99); });
  add("flight_longest", "the same: the longest", Reach{50, "the sandbox's aim: no hitch above 50 ms"},
      [](BenchContext& c) { return prepare_flight(c, 1); });
  add("edit_seen", "from a placed block to the end of the first picture that shows it, the median",
      Reach{50, "the sandbox's aim: seen the next frame, at 20 frames a second"}, prepare_edit);
  add("start_up", "from nothing to the first picture of the valley: world, copy, simulation, extraction",
      Reach{2000, "the sandbox's aim: under 2 s"}, prepare_start);
}

}  // namespace tools
