#include "render/gpu/device.h"

#include <bit>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <xxhash.h>

#include "render/gpu/owned.h"
#include "render/raster/raster.h"
#include "tests/support.h"

namespace render::gpu {
namespace {

std::unique_ptr<Device> device() {
  auto made = Device::make({.validation = true});
  EXPECT_TRUE(made.ok()) << (made.ok() ? "" : made.error().message);
  return made.ok() ? std::move(*made) : nullptr;
}

/// Points the Vulkan loader at a driver file that does not exist.
class NoDriver {
 public:
  NoDriver() {
    setenv("VK_ICD_FILENAMES", "/nonexistent/driver.json", 1), setenv("VK_DRIVER_FILES", "/nonexistent/driver.json", 1);
  }
  ~NoDriver() { unsetenv("VK_ICD_FILENAMES"), unsetenv("VK_DRIVER_FILES"); }
};

TEST(Device, ThisMachineHasOneThatDraws) {
  const auto made = Device::make();
  ASSERT_TRUE(made.ok()) << made.error().message;
  EXPECT_FALSE((*made)->name().empty());
}

TEST(Device, NoDriverIsAnErrorThatNamesThePackage) {
  const NoDriver none;
  for (const bool validation : {false, true}) {
    const auto made = Device::make({.validation = validation});
    ASSERT_FALSE(made.ok());
    EXPECT_EQ(made.error().kind, world::ErrorKind::no_device);
    EXPECT_NE(made.error().message.find("mesa-vulkan-drivers"), std::string::npos) << made.error().message;
    EXPECT_EQ(made.error().message.find('\n'), std::string::npos);
  }
  EXPECT_EQ(make_raster_backend().error().kind, world::ErrorKind::no_device);
}

TEST(Device, ValidationHearsAMistake) {
  const auto d = device();
  ASSERT_TRUE(d);
  // Copying more than a buffer holds.
  auto small = make_buffer(*d, 64, VK_BUFFER_USAGE_TRANSFER_DST_BIT, MemoryUse::upload);
  auto large = make_buffer(*d, 256, VK_BUFFER_USAGE_TRANSFER_SRC_BIT, MemoryUse::upload);
  ASSERT_TRUE(small.ok() && large.ok());
  auto unused = d->run([&](VkCommandBuffer commands) {
    const VkBufferCopy copy{0, 0, 64};
    vkCmdCopyBuffer(commands, small->handle, small->handle, 1, &copy);  // neither usage nor overlap allow it
  });
  EXPECT_FALSE(d->messages().empty());
}

TEST(Device, SynchronizationValidationHearsAMissingBarrier) {
  const auto d = device();
  ASSERT_TRUE(d);
  constexpr VkBufferUsageFlags kBoth = VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT;
  auto a = make_buffer(*d, 64, kBoth, MemoryUse::device), b = make_buffer(*d, 64, kBoth, MemoryUse::device);
  ASSERT_TRUE(a.ok() && b.ok());
  auto unused = d->run([&](VkCommandBuffer commands) {
    const VkBufferCopy copy{0, 0, 64};
    vkCmdCopyBuffer(commands, a->handle, b->handle, 1, &copy);
    vkCmdCopyBuffer(commands, b->handle, a->handle, 1, &copy);
  });
  ASSERT_FALSE(d->messages().empty());
  EXPECT_NE(d->messages()[0].find("SYNC-HAZARD"), std::string::npos) << d->messages()[0];
}

TEST(DeviceMemory, RangesDontOverlapAndReturn) {
  const auto d = device();
  ASSERT_TRUE(d);
  {
    std::vector<Buffer> buffers;
    for (int i = 0; i < 200; ++i) {
      auto made = make_buffer(*d, 1000 + static_cast<VkDeviceSize>(i * 37), VK_BUFFER_USAGE_STORAGE_BUFFER_BIT,
                              MemoryUse::upload);
      ASSERT_TRUE(made.ok());
      if (i % 3 == 2) buffers.erase(buffers.begin() + i / 3);
      buffers.push_back(std::move(*made));
    }
    for (size_t i = 0; i < buffers.size(); ++i)
      for (size_t j = 0; j < i; ++j) {
        const MemoryRange &a = buffers[i].memory.range(), &b = buffers[j].memory.range();
        EXPECT_TRUE(a.block != b.block || a.offset + a.size <= b.offset || b.offset + b.size <= a.offset);
      }
  }
  ASSERT_TRUE(d->run([](VkCommandBuffer) {}).ok());
  EXPECT_EQ(d->memory().bytes_used(), 0u);
  EXPECT_EQ(d->messages(), std::vector<std::string>{});
}

TEST(HardCaseR13, OutOfDeviceMemoryIsAnErrorAndTheDeviceGoesOn) {
  const auto d = device();
  ASSERT_TRUE(d);
  d->memory().limit = 1 << 20;
  EXPECT_FALSE(make_buffer(*d, 2 << 20, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, MemoryUse::device).ok());
  EXPECT_TRUE(make_buffer(*d, 1 << 16, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, MemoryUse::device).ok());
  EXPECT_TRUE(d->run([](VkCommandBuffer) {}).ok());
  EXPECT_EQ(d->messages(), std::vector<std::string>{});
}

/// Sends values through a blit from a float image to one of 8 bits: the device's own conversion.
std::vector<uint8_t> unorm8_on_device(Device& d, const std::vector<float>& values) {
  const uint32_t count = static_cast<uint32_t>(values.size());
  const VkExtent2D extent{count, 1};
  auto from = make_image(d, extent, VK_FORMAT_R32G32B32A32_SFLOAT,
                         VK_IMAGE_USAGE_TRANSFER_SRC_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT | VK_IMAGE_USAGE_SAMPLED_BIT,
                         VK_IMAGE_ASPECT_COLOR_BIT);
  auto to = make_image(
      d, extent, VK_FORMAT_R8G8B8A8_UNORM,
      VK_IMAGE_USAGE_TRANSFER_SRC_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT | VK_IMAGE_USAGE_COLOR_ATTACHMENT_BIT,
      VK_IMAGE_ASPECT_COLOR_BIT);
  auto in = make_buffer(d, count * 16, VK_BUFFER_USAGE_TRANSFER_SRC_BIT, MemoryUse::upload);
  auto out = make_buffer(d, count * 4, VK_BUFFER_USAGE_TRANSFER_DST_BIT, MemoryUse::readback);
  EXPECT_TRUE(from.ok() && to.ok() && in.ok() && out.ok());
  auto* texels = reinterpret_cast<float*>(in->mapped());
  for (uint32_t i = 0; i < count; ++i)
    for (uint32_t c = 0; c < 4; ++c) texels[4 * i + c] = values[i];
  const auto barrier = [](VkCommandBuffer commands, VkImage image, VkImageLayout old) {
    auto info = vk_info<VkImageMemoryBarrier2>(VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER_2);
    info.srcStageMask = info.dstStageMask = VK_PIPELINE_STAGE_2_ALL_TRANSFER_BIT;
    info.srcAccessMask = VK_ACCESS_2_TRANSFER_WRITE_BIT;
    info.dstAccessMask = VK_ACCESS_2_TRANSFER_WRITE_BIT | VK_ACCESS_2_TRANSFER_READ_BIT;
    info.oldLayout = old;
    info.newLayout = VK_IMAGE_LAYOUT_GENERAL;
    info.image = image;
    info.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
    auto dependency = vk_info<VkDependencyInfo>(VK_STRUCTURE_TYPE_DEPENDENCY_INFO);
    dependency.imageMemoryBarrierCount = 1;
    dependency.pImageMemoryBarriers = &info;
    vkCmdPipelineBarrier2(commands, &dependency);
  };
  EXPECT_TRUE(d.run([&](VkCommandBuffer commands) {
                 barrier(commands, from->handle, VK_IMAGE_LAYOUT_UNDEFINED);
                 barrier(commands, to->handle, VK_IMAGE_LAYOUT_UNDEFINED);
                 VkBufferImageCopy copy{};
                 copy.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
                 copy.imageExtent = {count, 1, 1};
                 vkCmdCopyBufferToImage(commands, in->handle, from->handle, VK_IMAGE_LAYOUT_GENERAL, 1, &copy);
                 barrier(commands, from->handle, VK_IMAGE_LAYOUT_GENERAL);
                 VkImageBlit blit{};
                 blit.srcSubresource = blit.dstSubresource = copy.imageSubresource;
                 blit.srcOffsets[1] = blit.dstOffsets[1] = {static_cast<int32_t>(count), 1, 1};
                 vkCmdBlitImage(commands, from->handle, VK_IMAGE_LAYOUT_GENERAL, to->handle, VK_IMAGE_LAYOUT_GENERAL, 1,
                                &blit, VK_FILTER_NEAREST);
                 barrier(commands, to->handle, VK_IMAGE_LAYOUT_GENERAL);
                 vkCmdCopyImageToBuffer(commands, to->handle, VK_IMAGE_LAYOUT_GENERAL, out->handle, 1, &copy);
               }).ok());
  std::vector<uint8_t> codes(count);
  for (uint32_t i = 0; i < count; ++i) codes[i] = static_cast<uint8_t>(out->mapped()[4 * i]);
  return codes;
}

TEST(HardCaseN2, UnormOnTheDeviceEqualsTheProcessorsAtCodesAndIsANeighbourAtHalves) {
  const auto d = device();
  ASSERT_TRUE(d);
  std::vector<float> exact, halves;
  for (int k = 0; k < 256; ++k) {
    exact.push_back(static_cast<float>(k) / 255.0f);
    halves.push_back((static_cast<float>(k) + 0.5f) / 255.0f);
  }
  const std::vector<uint8_t> at_codes = unorm8_on_device(*d, exact), at_halves = unorm8_on_device(*d, halves);
  for (int k = 0; k < 256; ++k) {
    EXPECT_EQ(at_codes[static_cast<size_t>(k)], k);
    const int expected = std::min(255, static_cast<int>(std::floor(halves[static_cast<size_t>(k)] * 255 + 0.5f)));
    EXPECT_LE(std::abs(at_halves[static_cast<size_t>(k)] - expected), 1) << k;
  }
  EXPECT_EQ(d->messages(), std::vector<std::string>{});
}

std::string read_all(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(PipelineCache, ABrokenOrForeignFileIsLeftOutWithOneWarningAndReplaced) {
  const world::TemporaryFolder folder;
  const auto open = [&] { return Device::make({.cache_folder = folder / "cache"}); };
  const auto file = [&]() -> std::filesystem::path {
    for (const auto& entry : std::filesystem::directory_iterator(folder / "cache")) return entry.path();
    return {};
  };
  {
    const auto first = open();
    ASSERT_TRUE(first.ok());
    EXPECT_TRUE((*first)->warnings().empty());
  }
  const std::string whole = read_all(file());
  ASSERT_GE(whole.size(), 64u);
  {
    const auto again = open();
    EXPECT_TRUE((*again)->warnings().empty());
  }
  EXPECT_EQ(read_all(file()), whole);
  std::vector<std::string> broken{"", "x", std::string(1000, 'x'), whole.substr(0, whole.size() - 1), whole + "x"};
  for (const size_t at : {size_t{0}, size_t{9}, size_t{17}, size_t{25}, whole.size() - 1}) {
    broken.push_back(whole);
    broken.back()[at] ^= 0x40;
  }
  for (const std::string& bytes : broken) {
    std::ofstream(file(), std::ios::binary) << bytes;
    {
      const auto device = open();
      ASSERT_TRUE(device.ok());
      ASSERT_EQ((*device)->warnings().size(), 1u) << bytes.size();
      EXPECT_NE((*device)->warnings()[0].find("left out"), std::string::npos) << (*device)->warnings()[0];
    }
    EXPECT_EQ(read_all(file()), whole) << "a broken cache is replaced by a whole one";
  }
  // Whole by its hash, but of another driver: the UUID is in the driver's own header.
  std::string foreign = whole;
  foreign[32 + 16] ^= 1;
  const uint64_t hash = XXH64(foreign.data() + 32, foreign.size() - 32, 0);
  std::memcpy(foreign.data() + 24, &hash, sizeof hash);
  std::ofstream(file(), std::ios::binary) << foreign;
  const auto device = open();
  ASSERT_EQ((*device)->warnings().size(), 1u);
  EXPECT_NE((*device)->warnings()[0].find("another driver"), std::string::npos) << (*device)->warnings()[0];
}

TEST(PipelineCache, AFolderThatCannotBeWrittenIsNoFault) {
  const auto made = Device::make({.cache_folder = "/proc/nowhere"});
  ASSERT_TRUE(made.ok());
  EXPECT_TRUE((*made)->warnings().empty());
}

/// A module of nothing but a capability and a memory model, as glslang would begin one.
const std::vector<uint32_t> kLeastModule{0x07230203, 0x00010000, 0, 1, 0, 0x00020011, 1, 0x0003000e, 0, 1};

TEST(ShaderCache, WhatWasMadeIsFoundAgainByModuleAndConstants) {
  const world::TemporaryFolder folder;
  const SpecialConstant one[] = {{3, 1}}, two[] = {{3, 2}};
  ShaderCache first;
  first.open(folder / "cache");
  const auto made = first.specialised(kLeastModule, one);
  EXPECT_EQ(made, specialise(kLeastModule, one));
  EXPECT_EQ(first.specialised(kLeastModule, one), made);
  EXPECT_EQ(first.made(), 1u);
  EXPECT_EQ(first.found(), 1u);
  ShaderCache again;
  again.open(folder / "cache");
  EXPECT_EQ(again.specialised(kLeastModule, one), made);
  EXPECT_EQ(again.made(), 0u);
  again.specialised(kLeastModule, two);
  EXPECT_EQ(again.made(), 1u);
  ShaderCache nowhere;
  nowhere.open({});
  nowhere.specialised(kLeastModule, one), nowhere.specialised(kLeastModule, one);
  EXPECT_EQ(nowhere.made(), 2u);
}

TEST(ShaderCache, ABrokenFileIsMadeAnewWithOneWarningAndAFolderThatCannotBeWrittenIsNoFault) {
  const world::TemporaryFolder folder;
  ShaderCache cache;
  cache.open(folder / "cache");
  const auto made = cache.specialised(kLeastModule, {});
  std::filesystem::path file;
  for (const auto& entry : std::filesystem::directory_iterator(folder / "cache" / "shaders")) file = entry.path();
  const std::string whole = read_all(file);
  ASSERT_EQ(whole.size(), 24 + made.size() * 4);
  std::vector<std::string> broken{"", "x", std::string(1000, 'x'), whole.substr(0, whole.size() - 1), whole + "x"};
  for (const size_t at : {size_t{0}, size_t{9}, size_t{13}, size_t{17}, whole.size() - 1}) {
    broken.push_back(whole);
    broken.back()[at] ^= 0x40;
  }
  EXPECT_EQ(cache.warning(), "");
  for (const std::string& bytes : broken) {
    std::ofstream(file, std::ios::binary) << bytes;
    ShaderCache next;
    next.open(folder / "cache");
    EXPECT_EQ(next.specialised(kLeastModule, {}), made);
    EXPECT_EQ(next.warning(), "the kept shader " + file.string() + " was damaged, and is made anew");
    EXPECT_EQ(next.specialised(kLeastModule, {}), made);
    EXPECT_EQ(next.found(), 1u) << "once";
    std::ofstream(file, std::ios::binary) << bytes;
    const size_t before = cache.made();
    EXPECT_EQ(cache.specialised(kLeastModule, {}), made);
    EXPECT_EQ(cache.made(), before + 1);
    EXPECT_EQ(read_all(file), whole);
  }
  EXPECT_EQ(cache.warning(), fmt::format("{} kept shaders in {} were damaged, and are made anew", broken.size(),
                                         (folder / "cache" / "shaders").string()));
  cache.open("/proc/nowhere");
  EXPECT_EQ(cache.specialised(kLeastModule, {}), made);
}

TEST(ShaderCache, WhatWasDamagedIsAWarningOfThePicture) {
  const world::TemporaryFolder folder;
  const world::World w(world::standard_blocks());
  const auto draw = [&] {
    gpu::DeviceOptions options;
    options.cache_folder = folder / "cache";
    auto raster = make_raster(options);
    EXPECT_TRUE(raster.ok());
    auto frame = (*raster)->render(world::WorldView(w), Camera{}, {}, 8, 8);
    EXPECT_TRUE(frame.ok());
    return frame.ok() ? std::move(*frame) : Frame{};
  };
  const Frame first = draw();
  EXPECT_EQ(first.report.warnings, std::vector<std::string>{});
  const std::filesystem::path shaders = folder / "cache" / "shaders";
  ASSERT_FALSE(std::filesystem::is_empty(shaders));
  for (const auto& entry : std::filesystem::directory_iterator(shaders)) std::filesystem::resize_file(entry.path(), 30);
  const Frame again = draw();
  ASSERT_EQ(again.report.warnings.size(), 1u);
  EXPECT_NE(again.report.warnings[0].find("made anew"), std::string::npos) << again.report.warnings[0];
  EXPECT_EQ(std::memcmp(again.image.pixels.data(), first.image.pixels.data(), 64 * sizeof(Rgb)), 0);
  EXPECT_EQ(draw().report.warnings, std::vector<std::string>{});
}

TEST(ShaderCache, TheOldestGoWhereThereAreTooMany) {
  const world::TemporaryFolder folder;
  std::filesystem::create_directories(folder / "cache" / "shaders");
  for (size_t i = 0; i < ShaderCache::kMostFiles; ++i)
    std::ofstream(folder / "cache" / "shaders" / (std::to_string(i) + ".spv")) << "x";
  ShaderCache cache;
  cache.open(folder / "cache");
  cache.specialised(kLeastModule, {});
  const std::filesystem::directory_iterator left(folder / "cache" / "shaders");
  EXPECT_EQ(static_cast<size_t>(std::distance(begin(left), end(left))), ShaderCache::kMostFiles * 3 / 4 + 1);
  cache.specialised(kLeastModule, {});
  EXPECT_EQ(cache.found(), 1u);
}

TEST(Device, AMissingOptionalFeatureIsNamedAndDoneWithout) {
  const auto made = Device::make({.validation = true, .without = {"multiDrawIndirect"}});
  ASSERT_TRUE(made.ok());
  ASSERT_EQ((*made)->warnings().size(), 1u);
  EXPECT_NE((*made)->warnings()[0].find("multiDrawIndirect"), std::string::npos);
  EXPECT_EQ((*made)->limits().maxDrawIndirectCount, 1u);
}

TEST(Device, OnlyAProcessorIsAskedForAtomicNumbersOf64Bits) {
  const auto with = Device::make({.validation = true}),
             without = Device::make({.validation = true, .without = {"shaderBufferInt64Atomics"}});
  ASSERT_TRUE(with.ok() && without.ok());
  const bool asked = (*with)->is_processor();
  EXPECT_FALSE((*with)->has_atomic64() && !asked);
  EXPECT_FALSE((*without)->has_atomic64());
  EXPECT_EQ((*without)->warnings().size(), (*with)->warnings().size() + ((*with)->has_atomic64() ? 1 : 0));
}

}  // namespace
}  // namespace render::gpu
