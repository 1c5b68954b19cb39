#include "tests/bench/scan_writers.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <limits>
#include <span>
#include <stdexcept>
#include <string_view>
#include <type_traits>
#include <vector>

namespace cairn::bench {
namespace {

/// Little-endian numbers appended to a file through a buffer.
class ByteSink {
 public:
  explicit ByteSink(const std::string& path) : file_(path, std::ios::binary) { check(); }

  template <typename T>
  void put(T value) {
    static_assert(std::endian::native == std::endian::little && std::is_arithmetic_v<T>);
    put_bytes(std::span(reinterpret_cast<const char*>(&value), sizeof value));
  }
  /// `text` cut or filled with zeros to `size_bytes`.
  void put_text(std::string_view text, std::size_t size_bytes) {
    std::string field(text.substr(0, size_bytes));
    field.resize(size_bytes);
    put_bytes(field);
  }
  void put_bytes(std::span<const char> bytes) {
    buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
    if (buffer_.size() >= kFlushBytes) flush();
  }
  void seek(std::streamoff offset) {
    flush();
    file_.seekp(offset);
  }
  void flush() {
    file_.write(buffer_.data(), static_cast<std::streamsize>(buffer_.size()));
    buffer_.clear();
    file_.flush();
    check();
  }

 private:
  static constexpr std::size_t kFlushBytes = std::size_t{1} << 20;

  void check() const {
    if (!file_) throw std::runtime_error("the output file cannot be written");
  }

  std::ofstream file_;
  std::vector<char> buffer_;
};

/// LAS 1.2, point format 2, coordinates in millimetres.
class LasWriter : public ScanWriter {
 public:
  LasWriter(const std::string& path, std::uint64_t count) : sink_(path), count_(count) {
    if (count > std::numeric_limits<std::uint32_t>::max())
      throw std::runtime_error("LAS 1.2 holds at most 4,294,967,295 points");
    put_header();
  }

  void write(const Point& point) override {
    const std::array world = {point.position.x, point.position.y, point.position.z};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto step = static_cast<std::int32_t>(std::lround(world[axis] / kScale));
      low_[axis] = std::min(low_[axis], step);
      high_[axis] = std::max(high_[axis], step);
      sink_.put(step);
    }
    sink_.put(point.intensity);
    sink_.put(std::uint8_t{0b001'001});  // return 1 of 1
    sink_.put(std::uint8_t{0});          // classification: never classified
    sink_.put(std::int8_t{0});           // scan angle
    sink_.put(std::uint8_t{0});          // user data
    sink_.put(std::uint16_t{1});         // point source
    for (const std::uint8_t channel : point.colour)
      sink_.put(static_cast<std::uint16_t>(channel * 257));
  }

  void finish() override {
    sink_.seek(0);
    put_header();
    sink_.flush();
  }

 private:
  static constexpr double kScale = 0.001;

  void put_header() {
    const auto count = static_cast<std::uint32_t>(count_);
    sink_.put_text("LASF", 4);
    sink_.put_text("", 20);  // file source, encoding, project id
    sink_.put(std::uint8_t{1});
    sink_.put(std::uint8_t{2});
    sink_.put_text("synthetic", 32);
    sink_.put_text("make_scan", 32);
    sink_.put(std::uint16_t{1});     // day of the year
    sink_.put(std::uint16_t{2000});  // year
    sink_.put(std::uint16_t{227});   // header size
    sink_.put(std::uint32_t{227});   // offset of the points
    sink_.put(std::uint32_t{0});     // variable-length records
    sink_.put(std::uint8_t{2});      // point format
    sink_.put(std::uint16_t{26});    // record size
    sink_.put(count);
    sink_.put(count);  // of these, first returns
    for (int later_return = 2; later_return <= 5; ++later_return) sink_.put(std::uint32_t{0});
    for (int axis = 0; axis < 3; ++axis) sink_.put(kScale);
    for (int axis = 0; axis < 3; ++axis) sink_.put(0.0);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      sink_.put(count > 0 ? high_[axis] * kScale : 0.0);
      sink_.put(count > 0 ? low_[axis] * kScale : 0.0);
    }
  }

  ByteSink sink_;
  std::uint64_t count_;
  std::array<std::int32_t, 3> low_ = filled(std::numeric_limits<std::int32_t>::max());
  std::array<std::int32_t, 3> high_ = filled(std::numeric_limits<std::int32_t>::min());

