// Hostile scans: whatever the bytes, a scan is read whole or refused.
#include <array>
#include <string>
#include <vector>

#include "formats/scans/crs.h"
#include "formats/scans/crs_facts.h"
#include "formats/scans/laz/laz_reader.h"
#include "formats/scans/scan_reader.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/memory_file.h"
#include "tests/support/temporary_folder.h"

namespace cairn::fuzz {
namespace {

using namespace formats;

/// The file under names whose suffixes decide where the content does not.
class NamedFile : public MemoryFile {
 public:
  NamedFile() {
    for (const char* name : {"scan", "scan.xyz", "scan.pts", "scan.ptx", "scan.pcd"})
      names_.push_back(link(folder_ / name));
  }
  const std::filesystem::path& name(std::size_t choice) const {
    return names_[choice % names_.size()];
  }

 private:
  test::TemporaryFolder folder_;
  std::vector<std::filesystem::path> names_;
};

/// All that is read of LAZ before its chunks are decoded. That is done by worker processes, into which libFuzzer does not
/// see, and of which a damaged chunk ends one: ten executions a second. The tests of LazReader damage chunks.
void check_chunks(const std::filesystem::path& path, bool allow_truncated) {
  const RandomAccessFile file(path);
  const LasHeader header = read_las_header(file);
  const LazEncoding encoding = read_laszip_record(file, header);
  const LazChunks chunks = read_chunk_table(file, header, encoding, allow_truncated);
  require(chunks.end <= file.size_bytes());
  if (encoding.layered)
    for (const LazChunk& chunk : chunks.chunks) check_layered_chunk(file, header, encoding, chunk);
}

void read_scan(const ScanReader& reader) {
  std::uint64_t capacity = 0;
  for (std::size_t stretch = 0; stretch < reader.stretch_count(); ++stretch) {
    std::uint64_t records = 0;
    reader.read(stretch,
                [&](const PointBlock& block) { records += block.count + block.no_return; });
    require(records <= reader.stretch_capacity(stretch));
    capacity += reader.stretch_capacity(stretch);
  }
  require(capacity == reader.info().present_points);
}

void read_all(const std::filesystem::path& path, const ScanOptions& options) {
  for (const auto& reader : open_scans(path, options)) {
    const std::string text = crs_text(reader->info().crs);
    require(text.empty() || !crs_of_comment(std::string(kCrsComment) + text).empty());
    compare_crs(reader->info().crs, crs_of_comment(std::string(kCrsComment) + text));
    if (dynamic_cast<const LazReader*>(reader.get()) != nullptr)
      check_chunks(path, options.allow_truncated);
    else
      read_scan(*reader);
  }
}

}  // namespace

/// The size chooses name and columns, so that real scans are seeds as they are.
void run(std::span<const std::byte> bytes) {
  static const NamedFile file;
  file.assign(bytes);
  ScanOptions options;
  if (bytes.size() / 5 % 2 != 0) options.columns = {"x", "y", "z", "_", "red", "green", "blue"};
  for (const bool allow_truncated : {false, true}) {
    options.allow_truncated = allow_truncated;
    accepts({ErrorKind::kInput}, [&] { read_all(file.name(bytes.size()), options); });
  }
}

}  // namespace cairn::fuzz
