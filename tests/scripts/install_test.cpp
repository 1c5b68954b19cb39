// scripts/install.cmake: what `cmake --install` leaves works wherever it is moved to, for users and for programs of others.
#include <sys/stat.h>

#include <array>
#include <cstdio>
#include <set>

#include "tests/end_to_end/program_test.h"
#include "tests/support/shared_data.h"
#include "tests/support/tiny_scans.h"

namespace cairn::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class Install : public ProgramTest {
 protected:
  /// Installs a component, or all, and moves the prefix to another place.
  fs::path install(const std::string& component) {
    std::vector<std::string> words{"cmake", "--install", fs::path(CAIRN_PROGRAM).parent_path(),
                                   "--prefix", folder_ / "first"};
    if (!component.empty()) words.insert(words.end(), {"--component", component});
    const Outcome outcome = run_program("/usr/bin/env", words);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    fs::rename(folder_ / "first", folder_ / "moved here");
    return folder_ / "moved here";
  }

  /// Relative paths of all files.
  static std::set<std::string> files_below(const fs::path& prefix) {
    std::set<std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(prefix))
      if (entry.is_regular_file()) files.insert(fs::relative(entry.path(), prefix));
    return files;
  }
};

TEST_F(Install, TheProgramReadsLazFromWhereverItsPrefixIsMoved) {
  CAIRN_NEEDS_SHARED_DATA();
  const fs::path prefix = install("program");
  const auto scans = files_in(CAIRN_SHARED_DATA "/laz", ".laz");
  ASSERT_FALSE(scans.empty());
  const std::string program = prefix / "bin/cairn";
  const Outcome built =
      run_program(program, {"build", scans.front(), "-o", output(), "--progress", "none"});
  EXPECT_EQ(built.exit_code, 0) << built.err;
  const Outcome verified =
      run_program(program, {"verify", output(), "--against", scans.front(), "--progress", "none"});
  EXPECT_EQ(verified.exit_code, 0) << verified.err;
  // Through a link, as in ~/bin.
  fs::create_symlink(program, folder_ / "link");
  const Outcome linked = run_program(
      folder_ / "link", {"build", scans.front(), "-o", output(), "--progress", "none", "--force"});
  EXPECT_EQ(linked.exit_code, 0) << linked.err;
  // Beside the program, as in a build folder, wins over what is installed.
  fs::create_directories(prefix / "bin/laz-worker");
  write_text(prefix / "bin/laz-worker/worker.cjs", "process.exit(1);");
  const Outcome beside = run_program(
      program, {"build", scans.front(), "-o", output(), "--progress", "none", "--force"});
  EXPECT_EQ(beside.exit_code, 4);
  EXPECT_THAT(beside.err, HasSubstr("the decoder of LAZ files does not start"));
}

TEST_F(Install, WithoutItsFoldersTheProgramTellsWhereItLooked) {
  CAIRN_NEEDS_SHARED_DATA();
  const fs::path prefix = install("program");
  fs::remove_all(prefix / "share/cairn");
  const auto scans = files_in(CAIRN_SHARED_DATA "/laz", ".laz");
  const Outcome outcome = run_program(
      prefix / "bin/cairn", {"build", scans.front(), "-o", output(), "--progress", "none"});
  expect_refusal(outcome, 4);
  EXPECT_THAT(outcome.err, HasSubstr((prefix / "bin/laz-worker").string()));
  EXPECT_THAT(outcome.err, HasSubstr((prefix / "share/cairn/laz-worker/worker.cjs").string()));
}

