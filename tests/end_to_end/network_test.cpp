// The program on datasets behind HTTP: what it says of them is what it says of the same folder, and failures are one line.
#include <algorithm>
#include <fstream>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <thread>

#include "tests/end_to_end/below_root.h"
#include "tests/end_to_end/render_fixture.h"
#include "tests/support/environment.h"
#include "tests/support/web_server.h"

namespace cairn::test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class Network : public Render {
 protected:
  void SetUp() override {
    Render::SetUp();
    server_.emplace(folder_.path());
  }
  std::string url() const { return server_->url("site.cairn"); }
  Outcome remote(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--web-cache", folder_ / "cache"});
    return cairn(std::move(arguments));
  }
  static std::string replaced(std::string text, const std::string& from, const std::string& to) {
    for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
      text.replace(at, from.size(), to);
    return text;
  }
  /// One line on stderr, nothing on stdout.
  void expect_line(const Outcome& outcome, int code, const std::string& text) {
    EXPECT_EQ(outcome.exit_code, code) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    const auto lines = lines_of(outcome.err);
    ASSERT_EQ(lines.size(), 1U) << outcome.err;
    EXPECT_THAT(lines.front(), AllOf(::testing::StartsWith("cairn: error: "), HasSubstr(text)));
  }
  void fail(const std::string& file, const WebFault& fault) {
    server_->set_script([=](const WebRequest& request) -> std::optional<WebFault> {
      return request.asks_for(file) ? std::optional(fault) : std::nullopt;
    });
  }
  /// Ctrl-C ends the command, which waits for what `waits` asks for, at once.
  void expect_stop(const std::vector<std::string>& arguments,
                   const std::function<bool(const WebRequest&)>& waits) {
    SCOPED_TRACE(testing::PrintToString(arguments));
    server_->set_script([=](const WebRequest& request) -> std::optional<WebFault> {
      return waits(request) ? std::optional(WebFault{.kind = WebFault::kStall}) : std::nullopt;
    });
    const std::size_t before = server_->requests().size();
    const auto has_asked = [&] {
      const auto requests = server_->requests();
      const auto begin = requests.begin() + static_cast<std::ptrdiff_t>(before);
      return std::any_of(begin, requests.end(), waits);
    };
    RunningProgram program(CAIRN_PROGRAM, arguments);
    while (program.running() && !has_asked())
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    program.signal(SIGINT);
    const Outcome outcome = program.wait(std::chrono::seconds(10));
    EXPECT_EQ(outcome.exit_code, 128 + SIGINT);
    EXPECT_THAT(outcome.err, HasSubstr("stopped by SIGINT"));
  }

  std::optional<WebServer> server_;
};

TEST_F(Network, CommandsTellWhatTheyTellOfTheFolder) {
  std::filesystem::remove(output() + "/run.json");  // how it was built is not told over a network
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"info"},
        {"info", "--json"},
        {"report"},
        {"verify", "--progress", "none"},
        {"measure", "--progress", "none", "--sample", "1000", "--threads", "2"}}) {
    SCOPED_TRACE(testing::PrintToString(command));
    std::vector<std::string> local = command, web = command;
    local.push_back(output());
    web.push_back(url());
    const Outcome expected = cairn(local), found = remote(web);
    EXPECT_EQ(found.exit_code, 0) << found.err;
    EXPECT_EQ(expected.exit_code, 0) << expected.err;
    EXPECT_EQ(found.err, "");
    EXPECT_EQ(replaced(found.out, url(), output()), expected.out);
  }
}

