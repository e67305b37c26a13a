#include "tools/play/picture_maker.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "render/image/display.h"
#include "tools/picture.h"
#include "world/store/copies.h"

namespace tools {

namespace {

using Steady = std::chrono::steady_clock;
double ms_since(Steady::time_point start) {
  return std::chrono::duration<double, std::milli>(Steady::now() - start).count();
}

constexpr double kWaitForEditS = 0.005;  // an edit made in this frame is mostly done by then
constexpr double kErrorMapCodes = 64;

void put_rgba(const render::Image8& image, int from_x, int to_x, Picture& picture) {
  const size_t width = static_cast<size_t>(picture.width);
  for (size_t y = 0; y < static_cast<size_t>(picture.height); ++y) {
    const unsigned char* in = image.pixels.data() + (y * width + static_cast<size_t>(from_x)) * 3;
    uint8_t* out = picture.rgba.data() + (y * width + static_cast<size_t>(from_x)) * 4;
    for (int x = from_x; x < to_x; ++x, in += 3, out += 4) out[0] = in[0], out[1] = in[1], out[2] = in[2], out[3] = 255;
  }
}

std::array<float, 5> moment_of(const render::RenderKnobs& k) {
  return {k.time_of_day, k.latitude, k.day_of_year, k.turbidity, k.moon ? 1.0f : 0.0f};
}

void fail(const world::Error& error, Picture& picture) {
  picture.error = error.message;
  picture.device_failed = error.kind == world::ErrorKind::no_device;
}

}  // namespace

bool is_of_moment(std::string_view knob) {
  for (const char* name : {"time_of_day", "latitude", "day_of_year", "turbidity", "moon", "exposure"})
    if (knob == name) return true;
  return false;
}

render::RenderKnobs at_moment_of(const render::RenderKnobs& from, render::RenderKnobs to) {
  for (const auto& row : render::render_knobs().rows())
    if (is_of_moment(row.name)) CHECK(render::render_knobs().set(to, row.name, row.get(from)).ok());
  return to;
}

world::World copy_of(const world::World& from) {
  world::World copy(*from.palette);
  copy.store = world::moved(from.store, {0, 0, 0}, *copy.palette);
  copy.environment = from.environment;
  copy.luminaires = from.luminaires;
  copy.media = from.media;
  copy.meshes = from.meshes;
  copy.cameras = from.cameras;
  copy.knobs = from.knobs;
  copy.metadata = from.metadata;
  return copy;
}

std::array<uint8_t, 3> cividis(double value) {
  static constexpr double kPoints[5][3] = {
      {0, 32, 77}, {66, 78, 108}, {124, 123, 120}, {187, 173, 108}, {255, 234, 70}};
  const double at = std::clamp(value, 0.0, 1.0) * 4;
  const int low = std::min(3, static_cast<int>(at));
  std::array<uint8_t, 3> rgb;
  for (int c = 0; c < 3; ++c)
    rgb[static_cast<size_t>(c)] =
        static_cast<uint8_t>(kPoints[low][c] + (kPoints[low + 1][c] - kPoints[low][c]) * (at - low) + 0.5);
  return rgb;
}

render::Image8 error_map(const render::Image8& a, const render::Image8& b) {
  render::Image8 map{a.width, a.height, std::vector<unsigned char>(a.pixels.size())};
  for (size_t i = 0; i + 2 < a.pixels.size(); i += 3) {
    int worst = 0;
    for (size_t c = 0; c < 3; ++c) worst = std::max(worst, std::abs(int{a.pixels[i + c]} - int{b.pixels[i + c]}));
    const std::array<uint8_t, 3> colour = cividis(worst / kErrorMapCodes);
    std::copy(colour.begin(), colour.end(), map.pixels.begin() + static_cast<std::ptrdiff_t>(i));
  }
  return map;
}

PictureMaker::PictureMaker(world::World mirror, SimThread& simulation)
    : mirror_(std::move(mirror)), simulation_(simulation), thread_([this] { run(); }) {}

PictureMaker::~PictureMaker() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

bool PictureMaker::begin(PictureRequest request) {
  {
    const std::lock_guard lock(mutex_);
    if (busy_) return false;
    busy_ = true;
    request_ = std::move(request);
    picture_.reset();
  }
  wake_.notify_all();
  return true;
}

std::optional<Picture> PictureMaker::take(double wait_s) {
  std::unique_lock lock(mutex_);
  done_.wait_for(lock, std::chrono::duration<double>(wait_s), [&] { return picture_.has_value(); });
  if (!picture_) return std::nullopt;
  busy_ = false;
  std::optional<Picture> taken = std::move(picture_);
  picture_.reset();
  return taken;
}

void PictureMaker::with_world(const std::function<void(const world::World&)>& read) const {
  const std::shared_lock lock(world_mutex_);
  read(mirror_);
}

void PictureMaker::run() {
  for (;;) {
    PictureRequest request;
    {
      std::unique_lock lock(mutex_);
      wake_.wait(lock, [&] { return stop_ || request_; });
      if (stop_) break;
      request = std::move(*request_);
      request_.reset();
    }
    Picture made = make(request);
    {
      const std::lock_guard lock(mutex_);
      picture_ = std::move(made);
    }
    done_.notify_all();
  }
  backends_.clear();  // on the thread that made them
}

void PictureMaker::follow(const PictureRequest& request, Picture& picture) {
  if (request.after_request > 0) simulation_.wait_for(request.after_request, kWaitForEditS);
  picture.applied = simulation_.take_changes(changes_, amounts_);
  const auto start = Steady::now();
  std::vector<world::LeafWrite> writes;
  writes.reserve(changes_.size());
  for (const auto& [leaf, values] : changes_) writes.push_back({leaf, values.data()});
  const auto sky = render::sky_view(request.environment, request.settings.knobs, sky_);
  stops_of_night_ = sky ? stops_of_night(*sky, request.settings.knobs.exposure_most) : 0;
  const std::unique_lock lock(world_mutex_);
  mirror_.environment = sky ? sky->environment : request.environment;
  version_ += writes.empty() && amounts_.empty() ? 0 : 1;
  if (!writes.empty()) CHECK(mirror_.store.write_leaves(writes).ok());
  amounts_.put_into(mirror_.store);
  picture.mirror_ms = ms_since(start);
}

void PictureMaker::follow_inhabitants(bool stand_still) {
  // Pictures that are compared show the same moment.
  MatterTime time;
  if (!stand_still && simulation_.take_inhabitants(inhabitants_, inhabitants_number_, time)) ++version_;
  const double part = time.part(SimThread::now_s());
  drawn_inhabitants_ = part < 1 && !inhabitants_.empty() ? inhabitants_.view_at(part) : inhabitants_.view();
}

world::Result<render::Backend*> PictureMaker::backend(const std::string& name) {
  std::unique_ptr<render::Backend>& slot = backends_[name];
  if (!slot) {
    TRY(slot, make_backend(name));
  }
  return slot.get();
}

world::Result<render::Frame> PictureMaker::frame(const PictureSettings& settings, const PictureRequest& request,
                                                 Picture& picture) {
  TRY(render::Backend* const drawn_by, backend(settings.backend));
  // Two settings may ask for two models of light, which are both kept.
  const auto start = Steady::now();
  const bool first =
      request.mode == ViewMode::single || settings.knobs.light_model == request.settings.knobs.light_model;
  LightOfWorld& light = first ? light_ : other_light_;
  drawn_by->light = {};
  drawn_by->inhabitants = drawn_inhabitants_;
  if (drawn_by->reads_light(mirror_, settings.knobs)) {
    TRY(drawn_by->light, light.follow(mirror_, request.camera.position, settings.knobs));
    picture.light_ms += ms_since(start);
    if (light.report().contains("bytes")) picture.light_bytes = light.report()["bytes"].get<size_t>();
  }
  const world::WorldView view(mirror_);
  return drawn_by->render(view, request.camera, settings.knobs, request.width, request.height);
}

void PictureMaker::measure(const PictureRequest& request, const render::Image& drawn, Picture& picture) {
  const render::RenderKnobs& knobs = request.settings.knobs;
  const render::Camera& c = request.camera;
  const auto same = [&](const Reference& r) {
    return r.image.width == request.width && r.image.height == request.height && r.version == version_ &&
           r.camera.position.voxel == c.position.voxel && r.camera.position.fraction == c.position.fraction &&
           r.camera.forward == c.forward && r.camera.vertical_fov == c.vertical_fov &&
           r.backend == request.settings.backend && r.environment == request.environment &&
           r.light_model == knobs.light_model && r.moment == moment_of(knobs) && r.exposure == knobs.exposure;
  };
  if (!reference_ || !same(*reference_)) {
    PictureSettings exact = request.settings;
    exact.knobs = at_moment_of(knobs, render::render_knobs().preset(world::Accuracy::exact));
    // What has no most exact setting stays as it is.
    exact.knobs.light_model = knobs.light_model;
    exact.knobs.light_transport = knobs.light_transport;
    auto made = frame(exact, request, picture);
    if (!made) return;
    reference_ = Reference{std::move(made->image),
                           c,
                           request.settings.backend,
                           request.environment,
                           version_,
                           knobs.light_model,
                           moment_of(knobs),
                           knobs.exposure};
  }
  // Twice: what is derived for other settings is made by the first.
  auto other = frame(*request.measured, request, picture);
  if (other) other = frame(*request.measured, request, picture);
  if (!other) return;
  picture.measured = {other->report.ms, render::compare_images(other->image, reference_->image).metrics,
                      render::compare_images(drawn, reference_->image).metrics};
}

Picture PictureMaker::make(const PictureRequest& request) {
  const auto start = Steady::now();
  Picture picture;
  picture.number = ++pictures_;
  picture.width = request.width, picture.height = request.height;
  picture.backend = request.settings.backend;
  follow(request, picture);
  follow_inhabitants(request.measured.has_value());
  auto drawn = frame(request.settings, request, picture);
  if (!drawn) {
    fail(drawn.error(), picture);
    return picture;
  }
  picture.report = std::move(drawn->report);
  const auto display_start = Steady::now();
  const float exposure = request.settings.knobs.exposure;
  picture.eye_ev = eye_.adapt(drawn->image, exposure, stops_of_night_, SimThread::now_s());
  const auto eye_ev = static_cast<float>(picture.eye_ev);
  const render::Image8 shown = render::display_image(drawn->image, exposure + eye_ev);
  picture.rgba.resize(size_t{4} * static_cast<size_t>(request.width) * static_cast<size_t>(request.height));
  put_rgba(shown, 0, request.width, picture);
  picture.display_ms = ms_since(display_start);
  if (request.mode != ViewMode::single) {
    auto second = frame(request.other, request, picture);
    if (!second) {
      fail(second.error(), picture);
      return picture;
    }
    picture.other_report = std::move(second->report);
    const render::Image8 other = render::display_image(second->image, request.other.knobs.exposure + eye_ev);
    if (request.mode == ViewMode::split)
      put_rgba(other, std::clamp(static_cast<int>(request.split_at * request.width), 0, request.width), request.width,
               picture);
    else
      put_rgba(error_map(shown, other), 0, request.width, picture);
    picture.difference = render::compare_images(shown, other).metrics;
  }
  if (request.measured) measure(request, drawn->image, picture);
  if (request.keep_linear) picture.linear = std::move(drawn->image);
  picture.ms = ms_since(start);
  return picture;
}

}  // namespace tools