TEST_F(Install, TheProgramComesWithItsDocumentsAndNothingElse) {
  const fs::path prefix = install("program");
  const std::set<std::string> files = files_below(prefix);
  for (const char* file :
       {"bin/cairn", "share/man/man1/cairn.1", "share/bash-completion/completions/cairn",
        "share/zsh/site-functions/_cairn", "share/fish/vendor_completions.d/cairn.fish",
        "share/doc/cairn/README.md", "share/doc/cairn/FORMAT.md", "share/doc/cairn/CHANGELOG.md",
        "share/doc/cairn/LICENSE", "share/doc/cairn/examples/scenes/statue.toml",
        "share/doc/cairn/examples/default.toml", "share/doc/cairn/examples/example_levels.py",
        "share/cairn/laz-worker/worker.cjs",
        "share/cairn/laz-worker/node_modules/laz-perf/lib/node/laz-perf.wasm"})
    EXPECT_TRUE(files.contains(file)) << file;
  for (const std::string& file : files) {
    EXPECT_TRUE(file == "bin/cairn" || file.starts_with("share/")) << file;
    const std::string text = read_text(prefix / file);
    EXPECT_EQ(text.find(folder_ / "first"), std::string::npos) << file << " tells its prefix";
    EXPECT_EQ(text.find(CAIRN_SOURCE), std::string::npos) << file << " tells where it was built";
    EXPECT_NE(fs::file_size(prefix / file), 0U) << file;
    struct stat status {};
    ASSERT_EQ(::stat((prefix / file).c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 07777, file == "bin/cairn" ? 0755U : 0644U) << file;
  }
  // The page of 3D Tiles is found where it is installed.
  ASSERT_EQ(build({write_wavy_las(folder_ / "wavy.las", 3000)}).exit_code, 0);
  const Outcome tiles = run_program(
      prefix / "bin/cairn",
      {"export", output(), "--format", "3dtiles", "-o", folder_ / "tiles", "--progress", "none"});
  EXPECT_EQ(tiles.exit_code, 0) << tiles.err;
  EXPECT_EQ(read_text(folder_ / "tiles/page.js"),
            read_text(prefix / "share/cairn/tiles-page/page.js"));
  // A scene of the examples works where it lies.
  const Outcome simulated = run_program(
      prefix / "bin/cairn", {"simulate", prefix / "share/doc/cairn/examples/scenes/statue.toml",
                             "-o", folder_ / "statue", "--points", "2000", "--progress", "none"});
  EXPECT_EQ(simulated.exit_code, 0) << simulated.err;
}

TEST_F(Install, GoesBelowAFolderThatOnlyStandsForTheRoot) {
  const Outcome outcome =
      run_program("/usr/bin/env", {"DESTDIR=" + std::string(folder_ / "root"), "cmake", "--install",
                                   fs::path(CAIRN_PROGRAM).parent_path(), "--component", "program",
                                   "--prefix", "/opt/of-cairn"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(fs::exists(fs::path(folder_ / "root/opt/of-cairn/share/man/man1/cairn.1")));
  EXPECT_FALSE(fs::exists("/opt/of-cairn"));
}

TEST_F(Install, AProgramOfOthersReadsADataset) {
  ASSERT_EQ(build({write_wavy_las(folder_ / "wavy.las", 3000), "--node-points", "500",
                   "--lossless-leaves"})
                .exit_code,
            0);
  const fs::path prefix = install("reader");
  for (const std::string& file : files_below(prefix))
    EXPECT_TRUE(file.starts_with("include/cairn/formats/") || file.starts_with("lib")) << file;
  const std::string place = folder_ / "consumer";
  for (const std::vector<std::string>& words : std::vector<std::vector<std::string>>{
           {"cmake", "-G", "Ninja", "-S", CAIRN_SOURCE "/tests/consumer", "-B", place,
            "-DCMAKE_PREFIX_PATH=" + prefix.string(), "-DCMAKE_CXX_COMPILER=" CAIRN_CXX,
            "-DCMAKE_CXX_FLAGS=" CAIRN_CXX_FLAGS},
           {"cmake", "--build", place}}) {
    const Outcome outcome = run_program("/usr/bin/env", words);
    ASSERT_EQ(outcome.exit_code, 0) << outcome.out << outcome.err;
  }
  const Outcome read = run_program(place + "/consumer", {output()});
  EXPECT_EQ(read.exit_code, 0) << read.err;
  // What it reads is what the program tells of the dataset.
  const nlohmann::json told = info();
  unsigned long long nodes = 0;
  unsigned long long points = 0;
  std::array<double, 3> low{}, high{};
  ASSERT_EQ(
      std::sscanf(read.out.c_str(), "%llu nodes, %llu points, from %lf %lf %lf to %lf %lf %lf",
                  &nodes, &points, &low[0], &low[1], &low[2], &high[0], &high[1], &high[2]),
      8)
      << read.out;
  EXPECT_EQ(points, 3000U);
  EXPECT_EQ(nodes, told.at("tree").at("nodes").get<unsigned long long>());
  for (std::size_t axis = 0; axis < 3; ++axis) {
    EXPECT_DOUBLE_EQ(low[axis], told.at("bounds").at("min").at(axis).get<double>());
    EXPECT_DOUBLE_EQ(high[axis], told.at("bounds").at("max").at(axis).get<double>());
  }
  // Errors arrive as the library's own.
  EXPECT_EQ(run_program(place + "/consumer", {folder_ / "none.cairn"}).exit_code, 4);
}

#ifdef CAIRN_PYTHON
TEST_F(Install, PythonReadsADatasetFromWhereverItsPrefixIsMoved) {
  ASSERT_EQ(build({write_wavy_las(folder_ / "wavy.las", 3000), "--node-points", "500"}).exit_code,
            0);
  const fs::path prefix = install("python");
  const std::string package = CAIRN_PYTHON_FOLDER "/cairn/";
  const std::set<std::string> files = files_below(prefix);
  for (const char* file : {"__init__.py", "_core.pyi", "py.typed"})
    EXPECT_TRUE(files.contains(package + file)) << file;
  for (const std::string& file : files) {
    EXPECT_TRUE(file.starts_with(package)) << file;
    EXPECT_EQ(read_text(prefix / file).find(CAIRN_SOURCE), std::string::npos)
        << file << " tells where it was built";
  }
  const Outcome read = run_program(
      "/usr/bin/env", {"PYTHONPATH=" + (prefix / CAIRN_PYTHON_FOLDER).string(), CAIRN_PYTHON, "-c",
                       "import cairn, sys; print(cairn.__file__, "
                       "cairn.open(sys.argv[1]).level(-1).read().weight.sum())",
                       output()});
  EXPECT_EQ(read.exit_code, 0) << read.err;
  EXPECT_EQ(read.out, (prefix / package / "__init__.py").string() + " 3000\n");
}
#endif

}  // namespace
}  // namespace cairn::test
