#include "render/gpu/specialise.h"

#include <unordered_map>

#include <spirv-tools/optimizer.hpp>

namespace render::gpu {

std::vector<uint32_t> specialise(std::span<const uint32_t> code, std::span<const SpecialConstant> constants) {
  std::unordered_map<uint32_t, std::vector<uint32_t>> values;
  for (const SpecialConstant& c : constants) values[c.id] = {c.value};
  spvtools::Optimizer optimizer(SPV_ENV_VULKAN_1_3);
  optimizer.SetMessageConsumer([](auto...) {});
  optimizer.RegisterPass(spvtools::CreateSetSpecConstantDefaultValuePass(values))
      .RegisterPass(spvtools::CreateFreezeSpecConstantValuePass())
      .RegisterPass(spvtools::CreateFoldSpecConstantOpAndCompositePass());
  // What a branch leaves may decide another. Blocks stay unmerged: merging those of version 2023.1 breaks a loop of the
  // light's table.
  for (int round = 0; round < 2; ++round) optimizer.RegisterPass(spvtools::CreateDeadBranchElimPass());
  optimizer.RegisterPass(spvtools::CreateEliminateDeadFunctionsPass());
  spvtools::OptimizerOptions options;
  options.set_run_validator(false);
  std::vector<uint32_t> out;
  if (!optimizer.Run(code.data(), code.size(), &out, options) || out.empty()) return {code.begin(), code.end()};
  return out;
}

}  // namespace render::gpu
