// A dataset of which a single byte is another: `verify` finds each, and whoever else reads it refuses the dataset or does
// without what is damaged. That is done in this process, by what the commands call, since it is done some thousand times;
// where a test dies of it, the changed file is what it leaves behind.
#include <cmath>
#include <fstream>
#include <functional>

#include <fmt/format.h>

#include "formats/error.h"
#include "stages/verify/verify.h"
#include "tests/end_to_end/program_test.h"
#include "tests/support/dataset_uses.h"

namespace cairn::test {
namespace {

using formats::DatasetReader;

constexpr int kScanPoints = 90;

/// What a byte is changed to.
using Change = std::function<std::uint8_t(std::uint8_t byte, std::size_t offset)>;

/// Points with normals, colors and what else an attribute may be.
std::string helix_ply() {
  std::string text = fmt::format(
      "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\n"
      "property float z\nproperty float nx\nproperty float ny\nproperty float nz\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\n"
      "property ushort intensity\nproperty uchar classification\nend_header\n",
      kScanPoints);
  for (int i = 0; i < kScanPoints; ++i) {
    const double t = 0.2 * i;
    text += fmt::format("{:.3f} {:.3f} {:.3f} {:.3f} {:.3f} 0 {} {} {} {} {}\n", 3 * std::cos(t),
                        3 * std::sin(t), t, std::cos(t), std::sin(t), i, 255 - i, i * 7 % 256,
                        i * 700, i % 5);
  }
  return text;
}

class ChangedByte : public ProgramTest {
 protected:
  void SetUp() override {
    const Outcome built = build({folder_.write("helix.ply", helix_ply()), "--node-points", "20"});
    ASSERT_EQ(built.exit_code, 0) << built.err;
    ASSERT_FALSE(verify_finds());
    ASSERT_GT(DatasetReader::open(output()).tree().node_count(), 4U);
  }

  /// Calls `check` for every byte of a file, changed as told.
  template <typename Check>
  void change_every_byte(const std::string& name, const Change& change, const Check& check) {
    const std::filesystem::path path = std::filesystem::path(output()) / name;
    const std::string whole = read_text(path);
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    const auto put = [&file](std::size_t offset, char byte) {
      file.seekp(static_cast<std::streamoff>(offset)).put(byte).flush();
      ASSERT_TRUE(file.good());
    };
    for (std::size_t i = 0; i < whole.size(); ++i) {
      const char changed = static_cast<char>(change(static_cast<std::uint8_t>(whole[i]), i));
      if (changed == whole[i]) continue;
      SCOPED_TRACE(fmt::format("byte {} of {} is {}", i, name, static_cast<std::uint8_t>(changed)));
      put(i, changed);
      check();
      put(i, whole[i]);
    }
  }

  /// The same of all that `verify` vouches for.
  void every_byte_is_found(const Change& change) {
    for (const char* name : {formats::dataset_file::kIndex, formats::dataset_file::kNodes,
                             formats::dataset_file::kMetadata})
      change_every_byte(name, change, [this] {
        EXPECT_TRUE(verify_finds());
        use();
      });
  }

  bool verify_finds() {
    bool held = false;
    const bool refused = !accepts([&](const DatasetReader& dataset) {
      held = stages::verify_dataset({}, dataset, std::nullopt).held();
    });
    return refused || !held;
  }

  void tell() {
    accepts([this](const DatasetReader& dataset) { tell_dataset(dataset, output()); });
  }

  /// Reads the dataset in all ways but by `verify`.
  void use() {
    tell();
    accepts([](const DatasetReader& dataset) { draw_dataset(dataset); });
    accepts([this](const DatasetReader& dataset) {
      export_dataset(dataset, dataset.tree().leaf_level(), folder_ / "leaves.las");
    });
    accepts(
        [this](const DatasetReader& dataset) { export_dataset(dataset, 0, folder_ / "root.ply"); });
  }

 private:
  /// Whether the dataset is not refused as damaged. All else that is thrown fails the test.
  template <typename Use>
  bool accepts(const Use& use) {
    try {
      use(DatasetReader::open(output()));
      return true;
    } catch (const formats::Error& error) {
      if (error.kind() != formats::ErrorKind::kInput) throw;
      return false;
    }
  }
};

std::uint8_t flip_a_bit(std::uint8_t byte, std::size_t offset) { return byte ^ 1U << offset % 8; }

/// Every bit flipped, and the bytes that damaged disks and careless writers leave.
std::vector<Change> many_changes() {
  std::vector<Change> changes;
  for (unsigned bit = 0; bit < 8; ++bit)
    changes.push_back([bit](std::uint8_t byte, std::size_t) { return byte ^ 1U << bit; });
  for (const std::uint8_t value : {0x00, 0xff})
    changes.push_back([value](std::uint8_t, std::size_t) { return value; });
  return changes;
}

TEST_F(ChangedByte, IsFoundByVerifyAndCrashesNothing) { every_byte_is_found(flip_a_bit); }

TEST_F(ChangedByte, OfTheRunRecordCrashesNothing) {
  change_every_byte("run.json", flip_a_bit, [this] { tell(); });
}

using LongChangedByte = ChangedByte;

TEST_F(LongChangedByte, IsFoundByVerifyAndCrashesNothing) {
  for (const Change& change : many_changes()) every_byte_is_found(change);
}

TEST_F(LongChangedByte, OfTheRunRecordCrashesNothing) {
  for (const Change& change : many_changes())
    change_every_byte("run.json", change, [this] { tell(); });
}

}  // namespace
}  // namespace cairn::test
