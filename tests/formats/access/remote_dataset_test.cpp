// A dataset read over HTTP against the same one read from the disk.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <set>
#include <thread>

#include "formats/checksum.h"
#include "formats/dataset/dataset_reader.h"
#include "formats/dataset/read_ahead.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/tiny_dataset.h"
#include "tests/support/web_server.h"

namespace cairn::formats {
namespace {

using std::chrono::milliseconds;
using test::WebFault;
using test::WebRequest;
using testing::HasSubstr;

class RemoteDataset : public testing::Test {
 protected:
  explicit RemoteDataset(test::WebVersions versions = test::WebVersions::kTags)
      : server_(folder_.path(), versions) {
    test::write_tiny_dataset(site(), test::make_tiny_tree(test::tiny_header()));
  }
  std::filesystem::path site() const { return folder_ / "site.cairn"; }
  AccessOptions options(bool kept = false) const {
    return {.cache_folder = kept ? folder_ / "cache" : "",
            .stall_timeout = std::chrono::seconds(5),
            .attempts = 3,
            .first_delay = milliseconds(1)};
  }
  DatasetReader open(bool kept = false) {
    return DatasetReader::open(server_.url("site.cairn"), options(kept));
  }
  /// All of it is what the disk has.
  void expect_same(const DatasetReader& remote, const SectionSet& wanted = all_sections()) const {
    const DatasetReader local = DatasetReader::open(site());
    EXPECT_EQ(remote.head(), local.head());
    EXPECT_EQ(remote.nodes(), local.nodes());
    EXPECT_EQ(remote.metadata(), local.metadata());
    EXPECT_EQ(remote.index_size_bytes(), local.index_size_bytes());
    for (std::uint64_t i = 0; i < local.tree().node_count(); ++i) {
      const NodeData found = remote.read_node(NodeId{i}, wanted);
      const NodeData expected = local.read_node(NodeId{i}, wanted);
      EXPECT_EQ(found.position, expected.position);
      EXPECT_EQ(found.radius, expected.radius);
      EXPECT_EQ(found.attributes, expected.attributes);
      EXPECT_EQ(found.representative, expected.representative);
    }
  }
  /// Opening ends in one line of this kind.
  void expect_refusal(ErrorKind kind, const std::string& text) {
    try {
      open();
      ADD_FAILURE() << "opened";
    } catch (const Error& error) {
      EXPECT_EQ(error.kind(), kind) << error.what();
      EXPECT_THAT(error.what(), HasSubstr(text));
      EXPECT_THAT(error.what(), HasSubstr(server_.url("site.cairn/")));
    }
  }
  void damage(const char* file, std::uint64_t byte) const {
    auto bytes = test::read_file(site() / file);
    bytes[byte] ^= std::byte{1};
    test::write_file(site() / file, bytes);
  }
  /// Answers every request for `file` by the fault, or the first few.
  void fail(const char* file, WebFault fault, int times = 1'000'000) {
    server_.set_script(
        [=, left = times](const WebRequest& request) mutable -> std::optional<WebFault> {
          if (!request.asks_for(file) || left == 0) return std::nullopt;
          --left;
          return fault;
        });
  }

