// The program's command line told as data, read off the parser itself: help, manual page and the completions of
// shells all follow from it, so none can know a flag that the others, or the parser, do not.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace CLI {
class App;
}

namespace cairn::pipeline {

/// What a value is, which is what a shell offers for it.
enum class ValueKind {
  kNone,  ///< a switch takes none
  kText,  ///< a number, a length, a condition: nothing that a shell knows
  kFile,  ///< of one of `suffixes`, or any
  kFolder,
  kDataset,  ///< a folder NAME.cairn
};

/// A flag, or an argument without one.
struct FlagText {
  std::string short_name;   ///< "-o", or empty
  std::string long_name;    ///< "--output"; empty for an argument without a flag
  std::string placeholder;  ///< "NAME.cairn"; empty for a switch
  std::string help;         ///< one line
  std::string group;        ///< heading in the help
  ValueKind kind = ValueKind::kNone;
  std::vector<std::string> words;     ///< values that are known by name
  std::vector<std::string> suffixes;  ///< of kFile, with their dots
  bool required = false;
  bool repeatable = false;
  bool greedy = false;  ///< a flag that takes all words up to the next flag

  bool is_argument() const { return short_name.empty() && long_name.empty(); }
  /// "NAME.cairn", or "SCANS..." of which there may be several.
  std::string value() const;
};

/// Lines that belong together.
struct Paragraph {
  std::vector<std::string> lines;
  bool verbatim = false;  ///< examples; else lines are to be filled
};

struct CommandText {
  std::string name;                ///< "build"; empty for the program itself
  std::string about;               ///< one sentence
  std::vector<FlagText> flags;     ///< arguments too, in the order of declaration
  std::vector<Paragraph> details;  ///< what the help tells below the flags

  /// Headings in the order of their first flag; arguments have none.
  std::vector<std::string> groups() const;
  /// "cairn render [OPTIONS] NAME.cairn -o FILE".
  std::string usage() const;
};

struct ProgramText {
  CommandText program;
  std::vector<CommandText> commands;
};

/// What the parser of one command, or of the program, declares.
CommandText describe_command(const CLI::App& parser);
/// All of it.
ProgramText describe_program(const CLI::App& program);

/// The words of "none, lzo, lzo999 or zstd"; none where the text is any other prose.
std::vector<std::string> words_of_choice(std::string_view prose);

}  // namespace cairn::pipeline
