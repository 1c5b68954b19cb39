#include "pipeline/manual/help_text.h"

#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <sstream>

namespace cairn::pipeline {
namespace {

constexpr std::size_t kFlagColumns =
    28;  ///< where what flags do begins; a longer flag has its own line
constexpr std::size_t kCommandColumns = 12;
constexpr unsigned kLeastColumns = 40;
constexpr unsigned kMostColumns = 100;  // longer lines are hard to follow

/// Words filled into lines of so many columns.
std::vector<std::string> filled(const std::string& text, std::size_t columns) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string word; in >> word;) {
    if (lines.empty() || lines.back().size() + 1 + word.size() > columns)
      lines.push_back(word);
    else
      lines.back() += " " + word;
  }
  return lines;
}

/// A command line of an example as a shell takes it, broken before a flag where that is possible.
std::vector<std::string> broken(std::string line, std::size_t columns) {
  const std::string deeper(line.find_first_not_of(' ') + 4, ' ');
  std::vector<std::string> lines;
  while (line.size() > columns) {
    const std::string_view head = std::string_view(line).substr(0, columns - 1);
    std::size_t at = std::max(head.rfind(" -") + 1, head.rfind(" &&") + 1);  // npos + 1 is 0
    if (at <= deeper.size()) at = head.rfind(' ') + 1;
    if (at <= deeper.size()) break;  // one long word
    lines.push_back(line.substr(0, at) + "\\");
    line = deeper + line.substr(at);
  }
  lines.push_back(line);
  return lines;
}

class Help {
 public:
  Help(unsigned columns, const Paint& paint) : columns_(columns), paint_(paint) {}

  /// "Title:", after an empty line.
  void heading(const std::string& title) { text_ += "\n" + paint_.heading(title + ":") + "\n"; }

  void prose(const std::string& text) {
    for (const std::string& line : filled(text, columns_)) text_ += line + "\n";
  }

  void usage(const std::string& usage) {
    constexpr std::size_t kIndent = 7;
    text_ += "\n" + paint_.heading("Usage:");
    bool first = true;
    for (const std::string& line : filled(usage, columns_ - kIndent)) {
      text_ += (first ? " " : std::string(kIndent, ' ')) + line + "\n";
      first = false;
    }
  }

  /// A name on the left, what it is on the right.
  void row(const std::string& name, const std::string& rest, const std::string& meaning,
           std::size_t left) {
    text_ += "  " + paint_.name(name) + rest;
    std::size_t at = 2 + name.size() + rest.size();
    for (const std::string& line : filled(meaning, columns_ - left)) {
      if (at + 2 > left && at > 0) {
        text_ += "\n";
        at = 0;
      }
      text_ += std::string(left - at, ' ') + line;
      at = columns_;
    }
    text_ += "\n";
  }

  void details(const std::vector<Paragraph>& paragraphs) {
    bool joined = false;  // a line that ends in a colon announces the examples below it
    for (const Paragraph& paragraph : paragraphs) {
      if (!joined) text_ += "\n";
      joined = !paragraph.verbatim && paragraph.lines.back().ends_with(':');
      if (paragraph.verbatim)
        for (const std::string& example : paragraph.lines)
          for (const std::string& line : broken(example, columns_)) text_ += line + "\n";
      else if (joined && paragraph.lines.size() == 1)
        text_ += paint_.heading(paragraph.lines.front()) + "\n";
      else
        prose(joined_lines(paragraph));
    }
  }

  std::string take() { return std::move(text_); }

 private:
  static std::string joined_lines(const Paragraph& paragraph) {
    std::string text;
    for (const std::string& line : paragraph.lines) text += line + " ";
    return text;
  }

  std::size_t columns_;
  const Paint& paint_;
  std::string text_;
};

void flag_row(Help& help, const FlagText& flag) {
  if (flag.is_argument()) {
    help.row(flag.value(), "", flag.help, kFlagColumns);
    return;
  }
  // Long names stand below each other.
  const std::string name = flag.short_name.empty()  ? "    " + flag.long_name
                           : flag.long_name.empty() ? flag.short_name
                                                    : flag.short_name + ", " + flag.long_name;
  help.row(name, flag.placeholder.empty() ? "" : " " + flag.value(), flag.help, kFlagColumns);
}

}  // namespace

std::string help_text(const CommandText& command, const std::vector<CommandText>& commands,
                      unsigned columns, const Paint& paint) {
  Help help(std::max(columns, kLeastColumns), paint);
  help.prose(command.about);
  help.usage(command.usage());
  const auto is_argument = [](const FlagText& flag) { return flag.is_argument(); };
  if (std::any_of(command.flags.begin(), command.flags.end(), is_argument)) {
    help.heading("Arguments");
    for (const FlagText& flag : command.flags)
      if (flag.is_argument()) flag_row(help, flag);
  }
  if (!commands.empty()) {
    help.heading("Commands");
    for (const CommandText& each : commands) help.row(each.name, "", each.about, kCommandColumns);
  }
  for (const std::string& group : command.groups()) {
    help.heading(group);
    for (const FlagText& flag : command.flags)
      if (!flag.is_argument() && flag.group == group) flag_row(help, flag);
  }
  help.details(command.details);
  return help.take();
}

unsigned help_columns() {
  unsigned columns = 0;
  if (const char* asked = std::getenv("COLUMNS"); asked != nullptr) {
    const std::string_view text(asked);
    const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), columns);
    if (error != std::errc{} || rest != text.data() + text.size()) columns = 0;
  }
  if (columns == 0) columns = terminal_columns(STDOUT_FILENO, 80);
  return std::min(columns, kMostColumns);
}

}  // namespace cairn::pipeline
