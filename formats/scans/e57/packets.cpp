#include "formats/scans/e57/packets.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "formats/bytes.h"
#include "formats/error.h"
#include "formats/wide_int.h"

namespace cairn::formats {
namespace {

constexpr std::size_t kSectionHeaderBytes = 32;
constexpr std::byte kPointSection{1};
constexpr std::byte kIndexPacket{0}, kDataPacket{1}, kEmptyPacket{2};
constexpr std::size_t kHeadBytes = 4;      // that all packets begin with
constexpr std::size_t kDataHeadBytes = 6;  // then the size of each piece, 16 bits
// Records none of which has a byte of its own, as all values are told to be the same, cannot be counted.
constexpr std::uint64_t kMostBytelessRecords = 65536;

// A walk over packets takes a page of each. Reading takes what fills a few packets, more than streams of common
// writers are out of step: those that are further apart are read right, but their pages several times.
constexpr std::size_t kWalkBlocks = 2, kReadBlocks = 8, kKnownPackets = 8;
constexpr std::uint64_t kReadBlockBytes = std::uint64_t{64} << 10;

unsigned number(std::byte byte) { return std::to_integer<unsigned>(byte); }

}  // namespace

struct E57Section::Head {
  std::byte type{};
  std::uint64_t size_bytes = 0;
};

bool E57SectionPlaces::take(std::uint64_t begin, std::uint64_t end) {
  const auto next = end_of_.lower_bound(begin);
  if (next != end_of_.end() && next->first < end) return false;
  if (next != end_of_.begin() && std::prev(next)->second > begin) return false;
  end_of_.emplace_hint(next, begin, end);
  return true;
}

E57Section::E57Section(const PageFile& file, const E57Scan& scan, std::vector<std::size_t> used,
                       E57Walk walk, E57SectionPlaces& places)
    : file_(file),
      claimed_(scan.records),
      streams_(scan.fields.size()),
      used_(std::move(used)),
      where_(std::move(walk.where)),
      places_(used_.size()) {
  for (const std::size_t field : used_) bits_.push_back(scan.fields[field].bits());
  // Writers that are given no points leave the offset, and what they write there, as it comes.
  if (claimed_ == 0) return;
  find_records(read_header(scan.section_offset, places), walk.stretch_records);
  if (records_ < claimed_ && !walk.allow_truncated)
    refuse(end_, "the packets end before the last point", fmt::format("{} points", records_),
           fmt::format("{}", claimed_));
}

void E57Section::refuse(std::uint64_t at, const std::string& what, std::string found,
                        std::string expected) const {
  throw_input({.what = fmt::format("{}: {}", where_, what),
               .path = file_.path(),
               .offset = file_.physical(at),
               .found = std::move(found),
               .expected = std::move(expected)});
}

void E57Section::refuse_value(const std::string& what, std::string found,
                              std::string expected) const {
  throw_input({.what = fmt::format("{}: {}", where_, what),
               .path = file_.path(),
               .found = std::move(found),
               .expected = std::move(expected)});
}

/// Finds the end of the section; returns the logical offset of its first packet.
std::uint64_t E57Section::read_header(std::uint64_t section_offset, E57SectionPlaces& places) {
  const std::uint64_t file_end = file_.logical_bytes();
  const auto begin = file_.logical(section_offset);
  end_ = file_end;
  if (!begin || file_end - *begin < kSectionHeaderBytes) {
    is_cut_ = file_.is_cut() && section_offset < file_.header().file_bytes;
    if (is_cut_) return file_end;
    throw_input({.what = where_ + ": the points do not lie in the file",
                 .path = file_.path(),
                 .offset = section_offset,
                 .expected = "the header of a section"});
  }
  std::array<std::byte, kSectionHeaderBytes> header{};
  PageWindow(file_, 1, 0).read(*begin, header);
  const auto size_bytes = load_le<std::uint64_t>(&header[8]);
  const auto data_offset = load_le<std::uint64_t>(&header[16]);
  if (header[0] != kPointSection)
    refuse(*begin, "damaged header of the points", fmt::format("section {}", number(header[0])),
           fmt::format("section {}", number(kPointSection)));
  const bool ends_early = size_bytes > file_end - *begin;
  is_cut_ = ends_early && file_.is_cut();
  if (size_bytes < kSectionHeaderBytes || (ends_early && !is_cut_))
    refuse(*begin, "the points have a size that cannot be", fmt::format("{} bytes", size_bytes),
           fmt::format("{} to {}", kSectionHeaderBytes, file_end - *begin));
  if (!ends_early) end_ = *begin + size_bytes;
  if (!places.take(*begin, end_))
    refuse(*begin, "the points lie where those of another scan do",
           fmt::format("a section of {} bytes", size_bytes), "one of its own");
  const auto first = file_.logical(data_offset);
  if (is_cut_ && data_offset >= file_.physical(file_end)) return file_end;
  if (!first || *first < *begin + kSectionHeaderBytes || *first > end_)
    refuse(*begin, "the points do not lie in their section", fmt::format("offset {}", data_offset),
           fmt::format("{} to {}", file_.physical(*begin + kSectionHeaderBytes),
                       file_.physical(end_)));
  return *first;
}

E57Section::Head E57Section::read_head(PageWindow& window, std::uint64_t at) const {
  std::array<std::byte, kHeadBytes> bytes{};
  window.read(at, bytes);
  const Head head{bytes[0], std::uint64_t{load_le<std::uint16_t>(&bytes[2])} + 1};
  if (head.type != kIndexPacket && head.type != kDataPacket && head.type != kEmptyPacket)
    refuse(at, "unknown kind of packet", fmt::format("{}", number(head.type)), "0, 1 or 2");
  if (head.size_bytes < kHeadBytes)
    refuse(at, "a packet is too small", fmt::format("{} bytes", head.size_bytes),
           fmt::format("{} or more", kHeadBytes));
  return head;
}

/// Of a data packet, all of which is there.
void E57Section::read_pieces(PageWindow& window, std::uint64_t at, const Head& head,
                             E57Packet& packet) const {
  const std::size_t head_bytes = kDataHeadBytes + 2 * streams_;
  std::vector<std::byte> bytes(std::min<std::size_t>(head_bytes, head.size_bytes));
  window.read(at, bytes);
  const std::uint16_t told =
      bytes.size() < kDataHeadBytes ? 0 : load_le<std::uint16_t>(&bytes[kHeadBytes]);
  if (told != streams_)
    refuse(at, "a packet has a wrong number of streams", fmt::format("{}", told),
           fmt::format("{}", streams_));
  packet.at = at;
  packet.begins.assign(1, at + head_bytes);
  for (std::size_t i = 0; i < streams_ && bytes.size() == head_bytes; ++i)
    packet.begins.push_back(packet.begins.back() +
                            load_le<std::uint16_t>(&bytes[kDataHeadBytes + 2 * i]));
  packet.next = at + head.size_bytes;
  if (bytes.size() < head_bytes || packet.begins.back() > packet.next)
    refuse(at, "a packet holds less than it tells", fmt::format("{} bytes", head.size_bytes),
           fmt::format("{}", packet.begins.back() - at));
}

bool E57Section::find_packet(PageWindow& window, std::uint64_t at, E57Packet& packet) const {
  while (at < end_ && end_ - at >= kHeadBytes) {
    const Head head = read_head(window, at);
    if (head.size_bytes > end_ - at) {
      if (is_cut_) return false;
      refuse(at, "a packet ends behind its section", fmt::format("{} bytes", head.size_bytes),
             fmt::format("at most {}", end_ - at));
    }
    if (head.type == kDataPacket) {
      read_pieces(window, at, head, packet);
      return true;
    }
    at += head.size_bytes;
  }
  return false;
}

/// As many as all streams hold, at most those claimed.
std::uint64_t E57Section::whole_records(const std::vector<std::uint64_t>& stream_bytes) const {
  std::uint64_t records = claimed_;
  bool any_bits = false;
  for (std::size_t i = 0; i < used_.size(); ++i) {
    if (bits_[i] == 0) continue;
    any_bits = true;
    const Int128 held = Int128{stream_bytes[i]} * 8 / bits_[i];
    if (held < Int128{records}) records = static_cast<std::uint64_t>(held);
  }
  if (!any_bits && claimed_ > kMostBytelessRecords)
    refuse(end_, "all points are told to be the same, and more than can be believed",
           fmt::format("{}", claimed_), fmt::format("at most {}", kMostBytelessRecords));
  return records;
}

void E57Section::find_records(std::uint64_t first_packet, std::uint64_t stretch_records) {
  PageWindow window(file_, kWalkBlocks, 0);
  std::vector<std::uint64_t> stream_bytes(used_.size(), 0);
  const std::uint64_t stretches = (claimed_ - 1) / stretch_records + 1;
  E57Packet packet;
  records_ = whole_records(stream_bytes);
  for (std::uint64_t at = first_packet; records_ < claimed_ && find_packet(window, at, packet);
       at = packet.next) {
    for (std::size_t i = 0; i < used_.size(); ++i) {
      const std::uint64_t before = stream_bytes[i];
      stream_bytes[i] += packet.begins[used_[i] + 1] - packet.begins[used_[i]];
      // All stretches that begin in this piece.
      while (bits_[i] > 0 && places_[i].size() < stretches &&
             Int128{places_[i].size()} * stretch_records * bits_[i] / 8 < Int128{stream_bytes[i]})
        places_[i].push_back({packet.at, before});
    }
    records_ = whole_records(stream_bytes);
  }
}

StreamReader::StreamReader(const PageFile& file, const E57Section& section, std::uint64_t stretch)
    : section_(section), window_(file, kReadBlocks, kReadBlockBytes), known_(kKnownPackets) {
  for (std::size_t i = 0; i < section.used().size(); ++i)
    places_.push_back(section.has_bits(i) ? section.place(i, stretch) : StreamPlace{});
}

std::uint64_t StreamReader::memory_bytes(const PageFile& file, const E57Section& section) {
  return PageWindow::memory_bytes(file, kReadBlocks, kReadBlockBytes) +
         kKnownPackets * section.streams() * sizeof(std::uint64_t);
}

const E57Packet& StreamReader::packet_at(std::uint64_t at) {
  ++uses_;
  Known* oldest = &known_.front();
  for (Known& candidate : known_) {
    if (candidate.from <= at && at <= candidate.packet.at) {
      candidate.last_use = uses_;
      return candidate.packet;
    }
    if (candidate.last_use < oldest->last_use) oldest = &candidate;
  }
  oldest->from = UINT64_MAX;
  if (!section_.find_packet(window_, at, oldest->packet))
    section_.refuse(at, "the packets end before the last point", "none", "one more packet");
  oldest->from = at;
  oldest->last_use = uses_;
  return oldest->packet;
}

void StreamReader::read(std::size_t i, std::uint64_t first, std::span<std::byte> out) {
  const std::size_t stream = section_.used()[i];
  StreamPlace& place = places_[i];
  while (!out.empty()) {
    const E57Packet& packet = packet_at(place.packet);
    place.packet = packet.at;  // a search that is done is not done again
    const std::uint64_t begin = packet.begins[stream];
    const std::uint64_t size_bytes = packet.begins[stream + 1] - begin;
    CAIRN_CHECK(first >= place.before);
    const std::uint64_t within = first - place.before;
    if (within >= size_bytes) {
      place.before += size_bytes;
      place.packet = packet.next;
      continue;
    }
    const auto part = out.first(std::min<std::size_t>(out.size(), size_bytes - within));
    window_.read(begin + within, part);
    out = out.subspan(part.size());
    first += part.size();
  }
}

}  // namespace cairn::formats
