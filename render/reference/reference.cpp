#include "render/reference/reference.h"

#include "render/trace/layers.h"
#include "render/trace/picture.h"

namespace render {

namespace {

class ReferenceBackend : public Backend {
 public:
  bool reads_light(const world::World&, const RenderKnobs&) const override { return false; }
  world::Result<Frame> render(const world::WorldView& view, const Camera& camera, const RenderKnobs& knobs, int width,
                              int height) override {
    RenderKnobs all_light = knobs;
    all_light.light_transport = LightTransport::path;
    TRY(Frame traced, trace_picture(view, camera, all_light, sampling, width, height));
    TRY_STATUS(finish_traced(view, inhabitants, camera, all_light, traced));
    return traced;
  }
};

}  // namespace

world::Result<std::unique_ptr<Backend>> make_reference_backend() {
  return std::unique_ptr<Backend>(new ReferenceBackend);
}

}  // namespace render
