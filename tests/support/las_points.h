// A second LAS parser, for tests alone: it shares no code with the readers that it is held against and
// knows just enough of the format to compare points as multisets.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace cairn::test {

/// A point with its fields widened to those of formats 6 to 10. What a format lacks is 0.
struct LasPoint {
  std::array<std::int64_t, 3> position{};  ///< steps from the world's origin, see LasFile
  std::uint16_t intensity = 0;
  std::uint8_t return_number = 0;
  std::uint8_t return_count = 0;
  std::uint8_t class_flags = 0;  ///< synthetic, key, withheld, overlap
  std::uint8_t scan_flags = 0;   ///< direction, edge, channel
  std::uint8_t classification = 0;
  std::int32_t scan_angle = 0;  ///< rank or 0.006 degrees, as the format has it
  std::uint8_t user_data = 0;
  std::uint16_t source_id = 0;
  std::uint64_t gps_bits = 0;             ///< of the double
  std::array<std::uint16_t, 4> colors{};  ///< red, green, blue, near infrared
  std::string waveform;
  std::string extra;  ///< bytes behind the format's own

  friend auto operator<=>(const LasPoint&, const LasPoint&) = default;
};

struct LasFile {
  int format = 0;
  std::array<double, 3> scale{};
  std::array<double, 3> offset{};
  std::vector<LasPoint> points;  ///< in file order; positions as stored in the file
};

LasFile read_las(const std::filesystem::path& path);

/// Positions counted from `offset` instead of the file's own. The offsets must differ by whole steps.
void rebase(LasFile& file, const std::array<double, 3>& offset);

}  // namespace cairn::test
