// After: LAS Specification 1.4 - R15, tables 3 and 7 to 17.
#include "tests/support/las_points.h"

#include <cmath>
#include <cstring>
#include <stdexcept>

#include "tests/support/temporary_folder.h"

namespace cairn::test {
namespace {

template <typename T>
T at(const std::string& bytes, std::size_t offset) {
  T value;
  if (offset + sizeof(T) > bytes.size()) throw std::runtime_error("LAS ends early");
  std::memcpy(&value, bytes.data() + offset, sizeof(T));
  return value;
}

/// Where a format keeps what not all have; 0 if it does not.
struct Places {
  std::size_t size, gps, color, near_infrared, waveform;
};
constexpr Places kPlaces[11] = {{20, 0, 0, 0, 0},   {28, 20, 0, 0, 0},   {26, 0, 20, 0, 0},
                                {34, 20, 28, 0, 0}, {57, 20, 0, 0, 28},  {63, 20, 28, 0, 34},
                                {30, 22, 0, 0, 0},  {36, 22, 30, 0, 0},  {38, 22, 30, 36, 0},
                                {59, 22, 0, 0, 30}, {67, 22, 30, 36, 38}};

void read_old_flags(const std::string& record, LasPoint& point) {
  const auto returns = at<std::uint8_t>(record, 14);
  const auto classes = at<std::uint8_t>(record, 15);
  point.return_number = returns & 7;
  point.return_count = returns >> 3 & 7;
  point.scan_flags = returns >> 6 & 3;
  point.classification = classes & 31;
  point.class_flags = classes >> 5;
  point.scan_angle = std::int32_t{at<std::int8_t>(record, 16)};
  point.user_data = at<std::uint8_t>(record, 17);
  point.source_id = at<std::uint16_t>(record, 18);
}

void read_new_flags(const std::string& record, LasPoint& point) {
  const auto returns = at<std::uint8_t>(record, 14);
  const auto flags = at<std::uint8_t>(record, 15);
  point.return_number = returns & 15;
  point.return_count = returns >> 4;
  point.class_flags = flags & 15;
  point.scan_flags = static_cast<std::uint8_t>((flags >> 6 & 3) | (flags >> 4 & 3) << 2);
  point.classification = at<std::uint8_t>(record, 16);
  point.user_data = at<std::uint8_t>(record, 17);
  point.scan_angle = at<std::int16_t>(record, 18);
  point.source_id = at<std::uint16_t>(record, 20);
}

LasPoint read_point(const std::string& record, int format) {
  const Places& places = kPlaces[format];
  LasPoint point;
  for (std::size_t axis = 0; axis < 3; ++axis)
    point.position[axis] = at<std::int32_t>(record, 4 * axis);
  point.intensity = at<std::uint16_t>(record, 12);
  format < 6 ? read_old_flags(record, point) : read_new_flags(record, point);
  if (places.gps != 0) point.gps_bits = at<std::uint64_t>(record, places.gps);
  for (std::size_t c = 0; places.color != 0 && c < 3; ++c)
    point.colors[c] = at<std::uint16_t>(record, places.color + 2 * c);
  if (places.near_infrared != 0) point.colors[3] = at<std::uint16_t>(record, places.near_infrared);
  if (places.waveform != 0) point.waveform = record.substr(places.waveform, 29);
  point.extra = record.substr(places.size);
  return point;
}

}  // namespace

LasFile read_las(const std::filesystem::path& path) {
  const std::string bytes = read_text(path);
  LasFile file{
      .format = at<std::uint8_t>(bytes, 104) & 63, .scale = {}, .offset = {}, .points = {}};
  if (file.format > 10) throw std::runtime_error("unknown LAS point format");
  const std::size_t start = at<std::uint32_t>(bytes, 96);
  const std::size_t stride = at<std::uint16_t>(bytes, 105);
  std::uint64_t count = at<std::uint32_t>(bytes, 107);
  if (at<std::uint8_t>(bytes, 25) >= 4 && count == 0) count = at<std::uint64_t>(bytes, 247);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    file.scale[axis] = at<double>(bytes, 131 + 8 * axis);
    file.offset[axis] = at<double>(bytes, 155 + 8 * axis);
  }
  for (std::uint64_t i = 0; i < count; ++i)
    file.points.push_back(read_point(bytes.substr(start + i * stride, stride), file.format));
  return file;
}

void rebase(LasFile& file, const std::array<double, 3>& offset) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double steps = (file.offset[axis] - offset[axis]) / file.scale[axis];
    if (std::abs(steps - std::round(steps)) > 1e-3)
      throw std::runtime_error("offsets differ by a part of a step");
    for (LasPoint& point : file.points) point.position[axis] += std::llround(steps);
    file.offset[axis] = offset[axis];
  }
}

}  // namespace cairn::test
