/// Passes over a picture, or over a list of its pixels, in pieces that a GPU can stop between: slices. One that is busy
/// with a single piece for long shows nothing else meanwhile, and after seconds counts as hung (hard case R10).
///
/// How long a group takes is foreseen by the last picture that used the pipeline: by the time of its row of timestamps,
/// all of it where pipelines share one. Groups that weren't measured yet are taken for slow. Slices depend on each
/// other as little as groups of one dispatch do: there are no barriers between them, and any number of them makes the
/// same picture, bit for bit. A slice is at least a group, which ends as its loops do. Reports count a pass that is cut
/// once.
///
/// cost   five slices of 46 ms of shading on lavapipe: 1 ms; 32: 8 ms
/// error  groups are taken to be alike, and the camera to move little: hence the aim far below the most
/// Doesn't cut draws of geometry; nor dispatches over other things than pictures and lists: vkCmdDispatchBase() left
/// tiles of the occlusion test out (lavapipe, Mesa 22.3.6), so shaders are told their first group; nor what is
/// submitted at once, which drivers limit too, to seconds.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <span>
#include <vector>

#include "render/gpu/owned.h"
#include "render/gpu/time_slices.shared.h"

namespace render::gpu {

/// What a slice is to take, and the most that it may: where all of a pass's work is in a fifth of the picture.
constexpr double kSliceAimMs = 10, kSliceMostMs = 50;
/// Of a group that wasn't measured: slices of 65,536 pixels.
constexpr double kUnmeasuredGroupMs = kSliceAimMs / 1024;

/// How many groups a slice has, of so many that take so long each: what the aim allows, but all slices are alike.
uint64_t groups_of_slice(uint64_t groups, double group_ms);

class TimeSlices {
 public:
  /// Called with a slice's first group and how many groups it has, along x and y.
  using Slice = std::function<void(uint32_t x, uint32_t y, uint32_t width, uint32_t height)>;
  /// A pass, or a part of one, in the picture at hand.
  struct Use {
    VkPipeline pipeline;
    size_t row;  // of timestamps, from 1; 0: before all
    uint64_t groups, of_slice, slices;
    double group_ms;  // foreseen
  };

  void begin_picture();
  /// What is recorded from here on has its time in the next row.
  void begin_row() { ++rows_; }
  /// Once the device is done.
  void end_picture(std::span<const double> row_ms);

  /// vkCmdDraw() of a triangle that covers the picture, whose scissor is all of it. The pipeline is bound.
  void draw(VkCommandBuffer commands, VkPipeline pipeline, VkExtent2D picture);

  /// vkCmdDispatch() over a picture in groups of 8 x 8 pixels. The pipeline is bound; push: the slice's first group
  /// along x and y, which is for the shader.
  void dispatch(VkCommandBuffer commands, VkPipeline pipeline, VkExtent2D picture,
                const std::function<void(const std::array<uint32_t, 2>& first_group)>& push);

  std::span<const Use> uses() const { return uses_; }
  /// For tests: cuts all into as many as this, where there are so many groups; 0: by time.
  uint64_t forced = 0;

 private:
  friend class ListDispatch;
  void cut(VkPipeline pipeline, VkExtent2D picture, const Slice& slice);
  double foreseen(VkPipeline pipeline) const;
  uint64_t of_slice(uint64_t groups, double group_ms) const;

  std::map<VkPipeline, double> group_ms_;  // of the last picture; a handle that is used anew is off for one
  std::vector<Use> uses_;
  std::vector<double> row_ms_;
  size_t rows_ = 0;
};

/// The dispatches over a list that a shader makes: an indirect one a slice.
class ListDispatch {
 public:
  /// Of a list of at most so many groups, along x.
  world::Status prepare(Device& device, const TimeSlices& slices, VkPipeline pipeline, uint64_t groups);
  /// Before the list is made: a transfer.
  void clear(VkCommandBuffer commands) const;
  /// Calls push with the first group of each slice, which is for the shader.
  void record(VkCommandBuffer commands, TimeSlices& slices, const std::function<void(uint32_t)>& push) const;
  /// Where there is no record(), after what is counted: for head().
  void read_head(VkCommandBuffer commands) const;
  /// Once the device is done, after end_picture(): how many groups the list came to have.
  void finish(TimeSlices& slices, uint64_t groups) const;
  const shared::ListHead& head() const { return *reinterpret_cast<const shared::ListHead*>(head_.mapped()); }

  /// A ListHead, and the arguments.
  const Buffer& arguments() const { return arguments_; }

 private:
  /// Empty dispatches cost little, but not nothing.
  static constexpr uint64_t kMostSlices = 1024;
  Buffer arguments_, head_;  // the arguments where atomics are fast
  TimeSlices::Use use_{};
};

}  // namespace render::gpu
