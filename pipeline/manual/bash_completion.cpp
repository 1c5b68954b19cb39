// For bash alone: no functions of the package bash-completion are needed.
#include <fmt/format.h>

#include "pipeline/manual/completion.h"

namespace cairn::pipeline {
namespace {

constexpr const char* kFunctions =
    R"bash(# Completion of cairn for bash; made by cairn --generate bash.

# Words, beside what is offered already.
_cairn_words() { mapfile -t -O ${#COMPREPLY[@]} COMPREPLY < <(compgen -W "$1" -- "$current"); }

# Folders, and files that match a pattern.
_cairn_files() {
  compopt -o filenames 2>/dev/null
  mapfile -t COMPREPLY < <(
    shopt -s extglob nocasematch
    compgen -f -- "$current" | while IFS= read -r name; do
      [[ -d ${name/#\~\//$HOME/} || $name == $1 ]] && printf '%s\n' "$name"
    done)
}

_cairn_folders() {
  compopt -o filenames 2>/dev/null
  mapfile -t COMPREPLY < <(compgen -d -- "$current")
}

_cairn() {
  local current=$2 previous=$3 command='' flag='' word
  COMPREPLY=()
  # bash takes --flag=value for three words.
  if [[ $current == '=' ]]; then
    current=''
  elif [[ $previous == '=' ]]; then
    previous=${COMP_WORDS[COMP_CWORD - 2]}
  fi
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    if [[ $word == -* ]]; then flag=$word; elif [[ -z $command ]]; then command=$word; fi
  done
)bash";

std::string joined(const std::vector<std::string>& words) {
  return fmt::format("{}", fmt::join(words, " "));
}

/// The calls that offer values.
std::string offer(const FlagText& flag) {
  std::vector<std::string> calls;
  if (flag.kind == ValueKind::kFolder || flag.kind == ValueKind::kDataset)
    calls.emplace_back("_cairn_folders");
  else if (flag.kind == ValueKind::kFile)
    calls.push_back(flag.suffixes.empty()
                        ? "_cairn_files '*'"
                        : fmt::format("_cairn_files '*@({})'", fmt::join(flag.suffixes, "|")));
  if (!flag.words.empty()) calls.push_back("_cairn_words '" + joined(flag.words) + "'");
  return calls.empty() ? ":" : fmt::format("{}", fmt::join(calls, "; "));
}

/// `case` branches for the values of flags, "build --codec" and the like.
std::string value_branches(const CommandText& command) {
  std::string text;
  for (const FlagText& flag : command.flags) {
    if (flag.is_argument() || flag.kind == ValueKind::kNone) continue;
    std::string patterns;
    for (const std::string& name : {flag.short_name, flag.long_name})
      if (!name.empty())
        patterns += fmt::format("{}'{} {}'", patterns.empty() ? "" : " | ", command.name, name);
    text += fmt::format("    {}) {}; return ;;\n", patterns, offer(flag));
  }
  return text;
}

/// "'verify --against' | ...": flags that take all words up to the next one.
std::string greedy_patterns(const ProgramText& text) {
  std::vector<std::string> patterns;
  for (const CommandText& command : text.commands)
    for (const FlagText& flag : command.flags)
      if (flag.greedy) patterns.push_back(fmt::format("'{} {}'", command.name, flag.long_name));
  return fmt::format("{}", fmt::join(patterns, " | "));
}

/// The branch of a command where a flag or an argument may come.
std::string command_branch(const CommandText& command,
                           const std::vector<std::string>& instead_of_arguments) {
  std::vector<std::string> flags;
  std::string argument =
      instead_of_arguments.empty() ? ":" : "_cairn_words '" + joined(instead_of_arguments) + "'";
  for (const FlagText& flag : command.flags) {
    if (flag.is_argument()) argument = offer(flag);
    for (const std::string& name : {flag.short_name, flag.long_name})
      if (!name.empty()) flags.push_back(name);
  }
  return fmt::format(
      "    '{}')\n"
      "      if [[ $current == -* ]]; then _cairn_words '{}'; else {}; fi ;;\n",
      command.name, joined(flags), argument);
}

}  // namespace

std::string bash_completion(const ProgramText& text) {
  std::string out = kFunctions;
  if (const std::string patterns = greedy_patterns(text); !patterns.empty())
    out += fmt::format(
        "  case \"$command $flag\" in {}) [[ $current == -* ]] || previous=$flag ;; esac\n",
        patterns);
  out += "  case \"$command $previous\" in\n" + value_branches(text.program);
  for (const CommandText& command : text.commands) out += value_branches(command);
  out += "  esac\n  case $command in\n";
  std::vector<std::string> names;
  for (const CommandText& command : text.commands) names.push_back(command.name);
  out += command_branch(text.program, names);
  for (const CommandText& command : text.commands) out += command_branch(command, {});
  return out + "  esac\n}\n\ncomplete -F _cairn cairn\n";
}

}  // namespace cairn::pipeline
