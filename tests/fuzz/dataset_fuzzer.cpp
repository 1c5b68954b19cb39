// Hostile datasets. An input is index.bin, nodes.bin and metadata.json one behind the other; the index tells where it and
// the nodes end. It is opened as it is, then once more with all checksums put right, as an attacker would.
#include <algorithm>
#include <vector>

#include "formats/bytes.h"
#include "formats/checksum.h"
#include "formats/dataset/dataset_reader.h"
#include "formats/dataset/metadata.h"
#include "stages/export.h"
#include "stages/verify/verify.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/memory_file.h"
#include "tests/support/dataset_uses.h"
#include "tests/support/temporary_folder.h"

namespace cairn::fuzz {
namespace {

using namespace formats;

using Bytes = std::vector<std::byte>;

struct Files {
  Bytes index, nodes, metadata;
};

/// The number at `offset`, 0 where the bytes end before.
template <typename T>
T number_at(std::span<const std::byte> bytes, std::size_t offset) {
  return offset + sizeof(T) <= bytes.size() ? load_le<T>(bytes.data() + offset) : 0;
}

Files split(std::span<const std::byte> bytes) {
  const auto take = [&bytes](std::uint64_t size) {
    const auto part =
        bytes.first(static_cast<std::size_t>(std::min<std::uint64_t>(size, bytes.size())));
    bytes = bytes.subspan(part.size());
    return Bytes(part.begin(), part.end());
  };
  const auto index = number_at<std::uint64_t>(bytes, 24);
  const auto nodes = number_at<std::uint64_t>(bytes, 32);
  return {take(index), take(nodes), take(bytes.size())};
}

/// Puts the checksums of a record's sections right.
void repair_record(std::span<const std::byte> index, std::span<std::byte> record,
                   std::span<const std::byte> nodes) {
  const auto fanout = number_at<std::uint32_t>(index, 184);
  const std::uint64_t begin = 168 + (4 * (std::uint64_t{fanout} + 1) + 7) / 8 * 8;
  const std::uint64_t sections = 4 + std::uint64_t{number_at<std::uint32_t>(index, 196)};
  for (std::uint64_t at = begin; at < begin + 24 * sections && at + 24 <= record.size(); at += 24) {
    const auto offset = number_at<std::uint64_t>(record, at);
    const auto size = number_at<std::uint32_t>(record, at + 8);
    if (size != 0 && size <= nodes.size() && offset <= nodes.size() - size)
      store_le(record.data() + at + 16, checksum_of(nodes.subspan(offset, size)));
  }
}

/// Puts all checksums and sizes right, by the layout that the index claims; false if it claims one that it has no room
/// for. The offsets are those of formats/FORMAT.md.
bool repair(Files& files) {
  const std::span<std::byte> index = files.index;
  const std::uint64_t head = number_at<std::uint32_t>(index, 12);
  const std::uint64_t nodes = number_at<std::uint64_t>(index, 56);
  const std::uint64_t record = number_at<std::uint32_t>(index, 64);
  const std::uint64_t page = record * number_at<std::uint32_t>(index, 68);
  if (head < kIndexFixedBytes || page == 0 || nodes > index.size()) return false;
  const std::uint64_t pages = (nodes * record + page - 1) / page;
  const std::uint64_t begin = head + 8 * pages;
  if (begin > index.size() || nodes * record > index.size() - begin) return false;

  store_le<std::uint64_t>(&index[24], files.index.size());
  store_le<std::uint64_t>(&index[32], files.nodes.size());
  store_le<std::uint64_t>(&index[40], files.metadata.size());
  store_le(&index[48], checksum_of(files.metadata));
  for (std::uint64_t i = 0; i < nodes; ++i)
    repair_record(index, index.subspan(begin + i * record, record), files.nodes);
  for (std::uint64_t p = 0; p < pages; ++p)
    store_le(
        &index[head + 8 * p],
        checksum_of(index.subspan(begin + p * page, std::min(page, nodes * record - p * page))));
  store_le(&index[16], checksum_of(index.subspan(24, begin - 24)));
  return true;
}

/// A dataset in memory.
class MemoryDataset {
 public:
  const std::filesystem::path& path() const { return folder_.path(); }
  void assign(const Files& files) const {
    index_.assign(files.index);
    nodes_.assign(files.nodes);
    metadata_.assign(files.metadata);
  }

 private:
  struct Part : MemoryFile {
    explicit Part(const std::filesystem::path& name) { link(name); }
  };
  test::TemporaryFolder folder_;
  Part index_{folder_ / dataset_file::kIndex};
  Part nodes_{folder_ / dataset_file::kNodes};
  Part metadata_{folder_ / dataset_file::kMetadata};
};

/// Takes what is exported and drops it.
struct NoWriter : ScanWriter {
  void write(const PointBlock& block) override { points += block.count; }
  void finish() override {}
  std::uint64_t points = 0;
};

void export_all(const DatasetReader& dataset) {
  for (Level level = 0; level <= dataset.tree().leaf_level(); ++level)
    for (const bool steps : {false, true})
      accepts({ErrorKind::kInput}, [&] {
        const auto selection = stages::level_selection(dataset, level);
        const ScanInfo info = stages::describe_export(dataset, selection, steps);
        NoWriter writer;
        require(stages::export_points({}, dataset, selection, info, writer) == writer.points);
      });
}

void explore(const std::filesystem::path& path) {
  const DatasetReader dataset = DatasetReader::open(path);
  std::vector<VariableLengthRecord> crs;
  (void)check_metadata(dataset.metadata(), dataset.header());
  (void)read_metadata_crs(dataset.metadata(), crs);
  for (std::uint64_t id = 0; id < dataset.tree().node_count(); ++id)
    accepts({ErrorKind::kInput}, [&] { dataset.read_node(NodeId{id}, all_sections()); });
  accepts({ErrorKind::kInput}, [&] { stages::verify_dataset({}, dataset, std::nullopt); });
  accepts({ErrorKind::kInput}, [&] { test::tell_dataset(dataset, path); });
  accepts({ErrorKind::kInput, ErrorKind::kUsage}, [&] { test::draw_dataset(dataset); });
  export_all(dataset);
}

}  // namespace

void run(std::span<const std::byte> bytes) {
  static const MemoryDataset dataset;
  Files files = split(bytes);
  dataset.assign(files);
  accepts({ErrorKind::kInput}, [&] { explore(dataset.path()); });
  if (!repair(files)) return;
  dataset.assign(files);
  accepts({ErrorKind::kInput}, [&] { explore(dataset.path()); });
}

}  // namespace cairn::fuzz
