// Reads E57 files that tests build.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/support/e57_bytes.h"
#include "tests/support/scan_points.h"
#include "tests/support/temporary_folder.h"

namespace cairn::formats {

class E57Reader : public ::testing::Test {
 protected:
  std::vector<test::ScanPoints> read_all(const test::E57Bytes& file,
                                         const ScanOptions& options = {}) {
    std::vector<test::ScanPoints> scans;
    for (const auto& reader : open_scans(folder_.write("scan.e57", file.bytes()), options))
      scans.push_back(test::read_points(*reader));
    return scans;
  }

  test::ScanPoints read(const test::E57ScanBytes& scan, const ScanOptions& options = {}) {
    return read_all({.scans = {scan}}, options).at(0);
  }

  /// Three points on a line, and one more stream.
  test::ScanPoints read_with(const test::E57Stream& stream, const std::string& xml = "") {
    test::E57ScanBytes scan{.streams = test::e57_line(3), .xml = xml};
    scan.streams.push_back(stream);
    return read(scan);
  }

  test::TemporaryFolder folder_;
};

}  // namespace cairn::formats
