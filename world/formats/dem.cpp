// USGS Digital Elevation Models; the parser is in world/formats/heights/dem.cpp.
#include "world/base/file.h"
#include "world/formats/heights/dem.h"

namespace world {

const Format& dem_format() {
  static const Format format = {
      .name = "dem",
      .extensions = {".dem"},
      .what = "USGS elevation, ASCII",
      .recognizes = nullptr,
      .read = [](const std::filesystem::path& path, const ImportOptions& options,
                 ImportReport& report) -> Result<World> {
        TRY(const std::vector<uint8_t> bytes, read_file(path, uint64_t{1} << 30));
        TRY(const DemFile dem, parse_dem(bytes, path.string()));
        return world_from_dem(dem, path.string(), options, report);
      },
      .write = nullptr,
  };
  return format;
}

}  // namespace world
