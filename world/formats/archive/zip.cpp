#include "world/formats/archive/zip.h"

#include <libdeflate.h>

#include <algorithm>
#include <memory>

#include "world/formats/bytes.h"

namespace world {
namespace {

constexpr uint32_t kEndSignature = 0x06054b50, kDirectorySignature = 0x02014b50, kLocalSignature = 0x04034b50;
constexpr size_t kEndBytes = 22, kMaxComment = 65535, kDirectoryBytes = 46;

/// Raw deflate of exactly out.size() bytes; false on any difference.
bool inflate_exactly(std::span<const uint8_t> packed, std::span<uint8_t> out) {
  const std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)> inflater(
      libdeflate_alloc_decompressor(), libdeflate_free_decompressor);
  return inflater && libdeflate_deflate_decompress(inflater.get(), packed.data(), packed.size(), out.data(), out.size(),
                                                   nullptr) == LIBDEFLATE_SUCCESS;
}

}  // namespace

Result<std::vector<ZipEntry>> list_zip(std::span<const uint8_t> bytes, std::string_view file) {
  // The end record is the last thing in the file but for a comment.
  if (bytes.size() < kEndBytes) return byte_error(file, bytes.size(), "the file is too short for a zip archive");
  size_t end = bytes.size() - kEndBytes;
  const size_t first = end > kMaxComment ? end - kMaxComment : 0;
  const auto is_end = [&](size_t at) { return ByteReader(bytes.subspan(at), file).u32_le() == kEndSignature; };
  while (end > first && !is_end(end)) --end;
  if (!is_end(end)) {
    return byte_error(file, bytes.size(),
                      "no end record of a zip archive was found; it is no .zip, or damaged or cut off");
  }
  ByteReader in(bytes.subspan(end), file, end);
  in.bytes(4);
  const uint16_t disk = in.u16_le(), directory_disk = in.u16_le(), entries_here = in.u16_le(), entries = in.u16_le();
  const uint32_t directory_size = in.u32_le(), directory_offset = in.u32_le();
  if (disk != 0 || directory_disk != 0 || entries_here != entries || directory_offset == UINT32_MAX) {
    return byte_error(file, end, "archives of several disks, or beyond 4 GiB, are not read");
  }
  if (uint64_t{directory_offset} + directory_size > end) {
    return byte_error(file, end, "the directory of the archive lies outside of the file");
  }
  ByteReader directory(bytes.subspan(directory_offset, directory_size), file, directory_offset);
  if (size_t{entries} * kDirectoryBytes > directory_size) {
    return byte_error(file, end, "the archive announces more entries than its directory can hold");
  }
  std::vector<ZipEntry> list;
  for (int i = 0; i < entries; ++i) {
    const uint64_t start = directory.offset();
    if (directory.u32_le() != kDirectorySignature)
      return byte_error(file, start, "expected an entry of the archive's directory");
    ZipEntry entry;
    directory.bytes(4);  // versions
    entry.flags = directory.u16_le();
    entry.method = directory.u16_le();
    directory.bytes(4);  // time
    entry.crc = directory.u32_le();
    entry.packed_size = directory.u32_le();
    entry.size = directory.u32_le();
    const size_t name = directory.u16_le(), extra = directory.u16_le(), comment = directory.u16_le();
    directory.bytes(8);  // disk, attributes
    entry.header_offset = directory.u32_le();
    const auto text = directory.bytes(name);
    directory.bytes(extra + comment);
    if (directory.failed()) return directory.end_error("the directory of the archive");
    entry.name.assign(text.begin(), text.end());
    list.push_back(std::move(entry));
  }
  return list;
}

Result<std::vector<uint8_t>> extract_zip(std::span<const uint8_t> bytes, const ZipEntry& entry, uint64_t limit,
                                         std::string_view file) {
  const uint64_t at = entry.header_offset;
  const auto fail = [&](std::string_view what) { return byte_error(file, at, what); };
  if (entry.flags & 1) return fail("the entry of the archive is encrypted; unpack it first");
  if (entry.method != 0 && entry.method != 8) {
    return fail(
        fmt::format("the compression method {} is not read; pack with deflate, or unpack it first", entry.method));
  }
  if (entry.size > limit)
    return fail(fmt::format("the entry claims {} bytes, more than the {} expected", entry.size, limit));
  if (at > bytes.size()) return fail("the entry lies outside of the file");
  ByteReader in(bytes.subspan(at), file, at);
  if (in.u32_le() != kLocalSignature) return fail("expected the head of an entry of the archive");
  in.bytes(22);
  const size_t name = in.u16_le(), extra = in.u16_le();
  in.bytes(name + extra);
  const auto packed = in.bytes(entry.packed_size);
  if (in.failed()) return in.end_error("an entry of the archive");
  std::vector<uint8_t> content(entry.size);
  if (entry.method == 0) {
    if (packed.size() != content.size()) return fail("a stored entry has two different sizes");
    std::copy(packed.begin(), packed.end(), content.begin());
  } else if (!inflate_exactly(packed, content)) {
    return fail("the compressed data of the entry are damaged, or don't have the size that it claims");
  }
  if (libdeflate_crc32(0, content.data(), content.size()) != entry.crc) {
    return fail("the checksum (CRC) of the entry does not match its content; the file is damaged");
  }
  return content;
}

}  // namespace world
