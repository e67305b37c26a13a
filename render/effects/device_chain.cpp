#include "render/effects/device_chain.h"

#include <array>
#include <bit>
#include <cstring>

#include "render/effects/chain.shared.h"
#include "render/effects/device.shared.h"
#include "render/image/formats.shared.h"
#include "add_sample.comp.spv.h"
#include "bloom_step.comp.spv.h"
#include "effects.comp.spv.h"
#include "meter.comp.spv.h"
#include "world/base/jobs.h"

namespace render {

namespace {

using namespace shared;
using gpu::vk_info;

uint64_t pixels_of(const EffectPlan& plan) {
  return static_cast<uint64_t>(plan.frame.size.x) * static_cast<uint64_t>(plan.frame.size.y);
}

void barrier(VkCommandBuffer commands, VkPipelineStageFlags2 from, VkAccessFlags2 wrote, VkPipelineStageFlags2 to,
             VkAccessFlags2 access) {
  auto one = vk_info<VkMemoryBarrier2>(VK_STRUCTURE_TYPE_MEMORY_BARRIER_2);
  one.srcStageMask = from;
  one.srcAccessMask = wrote;
  one.dstStageMask = to;
  one.dstAccessMask = access;
  auto info = vk_info<VkDependencyInfo>(VK_STRUCTURE_TYPE_DEPENDENCY_INFO);
  info.memoryBarrierCount = 1;
  info.pMemoryBarriers = &one;
  vkCmdPipelineBarrier2(commands, &info);
}
constexpr VkPipelineStageFlags2 kCompute = VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT;
constexpr VkAccessFlags2 kWritten = VK_ACCESS_2_SHADER_STORAGE_WRITE_BIT;
void between_passes(VkCommandBuffer commands) {
  barrier(commands, kCompute, kWritten, kCompute, kWritten | VK_ACCESS_2_SHADER_STORAGE_READ_BIT);
}

uint32_t groups(int pixels) { return (static_cast<uint32_t>(pixels) + kEffectGroup - 1) / kEffectGroup; }

}  // namespace

bool DeviceEffects::fits(const gpu::Device& device, const EffectPlan& plan) {
  const uint64_t limit = device.limits().maxStorageBufferRange;
  return pixels_of(plan) * sizeof(glm::vec4) <= limit && plan.blurred_numbers * sizeof(float) <= limit;
}

world::Status DeviceEffects::fit(gpu::Buffer& buffer, VkDeviceSize bytes, gpu::MemoryUse use,
                                 VkBufferUsageFlags usage) {
  if (buffer.handle && buffer.size >= bytes) return {};
  buffer = {};
  TRY(buffer, gpu::make_buffer(*device_, bytes, usage, use));
  return {};
}

world::Result<VkPipeline> DeviceEffects::pipeline(const Variant& variant) {
  if (const auto found = pipelines_.find(variant); found != pipelines_.end()) return VkPipeline{found->second};
  const auto code = [&]() -> std::span<const uint32_t> {
    if (variant.shader == Shader::finish) return effects_comp_spv;
    if (variant.shader == Shader::bloom_step) return bloom_step_comp_spv;
    if (variant.shader == Shader::meter) return meter_comp_spv;
    return add_sample_comp_spv;
  }();
  auto module_info = vk_info<VkShaderModuleCreateInfo>(VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO);
  module_info.codeSize = code.size_bytes();
  module_info.pCode = code.data();
  VkShaderModule module_handle = VK_NULL_HANDLE;
  VK_CHECK(vkCreateShaderModule(device_->handle(), &module_info, nullptr, &module_handle));
  const gpu::Owned<VkShaderModule> module(*device_, module_handle);
  const uint32_t values[] = {variant.first, variant.second, variant.third};
  constexpr uint32_t kWord = sizeof(uint32_t);
  const VkSpecializationMapEntry entries[] = {{0, 0, kWord}, {1, kWord, kWord}, {2, 2 * kWord, kWord}};
  const uint32_t used = variant.shader == Shader::finish ? 3 : variant.shader == Shader::add_sample ? 0 : 1;
  const VkSpecializationInfo special{used, entries, sizeof values, values};
  auto info = vk_info<VkComputePipelineCreateInfo>(VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO);
  info.stage = vk_info<VkPipelineShaderStageCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO);
  info.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
  info.stage.module = module;
  info.stage.pName = "main";
  info.stage.pSpecializationInfo = &special;
  info.layout = layout_;
  VkPipeline made = VK_NULL_HANDLE;
  VK_CHECK(vkCreateComputePipelines(device_->handle(), device_->pipeline_cache(), 1, &info, nullptr, &made));
  pipelines_[variant] = gpu::Owned<VkPipeline>(*device_, made);
  return made;
}

