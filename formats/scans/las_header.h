// The public header block of a LAS file, versions 1.0 to 1.5.
// Based on: ASPRS, LAS Specification 1.0 to 1.5. A LAZ file has the same header with a flag in the
// point format; `compressed` tells, and it is the reader's affair what to do with it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "formats/random_access_file.h"

namespace cairn::formats {

struct LasHeader {
  std::uint8_t version_minor = 0;  ///< of version 1.x
  std::uint16_t global_encoding = 0;
  std::uint16_t header_size_bytes = 0;
  std::uint32_t point_data_offset = 0;  ///< at least header_size_bytes, at most the file's size
  std::uint32_t vlr_count = 0;          ///< as claimed; there is room for so many headers
  std::uint8_t point_format = 0;        ///< 0 to 10
  bool compressed = false;
  std::uint16_t record_length_bytes = 0;  ///< at least what the point format needs
  std::uint64_t point_count = 0;          ///< as claimed
  std::uint64_t evlr_offset = 0;          ///< 0 if there are none
  std::uint32_t evlr_count = 0;           ///< as claimed
  std::uint64_t waveform_offset = 0;      ///< of packets within the file, as claimed; 0 if none
  std::array<double, 3> scale{};          ///< finite and > 0
  std::array<double, 3> offset{};         ///< finite
};

inline constexpr std::size_t kLasVlrHeaderBytes = 54;   ///< before a variable length record
inline constexpr std::size_t kLasEvlrHeaderBytes = 60;  ///< before an extended one
/// Byte offsets of the header's fields that other parts of a file are held against.
inline constexpr std::size_t kLasPointFormatField = 104;
inline constexpr std::size_t kLasEvlrOffsetField = 235;
inline constexpr std::size_t kLasEvlrCountField = 243;

/// Bytes of the header that each minor version defines.
std::uint16_t las_header_size(std::uint8_t version_minor);

/// Reads and checks the header. Throws kInput, naming the field, for one that no reader could follow; point and
/// EVLR counts and the waveform offset are returned as claimed and must be held against the file by whoever uses
/// them.
LasHeader read_las_header(const RandomAccessFile& file);

}  // namespace cairn::formats