  static std::array<std::int32_t, 3> filled(std::int32_t value) { return {value, value, value}; }
};

/// Binary little-endian PLY with normals and colours.
class PlyWriter : public ScanWriter {
 public:
  PlyWriter(const std::string& path, std::uint64_t count) : sink_(path) {
    std::string header = "ply\nformat binary_little_endian 1.0\ncomment made by make_scan\n";
    header += "element vertex " + std::to_string(count) + "\n";
    for (const char* name : {"x", "y", "z", "nx", "ny", "nz"})
      header += std::string("property float ") + name + "\n";
    for (const char* name : {"red", "green", "blue"})
      header += std::string("property uchar ") + name + "\n";
    sink_.put_bytes(header + "end_header\n");
  }

  void write(const Point& point) override {
    for (const Vec3 v : {point.position, point.normal})
      for (const double value : {v.x, v.y, v.z}) sink_.put(static_cast<float>(value));
    for (const std::uint8_t channel : point.colour) sink_.put(channel);
  }

  void finish() override { sink_.flush(); }

 private:
  ByteSink sink_;
};

/// The logical bytes of an E57 file, cut into pages that end in a checksum.
class PageSink {
 public:
  static constexpr std::size_t kPageBytes = 1024, kPayloadBytes = 1020;

  static std::uint64_t physical(std::uint64_t logical) {
    return logical / kPayloadBytes * kPageBytes + logical % kPayloadBytes;
  }

  explicit PageSink(const std::string& path) : sink_(path) {
    for (std::uint32_t byte = 0; byte < 256; ++byte) {
      table_[byte] = byte;
      for (int bit = 0; bit < 8; ++bit)
        table_[byte] = (table_[byte] >> 1) ^ ((table_[byte] & 1) != 0 ? 0x82f63b78U : 0);
    }
  }

  template <typename T>
  void put(T value) {
    put_bytes(std::string_view(reinterpret_cast<const char*>(&value), sizeof value));
  }
  void put_bytes(std::string_view bytes) {
    while (!bytes.empty()) {
      const std::string_view part = bytes.substr(0, kPayloadBytes - page_.size());
      page_ += part;
      bytes.remove_prefix(part.size());
      if (page_.size() == kPayloadBytes) put_page();
    }
  }
  void finish() {
    page_.resize(page_.empty() ? 0 : kPayloadBytes, ' ');
    if (!page_.empty()) put_page();
    sink_.flush();
  }

 private:
  void put_page() {
    std::uint32_t crc = 0xffffffffU;
    for (const char byte : page_)
      crc = (crc >> 8) ^ table_[(crc ^ static_cast<unsigned char>(byte)) & 0xff];
    sink_.put_bytes(page_);
    sink_.put(__builtin_bswap32(~crc));
    page_.clear();
  }

  ByteSink sink_;
  std::array<std::uint32_t, 256> table_{};
  std::string page_;
};

/// E57 of one scan: coordinates in millimetres of 21 bits, which cross bytes, intensities of 16 and colours of 8.
class E57Writer : public ScanWriter {
 public:
  E57Writer(const std::string& path, std::uint64_t count) : sink_(path), left_(count) {
    const std::uint64_t full = count / kPacketRecords, rest = count % kPacketRecords;
    const std::uint64_t section_bytes = kSectionHeaderBytes + full * packet_bytes(kPacketRecords) +
                                        (rest > 0 ? packet_bytes(rest) : 0);
    xml_ = xml(count);
    const std::uint64_t xml_at = kHeaderBytes + section_bytes;
    const std::uint64_t pages = (xml_at + xml_.size() - 1) / PageSink::kPayloadBytes + 1;
    sink_.put_bytes("ASTM-E57");
    sink_.put(std::uint32_t{1});
    sink_.put(std::uint32_t{0});
    sink_.put(pages * PageSink::kPageBytes);
    sink_.put(PageSink::physical(xml_at));
    sink_.put(std::uint64_t{xml_.size()});
    sink_.put(std::uint64_t{PageSink::kPageBytes});
    sink_.put(std::uint64_t{1});  // a section of points
    sink_.put(section_bytes);
    sink_.put(PageSink::physical(kHeaderBytes + kSectionHeaderBytes));
    sink_.put(std::uint64_t{0});  // no index
  }