world::Status DeviceEffects::open(gpu::Device& device) {
  device_ = &device;
  VkDescriptorSetLayoutBinding bindings[kEffectBindings];
  for (uint32_t i = 0; i < kEffectBindings; ++i)
    bindings[i] = {i, i == kEffectBindFrame ? VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER : VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1,
                   VK_SHADER_STAGE_COMPUTE_BIT, nullptr};
  auto set = vk_info<VkDescriptorSetLayoutCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO);
  set.bindingCount = kEffectBindings;
  set.pBindings = bindings;
  VkDescriptorSetLayout set_handle = VK_NULL_HANDLE;
  VK_CHECK(vkCreateDescriptorSetLayout(device.handle(), &set, nullptr, &set_handle));
  set_layout_ = gpu::Owned<VkDescriptorSetLayout>(device, set_handle);
  const VkPushConstantRange push{VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof(BloomStep)};
  static_assert(sizeof(AddSample) <= sizeof(BloomStep));
  auto layout = vk_info<VkPipelineLayoutCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO);
  layout.setLayoutCount = 1;
  layout.pSetLayouts = set_layout_.address();
  layout.pushConstantRangeCount = 1;
  layout.pPushConstantRanges = &push;
  VkPipelineLayout layout_handle = VK_NULL_HANDLE;
  VK_CHECK(vkCreatePipelineLayout(device.handle(), &layout, nullptr, &layout_handle));
  layout_ = gpu::Owned<VkPipelineLayout>(device, layout_handle);
  const VkDescriptorPoolSize sizes[] = {{VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, 2},
                                        {VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 2 * kEffectBindings}};
  auto info = vk_info<VkDescriptorPoolCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO);
  info.maxSets = 2;
  info.poolSizeCount = 2;
  info.pPoolSizes = sizes;
  VkDescriptorPool pool = VK_NULL_HANDLE;
  VK_CHECK(vkCreateDescriptorPool(device.handle(), &info, nullptr, &pool));
  descriptors_ = gpu::Owned<VkDescriptorPool>(device, pool);
  const VkDescriptorSetLayout layouts[] = {set_layout_, set_layout_};
  VkDescriptorSet sets[2] = {};
  auto two = vk_info<VkDescriptorSetAllocateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO);
  two.descriptorPool = descriptors_;
  two.descriptorSetCount = 2;
  two.pSetLayouts = layouts;
  VK_CHECK(vkAllocateDescriptorSets(device.handle(), &two, sets));
  set_ = sets[0], add_set_ = sets[1];
  return {};
}

world::Status DeviceEffects::write_set(VkDescriptorSet set, const gpu::Buffer& picture,
                                       const gpu::Buffer& finished) const {
  const gpu::Buffer* buffers[] = {&frame_, &picture, &blurred_, &meter_, &finished};
  VkDescriptorBufferInfo what[kEffectBindings];
  VkWriteDescriptorSet writes[kEffectBindings];
  for (uint32_t i = 0; i < kEffectBindings; ++i) {
    what[i] = {buffers[i]->handle, 0, VK_WHOLE_SIZE};
    writes[i] = vk_info<VkWriteDescriptorSet>(VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET);
    writes[i].dstSet = set;
    writes[i].dstBinding = i;
    writes[i].descriptorCount = 1;
    writes[i].descriptorType =
        i == kEffectBindFrame ? VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER : VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    writes[i].pBufferInfo = &what[i];
  }
  vkUpdateDescriptorSets(device_->handle(), kEffectBindings, writes, 0, nullptr);
  return {};
}

world::Status DeviceEffects::prepare(gpu::Device& device, const EffectPlan& plan, const ShadedPicture& shaded) {
  if (!device_) TRY_STATUS(open(device));
  plan_ = plan, shaded_ = shaded, finish_name_ = effect_pass_name(plan);
  const bool sums = shaded.samples > 1;
  plan_.frame.modes.w = sums ? 3 : shaded.stride;
  constexpr VkBufferUsageFlags kStorage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;
  TRY_STATUS(fit(frame_, sizeof(EffectFrame), gpu::MemoryUse::upload, VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT));
  TRY_STATUS(fit(meter_, kMeterWords * sizeof(uint32_t), gpu::MemoryUse::readback, kStorage));
  TRY_STATUS(fit(blurred_, plan.blurred_numbers * sizeof(float), gpu::MemoryUse::device, kStorage));
  if (sums) {
    // A sum that no effect follows is what is read.
    if (plan.empty() && sum_.handle && !sum_.mapped()) sum_ = {};
    TRY_STATUS(fit(sum_, pixels_of(plan) * sizeof(Rgb),
                   plan.empty() ? gpu::MemoryUse::readback : gpu::MemoryUse::device, kStorage));
  }
  TRY_STATUS(fit(finished_, plan.empty() ? 0 : finished_bytes(plan), gpu::MemoryUse::readback, kStorage));
  std::memcpy(frame_.mapped(), &plan_.frame, sizeof plan_.frame);
  std::memset(meter_.mapped(), 0, kMeterWords * sizeof(uint32_t));
  std::memcpy(meter_.mapped() + kMeterEv * sizeof(uint32_t), &plan.metered_ev, sizeof(float));
  if (sums) {
    TRY_STATUS(write_set(add_set_, *shaded.radiance, sum_));
    TRY(add_, pipeline({Shader::add_sample, 0, 0, 0}));
  }
  if (plan.empty() || !shaded.last()) return {};
  TRY_STATUS(write_set(set_, sums ? sum_ : *shaded.radiance, finished_));
  const bool toned = (plan.effects & 1u << EFFECT_tone_map) != 0;
  TRY(finish_, pipeline({Shader::finish, plan.effects, toned ? plan.frame.modes.x : 0, plan.format}));
  for (const BloomStep& step : plan.bloom_steps) {
    TRY(steps_[step.kind], pipeline({Shader::bloom_step, step.kind, 0, 0}));
  }
  if (plan.meter) {
    TRY(count_, pipeline({Shader::meter, 0, 0, 0}));
    TRY(resolve_, pipeline({Shader::meter, 1, 0, 0}));
  }
  return {};
}

