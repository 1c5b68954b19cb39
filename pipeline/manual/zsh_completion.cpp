// For zsh's completion system (zshcompsys), as an autoloaded function or sourced.
#include <fmt/format.h>

#include "pipeline/manual/completion.h"

namespace cairn::pipeline {
namespace {

/// Text for an argument of _arguments inside single quotes, where brackets and colons have a meaning.
std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '\'')
      out += "'\\''";
    else if (c == '[' || c == ']' || c == ':' || c == '\\')
      out += std::string("\\") + c;
    else
      out += c;
  }
  return out;
}

/// ":NAME:action" of a value.
std::string value_of(const FlagText& flag) {
  std::string action;
  if (flag.kind == ValueKind::kFolder || flag.kind == ValueKind::kDataset)
    action = "_files -/";
  else if (flag.kind == ValueKind::kFile && flag.suffixes.empty())
    action = "_files";
  else if (flag.kind == ValueKind::kFile) {
    std::string endings;
    for (const std::string& suffix : flag.suffixes)
      endings += (endings.empty() ? "" : "|") + suffix.substr(1);
    action = "_files -g \"(#i)*.(" + endings + ")\"";
  }
  const std::string words = fmt::format("{}", fmt::join(flag.words, " "));
  if (!action.empty() && !words.empty())
    action = "{" + action + "; compadd -- " + words + "}";
  else if (!words.empty())
    action = "(" + words + ")";
  else if (action.empty())
    action = " ";  // nothing is known of it
  return ":" + escaped(flag.placeholder) + ":" + action;
}

std::string flag_lines(const FlagText& flag) {
  if (flag.is_argument())
    return fmt::format("            '{}{}' \\\n", flag.repeatable ? "*" : "1", value_of(flag));
  const bool takes_value = flag.kind != ValueKind::kNone;
  std::string text;
  for (const std::string& name : {flag.short_name, flag.long_name}) {
    if (name.empty()) continue;
    const char* form = !takes_value ? "" : name == flag.short_name ? "+" : "=";
    const std::string others =
        flag.repeatable
            ? "*"
            : "(" + flag.short_name + (flag.short_name.empty() ? "" : " ") + flag.long_name + ")";
    text += fmt::format("            '{}{}{}[{}]{}' \\\n", others, name, form, escaped(flag.help),
                        takes_value ? value_of(flag) : "");
  }
  return text;
}

std::string command_branch(const CommandText& command) {
  std::string text = fmt::format("        {})\n          _arguments -s \\\n", command.name);
  for (const FlagText& flag : command.flags) text += flag_lines(flag);
  text += "            && return 0 ;;\n";
  return text;
}

}  // namespace

std::string zsh_completion(const ProgramText& text) {
  std::string out =
      "#compdef cairn\n"
      "# Completion of cairn for zsh; made by cairn --generate zsh.\n\n"
      "_cairn() {\n"
      "  local curcontext=$curcontext state line\n"
      "  typeset -A opt_args\n"
      "  local -a commands\n"
      "  commands=(\n";
  for (const CommandText& command : text.commands)
    out += fmt::format("    '{}:{}'\n", command.name, escaped(command.about));
  out += "  )\n  _arguments -C \\\n";
  for (const FlagText& flag : text.program.flags) out += flag_lines(flag);
  out +=
      "            '1: :->command' \\\n"
      "            '*:: :->argument' && return 0\n"
      "  case $state in\n"
      "    command) _describe -t commands command commands ;;\n"
      "    argument)\n"
      "      case $words[1] in\n";
  for (const CommandText& command : text.commands) out += command_branch(command);
  out +=
      "      esac ;;\n"
      "  esac\n"
      "}\n\n"
      "if [[ $funcstack[1] == _cairn ]]; then _cairn \"$@\"; else compdef _cairn cairn; fi\n";
  return out;
}

}  // namespace cairn::pipeline
