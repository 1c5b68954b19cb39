// The binary section of a scan in an E57 file: packets, each with a piece of the stream of every field. The streams
// are independent: a record's fields may lie in different packets, and a value may begin in one and end in the next.
// Based on: ASTM E2807-11, "Standard Specification for 3D Imaging Data Exchange", 2011, section 9.
//
// Since a field has as many bits in every record, the bytes of any record are known in each stream; what a walk over
// the heads of all packets adds is in which packet they lie. So records can be read from anywhere, by many threads.
// (Index packets tell less: the records at the begins of packets.)
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "formats/scans/e57/e57_document.h"
#include "formats/scans/e57/page_file.h"

namespace cairn::formats {

/// A data packet: where it lies, where the piece of each stream lies in the logical file, and what follows the packet.
struct E57Packet {
  std::uint64_t at = 0;
  std::vector<std::uint64_t>
      begins;  ///< one more than streams: each piece ends where the next begins
  std::uint64_t next = 0;
};

/// Where reading a stream may begin: at the data packet at or behind `packet`, with `before` bytes in those before.
struct StreamPlace {
  std::uint64_t packet = 0;
  std::uint64_t before = 0;
};

/// Where the sections lie of the scans of a file that were opened. None may lie in another: then all walks over packets
/// together take no more than the file has.
class E57SectionPlaces {
 public:
  /// False if the logical bytes from `begin` to `end` meet those of a section before.
  bool take(std::uint64_t begin, std::uint64_t end);

 private:
  std::map<std::uint64_t, std::uint64_t> end_of_;  ///< by begin
};

/// How the packets of a section are walked over.
struct E57Walk {
  std::uint64_t stretch_records = 0;
  std::string where;  ///< the scan, for messages
  bool allow_truncated = false;
};

class E57Section {
 public:
  /// Checks the section's header and walks over its packets. `used` are the fields whose streams will be read, at
  /// least one, all numbers. Throws kInput, naming `walk.where`, for a damaged header or packet, for a section that
  /// holds records and meets one in `places`, and where a stream ends before the last record unless
  /// `walk.allow_truncated`.
  E57Section(const PageFile& file, const E57Scan& scan, std::vector<std::size_t> used, E57Walk walk,
             E57SectionPlaces& places);

  /// Whole records that are there, at most those claimed.
  std::uint64_t records() const { return records_; }
  const std::vector<std::size_t>& used() const { return used_; }
  std::size_t streams() const { return streams_; }
  /// Whether used()[i] has bits; where it has none, all its values are the same.
  bool has_bits(std::size_t i) const { return bits_[i] > 0; }
  /// Where the stream of used()[i] has the first record of a stretch. Only for fields that have bits.
  StreamPlace place(std::size_t i, std::uint64_t stretch) const { return places_[i].at(stretch); }

  /// The first data packet at or behind `at`; false at the end of the section.
  bool find_packet(PageWindow& window, std::uint64_t at, E57Packet& packet) const;

  /// Throws kInput for a damaged value.
  [[noreturn]] void refuse_value(const std::string& what, std::string found,
                                 std::string expected) const;
  /// Throws kInput for what is wrong at a logical offset.
  [[noreturn]] void refuse(std::uint64_t at, const std::string& what, std::string found,
                           std::string expected) const;

 private:
  struct Head;

  std::uint64_t read_header(std::uint64_t section_offset, E57SectionPlaces& places);
  void find_records(std::uint64_t first_packet, std::uint64_t stretch_records);
  Head read_head(PageWindow& window, std::uint64_t at) const;
  void read_pieces(PageWindow& window, std::uint64_t at, const Head& head, E57Packet& packet) const;
  std::uint64_t whole_records(const std::vector<std::uint64_t>& stream_bytes) const;

  const PageFile& file_;
  std::uint64_t claimed_;
  std::size_t streams_;
  std::vector<std::size_t> used_;
  std::vector<unsigned> bits_;  ///< of each used field
  std::string where_;
  std::uint64_t end_ = 0;  ///< logical, of the last packet
  bool is_cut_ = false;    ///< by the end of the file
  std::uint64_t records_ = 0;
  std::vector<std::vector<StreamPlace>> places_;  ///< by used field, then stretch
};

/// Reads the used streams of a section side by side, each front to back, from the first record of a stretch on. For one
/// thread.
class StreamReader {
 public:
  /// `file` and `section` must outlive the reader.
  StreamReader(const PageFile& file, const E57Section& section, std::uint64_t stretch);

  /// Fills `out` with the bytes of the stream of used()[i] from `first` on, which may not lie before the last byte
  /// that was read of it. Throws kInput where the stream ends.
  void read(std::size_t i, std::uint64_t first, std::span<std::byte> out);

  static std::uint64_t memory_bytes(const PageFile& file, const E57Section& section);

 private:
  /// A packet, and from where on it was searched for: from any place between, it is the one at or behind.
  struct Known {
    std::uint64_t from = UINT64_MAX;
    std::uint64_t last_use = 0;
    E57Packet packet;
  };

  const E57Packet& packet_at(std::uint64_t at);

  const E57Section& section_;
  PageWindow window_;
  std::vector<StreamPlace> places_;
  std::vector<Known> known_;  ///< the packets used last
  std::uint64_t uses_ = 0;
};

}  // namespace cairn::formats
