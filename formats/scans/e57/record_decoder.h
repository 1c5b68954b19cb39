// Decodes records of an E57 scan, stream by stream, into blocks of points.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "formats/point_block.h"
#include "formats/scans/e57/packets.h"
#include "formats/scans/e57/record_plan.h"

namespace cairn::formats {

/// What all stretches of a scan share.
struct E57Records {
  std::vector<E57Field> fields;
  E57Plan plan;
  Schema schema;
  PositionEncoding encoding = PositionEncoding::kFloat64;
};

/// The fields that a plan uses, in the order of its uses: the streams of E57Section and StreamReader.
std::vector<std::size_t> used_fields(const E57Plan& plan);

/// For one thread and one stretch.
class RecordDecoder {
 public:
  /// What it holds beside the block, but for records of very many fields.
  static constexpr std::uint64_t kMemoryBytes = std::uint64_t{512} << 10;

  /// All must outlive the decoder; `section` and `streams` are of used_fields(records.plan).
  RecordDecoder(const E57Records& records, const E57Section& section, StreamReader& streams);

  /// Fills `block` with those of `count` records from `first` on that hold a point, and counts the others as its
  /// no_return. Throws kInput for a value beyond the bounds of its field, and as StreamReader does. Records are to be
  /// decoded front to back.
  void decode(std::uint64_t first, std::size_t count, PointBlock& block);

 private:
  struct Batch {
    std::uint64_t first;  ///< record
    std::size_t count;
    std::size_t slot;  ///< of the first in the block
  };

  void decode_batch(const Batch& batch, PointBlock& block);
  void unpack(std::size_t use, const Batch& batch);
  void clear_marked(E57Mark mark, std::size_t count);
  void check_bounds(const E57Use& use, const E57Field& field, const Batch& batch);
  void make_real(const E57Field& field, std::size_t count);
  void store_position(const E57Use& use, const Batch& batch, PointBlock& block);
  void store_attribute(const E57Use& use, const Batch& batch, PointBlock& block);
  bool is_marked(E57Mark mark) const;
  std::uint8_t* marks(E57Mark mark) { return marks_[static_cast<std::size_t>(mark)].data(); }

  const E57Records& records_;
  const E57Section& section_;
  StreamReader& streams_;
  std::size_t batch_records_;
  std::vector<std::byte> bytes_;    ///< of one stream
  std::vector<std::uint64_t> raw_;  ///< one value a record of the batch
  std::vector<double> real_;
  std::array<std::vector<std::uint8_t>, kE57Marks> marks_;  ///< one a record of the batch
};

}  // namespace cairn::formats