TEST_F(Network, ExportAndPicturesAreThoseOfTheFolder) {
  for (const char* name : {"leaves.las", "leaves.ply"}) {
    ASSERT_EQ(cairn({"export", output(), "-o", file(name), "--progress", "none"}).exit_code, 0);
    const std::string web = std::string("web-") + name;
    const Outcome outcome = remote({"export", url(), "-o", file(web), "--progress", "none"});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_EQ(read_text(file(web)), read_text(file(name)));
  }
  render("local.png", {"--budget", "2000"});
  const Outcome outcome = remote({"render", url(), "-o", file("web.png"), "--stats", "json",
                                  "--size", "320x200", "--budget", "2000"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(read_text(file("web.png")), read_text(file("local.png")));
  const auto network = nlohmann::json::parse(outcome.out)["network"];
  EXPECT_GT(network["requests"], 0);
  EXPECT_GT(network["drawn_bytes"], 0);
  EXPECT_GT(network["full_front_s"], 0);
}

TEST_F(Network, NothingIsFetchedTwice) {
  const std::vector<std::string> command{"verify", url(), "--progress", "none", "--threads", "2"};
  ASSERT_EQ(remote(command).exit_code, 0);
  std::uint64_t all = 1;
  for (const char* name : {"index.bin", "nodes.bin", "metadata.json"})
    all += std::filesystem::file_size(output() + "/" + name);
  EXPECT_LE(server_->body_bytes(), all);
  const std::uint64_t sent = server_->body_bytes();
  ASSERT_EQ(remote(command).exit_code, 0);
  EXPECT_LE(server_->body_bytes(), sent + 1);
}

TEST_F(Network, AWalkWithoutWaitingDrawsWhatIsThere) {
  write_text(file("walk.toml"), kWalk);
  const Outcome outcome =
      remote({"render", url(), "--path", file("walk.toml"), "-o", file("walk.csv"), "--size",
              "160x100", "--stats", "json", "--real-time"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  std::ifstream table(file("walk.csv"));
  std::string header, row;
  std::getline(table, header);
  EXPECT_TRUE(header.ends_with(",draw_ms,elapsed_s,fetched_bytes")) << header;
  std::size_t rows = 0;
  double last = 0;
  for (; std::getline(table, row); ++rows) {
    const std::string fetched = row.substr(row.rfind(',') + 1);
    const std::size_t before = row.rfind(',', row.rfind(',') - 1);
    const double elapsed = std::stod(row.substr(before + 1));
    EXPECT_GE(elapsed, last);
    EXPECT_GE(elapsed, static_cast<double>(rows) / 10) << "no frame before its time";
    last = elapsed;
  }
  EXPECT_EQ(rows, kWalkFrames);
}

TEST_F(Network, ANodeThatDoesNotComeIsDrawnByItsAncestorAndToldOnce) {
  render("local.png");
  server_->set_script(
      [waits = asks_below_root(output())](const WebRequest& request) -> std::optional<WebFault> {
        if (!waits(request)) return std::nullopt;
        return WebFault{.kind = WebFault::kStatus, .status = 404};
      });
  const Outcome outcome =
      remote({"render", url(), "-o", file("web.png"), "--size", "320x200", "--stats", "json"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto lines = lines_of(outcome.err);
  ASSERT_EQ(lines.size(), 1U) << outcome.err;
  EXPECT_THAT(lines.front(), AllOf(HasSubstr("cairn: warning: "), HasSubstr("status 404"),
                                   HasSubstr("drawn by what stands for it")));
  EXPECT_GT(nlohmann::json::parse(outcome.out)["unreachable"], 0);
}

TEST_F(Network, FailuresAreOneLineAndTheRightExitCode) {
  const auto info = [&] { return remote({"info", url()}); };
  fail("index.bin", {.kind = WebFault::kStatus, .status = 404});
  expect_line(info(), 4, url() + "/index.bin at byte 0: found status 404");
  fail("index.bin", {.kind = WebFault::kWhole});
  expect_line(info(), 4, "the server does not answer requests for ranges");
  fail("index.bin", {.kind = WebFault::kDamage, .bytes = 30});
  expect_line(info(), 3, url() + "/index.bin");
  fail("metadata.json", {.kind = WebFault::kDamage, .bytes = 30});
  expect_line(info(), 3, url() + "/metadata.json");
  fail("nodes.bin", {.kind = WebFault::kOtherTotal, .bytes = 77});
  expect_line(info(), 3, "the file has not the size that the index tells");
  server_->set_script({});
  expect_line(remote({"info", "http://127.0.0.1:1/site.cairn"}), 4,
              "http://127.0.0.1:1/site.cairn/index.bin");
  expect_line(remote({"info", "http://"}), 2, "an address of a dataset");
  expect_line(remote({"info", "http://me:secret@host/site.cairn"}), 2, "without a user name");
  expect_line(cairn({"info", url(), "--web-cache", file("a.las")}), 4, "a.las");
  expect_line(remote({"info", url(), "--web-cache-size", "much"}), 2, "--web-cache-size");
}

TEST_F(Network, WithoutACacheNothingIsLeftBehind) {
  const auto before = entries();
  const Outcome outcome = cairn({"verify", url(), "--progress", "none", "--web-cache", "off"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(entries(), before);
}

TEST_F(Network, AHomeThatCannotBeWrittenToIsNoFailure) {
  const Environment environment(
      std::map<std::string, std::string>{{"XDG_CACHE_HOME", "/proc/none"}});
  const Outcome outcome = cairn({"info", url()});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  expect_line(cairn({"info", url(), "--web-cache", "/proc/none/cairn"}), 4, "/proc/none/cairn");
}

TEST_F(Network, HowAFolderOfTheAddressesNameWasBuiltIsNotTold) {
  const std::string folder = file(url());
  std::filesystem::create_directories(folder);
  std::filesystem::copy_file(output() + "/run.json", folder + "/run.json");
  const auto before = std::filesystem::current_path();
  std::filesystem::current_path(folder_.path());
  const Outcome here = cairn({"info", "site.cairn"}), web = remote({"info", url()});
  std::filesystem::current_path(before);
  EXPECT_EQ(web.exit_code, 0) << web.err;
  EXPECT_THAT(here.out, HasSubstr("threads"));
  EXPECT_THAT(web.out, Not(HasSubstr("threads")));
}

TEST_F(Network, CtrlCEndsWaitingForAServer) {
  expect_stop({"info", url(), "--web-cache", "off"},
              [](const WebRequest& request) { return request.asks_for("index.bin"); });
}

TEST_F(Network, CtrlCEndsWaitingForAName) {
  const Environment environment({{"LD_PRELOAD", CAIRN_FAULTS}, {"CAIRN_FAULT", "lookup"}});
  RunningProgram program(CAIRN_PROGRAM, {"info", "http://host.test/a", "--web-cache", "off"});
  while (program.running() && program.err().find("looking up") == std::string::npos)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  program.signal(SIGINT);
  const Outcome outcome = program.wait(std::chrono::seconds(10));
  EXPECT_EQ(outcome.exit_code, 128 + SIGINT);
  EXPECT_THAT(outcome.err, HasSubstr("stopped by SIGINT"));
}

TEST_F(Network, CtrlCEndsWaitingForNodes) {
  write_text(file("walk.toml"), kWalk);
  const auto below = asks_below_root(output());
  expect_stop({"render", url(), "-o", file("web.png"), "--web-cache", "off"}, below);
  expect_stop({"render", url(), "--path", file("walk.toml"), "--wait", "-o", file("walk.csv"),
               "--web-cache", "off"},
              below);
  expect_stop({"verify", url(), "--progress", "none", "--web-cache", "off"}, below);
  EXPECT_FALSE(std::filesystem::exists(file("web.png")));
  EXPECT_FALSE(std::filesystem::exists(file("walk.csv")));
}

}  // namespace
}  // namespace cairn::test
