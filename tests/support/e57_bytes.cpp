#include "tests/support/e57_bytes.h"

#include <algorithm>

#include "tests/support/las_bytes.h"

namespace cairn::test {
namespace {

constexpr std::size_t kChecksumBytes = 4;

/// Bit after bit, as the polynomial's definition has it.
std::uint32_t slow_crc32c(const char* bytes, std::size_t size) {
  std::uint32_t crc = 0xffffffffU;
  for (std::size_t i = 0; i < size; ++i) {
    crc ^= static_cast<unsigned char>(bytes[i]);
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1) != 0 ? (crc >> 1) ^ 0x82f63b78U : crc >> 1;
  }
  return ~crc;
}

std::uint64_t physical(std::uint64_t logical, std::size_t page_bytes) {
  const std::uint64_t payload = page_bytes - kChecksumBytes;
  return logical / payload * page_bytes + logical % payload;
}

/// Bit after bit, lowest first; the last byte filled with zeros.
std::string packed(const E57Stream& stream) {
  std::string bytes((stream.values.size() * stream.bits + 7) / 8, '\0');
  std::size_t at = 0;
  for (const std::uint64_t value : stream.values)
    for (unsigned bit = 0; bit < stream.bits; ++bit, ++at)
      if ((value >> bit & 1) != 0)
        bytes[at / 8] = static_cast<char>(static_cast<unsigned char>(bytes[at / 8]) | 1U << at % 8);
  return bytes;
}

std::string data_packet(const std::vector<std::string>& pieces) {
  std::string packet(4, '\0');
  packet[0] = 1;
  put(packet, static_cast<std::uint16_t>(pieces.size()));
  for (const std::string& piece : pieces) put(packet, static_cast<std::uint16_t>(piece.size()));
  for (const std::string& piece : pieces) packet += piece;
  packet.resize((packet.size() + 3) / 4 * 4);
  put_at(packet, 2, static_cast<std::uint16_t>(packet.size() - 1));
  return packet;
}

/// The packets of all streams.
std::string packets(const E57ScanBytes& scan) {
  std::vector<std::string> left;
  for (const E57Stream& stream : scan.streams) left.push_back(packed(stream));
  // In step: as many records a packet as fit, a multiple of 8 that all streams have whole bytes for.
  std::size_t record_bits = 1;
  for (const E57Stream& stream : scan.streams) record_bits += stream.bits;
  const std::size_t eights = std::max<std::size_t>(1, 50000 / record_bits);
  std::string all;
  const auto any_left = [&] {
    return std::any_of(left.begin(), left.end(), [](const auto& bytes) { return !bytes.empty(); });
  };
  for (std::size_t packet = 0; any_left(); ++packet) {
    std::vector<std::string> pieces;
    for (std::size_t i = 0; i < left.size(); ++i) {
      const std::size_t asked =
          scan.piece ? scan.piece(packet, i, left[i].size()) : eights * scan.streams[i].bits;
      pieces.push_back(left[i].substr(0, asked));
      left[i].erase(0, asked);
    }
    if (scan.before_packet) all += scan.before_packet(packet);
    all += data_packet(pieces);
  }
  return all;
}

std::string section(const E57ScanBytes& scan, std::size_t logical_offset, std::size_t page_bytes) {
  const std::string body = packets(scan);
  std::string bytes(8, '\0');
  bytes[0] = 1;
  put<std::uint64_t>(bytes, 32 + body.size());
  put(bytes, physical(logical_offset + 32, page_bytes));
  put<std::uint64_t>(bytes, 0);  // no index
  bytes += body;
  if (scan.tamper) scan.tamper(bytes);
  return bytes;
}

std::string scan_xml(const E57ScanBytes& scan, std::uint64_t offset) {
  const std::uint64_t records =
      scan.record_count.value_or(scan.streams.empty() ? 0 : scan.streams.front().values.size());
  std::string xml = "<vectorChild type=\"Structure\">" + scan.xml +
                    "<points type=\"CompressedVector\" fileOffset=\"" + std::to_string(offset) +
                    "\" recordCount=\"" + std::to_string(records) +
                    "\"><prototype type=\"Structure\">";
  for (const E57Stream& stream : scan.streams) xml += stream.xml;
  return xml + "</prototype><codecs type=\"Vector\" allowHeterogeneousChildren=\"1\">" +
         scan.codecs + "</codecs></points></vectorChild>\n";
}

E57Stream integers(std::string xml, std::int64_t minimum, std::int64_t maximum,
                   const std::vector<std::int64_t>& values) {
  E57Stream stream{.xml = std::move(xml), .bits = 0, .values = {}};
  const std::uint64_t range =
      static_cast<std::uint64_t>(maximum) - static_cast<std::uint64_t>(minimum);
  while (stream.bits < 64 && range >> stream.bits != 0) ++stream.bits;
  for (const std::int64_t value : values)
    stream.values.push_back(static_cast<std::uint64_t>(value) -
                            static_cast<std::uint64_t>(minimum));
  return stream;
}

std::string bounds_xml(std::int64_t minimum, std::int64_t maximum) {
  return " minimum=\"" + std::to_string(minimum) + "\" maximum=\"" + std::to_string(maximum) + "\"";
}

}  // namespace