  test::TemporaryFolder folder_;
  test::WebServer server_;
};

TEST_F(RemoteDataset, IsWhatTheDiskHas) {
  const DatasetReader remote = open();
  EXPECT_TRUE(remote.is_remote());
  expect_same(remote);
}

TEST_F(RemoteDataset, OpensWithThreeRequestsAtATime) {
  open();
  const auto requests = server_.requests();
  ASSERT_EQ(requests.size(), 3u);
  EXPECT_EQ(std::ranges::count_if(requests, [](const auto& r) { return r.asks_for("nodes.bin"); }),
            1);
  EXPECT_EQ(std::ranges::count_if(requests, [](const auto& r) { return r.asks_for("index.bin"); }),
            1);
}

TEST_F(RemoteDataset, OnlyWantedSectionsAreFetched) {
  const DatasetReader remote = open();
  const SectionSet wanted = SectionSet().set(kPositionSection);
  const std::uint64_t before = remote.access().fetched_bytes;
  remote.read_node(NodeId{0}, wanted);
  EXPECT_EQ(remote.access().fetched_bytes - before,
            remote.record(NodeId{0}).sections[0].size_bytes);
}

TEST_F(RemoteDataset, ALaterRunFetchesNothingAgain) {
  expect_same(open(true));
  const std::uint64_t sent = server_.body_bytes();
  const DatasetReader again = open(true);
  expect_same(again);
  EXPECT_LE(server_.body_bytes() - sent, 1u) << "the byte that tells the size of nodes.bin";
  EXPECT_LE(again.access().requests, 2u);
}

TEST_F(RemoteDataset, AnotherDatasetAtTheSameAddressIsReadAnew) {
  expect_same(open(true));
  test::write_tiny_dataset(site(), test::make_tiny_tree(test::tiny_header(), 30'000));
  expect_same(open(true));
}

/// Behind a server that tells versions apart by times alone.
class TimedDataset : public RemoteDataset, public testing::WithParamInterface<int> {
 protected:
  TimedDataset() : RemoteDataset(test::WebVersions::kTimes) {}
  /// In the place of the dataset, with files as old as its own or, by the parameter in seconds, older.
  void replace(const test::TinyTree& tree) const {
    const auto written = std::filesystem::last_write_time(site() / "index.bin");
    test::write_tiny_dataset(site(), tree);
    for (const auto& file : std::filesystem::directory_iterator(site()))
      std::filesystem::last_write_time(file.path(), written - std::chrono::seconds(GetParam()));
  }
};

TEST_P(TimedDataset, AnotherDatasetThatIsNotYoungerIsReadAnew) {
  expect_same(open(true));
  replace(test::make_tiny_tree(test::tiny_header(), 30'000));
  expect_same(open(true));
  const DatasetReader again = open(true);
  expect_same(again);
  EXPECT_LE(again.access().requests, 2u) << "and is kept";
}

TEST_P(TimedDataset, OneOfTheSameSizesIsReadAnewAfterOneFailureAtMost) {
  open(true);
  const auto written = std::filesystem::last_write_time(site() / "index.bin");
  auto nodes = test::read_file(site() / "nodes.bin");
  test::edit_index(site(), [&](DatasetIndex& index) {
    SectionRef& section = index.nodes[0].sections[0];
    nodes[section.offset] ^= std::byte{1};
    section.checksum = checksum_of(std::span(nodes).subspan(section.offset, section.size_bytes));
  });
  test::write_file(site() / "nodes.bin", nodes);
  std::filesystem::last_write_time(site() / "index.bin",
                                   written - std::chrono::seconds(GetParam()));
  if (GetParam() == 0) EXPECT_THROW(open(true).read_node(NodeId{0}, all_sections()), Error);
  EXPECT_EQ(open(true).nodes(), DatasetReader::open(site()).nodes());
}

INSTANTIATE_TEST_SUITE_P(SecondsOlder, TimedDataset, testing::Values(0, 3600));

TEST_F(RemoteDataset, ADamagedCacheGivesNoWrongPoint) {
  expect_same(open(true));
  for (const auto& entry : std::filesystem::directory_iterator(folder_ / "cache")) {
    auto bytes = test::read_file(entry.path());
    bytes[bytes.size() / 2] ^= std::byte{4};
    test::write_file(entry.path(), bytes);
  }
  expect_same(open(true));
}

TEST_F(RemoteDataset, ACacheOfAnothersBytesGivesNoWrongPoint) {
  // Entries whose own checksums fit, with bytes of another section of the same size.
  expect_same(open(true));
  std::vector<std::filesystem::path> entries;
  for (const auto& entry : std::filesystem::directory_iterator(folder_ / "cache"))
    entries.push_back(entry.path());
  for (std::size_t i = 1; i < entries.size(); ++i)
    std::filesystem::copy_file(entries[0], entries[i],
                               std::filesystem::copy_options::overwrite_existing);
  expect_same(open(true));
}

TEST_F(RemoteDataset, DamageOnTheWayComesRight) {
  for (const char* file : {"index.bin", "metadata.json", "nodes.bin"}) {
    fail(file, {.kind = WebFault::kDamage, .bytes = file == std::string("nodes.bin") ? 0u : 30u},
         1);
    const DatasetReader remote = open();
    fail(file, {.kind = WebFault::kDamage, .bytes = 0}, 1);
    expect_same(remote);
  }
}

TEST_F(RemoteDataset, DamageOnTheServerIsRefused) {
  damage("index.bin", 300);
  expect_refusal(ErrorKind::kInput, "checksum");
  damage("index.bin", 300);
  damage("metadata.json", 10);
  expect_refusal(ErrorKind::kInput, "checksum");
  damage("metadata.json", 10);
  const DatasetReader remote = open();
  damage("nodes.bin", 0);
  EXPECT_THROW(remote.read_node(NodeId{0}, all_sections()), Error);
}

TEST_F(RemoteDataset, AFileOfAnotherSizeIsRefused) {
  for (const char* file : {"nodes.bin", "metadata.json", "index.bin"}) {
    const auto whole = test::read_file(site() / file);
    auto longer = whole;
    longer.push_back({});
    test::write_file(site() / file, longer);
    expect_refusal(ErrorKind::kInput, "size");
    test::write_file(site() / file, whole);
  }
  expect_same(open());
}

TEST_F(RemoteDataset, AMissingFileIsToldByItsAddress) {
  for (const char* file : {"nodes.bin", "metadata.json", "index.bin"}) {
    std::filesystem::rename(site() / file, site() / "away");
    expect_refusal(ErrorKind::kSystem, std::string(file) + " at byte 0: found status 404");
    std::filesystem::rename(site() / "away", site() / file);
  }
}

TEST_F(RemoteDataset, AServerWithoutRangesIsToldAtOnce) {
  fail("index.bin", {.kind = WebFault::kWhole});
  expect_refusal(ErrorKind::kSystem, "does not answer requests for ranges");
}

TEST_F(RemoteDataset, SizesThatAreOnlyClaimedTakeNoMemory) {
  // The head of an index of three gigabytes, right in itself: its page checksums alone are more than is asked for first.
  DatasetIndex index;
  ASSERT_FALSE(parse_index(test::read_file(site() / "index.bin"), index));
  DatasetHeader& header = index.head.dataset;
  header.points = header.target_points << 22;
  header.read_points = header.points + header.dropped_points;
  const IndexLayout layout = layout_of(header);
  ASSERT_GT(layout.pages_offset, 300'000u);
  ASSERT_GT(layout.size_bytes, 3'000'000'000u);
  auto bytes = write_index_head(index.head, std::vector<std::uint64_t>(layout.page_count, 7));
  bytes.resize(bytes.size() + 1000);  // of the first page
  test::write_file(site() / "index.bin", bytes);
  fail("index.bin", {.kind = WebFault::kOtherTotal, .bytes = layout.size_bytes});
  expect_refusal(ErrorKind::kSystem, "the server answered another range");
  std::uint64_t end = 0;
  for (const WebRequest& request : server_.requests()) {
    EXPECT_LE(*request.last - *request.first, std::uint64_t{9} << 20);
    if (request.asks_for("index.bin")) end = std::max(end, *request.last);
  }
  EXPECT_GT(end, layout.pages_offset) << "the first pages have been asked for";
}

/// Of 1023 nodes: the index has more bytes than are asked for first.
class LargeIndex : public RemoteDataset {
 protected:
  LargeIndex() {
    DatasetHeader header = test::tiny_header();
    header.points = header.target_points * 512;
    header.read_points = header.points + header.dropped_points;
    test::write_tiny_dataset(site(), test::make_tiny_tree(header));
    DatasetIndex index;
    EXPECT_FALSE(parse_index(test::read_file(site() / "index.bin"), index));
    layout_ = layout_of(index.head.dataset);
    EXPECT_GT(layout_.size_bytes, 300'000u);
  }
  /// Ranges of index.bin that were asked for.
  std::vector<IndexRange> asked() const {
    std::vector<IndexRange> ranges;
    for (const WebRequest& request : server_.requests())
      if (request.asks_for("index.bin"))
        ranges.push_back({*request.first, *request.last + 1 - *request.first});
    return ranges;
  }

  IndexLayout layout_;
};

TEST_F(LargeIndex, ComesInPagesBehindItsFront) {
  const DatasetReader remote = open(), local = DatasetReader::open(site());
  EXPECT_EQ(remote.nodes(), local.nodes());
  EXPECT_EQ(remote.metadata(), local.metadata());
  const NodeId last{local.tree().node_count() - 1};
  EXPECT_EQ(remote.read_node(last, all_sections()).position,
            local.read_node(last, all_sections()).position);
}

TEST_F(LargeIndex, IsKeptAsAWhole) {
  open(true);
  const DatasetReader again = open(true);
  EXPECT_EQ(again.nodes(), DatasetReader::open(site()).nodes());
  EXPECT_LE(again.access().fetched_bytes, 1u);
}

TEST_F(LargeIndex, OfADamagedPageThatPageAloneComesAgain) {
  server_.set_script([times = 1](const WebRequest& request) mutable -> std::optional<WebFault> {
    if (!request.asks_for("index.bin") || request.first == 0u || times-- <= 0) return std::nullopt;
    return WebFault{.kind = WebFault::kDamage, .bytes = 0};
  });
  const DatasetReader remote = open();
  EXPECT_EQ(remote.nodes(), DatasetReader::open(site()).nodes());
  const auto ranges = asked();
  ASSERT_GE(ranges.size(), 3u);
  EXPECT_EQ(std::ranges::count(ranges, 0u, &IndexRange::first), 1) << "the front is good";
  EXPECT_EQ(remote.access().repeated_bytes, layout_.bytes_of(0).count);
}

TEST_F(LargeIndex, DamageOnTheServerIsRefused) {
  damage("index.bin", layout_.size_bytes - 10);
  expect_refusal(ErrorKind::kInput, "checksum");
}

TEST_F(LargeIndex, CutsAnywhereEndInOneLine) {
  const auto whole = test::read_file(site() / "index.bin");
  for (const std::uint64_t size : {layout_.pages_offset, layout_.size_bytes - 1}) {
    auto cut = whole;
    cut.resize(size);
    test::write_file(site() / "index.bin", cut);
    expect_refusal(ErrorKind::kInput, "size of the index");
  }
}

TEST_F(RemoteDataset, ADatasetReplacedWhileItIsReadGivesNoWrongPoint) {
  const DatasetReader remote = open();
  const NodeData root = remote.read_node(NodeId{0}, all_sections());
  test::write_tiny_dataset(site(), test::make_tiny_tree(test::tiny_header(), 30'000));
  try {
    remote.read_node(NodeId{1}, all_sections());
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), ErrorKind::kInput);
    EXPECT_THAT(error.what(), HasSubstr("the dataset changed while it was read"));
  }
  EXPECT_EQ(remote.read_node(NodeId{0}, all_sections()).position, root.position);
}

TEST_F(RemoteDataset, WishesMakeNodesReady) {
  const DatasetReader remote = open();
  const auto wishes = remote.make_wishes(all_sections());
  std::vector<NodeId> nodes;
  for (std::uint64_t i = 0; i < remote.tree().node_count(); ++i) nodes.push_back(NodeId{i});
  wishes->replace(nodes);
  for (const NodeId id : nodes)
    while (!wishes->ready(id)) std::this_thread::sleep_for(milliseconds(1));
  const std::size_t requests = server_.requests().size();
  expect_same(remote);
  EXPECT_EQ(server_.requests().size(), requests);
  EXPECT_LE(remote.access().fetched_bytes, remote.index_size_bytes() + remote.metadata().size() +
                                               remote.head().nodes_size_bytes + 1);
}

TEST_F(RemoteDataset, ReadingAheadBringsEveryNodeOnce) {
  const DatasetReader remote = open();
  std::vector<NodeId> order;
  for (std::uint64_t i = remote.tree().node_count(); i-- > 0;) order.push_back(NodeId{i});
  ReadAhead ahead(remote, all_sections(), order);
  const DatasetReader local = DatasetReader::open(site());
  for (const NodeId id : order) {
    ahead.next();
    EXPECT_EQ(remote.read_node(id, all_sections()).position,
              local.read_node(id, all_sections()).position);
  }
  ahead.next();  // behind the end
  EXPECT_LE(server_.body_bytes(), remote.index_size_bytes() + remote.metadata().size() +
                                      remote.head().nodes_size_bytes + 1);
}

TEST_F(RemoteDataset, EveryFaultAnywhereEndsInPointsOrOneLine) {
  using Kind = WebFault::Kind;
  const Kind kinds[] = {WebFault::kReset,       WebFault::kShort,      WebFault::kDrop,
                        WebFault::kWhole,       WebFault::kStatus,     WebFault::kOtherRange,
                        WebFault::kNoRange,     WebFault::kOtherTotal, WebFault::kLongLength,
                        WebFault::kShortLength, WebFault::kDamage,     WebFault::kTag,
                        WebFault::kGarbage};
  // What passes is passed over; so is what one more look at all of the files puts right.
  const std::set<Kind> passing{WebFault::kReset,      WebFault::kShort,       WebFault::kDrop,
                               WebFault::kLongLength, WebFault::kShortLength, WebFault::kDamage,
                               WebFault::kGarbage};
  for (const Kind kind : kinds)
    for (std::size_t victim = 0; victim < 6; ++victim) {
      const std::size_t base = server_.requests().size();
      server_.set_script([=](const WebRequest& request) -> std::optional<WebFault> {
        if (request.number - base != victim) return std::nullopt;
        return WebFault{.kind = kind, .bytes = 1, .status = 404, .text = "x"};
      });
      try {
        expect_same(open());
      } catch (const Error& error) {
        EXPECT_FALSE(passing.contains(kind)) << kind << " at " << victim << ": " << error.what();
        EXPECT_NE(error.kind(), ErrorKind::kInvariant) << error.what();
        EXPECT_NE(error.kind(), ErrorKind::kUsage) << error.what();
        EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
      }
    }
}

}  // namespace
}  // namespace cairn::formats
