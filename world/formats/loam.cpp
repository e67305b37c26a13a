// Loam's own save as a format: whole worlds in and out. What the file holds is world/saves/save_file.h's.
#include "world/formats/format.h"
#include "world/saves/session.h"

namespace world {

namespace {

Result<World> read_loam(const std::filesystem::path& path, const ImportOptions&, ImportReport& report) {
  TRY(const auto file, SaveFile::open(path, SaveFile::Access::read));
  report.fact("save version", std::to_string(file->version()));
  if (file->version() > 1) report.fact("saves so far", std::to_string(file->save_number()));
  return file->read_all();
}

Status write_loam(const World& world, const std::filesystem::path& path) {
  return write_new_save(world, path, kSmallPayload);
}

}  // namespace

const Format& loam_format() {
  static const Format format = [] {
    Format f;
    f.name = "loam";
    f.extensions = {".loam"};
    f.what = "Loam's own save: SQLite, a row a 128^3 region";
    f.recognizes = [](const std::vector<uint8_t>& head) {
      static constexpr std::string_view magic = "SQLite format 3";
      return std::equal(magic.begin(), magic.end(), head.begin(), head.begin() + std::min(head.size(), magic.size()));
    };
    f.read = read_loam;
    f.write = write_loam;
    return f;
  }();
  return format;
}

}  // namespace world
