/// Sources from text, sampled into a store of their own.
#pragma once

#include <gtest/gtest.h>

#include "world/sources/source.h"

namespace world {

/// The only [[source]] of the text; block is "stone".
inline Result<SourceInstance> source_from(const std::string& keys) {
  TRY(TomlDocument document, TomlDocument::parse("[[source]]\nblock = \"stone\"\n" + keys, "test.toml"));
  TomlTable root = document.root();
  SourceInstance source;
  for (TomlTable table : root.array_of_tables("source")) source = read_source(table, {}, {});
  TRY_STATUS(document.finish());
  return source;
}

struct Sampled {
  Store store{standard_blocks()};
  SamplingReport report;
  uint64_t voxels() const { return store.voxel_count(); }
};

inline Result<Sampled> sample(const SourceInstance& source) {
  Sampled out;
  TRY(out.report, sample_shape(out.store, *source.shape, source.placement, source.sampling,
                               *standard_blocks().find("stone"), source.clip ? &*source.clip : nullptr));
  return out;
}
inline Result<Sampled> sample(const std::string& keys) {
  TRY(const SourceInstance source, source_from(keys));
  return sample(source);
}

}  // namespace world
