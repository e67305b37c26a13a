/// One dispatch for tests of shared headers: questions in a buffer at binding 0, answers in one at binding 1.
#pragma once

#include <cstring>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "render/gpu/owned.h"

namespace render {

namespace detail {

template <class Handle, class Create, class Info>
gpu::Owned<Handle> made(gpu::Device& device, Create create, const Info& info) {
  Handle handle{};
  EXPECT_EQ(create(device.handle(), &info, nullptr, &handle), VK_SUCCESS);
  return {device, handle};
}

}  // namespace detail

/// An answer a question, by a shader whose workgroups have 64 invocations.
template <class Answer, class Question>
std::vector<Answer> compute_answers(gpu::Device& device, std::span<const uint32_t> spirv,
                                    const std::vector<Question>& asked) {
  const size_t in_bytes = asked.size() * sizeof(Question), out_bytes = asked.size() * sizeof(Answer);
  auto in = gpu::make_buffer(device, in_bytes, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, gpu::MemoryUse::upload);
  auto out = gpu::make_buffer(device, out_bytes, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, gpu::MemoryUse::readback);
  EXPECT_TRUE(in.ok() && out.ok());
  std::memcpy(in->mapped(), asked.data(), in_bytes);

  VkDescriptorSetLayoutBinding bindings[2] = {};
  for (uint32_t i = 0; i < 2; ++i)
    bindings[i] = {i, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr};
  auto set_info = gpu::vk_info<VkDescriptorSetLayoutCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO);
  set_info.bindingCount = 2;
  set_info.pBindings = bindings;
  const auto set_layout = detail::made<VkDescriptorSetLayout>(device, vkCreateDescriptorSetLayout, set_info);
  auto layout_info = gpu::vk_info<VkPipelineLayoutCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO);
  layout_info.setLayoutCount = 1;
  layout_info.pSetLayouts = set_layout.address();
  const auto layout = detail::made<VkPipelineLayout>(device, vkCreatePipelineLayout, layout_info);
  auto module_info = gpu::vk_info<VkShaderModuleCreateInfo>(VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO);
  module_info.codeSize = spirv.size_bytes();
  module_info.pCode = spirv.data();
  const auto module = detail::made<VkShaderModule>(device, vkCreateShaderModule, module_info);
  auto pipeline_info = gpu::vk_info<VkComputePipelineCreateInfo>(VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO);
  pipeline_info.stage =
      gpu::vk_info<VkPipelineShaderStageCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO);
  pipeline_info.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
  pipeline_info.stage.module = module;
  pipeline_info.stage.pName = "main";
  pipeline_info.layout = layout;
  VkPipeline pipeline_handle = VK_NULL_HANDLE;
  EXPECT_EQ(vkCreateComputePipelines(device.handle(), VK_NULL_HANDLE, 1, &pipeline_info, nullptr, &pipeline_handle),
            VK_SUCCESS);
  const gpu::Owned<VkPipeline> pipeline(device, pipeline_handle);

  const VkDescriptorPoolSize pool_size{VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 2};
  auto pool_info = gpu::vk_info<VkDescriptorPoolCreateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO);
  pool_info.maxSets = 1;
  pool_info.poolSizeCount = 1;
  pool_info.pPoolSizes = &pool_size;
  const auto pool = detail::made<VkDescriptorPool>(device, vkCreateDescriptorPool, pool_info);
  auto allocate = gpu::vk_info<VkDescriptorSetAllocateInfo>(VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO);
  allocate.descriptorPool = pool;
  allocate.descriptorSetCount = 1;
  allocate.pSetLayouts = set_layout.address();
  VkDescriptorSet set = VK_NULL_HANDLE;
  EXPECT_EQ(vkAllocateDescriptorSets(device.handle(), &allocate, &set), VK_SUCCESS);
  const VkDescriptorBufferInfo buffers[2] = {{in->handle, 0, VK_WHOLE_SIZE}, {out->handle, 0, VK_WHOLE_SIZE}};
  auto write = gpu::vk_info<VkWriteDescriptorSet>(VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET);
  write.dstSet = set;
  write.descriptorCount = 2;
  write.descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
  write.pBufferInfo = buffers;
  vkUpdateDescriptorSets(device.handle(), 1, &write, 0, nullptr);

  EXPECT_TRUE(device
                  .run([&](VkCommandBuffer commands) {
                    vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline);
                    vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, layout, 0, 1, &set, 0, nullptr);
                    vkCmdDispatch(commands, static_cast<uint32_t>((asked.size() + 63) / 64), 1, 1);
                    auto barrier = gpu::vk_info<VkMemoryBarrier2>(VK_STRUCTURE_TYPE_MEMORY_BARRIER_2);
                    barrier.srcStageMask = VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT;
                    barrier.srcAccessMask = VK_ACCESS_2_SHADER_WRITE_BIT;
                    barrier.dstStageMask = VK_PIPELINE_STAGE_2_HOST_BIT;
                    barrier.dstAccessMask = VK_ACCESS_2_HOST_READ_BIT;
                    auto dependency = gpu::vk_info<VkDependencyInfo>(VK_STRUCTURE_TYPE_DEPENDENCY_INFO);
                    dependency.memoryBarrierCount = 1;
                    dependency.pMemoryBarriers = &barrier;
                    vkCmdPipelineBarrier2(commands, &dependency);
                  })
                  .ok());

  std::vector<Answer> answers(asked.size());
  std::memcpy(answers.data(), out->mapped(), out_bytes);
  return answers;
}

}  // namespace render
