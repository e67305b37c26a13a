#include "render/raster/temporal_pass.h"

#include "temporal.comp.spv.h"

namespace render::raster {

namespace {

/// The camera without the shift by parts of a pixel.
Camera middle_of(Camera camera) {
  camera.window = {};
  return camera;
}

bool is_whole(const Drawing& drawing) {
  const PictureWindow& window = drawing.camera.window;
  return window.whole_height <= 0 || (window.whole_height == drawing.height && window.whole_width == drawing.width);
}

}  // namespace

PassKind TemporalPass::kind() {
  return {"temporal",
          [](const Drawing& drawing, TargetNeeds& needs) {
            if (drawing.knobs.anti_aliasing != AntiAliasing::temporal || !is_whole(drawing)) return false;
            needs.colour = true;
            return true;
          },
          []() -> std::unique_ptr<Pass> { return std::make_unique<TemporalPass>(); }};
}

world::Status TemporalPass::fit(PassContext& context) {
  const uint64_t bytes =
      sizeof(vec4) * static_cast<uint64_t>(context.targets.width) * static_cast<uint64_t>(context.targets.height);
  newest_ = -1;
  for (gpu::Buffer& history : history_) {
    history = {};
    TRY(history, gpu::make_buffer(context.device, bytes, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, gpu::MemoryUse::device));
  }
  return {};
}

world::Status TemporalPass::prepare(PassContext& context, const Drawing&, FrameReport&) {
  if (!pipeline_) {
    TRY(pipeline_, make_compute(context.device, temporal_comp_spv));
  }
  const int last = newest_ < 0 ? 0 : newest_;
  context.bindings.bind(kBindHistory, history_[last]);
  context.bindings.bind(kBindNewHistory, history_[1 - last]);
  return {};
}

void TemporalPass::record(VkCommandBuffer commands, PassContext& context, const Drawing& drawing) {
  const Targets& targets = context.targets;
  image_barrier(commands, targets.colour.handle, VK_IMAGE_ASPECT_COLOR_BIT, kColourReadWrite | kComputeReadWrite,
                kComputeReadWrite);
  image_barrier(commands, targets.depth.handle, VK_IMAGE_ASPECT_DEPTH_BIT, kDepthReadWrite | kFragmentRead,
                kComputeRead);
  const Camera now = drawn_ = middle_of(drawing.camera);
  const Camera& before = newest_ < 0 ? now : before_;
  const PixelRays then(before, drawing.width, drawing.height);
  const world::VoxelPos voxels = now.position.voxel - before.position.voxel;
  const Vec3d moved = Vec3d(voxels.x, voxels.y, voxels.z) + (now.position.fraction - before.position.fraction);
  const auto row = [](const Vec3d& v, double w) { return vec4(glm::vec3(v), static_cast<float>(w)); };
  const PictureWindow& window = drawing.camera.window;
  const TemporalConstants constants{row(then.right / then.tan_half_x, window.x),
                                    row(-then.up / then.tan_half_y, window.y), row(then.forward, newest_ < 0 ? 0 : 1),
                                    row(moved, 0)};
  context.bindings.use(commands, pipeline_);
  const auto dispatch = [&](const TemporalConstants& of_all) {
    context.slices.dispatch(commands, pipeline_.handle, targets.extent(), [&](const auto& first_group) {
      struct {
        TemporalConstants constants;
        std::array<uint32_t, 2> first_group;
        std::array<uint32_t, 2> unused;
      } const pushed{of_all, first_group, {}};
      pipeline_.push(commands, pushed);
    });
  };
  dispatch(constants);
  // The radiance is read and written: what all pixels read is history and the image before, so a copy comes last.
  memory_barrier(commands, kComputeWrite, kComputeReadWrite);
  TemporalConstants copies = constants;
  copies.then_forward.w = -1;
  dispatch(copies);
}

world::Status TemporalPass::finish(PassContext& context, FrameReport& report) {
  newest_ = newest_ < 0 ? 1 : 1 - newest_;
  before_ = drawn_;
  const uint64_t pixels = static_cast<uint64_t>(context.targets.width) * static_cast<uint64_t>(context.targets.height);
  PassReport& row = row_of(report, "temporal");
  row.draws = 2, row.bytes = 5 * pixels * sizeof(vec4);
  return {};
}

}  // namespace render::raster