E57Stream e57_integers(const std::string& name, std::int64_t minimum, std::int64_t maximum,
                       const std::vector<std::int64_t>& values) {
  return integers("<" + name + " type=\"Integer\"" + bounds_xml(minimum, maximum) + "/>", minimum,
                  maximum, values);
}

E57Stream e57_scaled(const std::string& name, std::int64_t minimum, std::int64_t maximum,
                     const std::string& scale_and_offset, const std::vector<std::int64_t>& values) {
  return integers("<" + name + " type=\"ScaledInteger\"" + bounds_xml(minimum, maximum) + " " +
                      scale_and_offset + "/>",
                  minimum, maximum, values);
}

E57Stream e57_floats(const std::string& name, const std::vector<float>& values) {
  E57Stream stream{"<" + name + " type=\"Float\" precision=\"single\"/>", 32, {}};
  for (const float value : values) stream.values.push_back(std::bit_cast<std::uint32_t>(value));
  return stream;
}

E57Stream e57_doubles(const std::string& name, const std::vector<double>& values) {
  E57Stream stream{"<" + name + " type=\"Float\"/>", 64, {}};
  for (const double value : values) stream.values.push_back(std::bit_cast<std::uint64_t>(value));
  return stream;
}

std::vector<E57Stream> e57_line(std::size_t count) {
  std::vector<E57Stream> streams;
  for (const char axis : {'X', 'Y', 'Z'}) {
    std::vector<double> values;
    for (std::size_t i = 0; i < count; ++i) values.push_back(static_cast<double>(i) * (axis - 'W'));
    streams.push_back(e57_doubles(std::string("cartesian") + axis, values));
  }
  return streams;
}

std::string E57Bytes::bytes() const {
  const std::size_t payload = page_bytes - kChecksumBytes;
  std::string logical(48, '\0');
  std::string xml = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n" + prolog +
                    "<e57Root type=\"Structure\" "
                    "xmlns=\"http://www.astm.org/COMMIT/E57/2010-e57-v1.0\">" +
                    root_xml + "<data3D type=\"Vector\" allowHeterogeneousChildren=\"1\">\n";
  for (const E57ScanBytes& scan : scans) {
    xml += scan_xml(scan, physical(logical.size(), page_bytes));
    logical += section(scan, logical.size(), page_bytes);
  }
  xml += "</data3D></e57Root>\n";
  if (tamper) tamper(xml);
  const std::uint64_t xml_offset = physical(logical.size(), page_bytes);
  logical += xml;
  logical.resize((logical.size() + payload - 1) / payload * payload);
  std::string header = "ASTM-E57";
  put<std::uint32_t>(header, 1);
  put<std::uint32_t>(header, 0);
  put<std::uint64_t>(header, logical.size() / payload * page_bytes);
  put<std::uint64_t>(header, xml_offset);
  put<std::uint64_t>(header, xml.size());
  put<std::uint64_t>(header, page_bytes);
  logical.replace(0, header.size(), header);
  std::string pages;
  for (std::size_t at = 0; at < logical.size(); at += payload)
    pages += logical.substr(at, payload) + std::string(kChecksumBytes, '\0');
  seal_e57_pages(pages, page_bytes);
  return pages;
}

std::string e57_index_packet() {
  std::string packet(16, '\0');  // kind 0, one entry, level 0
  put_at<std::uint16_t>(packet, 2, 31);
  put_at<std::uint16_t>(packet, 4, 1);
  put<std::uint64_t>(packet, 0);
  put<std::uint64_t>(packet, 80);
  return packet;
}

std::string e57_empty_packet(std::size_t size_bytes) {
  std::string packet(size_bytes, '\xee');
  packet[0] = 2;
  packet[1] = 0;
  put_at(packet, 2, static_cast<std::uint16_t>(size_bytes - 1));
  return packet;
}

void seal_e57_pages(std::string& bytes, std::size_t page_bytes) {
  const std::size_t payload = page_bytes - kChecksumBytes;
  for (std::size_t page = 0; page + page_bytes <= bytes.size(); page += page_bytes) {
    const std::uint32_t crc = slow_crc32c(bytes.data() + page, payload);
    for (std::size_t i = 0; i < kChecksumBytes; ++i)
      bytes[page + payload + i] = static_cast<char>(crc >> (24 - 8 * i));
  }
}

}  // namespace cairn::test
