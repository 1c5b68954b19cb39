// The manual page and the completions that the program generates, read by the programs that they are for, and held to
// what --help tells.
#include <algorithm>
#include <set>
#include <sstream>

#include "tests/end_to_end/program_test.h"
#include "tests/support/tiny_scans.h"

namespace cairn::test {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::IsSupersetOf;
using ::testing::Not;
using ::testing::UnorderedElementsAre;

using Words = std::vector<std::string>;

Words lines_in(const std::string& text) {
  Words lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

class Manual : public ProgramTest {
 protected:
  std::string generate(const std::string& what) {
    const Outcome outcome = cairn({"--generate", what});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_EQ(outcome.err, "");
    const std::string file = folder_ / ("cairn." + what);
    write_text(file, outcome.out);
    return file;
  }

  /// The commands that `cairn --help` lists.
  Words commands() {
    Words names;
    bool listed = false;
    for (const std::string& line : lines_in(cairn({"--help"}).out)) {
      if (line == "Commands:")
        listed = true;
      else if (listed && line.empty())
        break;
      else if (listed && line[2] != ' ')
        names.push_back(line.substr(2, line.find(' ', 2) - 2));
    }
    EXPECT_GE(names.size(), 10U);
    return names;
  }

  /// The long flags that the help of a command (none: of the program) tells.
  std::set<std::string> flags_of(const std::string& command) {
    std::set<std::string> flags;
    const Words arguments = command.empty() ? Words{"--help"} : Words{command, "--help"};
    for (const std::string& line : lines_in(cairn(arguments).out)) {
      // A row of a flag: "  -o, --output NAME" or "      --codec NAME".
      const std::size_t at = line.find("--");
      if (!line.starts_with("  ") || at != 6 || (line[2] != '-' && line[2] != ' ')) continue;
      flags.insert(line.substr(at, line.find_first_of(" \n", at) - at));
    }
    EXPECT_TRUE(flags.contains("--help")) << command;
    return flags;
  }

  /// What bash offers for the last word; words are told as bash tells them, which takes '=' for one of its own.
  Words bash(Words line) {
    line.insert(
        line.begin(),
        {"--norc", "--noprofile", "-c",
         "cd \"$0\" && source ./cairn.bash && COMP_WORDS=(\"$@\") COMP_CWORD=$(($# - 1)) && "
         "_cairn cairn \"${COMP_WORDS[COMP_CWORD]}\" \"${COMP_WORDS[COMP_CWORD - 1]}\"; "
         "[[ ${#COMPREPLY[@]} -eq 0 ]] || printf '%s\\n' \"${COMPREPLY[@]}\"",
         folder_.path(), "cairn"});
    const Outcome outcome = run_program("/bin/bash", line);
    EXPECT_EQ(outcome.err, "");
    return lines_in(outcome.out);
  }

  /// What fish offers at the end of a command line, without descriptions.
  Words fish(const std::string& line) {
    const Outcome outcome =
        run_program("/usr/bin/fish",
                    {"--no-config", "-c", "cd $argv[1]; source ./cairn.fish; complete -C $argv[2]",
                     folder_.path(), line});
    EXPECT_EQ(outcome.err, "");
    Words offered = lines_in(outcome.out);
    for (std::string& word : offered) word = word.substr(0, word.find('\t'));
    return offered;
  }

  void make_files() {
    for (const char* name : {"a.las", "b.LAZ", "c d.ply", "notes.pdf", "walk.toml"})
      folder_.write(name, "");
    std::filesystem::create_directories(folder_ / "site.cairn");
  }
};

TEST_F(Manual, ThePageRendersWithoutWarnings) {
  const std::string page = generate("man");
  // groff's own warnings, on pages of two widths.
  for (const char* width : {"80", "120"}) {
    const Outcome shown = run_program(
        "/usr/bin/env", {"-u", "MANPAGER", "LC_ALL=C.UTF-8", std::string("MANWIDTH=") + width,
                         "MANROFFSEQ=", "man", "--warnings=w", "-P", "cat", "-l", page});
    EXPECT_EQ(shown.exit_code, 0);
    EXPECT_EQ(shown.err, "");
    EXPECT_THAT(shown.out, HasSubstr("cairn - multiresolution point datasets from laser scans"));
    EXPECT_THAT(shown.out, HasSubstr("cairn build *.las -o site.cairn --preset archive"));
  }
  // It tells no date: that would not be the same for the same program.
  for (const std::string& line :
       lines_in(run_program("/usr/bin/mandoc", {"-T", "lint", "-W", "warning", page}).out))
    EXPECT_THAT(line, HasSubstr("missing date"));
}

TEST_F(Manual, EveryFlagOfEveryHelpIsInThePageAndInTheCompletions) {
  const std::string page = read_text(generate("man"));
  generate("bash");
  const std::string zsh = read_text(generate("zsh"));
  const std::string fish_text = read_text(generate("fish"));
  Words all = commands();
  EXPECT_THAT(bash({""}), ::testing::UnorderedElementsAreArray(all));
  for (const std::string& command : all) {
    SCOPED_TRACE(command);
    const std::set<std::string> flags = flags_of(command);
    const std::string heading = ".SH CAIRN " + [&] {
      std::string upper = command;
      std::transform(upper.begin(), upper.end(), upper.begin(), ::toupper);
      return upper;
    }();
    const std::size_t begin = page.find(heading + "\n");
    ASSERT_NE(begin, std::string::npos);
    const std::string section = page.substr(begin, page.find(".SH ", begin + 4) - begin);
    const std::size_t branch = zsh.find("\n        " + command + ")\n");
    ASSERT_NE(branch, std::string::npos);
    const std::string zsh_section = zsh.substr(branch, zsh.find(";;", branch) - branch);
    const Words offered = bash({command, "--"});
    for (const std::string& flag : flags) {
      SCOPED_TRACE(flag);
      std::string roff;
      for (const char c : flag) roff += c == '-' ? "\\-" : std::string(1, c);
      EXPECT_THAT(section, HasSubstr("\\fB" + roff + "\\fR"));
      EXPECT_THAT(offered, Contains(flag));
      EXPECT_THAT(zsh_section, ::testing::ContainsRegex(flag + "=?\\["));
      EXPECT_THAT(fish_text, ::testing::ContainsRegex("__fish_seen_subcommand_from " + command +
                                                      "'.* -l " + flag.substr(2) + " "));
    }
    // And none that the help does not tell.
    for (const std::string& flag : offered) EXPECT_TRUE(flags.contains(flag)) << flag;
  }
  EXPECT_THAT(bash({"--"}), ::testing::UnorderedElementsAreArray(flags_of("")));
}

TEST_F(Manual, BashOffersWordsFlagsAndFiles) {
  generate("bash");
  make_files();
  EXPECT_THAT(bash({"bu"}), ElementsAre("build"));
  EXPECT_THAT(bash({"build", "--codec", ""}), ElementsAre("none", "lzo", "lzo999", "zstd"));
  EXPECT_THAT(bash({"build", "--codec", "lz"}), ElementsAre("lzo", "lzo999"));
  EXPECT_THAT(bash({"build", "--codec", "=", "z"}), ElementsAre("zstd"));
  EXPECT_THAT(bash({"build", "--codec", "="}), ElementsAre("none", "lzo", "lzo999", "zstd"));
  EXPECT_THAT(bash({"build", "--preset", ""}),
              UnorderedElementsAre("default", "preview", "archive"));
  EXPECT_THAT(bash({"build", "--progress", "j"}), ElementsAre("json"));
  EXPECT_THAT(bash({"build", "--reducer", "w"}), ElementsAre("weighted"));
  EXPECT_THAT(bash({"build", "--node-points", ""}), IsEmpty());
  EXPECT_THAT(bash({"build", "--no"}), ElementsAre("--node-points"));
  EXPECT_THAT(bash({"build", "--force", "--fr"}), ElementsAre("--fresh"));
  EXPECT_THAT(bash({"render", "site.cairn", "--mode", ""}), ElementsAre("cpu", "gl"));
  EXPECT_THAT(bash({"view", "--color", "cl"}), ElementsAre("classification"));
  EXPECT_THAT(bash({"verify", "--against", "a.las", "--thr"}), ElementsAre("--threads"));
  EXPECT_THAT(bash({"verify", "site.cairn", "--against", "a.las", "b"}), ElementsAre("b.LAZ"));
  // Scans by any spelling of their suffix, folders on the way to others, and nothing else.
  EXPECT_THAT(bash({"build", ""}),
              UnorderedElementsAre("a.las", "b.LAZ", "c d.ply", "walk.toml", "site.cairn"));
  EXPECT_THAT(bash({"build", "c"}), Contains("c d.ply"));
  EXPECT_THAT(bash({"info", ""}), ElementsAre("site.cairn"));
  EXPECT_THAT(bash({"view", "site.cairn", "--path", ""}),
              UnorderedElementsAre("walk.toml", "site.cairn"));
  EXPECT_THAT(bash({"build", "--scratch", "s"}), ElementsAre("site.cairn"));
  // Values of two kinds.
  EXPECT_THAT(bash({"export", "site.cairn", "-o", ""}),
              IsSupersetOf({"a.las", "notes.pdf", "site.cairn"}));
  EXPECT_THAT(bash({"info", "site.cairn", "--web-cache", ""}),
              UnorderedElementsAre("site.cairn", "off"));
}

TEST_F(Manual, FishOffersWordsFlagsAndFiles) {
  generate("fish");
  EXPECT_EQ(run_program("/usr/bin/fish", {"--no-execute", folder_ / "cairn.fish"}).exit_code, 0);
  make_files();
  EXPECT_THAT(fish("cairn bu"), ElementsAre("build"));
  EXPECT_THAT(fish("cairn build --codec "), UnorderedElementsAre("none", "lzo", "lzo999", "zstd"));
  EXPECT_THAT(fish("cairn build --codec=z"), ElementsAre("--codec=zstd"));
  EXPECT_THAT(fish("cairn build --no"), ElementsAre("--node-points"));
  EXPECT_THAT(fish("cairn view --color cl"), ElementsAre("classification"));
  EXPECT_THAT(fish("cairn info "), ElementsAre("site.cairn/"));
  EXPECT_THAT(fish("cairn build a"), Contains("a.las"));
  EXPECT_THAT(fish("cairn build --node-points "), Not(Contains("a.las")));
  EXPECT_THAT(fish("cairn export site.cairn -o "), IsSupersetOf({"a.las", "site.cairn/"}));
  EXPECT_THAT(fish("cairn info --web-cache "), UnorderedElementsAre("site.cairn/", "off"));
}

TEST_F(Manual, ZshTakesTheCompletion) {
  const std::string file = generate("zsh");
  EXPECT_EQ(run_program("/usr/bin/zsh", {"-n", file}).err, "");
  // Sourced, and as zsh loads it from a folder of its path.
  const Outcome sourced = run_program(
      "/usr/bin/zsh",
      {"-f", "-c", "autoload -U compinit; compinit -u -D; source $1; print $_comps[cairn]", "zsh",
       file});
  EXPECT_EQ(sourced.out, "_cairn\n") << sourced.err;
  std::filesystem::create_directories(folder_ / "functions");
  std::filesystem::copy_file(file, folder_ / "functions/_cairn");
  const Outcome loaded = run_program(
      "/usr/bin/zsh",
      {"-f", "-c", "fpath=($1 $fpath); autoload -U compinit; compinit -u -D; print $_comps[cairn]",
       "zsh", folder_ / "functions"});
  EXPECT_EQ(loaded.out, "_cairn\n") << loaded.err;
}

TEST_F(Manual, ZshOffersWordsAndFlags) {
  const std::string file = generate("zsh");
  make_files();
  // A zsh on a terminal of its own types the line and Tab, and then lists what is offered.
  const char* const script = R"zsh(
zmodload zsh/zpty
cd $2
zpty shell zsh -f -i
zpty -w shell 'PS1=; PROMPT=; autoload -U compinit; compinit -u -D; source '$1'; stty columns 200; zstyle ":completion:*" list-colors; LISTMAX=1000; unsetopt prompt_sp zle_bracketed_paste; print rea""dy'
zpty -r shell text '*ready*'
zpty -w -n shell "$3"$'\t\t'
quiet=0
for i in {1..100}; do
  sleep 0.1
  if zpty -r -t shell text; then print -rn -- $text; quiet=0; elif [[ $i -gt 10 ]] && (( ++quiet > 5 )); then break; fi
done
zpty -d shell
)zsh";
  const auto zsh = [&](const std::string& line) {
    return run_program("/usr/bin/zsh", {"-f", "-c", script, "zsh", file, folder_.path(), line}).out;
  };
  EXPECT_THAT(zsh("cairn build --codec zs"), HasSubstr("std"));
  EXPECT_THAT(zsh("cairn build --codec l"), HasSubstr("lzo999"));
  EXPECT_THAT(zsh("cairn build --node-p"), HasSubstr("oints"));
  EXPECT_THAT(zsh("cairn info --web-cache of"), HasSubstr("off"));
  EXPECT_THAT(zsh("cairn info --web-cache si"), HasSubstr("site.cairn"));
  EXPECT_THAT(zsh("cairn export site.cairn -o not"), HasSubstr("es.pdf"));
}

}  // namespace
}  // namespace cairn::test
