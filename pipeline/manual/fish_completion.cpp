// For fish 3.
#include <fmt/format.h>

#include "pipeline/manual/completion.h"

namespace cairn::pipeline {
namespace {

/// Text between single quotes.
std::string in_quotes(std::string_view text) {
  std::string out = "'";
  for (const char c : text) {
    if (c == '\'' || c == '\\') out += '\\';
    out += c;
  }
  return out + "'";
}

/// What is offered for a value; empty if nothing is known of it.
std::string offered(const FlagText& flag) {
  std::vector<std::string> parts = flag.words;
  if (flag.kind == ValueKind::kFolder || flag.kind == ValueKind::kDataset)
    parts.emplace_back("(__fish_complete_directories)");
  else if (flag.kind == ValueKind::kFile)
    parts.push_back(flag.suffixes.empty() ? "(__fish_complete_path)"
                                          : fmt::format("(__fish_complete_suffix {})",
                                                        fmt::join(flag.suffixes, " ")));
  return fmt::format("{}", fmt::join(parts, " "));
}

std::string flag_line(const FlagText& flag, const std::string& condition) {
  const std::string head = "complete -c cairn -n " + in_quotes(condition);
  const std::string values = offered(flag);
  if (flag.is_argument()) return head + " -a " + in_quotes(values) + "\n";
  std::string text = head;
  if (!flag.short_name.empty()) text += " -s " + flag.short_name.substr(1);
  if (!flag.long_name.empty()) text += " -l " + flag.long_name.substr(2);
  if (flag.kind != ValueKind::kNone) text += " -x";
  if (!values.empty()) text += " -a " + in_quotes(values);
  return text + " -d " + in_quotes(flag.help) + "\n";
}

}  // namespace

std::string fish_completion(const ProgramText& text) {
  std::string out =
      "# Completion of cairn for fish; made by cairn --generate fish.\n\n"
      "complete -c cairn -f\n";
  for (const CommandText& command : text.commands)
    out += fmt::format("complete -c cairn -n __fish_use_subcommand -a {} -d {}\n", command.name,
                       in_quotes(command.about));
  for (const FlagText& flag : text.program.flags) out += flag_line(flag, "__fish_use_subcommand");
  for (const CommandText& command : text.commands) {
    out += "\n";
    for (const FlagText& flag : command.flags)
      out += flag_line(flag, "__fish_seen_subcommand_from " + command.name);
  }
  return out;
}

}  // namespace cairn::pipeline
