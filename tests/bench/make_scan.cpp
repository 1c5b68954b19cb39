// make_scan: writes a synthetic scan of any size, the same bytes for the same arguments.
#include <CLI/CLI.hpp>

#include <cstdint>
#include <cstdio>
#include <exception>
#include <memory>
#include <string>

#include "tests/bench/scan_writers.h"
#include "tests/bench/synthetic_scan.h"

namespace bench = cairn::bench;

int main(int argc, char** argv) {
  CLI::App app("Writes a synthetic scan, the same bytes for the same arguments", "make_scan");
  std::uint64_t count = 0, seed = 1;
  std::string shape = "statue", output;
  app.add_option("--points", count, "number of points")->required();
  app.add_option("--shape", shape, "statue, terrain or facade")
      ->check(CLI::IsMember(bench::shapes()));
  app.add_option("--seed", seed, "of jitter and noise; scans of one shape differ by it");
  app.add_option("-o,--output", output, "file to write, .las, .ply or .e57")->required();
  CLI11_PARSE(app, argc, argv);

  try {
    const std::unique_ptr<bench::ScanWriter> writer = bench::open_writer(output, count);
    bench::sweep(bench::shapes().at(shape), count, seed,
                 [&](const bench::Point& point) { writer->write(point); });
    writer->finish();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "make_scan: error: %s: %s\n", output.c_str(), error.what());
    return 1;
  }
  return 0;
}
