// A whole scan in memory, for comparing what was written with what is read.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "formats/scans/scan_reader.h"

namespace cairn::test {

struct ScanPoints {
  formats::ScanInfo info;
  /// All stretches joined: `points.count` may exceed what a block holds, `no_return` is that of all.
  formats::PointBlock points;

  std::array<double, 3> world(std::size_t point) const;
  /// Component `component` of an attribute at a point, as T. The attribute must have that type.
  template <typename T>
  T value(std::string_view attribute, std::size_t point, std::size_t component = 0) const {
    const auto index = formats::find_attribute(info.schema, attribute);
    const formats::Attribute& described = info.schema.at(index.value());
    T result;
    std::memcpy(
        &result,
        points.columns[*index].data() + point * described.size_bytes() + component * sizeof(T),
        sizeof(T));
    return result;
  }

  /// One string of bytes a point, sorted: world position as three doubles, then the attributes named, each in
  /// its own bytes.
  std::vector<std::string> records(const std::vector<std::string>& attributes) const;
  /// The names of all attributes.
  std::vector<std::string> names() const;
};

/// Adds an attribute to a scan that is to be written: `values` are interleaved, as many for each of the block's points.
template <typename T>
void add_column(formats::ScanInfo& info, formats::PointBlock& block, std::string name,
                formats::ScalarType type, const std::vector<T>& values) {
  info.schema.push_back(
      {std::move(name), type, static_cast<std::uint8_t>(values.size() / block.count)});
  const auto bytes = std::as_bytes(std::span(values));
  block.columns.emplace_back(bytes.begin(), bytes.end());
}

/// The one scan of a file. Throws std::logic_error if there are more.
std::unique_ptr<formats::ScanReader> open_scan(const std::filesystem::path& path,
                                               const formats::ScanOptions& options = {});

/// Reads every stretch, in order. Checks that no stretch exceeds its capacity and that blocks are well formed.
ScanPoints read_points(const formats::ScanReader& reader);
/// As above, the one scan of a file.
ScanPoints read_points(const std::filesystem::path& path, const formats::ScanOptions& options = {});

/// Copies a scan through a writer, block by block.
void copy_scan(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace cairn::test
