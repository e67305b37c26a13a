/// What reading and writing of .nvdb share. Internal to world/formats/vdb.
#pragma once

namespace world::vdb {

/// The blind data that hold a grid's text metadata: "key\0value\0" each. NanoVDB's grids have no metadata of their own.
constexpr const char* kTextBlindData = "loam_text";

}  // namespace world::vdb
