// What the program shows on a terminal, and what it never sends into a pipe.
#include <sstream>

#include "tests/end_to_end/program_test.h"
#include "tests/support/environment.h"
#include "tests/support/pseudo_terminal.h"
#include "tests/support/tiny_scans.h"

namespace cairn::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

using Variables = std::map<std::string, std::string>;
const Variables kColorTerminal{
    {"TERM", "xterm-256color"}, {"NO_COLOR", ""}, {"CLICOLOR", ""}, {"COLUMNS", ""}};
constexpr const char* kEscape = "\x1b[";

class Terminal : public ProgramTest {
 protected:
  TerminalOutcome show(const std::vector<std::string>& arguments, const Variables& changed = {},
                       unsigned columns = 80) {
    Variables environment = kColorTerminal;
    for (const auto& [name, value] : changed) environment[name] = value;
    return run_on_terminal(CAIRN_PROGRAM, arguments, columns, environment);
  }

  /// Without escape sequences and carriage returns.
  static std::string plain(const std::string& text) {
    std::string out;
    for (std::size_t i = 0; i < text.size(); ++i) {
      if (text.compare(i, 2, kEscape) == 0)
        while (i < text.size() && std::isalpha(static_cast<unsigned char>(text[i])) == 0) ++i;
      else if (text[i] != '\r')
        out += text[i];
    }
    return out;
  }
};

TEST_F(Terminal, ReportsAreColoredOnATerminalAlone) {
  ASSERT_EQ(build({write_wavy_las(folder_ / "wavy.las", 3000), "--node-points", "500"}).exit_code,
            0);
  for (const std::vector<std::string>& arguments :
       std::vector<std::vector<std::string>>{{"--help"},
                                             {"build", "--help"},
                                             {"info", output()},
                                             {"report", output()},
                                             {"verify", output(), "--progress", "none"},
                                             {"measure", output(), "--progress", "none"}}) {
    SCOPED_TRACE(::testing::PrintToString(arguments));
    const Environment width(Variables{{"COLUMNS", "80"}});
    const Outcome piped = cairn(arguments);
    EXPECT_THAT(piped.out, Not(HasSubstr("\x1b")));
    const TerminalOutcome shown = show(arguments);
    EXPECT_EQ(shown.exit_code, 0);
    EXPECT_THAT(shown.text, HasSubstr(kEscape));
    EXPECT_EQ(plain(shown.text), piped.out);  // colors move nothing
    for (const Variables& none :
         {Variables{{"NO_COLOR", "1"}}, Variables{{"CLICOLOR", "0"}}, Variables{{"TERM", "dumb"}}})
      EXPECT_THAT(show(arguments, none).text, Not(HasSubstr("\x1b")));
  }
}

TEST_F(Terminal, PromisesThatHoldAreGreenAndErrorsAreRed) {
  ASSERT_EQ(build({write_wavy_las(folder_ / "wavy.las", 3000)}).exit_code, 0);
  EXPECT_THAT(show({"verify", output(), "--progress", "none"}).text,
              HasSubstr("\x1b[32mEvery checked promise holds.\x1b[0m"));
  const TerminalOutcome refused = show({"info", folder_ / "none.cairn"});
  EXPECT_EQ(refused.exit_code, 4);
  EXPECT_THAT(refused.text, HasSubstr("\x1b[1;31mcairn: error:\x1b[0m "));
  EXPECT_THAT(cairn({"info", folder_ / "none.cairn"}).err, ::testing::StartsWith("cairn: error: "));
}

TEST_F(Terminal, HelpFitsTheTerminal) {
  for (const std::string command : {"", "build", "info", "verify", "report", "measure", "study",
                                    "export", "render", "view", "simulate"})
    for (const unsigned columns : {80U, 120U}) {
      std::vector<std::string> arguments{"--help"};
      if (!command.empty()) arguments.insert(arguments.begin(), command);
      const TerminalOutcome shown = show(arguments, {}, columns);
      EXPECT_EQ(shown.exit_code, 0);
      std::istringstream lines(plain(shown.text));
      std::size_t longest = 0;
      for (std::string line; std::getline(lines, line);) {
        EXPECT_LE(line.size(), columns) << command << ": " << line;
        EXPECT_FALSE(line.ends_with(' ')) << command << ": " << line;
        longest = std::max(longest, line.size());
      }
      EXPECT_GT(longest, 60U);
    }
}

}  // namespace
}  // namespace cairn::test