void DeviceEffects::record(VkCommandBuffer commands, const std::function<void(const char*)>& mark) const {
  const auto use = [&](VkPipeline pipeline) { vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline); };
  const auto bind = [&](VkDescriptorSet set) {
    vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, layout_, 0, 1, &set, 0, nullptr);
  };
  barrier(commands, kCompute | VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT, kWritten | VK_ACCESS_2_TRANSFER_WRITE_BIT,
          kCompute, kWritten | VK_ACCESS_2_SHADER_STORAGE_READ_BIT);
  if (shaded_.samples > 1) {
    mark("add_sample");
    use(add_), bind(add_set_);
    const AddSample what{static_cast<uint32_t>(3 * pixels_of(plan_)), shaded_.stride, shaded_.sample == 0,
                         1.0f / static_cast<float>(shaded_.samples)};
    vkCmdPushConstants(commands, layout_, VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof what, &what);
    const uint32_t all = (what.numbers + 63) / 64;
    vkCmdDispatch(commands, std::min(all, 65535u), (all + 65534) / 65535, 1);
    between_passes(commands);
  }
  if (!plan_.empty() && shaded_.last()) {
    bind(set_);
    if (!plan_.bloom_steps.empty()) mark("bloom_levels");
    for (const BloomStep& step : plan_.bloom_steps) {
      use(steps_.at(step.kind));
      vkCmdPushConstants(commands, layout_, VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof step, &step);
      vkCmdDispatch(commands, groups(step.to_width), groups(step.to_height), 1);
      between_passes(commands);
    }
    const int width = plan_.frame.size.x, height = plan_.frame.size.y;
    if (plan_.meter) {
      mark("exposure_meter");
      use(count_);
      vkCmdDispatch(commands, groups(width), groups((height + 7) / 8), 1);
      between_passes(commands);
      use(resolve_);
      vkCmdDispatch(commands, 1, 1, 1);
      between_passes(commands);
    }
    mark(finish_name_.c_str());
    use(finish_);
    vkCmdDispatch(commands, groups(width), groups(height), 1);
  }
  barrier(commands, kCompute, kWritten, VK_PIPELINE_STAGE_2_HOST_BIT, VK_ACCESS_2_HOST_READ_BIT);
}

EffectOutcome DeviceEffects::read(Image& image) const {
  EffectOutcome outcome;
  const auto* meter = reinterpret_cast<const uint32_t*>(meter_.mapped());
  outcome.metered_ev = std::bit_cast<float>(meter[kMeterEv]);
  outcome.not_finite = meter[kMeterNotFinite];
  const gpu::Buffer& from = plan_.empty() ? sum_ : finished_;
  if (plan_.format == kFormatFloat32) {
    std::memcpy(image.pixels.data(), from.mapped(), image.pixels.size() * sizeof(Rgb));
    return outcome;
  }
  const auto* words = reinterpret_cast<const uint32_t*>(from.mapped());
  world::parallel_ranges(image.pixels.size(), 16384, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      glm::uvec2 code(0u);
      if (plan_.format == kFormatRgb565)
        code.x = words[i / 2] >> (i % 2 * 16) & 0xffffu;
      else if (plan_.format == kFormatHalf)
        code = {words[2 * i], words[2 * i + 1]};
      else
        code.x = words[i];
      const glm::vec3 c = unpack_colour(plan_.format, code) * plan_.frame.window.w;
      image.pixels[i] = {c.x, c.y, c.z};
    }
  });
  return outcome;
}

}  // namespace render
