// How fast a dataset is read back: all its nodes decoded, from memory; and nodes in random order from the disk, against plain
// reads of the same ranges of bytes, each with nothing of the file in memory.
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "formats/dataset/dataset_reader.h"
#include "formats/error.h"
#include "formats/random_access_file.h"
#include "stages/parallel.h"
#include "tests/bench/spread.h"

namespace {

using namespace cairn;
using bench::print_spread;
using bench::seconds_of;
using formats::DatasetReader;
using formats::NodeId;

struct Flags {
  std::filesystem::path dataset;
  unsigned threads = 2;
  int turns = 5;
};

/// Bytes of a file that follow each other.
struct Extent {
  std::uint64_t first = UINT64_MAX, end = 0;
};

/// The sections that a renderer takes: positions, radii, and of the attributes normals and colors.
formats::SectionSet drawn_sections(const formats::Schema& schema) {
  formats::SectionSet drawn;
  drawn.set(formats::kPositionSection).set(formats::kRadiusSection);
  for (std::size_t a = 0; a < schema.size(); ++a)
    if (schema[a].name == formats::attribute_name::kNormal ||
        schema[a].name == formats::attribute_name::kColor)
      drawn.set(formats::kFirstAttributeSection + a);
  return drawn;
}

/// Decodes all nodes; returns their points.
std::uint64_t decode_all(const DatasetReader& dataset, const formats::SectionSet& wanted) {
  std::atomic<std::uint64_t> points = 0;
  stages::for_each_piece(dataset.nodes().size(), [&](std::uint64_t id) {
    points += dataset.read_node(NodeId{id}, wanted).count();
  });
  return points;
}

Extent extent_of(const formats::NodeRecord& node) {
  Extent extent;
  for (const formats::SectionRef& section : node.sections) {
    if (section.size_bytes == 0) continue;
    extent.first = std::min(extent.first, section.offset);
    extent.end = std::max(extent.end, section.offset + section.size_bytes);
  }
  return extent;
}

/// Has the kernel drop what it holds of a file.
void forget(const std::filesystem::path& path) {
  const int file = ::open(path.c_str(), O_RDONLY);
  if (file < 0) return;
  ::fsync(file);
  ::posix_fadvise(file, 0, 0, POSIX_FADV_DONTNEED);
  ::close(file);
}

void print_decoding(const DatasetReader& dataset, const Flags& flags) {
  const std::pair<std::string, formats::SectionSet> kinds[] = {
      {"all sections", formats::all_sections()},
      {"what is drawn", drawn_sections(dataset.header().schema)}};
  std::vector<double> rates[std::size(kinds)];
  for (int turn = -1; turn < flags.turns; ++turn)  // the first brings the file into memory
    for (std::size_t i = 0; i < std::size(kinds); ++i) {
      std::uint64_t points = 0;
      const double seconds = seconds_of([&] {
        stages::run_in_arena(flags.threads, [&] { points = decode_all(dataset, kinds[i].second); });
      });
      if (turn >= 0) rates[i].push_back(static_cast<double>(points) / seconds / 1e6);
    }
  for (std::size_t i = 0; i < std::size(kinds); ++i)
    print_spread("decoded, " + kinds[i].first, rates[i], "million points a second");
}

void print_random_access(const DatasetReader& dataset, const Flags& flags) {
  const std::filesystem::path path = flags.dataset / formats::dataset_file::kNodes;
  const formats::RandomAccessFile file(path);
  std::vector<std::uint64_t> order(dataset.nodes().size());
  for (std::uint64_t id = 0; id < order.size(); ++id) order[id] = id;
  std::shuffle(order.begin(), order.end(), std::mt19937_64(1));
  double bytes = 0;
  for (const formats::NodeRecord& node : dataset.nodes()) {
    const Extent extent = extent_of(node);
    bytes += static_cast<double>(extent.end - extent.first);
  }
  const auto read_plainly = [&](std::uint64_t id) {
    const Extent extent = extent_of(dataset.nodes()[id]);
    std::vector<std::byte> buffer(extent.end - extent.first);
    file.read_exactly(extent.first, buffer);
  };
  const auto read_node = [&](std::uint64_t id) {
    dataset.read_node(NodeId{id}, formats::all_sections());
  };
  std::vector<double> plain, nodes, ratio;
  const auto rate_of = [&](const auto& read) {
    forget(path);
    return bytes / 1e6 / seconds_of([&] {
             stages::run_in_arena(flags.threads, [&] {
               stages::for_each_piece(order.size(), [&](std::uint64_t i) { read(order[i]); });
             });
           });
  };
  for (int turn = 0; turn < flags.turns; ++turn) {
    plain.push_back(rate_of(read_plainly));
    nodes.push_back(rate_of(read_node));
    ratio.push_back(nodes.back() / plain.back());
  }
  print_spread("plain reads, random nodes", plain, "MB/s");
  print_spread("read and decoded", nodes, "MB/s");
  print_spread("share of the disk's rate", ratio, "");
}

void run(const Flags& flags) {
  const DatasetReader dataset = DatasetReader::open(flags.dataset);
  fmt::print("{} nodes, {} threads, {} turns\n", dataset.nodes().size(), flags.threads,
             flags.turns);
  print_decoding(dataset, flags);
  print_random_access(dataset, flags);
}

}  // namespace

int main(int argc, char** argv) {
  Flags flags;
  CLI::App app("Times the decoding of a dataset, and reads of random nodes against the disk's.");
  app.add_option("dataset", flags.dataset, "a dataset's folder")->required();
  app.add_option("--threads", flags.threads)->check(CLI::PositiveNumber)->capture_default_str();
  app.add_option("--turns", flags.turns)->check(CLI::PositiveNumber)->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    run(flags);
  } catch (const formats::Error& error) {
    fmt::print(stderr, "read_back: {}\n", error.what());
    return 1;
  }
}
