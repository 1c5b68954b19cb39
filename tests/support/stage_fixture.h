// What a stage needs to run in a test: a context with a folder for its arrays, and scans made of blocks.
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <utility>
#include <vector>

#include "formats/scans/scan_reader.h"
#include "stages/context.h"
#include "tests/support/temporary_folder.h"

namespace cairn::test {

class SilentProgress final : public stages::ProgressSink {
 public:
  void begin(std::string_view, std::uint64_t) override {}
  void advance(std::uint64_t) override {}
  void end() override {}
};

class StageFixture : public ::testing::Test {
 protected:
  StageFixture() {
    context_.threads = 2;
    context_.memory_bytes = std::uint64_t{1} << 30;
    context_.progress = &progress_;
    context_.make_array = [this](std::string_view name, std::uint64_t size_bytes) {
      return formats::ExternalArray(folder_ / (std::string(name) + std::to_string(next_array_++)),
                                    size_bytes);
    };
  }
  stages::Context& context() { return context_; }
  const TemporaryFolder& folder() const { return folder_; }

 private:
  TemporaryFolder folder_;
  SilentProgress progress_;
  stages::Context context_;
  int next_array_ = 0;
};

/// A scan that lies in memory: each block is a stretch.
class MemoryScan final : public formats::ScanReader {
 public:
  MemoryScan(formats::ScanInfo info, std::vector<formats::PointBlock> blocks)
      : blocks_(std::move(blocks)) {
    info_ = std::move(info);
    for (const auto& block : blocks_) info_.present_points += block.count;
    if (info_.claimed_points == 0) info_.claimed_points = info_.present_points;
  }
  std::size_t stretch_count() const override { return blocks_.size(); }
  std::uint64_t stretch_capacity(std::size_t stretch) const override {
    return blocks_[stretch].count;
  }
  void read(std::size_t stretch, const formats::BlockSink& sink) const override {
    sink(blocks_[stretch]);
  }

 private:
  std::vector<formats::PointBlock> blocks_;
};

inline std::unique_ptr<formats::ScanReader> steps_scan(formats::Schema schema,
                                                       std::vector<formats::PointBlock> blocks,
                                                       std::array<double, 3> scale = {1, 1, 1},
                                                       std::array<double, 3> offset = {0, 0, 0}) {
  formats::ScanInfo info;
  info.path = "steps";
  info.encoding = formats::PositionEncoding::kSteps;
  info.scale = scale;
  info.offset = offset;
  info.schema = std::move(schema);
  return std::make_unique<MemoryScan>(std::move(info), std::move(blocks));
}

inline std::unique_ptr<formats::ScanReader> world_scan(formats::PositionEncoding encoding,
                                                       formats::Schema schema,
                                                       std::vector<formats::PointBlock> blocks) {
  formats::ScanInfo info;
  info.path = "world";
  info.encoding = encoding;
  info.schema = std::move(schema);
  return std::make_unique<MemoryScan>(std::move(info), std::move(blocks));
}

}  // namespace cairn::test
