/// The same BSDFs on the processor and on the device: the shared headers, compiled into a compute shader, answer what
/// the C++ table answers.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <vector>

#include <gtest/gtest.h>

#include "render/bsdf/blinn_phong.shared.h"
#include "render/bsdf/bsdf.h"
#include "render/gpu/owned.h"
#include "world/base/random.h"

#include "every_bsdf.comp.spv.h"

namespace render {
namespace {

/// As in every_bsdf.comp.glsl.
struct Question {
  BsdfParameters parameters;
  Vec3f wi;
  uint32_t bsdf;
  Vec3f wo;
  float reserved0 = 0;
  Vec3f n;
  float reserved1 = 0;
  Vec3f u;
  float reserved2 = 0;
};
static_assert(sizeof(Question) == 128);
static_assert(offsetof(BsdfParameters, gloss) == 60 && offsetof(Question, bsdf) == 76);

constexpr size_t kAnswers = 52;
using Answer = std::array<float, kAnswers>;

struct Field {
  const char* name;
  size_t first, count;
};
constexpr Field kFields[] = {{"finite density", 0, 3},      {"pdf", 3, 1},
                             {"probability in", 4, 3},      {"probability out", 7, 3},
                             {"incoming impulses", 10, 13}, {"outgoing impulses", 23, 13},
                             {"scatter in", 36, 8},         {"scatter out", 44, 8}};

Answer answer(const Question& q) {
  const Bsdf& bsdf = bsdfs()[q.bsdf];
  Answer answers;
  size_t at = 0;
  const auto put = [&](float value) { answers[at++] = value; };
  const auto put3 = [&](Vec3f v) { put(v.x), put(v.y), put(v.z); };
  put3(bsdf.finite_density(q.parameters, q.wi, q.wo, q.n));
  put(bsdf.pdf(q.parameters, q.wi, q.wo, q.n));
  put3(bsdf.probability_in(q.parameters, q.wo, q.n));
  put3(bsdf.probability_out(q.parameters, q.wi, q.n));
  for (const Impulses& impulses :
       {bsdf.incoming_impulses(q.parameters, q.wo, q.n), bsdf.outgoing_impulses(q.parameters, q.wi, q.n)}) {
    put(static_cast<float>(impulses.count));
    for (const Impulse& impulse : impulses.impulse) put3(impulse.direction), put3(impulse.magnitude);
  }
  for (const BsdfSample& drawn :
       {bsdf.scatter_in(q.parameters, q.wo, q.n, q.u), bsdf.scatter_out(q.parameters, q.wi, q.n, q.u)})
    put3(drawn.direction), put3(drawn.weight), put(drawn.pdf), put(drawn.impulse ? 1.0f : 0.0f);
  EXPECT_EQ(at, kAnswers);
  return answers;
}

std::vector<Question> questions() {
  std::vector<Question> all;
  int64_t count = 0;
  const auto unit = [&] { return world::uniform01(world::random_bits(11, ++count, 0, 0)); };
  const auto direction = [&] {
    const float z = 2 * unit() - 1, turn = 6.2831853f * unit(), r = std::sqrt(1 - z * z);
    return glm::normalize(Vec3f(r * std::cos(turn), r * std::sin(turn), z));
  };
  for (uint32_t bsdf = 0; bsdf < bsdfs().size(); ++bsdf)
    for (int i = 0; i < 3000; ++i) {
      Question q{};
      q.bsdf = bsdf;
      BsdfParameters& p = q.parameters;
      p.lambertian = 0.6f * Vec3f(unit(), unit(), unit());
      p.glossy = unit() * (Vec3f(1) - p.lambertian);
      p.smoothness = shared::smoothness_from_shininess(unit());
      p.eta = i % 3 == 0 ? 1.0f : 0.5f + 1.5f * unit();
      p.transmission = unit() * (Vec3f(1) - p.lambertian);
      p.coverage = unit();
      p.gloss = static_cast<uint32_t>(i % 3);
      q.n = i % 2 ? direction() : Vec3f(0, i % 4 ? 1 : -1, 0);
      const auto side = [&](Vec3f w) { return dot(w, q.n) < 0 ? -w : w; };
      q.wo = side(direction());
      // By turns: anywhere, on its side, in the lobe.
      q.wi = i % 5 == 0 ? direction() : side(direction());
      if (i % 5 > 2) q.wi = side(glm::normalize(shared::reflected_direction(q.wo, q.n) + 0.05f * direction()));
      q.u = {unit(), unit(), unit()};
      all.push_back(q);
    }
  return all;
}

template <class Handle, class Create, class Info>
gpu::Owned<Handle> made(gpu::Device& device, Create create, const Info& info) {
  Handle handle{};
  EXPECT_EQ(create(device.handle(), &info, nullptr, &handle), VK_SUCCESS);
  return {device, handle};
}

std::vector<Answer> answers_of_device(gpu::Device& device, const std::vector<Question>& asked) {
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
  const auto set_layout = made<VkDescriptorSetLayout>(device, vkCreateDescriptorSetLayout, set_info);
  auto layout_info = gpu::vk_info<VkPipelineLayoutCreateInfo>(VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO);
  layout_info.setLayoutCount = 1;
  layout_info.pSetLayouts = set_layout.address();
  const auto layout = made<VkPipelineLayout>(device, vkCreatePipelineLayout, layout_info);
  auto module_info = gpu::vk_info<VkShaderModuleCreateInfo>(VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO);
  module_info.codeSize = sizeof every_bsdf_comp_spv;
  module_info.pCode = every_bsdf_comp_spv;
  const auto module = made<VkShaderModule>(device, vkCreateShaderModule, module_info);
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
  const auto pool = made<VkDescriptorPool>(device, vkCreateDescriptorPool, pool_info);
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

TEST(EveryBsdfOnTheDevice, AnswersAsOnTheProcessor) {
  auto device = gpu::Device::make({.validation = true});
  ASSERT_TRUE(device.ok()) << device.error().message;
  const std::vector<Question> asked = questions();
  const std::vector<Answer> answers = answers_of_device(**device, asked);
  for (uint32_t bsdf = 0; bsdf < bsdfs().size(); ++bsdf)
    for (const Field& field : kFields) {
      int compared = 0, other_choice = 0;
      double worst = 0;
      for (size_t i = 0; i < asked.size(); ++i) {
        if (asked[i].bsdf != bsdf) continue;
        const Answer here = answer(asked[i]);
        // Exponentials on the device: (3 + 2 |x|) ulp for e^x, and x up to -88 counts; roots and quotients 3 ulp.
        // Directions' rounding is magnified by a lobe's slope.
        const double share = 1e-5 + 1e-6 * std::sqrt(asked[i].parameters.smoothness);
        double off = 0;
        for (size_t k = field.first; k < field.first + field.count; ++k) {
          ASSERT_TRUE(std::isfinite(answers[i][k])) << bsdfs()[bsdf].name << ", " << field.name;
          off = std::max(off, std::abs(double{answers[i][k]} - here[k]) / (1e-5 + share * std::abs(here[k])));
        }
        ++compared;
        // Where a random number meets a threshold, or eta the critical angle, rounding may choose the other way.
        if (off > 100) {
          ++other_choice;
        } else {
          worst = std::max(worst, off);
        }
      }
      printf("  %-12s %-18s worst %.2f of the bound, %d of %d another choice\n", bsdfs()[bsdf].name.data(), field.name,
             worst, other_choice, compared);
      EXPECT_LE(worst, 1) << bsdfs()[bsdf].name << ", " << field.name;
      EXPECT_LE(other_choice, compared / 1000) << bsdfs()[bsdf].name << ", " << field.name;
    }
  EXPECT_EQ((*device)->messages(), std::vector<std::string>{});
}

}  // namespace
}  // namespace render