  void write(const Point& point) override {
    const std::array world = {point.position.x, point.position.y, point.position.z};
    for (std::size_t axis = 0; axis < 3; ++axis)
      put_bits(axis, static_cast<std::uint64_t>(std::lround(world[axis] * 1000) - kLeast));
    put_bits(3, point.intensity);
    for (std::size_t channel = 0; channel < 3; ++channel)
      put_bits(4 + channel, point.colour[channel]);
    --left_;
    if (++records_ == kPacketRecords || left_ == 0) put_packet();
  }

  void finish() override {
    sink_.put_bytes(xml_);
    sink_.finish();
  }

 private:
  static constexpr std::size_t kHeaderBytes = 48, kSectionHeaderBytes = 32;
  // A packet holds at most 64 KiB, and streams have whole bytes for a multiple of eight records.
  static constexpr std::uint64_t kPacketRecords = 4096;
  static constexpr std::array<unsigned, 7> kBits{21, 21, 21, 16, 8, 8, 8};
  static constexpr std::int64_t kLeast = -1048576;

  static std::uint64_t packet_bytes(std::uint64_t records) {
    std::uint64_t bytes = 6 + 2 * kBits.size();
    for (const unsigned bits : kBits) bytes += (records * bits + 7) / 8;
    return (bytes + 3) / 4 * 4;
  }

  static std::string xml(std::uint64_t count) {
    std::string text =
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<e57Root type=\"Structure\" "
        "xmlns=\"http://www.astm.org/COMMIT/E57/2010-e57-v1.0\"><data3D type=\"Vector\" "
        "allowHeterogeneousChildren=\"1\"><vectorChild type=\"Structure\"><points "
        "type=\"CompressedVector\" fileOffset=\"48\" recordCount=\"" +
        std::to_string(count) + "\"><prototype type=\"Structure\">\n";
    for (const char axis : {'X', 'Y', 'Z'})
      text += std::string("<cartesian") + axis +
              " type=\"ScaledInteger\" minimum=\"-1048576\" maximum=\"1048575\" "
              "scale=\"0.001\"/>\n";
    text += "<intensity type=\"Integer\" minimum=\"0\" maximum=\"65535\"/>\n";
    for (const char* channel : {"Red", "Green", "Blue"})
      text +=
          std::string("<color") + channel + " type=\"Integer\" minimum=\"0\" maximum=\"255\"/>\n";
    return text +
           "</prototype><codecs type=\"Vector\" allowHeterogeneousChildren=\"1\"/></points>"
           "</vectorChild></data3D></e57Root>\n";
  }

  void put_bits(std::size_t stream, std::uint64_t value) {
    Bits& bits = streams_[stream];
    bits.pending |= value << bits.count;
    for (bits.count += kBits[stream]; bits.count >= 8; bits.count -= 8) {
      bits.bytes += static_cast<char>(bits.pending & 0xff);
      bits.pending >>= 8;
    }
  }

  void put_packet() {
    const std::uint64_t size = packet_bytes(records_);
    std::string packet(1, '\1');
    const auto put16 = [&](std::uint64_t value) {
      packet += static_cast<char>(value & 0xff);
      packet += static_cast<char>(value >> 8 & 0xff);
    };
    packet += '\0';
    put16(size - 1);
    put16(streams_.size());
    for (Bits& bits : streams_) {
      if (bits.count > 0) bits.bytes += static_cast<char>(bits.pending);
      bits.pending = bits.count = 0;
      put16(bits.bytes.size());
    }
    for (Bits& bits : streams_) {
      packet += bits.bytes;
      bits.bytes.clear();
    }
    packet.resize(size);
    sink_.put_bytes(packet);
    records_ = 0;
  }

  struct Bits {
    std::string bytes;
    std::uint64_t pending = 0;
    unsigned count = 0;
  };

  PageSink sink_;
  std::uint64_t left_;
  std::uint64_t records_ = 0;
  std::string xml_;
  std::array<Bits, kBits.size()> streams_;
};

}  // namespace

std::unique_ptr<ScanWriter> open_writer(const std::string& path, std::uint64_t count) {
  if (path.ends_with(".las")) return std::make_unique<LasWriter>(path, count);
  if (path.ends_with(".ply")) return std::make_unique<PlyWriter>(path, count);
  if (path.ends_with(".e57")) return std::make_unique<E57Writer>(path, count);
  throw std::runtime_error("the output's name must end in .las, .ply or .e57");
}

}  // namespace cairn::bench
