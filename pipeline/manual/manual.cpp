#include "pipeline/manual/manual.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cctype>
#include <sstream>

namespace cairn::pipeline {
namespace {

std::vector<std::string> split(std::string_view text, std::string_view separator) {
  std::vector<std::string> parts;
  for (std::size_t end = 0; end != std::string_view::npos;) {
    end = text.find(separator);
    parts.emplace_back(text.substr(0, end));
    if (end != std::string_view::npos) text.remove_prefix(end + separator.size());
  }
  return parts;
}

bool is_word(std::string_view text) {
  return !text.empty() && std::islower(static_cast<unsigned char>(text.front())) != 0 &&
         std::all_of(text.begin(), text.end(), [](unsigned char c) {
           return std::islower(c) != 0 || std::isdigit(c) != 0 || c == '_' || c == '-';
         });
}

/// The words of "{auto,on,off}", which is how a parser's check tells what it allows.
std::vector<std::string> checked_words(const std::string& type) {
  const std::size_t begin = type.find('{');
  const std::size_t end = type.find('}', begin);
  if (begin == std::string::npos || end == std::string::npos) return {};
  return split(std::string_view(type).substr(begin + 1, end - begin - 1), ",");
}

/// What one part of a placeholder says of the value: "DIR", "WALK.toml" or a word.
void take_placeholder(const std::string& part, FlagText& flag) {
  // The suffixes of all scans that can be read; a configuration file may stand for its scans.
  static const std::vector<std::string> scans{".las", ".laz", ".copc", ".e57", ".ply", ".pcd",
                                              ".ptx", ".pts", ".xyz",  ".txt", ".csv", ".toml"};
  const std::size_t dot = part.rfind('.');
  if (part == "DIR" || part == "FOLDER") {
    // Where a file may stand, folders are offered beside files.
    if (flag.kind != ValueKind::kFile) flag.kind = ValueKind::kFolder;
  } else if (part == "FILE") {
    flag.kind = ValueKind::kFile;
  } else if (part == "SCANS") {
    flag.kind = ValueKind::kFile;
    flag.suffixes = scans;
  } else if (part.ends_with(".cairn")) {
    flag.kind = ValueKind::kDataset;
  } else if (dot != std::string::npos && is_word(part.substr(dot + 1))) {
    flag.kind = ValueKind::kFile;
    flag.suffixes.push_back(part.substr(dot));
  } else if (is_word(part)) {
    flag.words.push_back(part);
  }
}

FlagText describe(const CLI::Option& option) {
  FlagText flag;
  if (!option.get_snames().empty()) flag.short_name = "-" + option.get_snames().front();
  if (!option.get_lnames().empty()) flag.long_name = "--" + option.get_lnames().front();
  flag.help = option.get_description();
  flag.group = option.get_group();
  flag.required = option.get_required();
  if (option.get_items_expected_max() == 0 ||
      (option.get_expected_max() == 1 && option.get_type_size_max() == 0))
    return flag;
  flag.placeholder = option.get_option_text();
  if (flag.placeholder.empty()) flag.placeholder = "VALUE";
  flag.kind = ValueKind::kText;
  flag.repeatable = option.get_items_expected_max() > 1;
  flag.greedy = flag.repeatable && !flag.is_argument() && option.get_allow_extra_args();
  for (const std::string& part : split(flag.placeholder, "|")) take_placeholder(part, flag);
  for (const std::string& word : checked_words(option.get_type_name()))
    if (std::find(flag.words.begin(), flag.words.end(), word) == flag.words.end())
      flag.words.push_back(word);
  return flag;
}

/// A paragraph ends at an empty line, and where lines begin or cease to be indented.
std::vector<Paragraph> paragraphs_of(const std::string& text) {
  std::vector<Paragraph> paragraphs;
  bool fresh = true;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    if (line.empty()) {
      fresh = true;
      continue;
    }
    const bool verbatim = line.front() == ' ';
    if (fresh || paragraphs.back().verbatim != verbatim) paragraphs.push_back({{}, verbatim});
    paragraphs.back().lines.push_back(line);
    fresh = false;
  }
  return paragraphs;
}

}  // namespace

std::string FlagText::value() const {
  return greedy || (is_argument() && repeatable) ? placeholder + "..." : placeholder;
}

std::vector<std::string> CommandText::groups() const {
  std::vector<std::string> names;
  for (const FlagText& flag : flags)
    if (!flag.is_argument() && std::find(names.begin(), names.end(), flag.group) == names.end())
      names.push_back(flag.group);
  return names;
}

std::string CommandText::usage() const {
  std::string text = name.empty() ? "cairn [OPTIONS] COMMAND" : "cairn " + name + " [OPTIONS]";
  for (const FlagText& flag : flags)
    if (flag.is_argument())
      text += (flag.required ? " " : " [") + flag.value() + (flag.required ? "" : "]");
  for (const FlagText& flag : flags)
    if (!flag.is_argument() && flag.required)
      text +=
          " " + (flag.short_name.empty() ? flag.long_name : flag.short_name) + " " + flag.value();
  return text;
}

CommandText describe_command(const CLI::App& parser) {
  CommandText command{.name = parser.get_parent() == nullptr ? "" : parser.get_name(),
                      .about = parser.get_description(),
                      .flags = {},
                      .details = paragraphs_of(parser.get_footer())};
  for (const CLI::Option* option : parser.get_options())
    if (!option->get_group().empty()) command.flags.push_back(describe(*option));
  return command;
}

ProgramText describe_program(const CLI::App& program) {
  ProgramText text{.program = describe_command(program), .commands = {}};
  for (const CLI::App* command : program.get_subcommands([](const CLI::App*) { return true; }))
    text.commands.push_back(describe_command(*command));
  return text;
}

std::vector<std::string> words_of_choice(std::string_view prose) {
  const std::size_t last = prose.rfind(" or ");
  if (last == std::string_view::npos) return {};
  std::vector<std::string> words = split(prose.substr(0, last), ", ");
  words.emplace_back(prose.substr(last + 4));
  return std::all_of(words.begin(), words.end(), is_word) ? words : std::vector<std::string>{};
}

}  // namespace cairn::pipeline
