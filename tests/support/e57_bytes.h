// Builds E57 files by the text of the standard (ASTM E2807), bit by bit, apart from the code that is tested.
#pragma once

#include <bit>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace cairn::test {

/// A field of the records and its values, as the bits that are stored.
struct E57Stream {
  std::string xml;  ///< of the prototype
  unsigned bits = 0;
  std::vector<std::uint64_t> values;
};

/// <name type="Integer" minimum= maximum=> of these values.
E57Stream e57_integers(const std::string& name, std::int64_t minimum, std::int64_t maximum,
                       const std::vector<std::int64_t>& values);
/// <name type="ScaledInteger" ... scale= offset=> of these values before scale and offset.
E57Stream e57_scaled(const std::string& name, std::int64_t minimum, std::int64_t maximum,
                     const std::string& scale_and_offset, const std::vector<std::int64_t>& values);
E57Stream e57_floats(const std::string& name, const std::vector<float>& values);
E57Stream e57_doubles(const std::string& name, const std::vector<double>& values);
/// cartesianX, Y and Z as doubles: a point (i, 2 i, 3 i) for each i below `count`.
std::vector<E57Stream> e57_line(std::size_t count);

struct E57ScanBytes {
  std::vector<E57Stream> streams;
  std::string xml;                            ///< beside the points: name, pose, limits
  std::string codecs;                         ///< inside the element codecs
  std::optional<std::uint64_t> record_count;  ///< claimed; else the values of the first stream
  /// Bytes of a stream that a packet takes, of those left; together at most 64 KiB. None: as many of the shortest
  /// packets as there are, in step.
  std::function<std::size_t(std::size_t packet, std::size_t stream, std::size_t left)> piece;
  /// What comes before a data packet, such as index packets.
  std::function<std::string(std::size_t packet)> before_packet;
  std::function<void(std::string& section)> tamper;  ///< with the finished section, header and all
};

struct E57Bytes {
  std::size_t page_bytes = 1024;
  std::vector<E57ScanBytes> scans;
  std::string root_xml;                          ///< beside data3D: coordinateMetadata, images2D
  std::string prolog;                            ///< before the root element
  std::function<void(std::string& xml)> tamper;  ///< with the finished XML

  std::string bytes() const;
};

/// An index packet without use, and an empty packet of so many bytes, a multiple of 4.
std::string e57_index_packet();
std::string e57_empty_packet(std::size_t size_bytes);

/// Gives every whole page the checksum of its bytes.
void seal_e57_pages(std::string& bytes, std::size_t page_bytes = 1024);

}  // namespace cairn::test
