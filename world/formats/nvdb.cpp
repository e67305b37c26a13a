// NanoVDB .nvdb -> world, and back: as .vdb, see vdb.cpp; the grids become OpenVDB's first (world/formats/vdb/nano_*).
#include "world/base/file.h"
#include "world/formats/vdb/nvdb.h"

namespace world {

const Format& nvdb_format() {
  static const Format format = {
      .name = "nvdb",
      .extensions = {".nvdb"},
      .what = "NanoVDB grids, uncompressed, zip and Blosc; writes block ids with their palette",
      .recognizes =
          [](const std::vector<uint8_t>& head) {
            return head.size() >= 8 && std::string_view(reinterpret_cast<const char*>(head.data()), 7) == "NanoVDB";
          },
      .read = [](const std::filesystem::path& path, const ImportOptions& options,
                 ImportReport& report) -> Result<World> {
        TRY(const std::vector<uint8_t> bytes, read_file(path, uint64_t{1} << 33));
        return world_from_nvdb(bytes, path.string(), report, options);
      },
      .write = write_nvdb,
      .losses = lost_surroundings,
  };
  return format;
}

}  // namespace world
