#include "tools/play/sim_thread.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include <fmt/format.h>

#include "world/formats/format.h"

namespace tools {

namespace {

using Steady = std::chrono::steady_clock;
constexpr double kBusyMs = 10;        // of matter in one turn; what is left is done in the next
constexpr double kFullEveryS = 0.25;  // what costs more to say: the ledger, the effects
constexpr uint64_t kMarkEvery = 600;  // ticks of the player between hashes of a recording
constexpr double kTellAgainS = 30;    // while the world can't be saved
constexpr double kTurnMs = 1000.0 / 60;

double ms_since(Steady::time_point start) {
  return std::chrono::duration<double, std::milli>(Steady::now() - start).count();
}

}  // namespace

double SimThread::now_s() { return std::chrono::duration<double>(Steady::now().time_since_epoch()).count(); }

world::Result<std::unique_ptr<SimThread>> SimThread::make(std::unique_ptr<PlayedWorld> played, const Options& options) {
  std::unique_ptr<SimThread> made(new SimThread);
  made->played_ = std::move(played);
  made->options_ = options;
  world::World& world = made->played_->world();
  TRY(made->play_, PlaySimulation::make(world));
  made->subscriber_ = world.store.subscribe();
  // Who draws begins with a copy of what is there.
  if (const world::IntLayer* liquid = world.store.find_int_layer(world::Layer::liquid))
    (void)liquid->changes(made->liquid_mark_);
  if (!options.record.empty()) {
    TRY(made->log_, PlayLogWriter::open(options.record, made->played_->scene, *made->play_));
  }
  made->before_ = made->play_->walker().state();
  made->state_.before = made->state_.now = made->before_;
  made->last_save_s_ = now_s();
  made->publish(true);
  return made;
}

SimThread::~SimThread() {
  if (thread_.joinable()) (void)stop(yaw_, pitch_).ok();
}

void SimThread::start() {
  thread_ = std::thread([this] { run(); });
}

world::Status SimThread::stop(double yaw, double pitch) {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
  if (thread_.joinable()) thread_.join();
  yaw_ = yaw, pitch_ = pitch;
  mark();
  log_.reset();
  if (!played_->session || !play_->edited()) return {};
  play_->prepare_save(yaw, pitch);
  return played_->session->close();
}

uint64_t SimThread::ask(PlayRequest request) {
  uint64_t number;
  {
    const std::lock_guard lock(mutex_);
    number = ++asked_;
    requests_.emplace_back(number, std::move(request));
  }
  wake_.notify_all();
  return number;
}

void SimThread::set_input(const WalkInput& input) {
  const std::lock_guard lock(mutex_);
  input_ = input;
}

PlayState SimThread::state() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

void AmountChanges::put_into(world::Store& store) const {
  if (all && store.find_int_layer(world::Layer::liquid)) store.drop_layer(world::Layer::liquid);
  if (leaves.empty()) return;
  world::IntLayer& liquid = store.make_int_layer(world::Layer::liquid);
  for (const auto& [pos, leaf] : leaves) liquid.write_leaf(pos, leaf.values, leaf.active);
}

/// Since the last call.
AmountChanges SimThread::changed_amounts() {
  AmountChanges changes;
  const world::IntLayer* const liquid = played_->world().store.find_int_layer(world::Layer::liquid);
  if (!liquid) {
    changes.all = liquid_mark_.layer != 0;
    liquid_mark_ = {};
    return changes;
  }
  const std::optional<std::vector<world::LeafPos>> changed = liquid->changes(liquid_mark_);
  changes.all = !changed;
  for (const world::LeafPos& l : changed ? *changed : liquid->leaves()) {
    AmountChanges::Leaf& leaf = changes.leaves[l];
    if (!liquid->read_leaf(l, leaf.values, leaf.active)) leaf.active = {};
  }
  return changes;
}

uint64_t SimThread::take_changes(LeafValuesMap& into, AmountChanges& amounts) {
  const std::lock_guard lock(mutex_);
  into.clear();
  std::swap(into, changes_);
  amounts = std::exchange(amount_changes_, {});
  return state_.applied;
}

bool SimThread::take_inhabitants(InhabitantRecords& into, uint64_t& number, MatterTime& time) {
  const std::lock_guard lock(mutex_);
  time = state_.matter_time;
  if (number == inhabitants_number_) return false;
  number = inhabitants_number_;
  std::swap(into, inhabitants_);
  return true;
}

void SimThread::wait_for(uint64_t number, double seconds) const {
  std::unique_lock lock(mutex_);
  done_.wait_for(lock, std::chrono::duration<double>(seconds), [&] { return state_.applied >= number || stop_; });
}

void SimThread::say(std::string message) {
  const std::lock_guard lock(mutex_);
  state_.message = std::move(message);
  ++state_.message_number;
}

void SimThread::do_request(PlayRequest& request) {
  using Kind = PlayRequest::Kind;
  ticked_ = true;
  switch (request.kind) {
    case Kind::edit: {
      if (log_) log_->edit(request.edit, *played_->world().palette);
      const auto done = play_->edit(request.edit);
      if (log_) log_->sum();
      if (!done) say(done.error().message);
      break;
    }
    case Kind::undo:
      if (log_) log_->note("undo");
      if (!play_->undo()) say("there is nothing to undo");
      if (log_) log_->sum();
      break;
    case Kind::redo:
      if (log_) log_->note("redo");
      if (!play_->redo()) say("there is nothing to redo");
      if (log_) log_->sum();
      break;
    case Kind::back:
      matter_clock_.set_paused(true);
      if (log_) log_->note("back");
      if (!play_->step_back()) say("nothing is kept of the time before");
      if (log_) log_->sum();
      break;
    case Kind::step:
      matter_clock_.set_paused(true);
      step_matter();
      break;
    case Kind::mode:
      if (log_) log_->mode(request.flies, request.passes);
      play_->set_mode(request.flies, request.passes);
      break;
    case Kind::teleport:
      if (log_) log_->teleport(request.foot);
      play_->teleport(request.foot);
      before_ = play_->walker().state();
      break;
    case Kind::pause:
      matter_clock_.set_paused(request.on);
      waiting_steps_ = 0;
      break;
    case Kind::speed:
      matter_clock_.set_speed(request.speed_eighths);
      waiting_steps_ = 0;
      break;
    case Kind::save:
      yaw_ = request.yaw, pitch_ = request.pitch;
      save(true);
      break;
    case Kind::save_all: {
      yaw_ = request.yaw, pitch_ = request.pitch;
      unsaved_.clear();
      if (!played_->session || !play_->edited()) break;
      play_->prepare_save(yaw_, pitch_);
      if (const world::Status saved = played_->session->save(); !saved.ok()) unsaved_ = saved.error().message;
      break;
    }
    case Kind::copy: {
      play_->prepare_save(request.yaw, request.pitch);
      const world::Status written = world::write_world(played_->world(), request.path);
      if (!written.ok()) say(written.error().message);
      copied_hash_ = play_->matter().state_hash();
      break;
    }
    case Kind::knob:
      play_->keep_knob(request.name, request.value);
      break;
    case Kind::look:
      yaw_ = request.yaw, pitch_ = request.pitch;
      break;
  }
}

void SimThread::save(bool wait) {
  if (!played_->session) {
    if (wait) say("this world can't be saved: there is no file for it");
    return;
  }
  play_->prepare_save(yaw_, pitch_);
  last_save_s_ = now_s();
  const bool begun = played_->session->begin_save();
  if (wait) say(begun ? "saved as " + played_->path.string() : "all is saved already");
}

void SimThread::mark() {
  if (log_) log_->mark();
}

void SimThread::step_matter() {
  if (log_) log_->matter();
  play_->step_matter();
  if (log_) log_->sum();
}

void SimThread::tick(int64_t elapsed_ns) {
  const auto start = Steady::now();
  WalkInput input;
  {
    const std::lock_guard lock(mutex_);
    input = input_;
  }
  for (int n = walk_clock_.advance(elapsed_ns); n > 0; --n) {
    before_ = play_->walker().state();
    if (log_) log_->walk(input);
    play_->walk(input);
    if (++walked_ % kMarkEvery == 0) mark();
  }
  waiting_steps_ += matter_clock_.advance(elapsed_ns);
  while (waiting_steps_ > 0 && ms_since(start) < kBusyMs) {
    --waiting_steps_;
    step_matter();
    ticked_ = true;
  }
  // What could not be done within a fifth of a second of the world's time is dropped: it lags, and nothing queues up.
  const int64_t most = std::max<int64_t>(4, matter_clock_.speed_eighths() / 2);
  if (waiting_steps_ > most) dropped_ += static_cast<uint64_t>(waiting_steps_ - most), waiting_steps_ = most;
}

void SimThread::publish(bool all) {
  world::World& world = played_->world();
  PlayState next;
  next.before = before_, next.now = play_->walker().state(), next.jumped = play_->walker().jumped();
  next.tick_begun_s = now_s() - walk_clock_.part() * kWalkTick.seconds();
  next.tick = play_->tick();
  if (!matter_clock_.paused()) {
    next.matter_time.tick_s = sim::kMatterTick.seconds() * 8 / matter_clock_.speed_eighths();
    next.matter_time.due_s = now_s() - matter_clock_.part() * next.matter_time.tick_s;
  }
  next.paused = matter_clock_.paused(), next.speed_eighths = matter_clock_.speed_eighths();
  next.settled = play_->matter().settled(), next.edited = play_->edited();
  next.awake_leaves = play_->matter().awake_leaves();
  next.undo_steps = play_->history().undo_steps(), next.redo_steps = play_->history().redo_steps();
  next.matter_ms = next.settled ? 0 : play_->matter_ms();
  next.dropped_ticks = dropped_ + matter_clock_.dropped();
  if (played_->session) next.saves = played_->session->saves(), next.saving = played_->session->is_saving();
  if (all) {
    next.ledger = play_->matter().ledger(), next.effects = play_->matter().effects();
    next.layers = world.store.layers();
    next.store_bytes = world.store.bytes_memory(), next.matter_bytes = play_->matter().bytes();
    next.history_bytes = play_->history().bytes();
  }
  const std::vector<world::LeafPos> dirty = world.store.take_dirty(subscriber_);
  std::vector<LeafValues> values(dirty.size());
  for (size_t n = 0; n < dirty.size(); ++n) {
    const world::LeafBlocks leaf = world.store.leaf(dirty[n]);
    for (int i = 0; i < world::kLeafVoxels; ++i) values[n][static_cast<size_t>(i)] = leaf[i];
  }
  AmountChanges amounts = changed_amounts();
  const bool ticked = std::exchange(ticked_, false);
  if (ticked) next_inhabitants_.take(play_->matter(), next.now.foot.voxel);
  const std::lock_guard lock(mutex_);
  if (ticked && (has_inhabitants_ || !next_inhabitants_.empty())) {
    has_inhabitants_ = !next_inhabitants_.empty();
    std::swap(inhabitants_, next_inhabitants_);
    ++inhabitants_number_;
  }
  for (size_t n = 0; n < dirty.size(); ++n) changes_[dirty[n]] = values[n];
  if (amounts.all)
    amount_changes_ = std::move(amounts);
  else
    for (const auto& [leaf, of_leaf] : amounts.leaves) amount_changes_.leaves[leaf] = of_leaf;
  next.applied = state_.applied;
  next.copied_hash = copied_hash_;
  next.unsaved = unsaved_;
  next.message = std::move(state_.message), next.message_number = state_.message_number;
  if (!all) {
    next.ledger = std::move(state_.ledger), next.effects = std::move(state_.effects);
    next.layers = std::move(state_.layers);
    next.store_bytes = state_.store_bytes, next.matter_bytes = state_.matter_bytes;
    next.history_bytes = state_.history_bytes;
  }
  state_ = std::move(next);
}

void SimThread::run() {
  auto last = Steady::now();
  std::optional<world::Error> told;
  double told_s = 0;
  for (;;) {
    std::vector<std::pair<uint64_t, PlayRequest>> requests;
    {
      std::unique_lock lock(mutex_);
      const double wait_ms = waiting_steps_ > 0 ? 0 : std::max(0.0, kTurnMs - ms_since(last));
      wake_.wait_for(lock, std::chrono::duration<double, std::milli>(wait_ms),
                     [&] { return stop_ || !requests_.empty(); });
      if (stop_ && requests_.empty()) return;
      requests = std::move(requests_);
      requests_.clear();
    }
    for (auto& [number, request] : requests) do_request(request);
    const auto now = Steady::now();
    if (ms_since(last) >= kTurnMs || waiting_steps_ > 0) {
      tick(std::chrono::duration_cast<std::chrono::nanoseconds>(now - last).count());
      last = now;
    }
    if (played_->session) {
      played_->session->tick(now_s());
      const bool due = now_s() - last_save_s_ > options_.autosave_s;
      if (options_.autosave_s > 0 && due && !played_->session->is_saving()) {
        if (play_->edited() && played_->session->has_changes()) save(false);
        last_save_s_ = now_s();
      }
      const std::optional<world::Error>& error = played_->session->last_error();
      if (error && (!told || told->message != error->message || now_s() - told_s > kTellAgainS)) {
        say("the world could not be saved and is kept in memory: " + error->message);
        told = error, told_s = now_s();
      }
      if (!error && told && !played_->session->is_saving()) {
        say("the world is saved again");
        told.reset();
      }
    }
    const bool all = now_s() - last_full_s_ > kFullEveryS;
    if (all) last_full_s_ = now_s();
    publish(all);
    if (!requests.empty()) {
      {
        const std::lock_guard lock(mutex_);
        state_.applied = requests.back().first;
      }
      done_.notify_all();
    }
  }
}

}  // namespace tools
