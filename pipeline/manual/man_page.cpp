#include "pipeline/manual/man_page.h"

#include <algorithm>
#include <cctype>

namespace cairn::pipeline {
namespace {

/// Text as roff takes it literally: its hyphens are those that programs read.
std::string literal(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '\\')
      out += "\\e";
    else if (c == '-')
      out += "\\-";
    else if (c == '\'')
      out += "\\(aq";
    else if (c == '^')
      out += "\\(ha";
    else if (c == '~')
      out += "\\(ti";
    else if (c == '`')
      out += "\\(ga";
    else
      out += c;
  }
  if (out.starts_with('.')) out.insert(0, "\\&");  // else a macro
  return out;
}

std::string bold(std::string_view text) { return "\\fB" + literal(text) + "\\fR"; }
std::string italic(std::string_view text) { return "\\fI" + literal(text) + "\\fR"; }

/// An upper-case section heading.
std::string section(std::string title) {
  std::transform(title.begin(), title.end(), title.begin(),
                 [](unsigned char c) { return std::toupper(c); });
  return ".SH " + literal(title) + "\n";
}

std::string tag(const std::string& name, const std::string& meaning) {
  return ".TP\n" + name + "\n" + literal(meaning) + "\n";
}

std::string flag_tag(const FlagText& flag) {
  if (flag.is_argument()) return tag(italic(flag.value()), flag.help);
  std::string names;
  for (const std::string& name : {flag.short_name, flag.long_name})
    if (!name.empty()) names += (names.empty() ? "" : ", ") + bold(name);
  if (!flag.placeholder.empty()) names += " " + italic(flag.value());
  return tag(names, flag.help);
}

/// Within a section or subsection; a first paragraph must not be announced there.
std::string paragraphs(const std::vector<Paragraph>& all, bool first) {
  std::string text;
  for (const Paragraph& paragraph : all) {
    if (!first) text += ".PP\n";
    first = false;
    if (paragraph.verbatim) text += ".nf\n";
    for (const std::string& line : paragraph.lines) text += literal(line) + "\n";
    if (paragraph.verbatim) text += ".fi\n";
  }
  return text;
}

std::string command_section(const CommandText& command) {
  std::string text = section("cairn " + command.name) + bold(command.usage()) + "\n.PP\n" +
                     literal(command.about) + "\n";
  for (const FlagText& flag : command.flags)
    if (flag.is_argument()) text += flag_tag(flag);
  for (const std::string& group : command.groups()) {
    text += ".SS " + literal(group) + "\n";
    for (const FlagText& flag : command.flags)
      if (!flag.is_argument() && flag.group == group) text += flag_tag(flag);
  }
  if (!command.details.empty()) text += ".SS Details\n" + paragraphs(command.details, true);
  return text;
}

std::string environment_section() {
  return section("environment") +
         tag(bold("NO_COLOR") + ", " + bold("CLICOLOR=0") + ", " + bold("TERM=dumb"),
             "No colors on a terminal either. What goes to a file or a pipe never has any.") +
         tag(bold("COLUMNS"), "Columns that help is filled to, instead of the terminal's.") +
         tag(bold("CAIRN_VECTOR_PATH"),
             "portable, avx2 or avx512: vector instructions to use if the processor has them. "
             "Results are the same.");
}

std::string files_section() {
  return section("files") +
         tag(italic("NAME.cairn/"),
             "A dataset: index.bin, nodes.bin, metadata.json, and run.json, which tells of the "
             "build.") +
         tag(italic("NAME.cairn.work/"),
             "What a running or interrupted build has done. Goes away with a build that succeeds.");
}

}  // namespace

std::string man_page(const ProgramText& text, std::string_view version) {
  const std::string number(version);
  std::string page = ".\\\" Made by cairn --generate man.\n.TH CAIRN 1 \"\" \"cairn " + number +
                     "\" \"User Commands\"\n.nh\n.ad l\n";
  page += section("name") + "cairn \\- multiresolution point datasets from laser scans\n";
  page += section("synopsis") + bold(text.program.usage()) + "\n";
  for (const CommandText& command : text.commands) page += ".br\n" + bold(command.usage()) + "\n";
  page += section("description") + literal(text.program.about) + "\n";
  for (const CommandText& command : text.commands)
    page += tag(bold("cairn " + command.name), command.about);
  page += section("options");
  for (const FlagText& flag : text.program.flags) page += flag_tag(flag);
  for (const CommandText& command : text.commands) page += command_section(command);
  page += section("more") + paragraphs(text.program.details, true);
  page += environment_section() + files_section();
  return page;
}

}  // namespace cairn::pipeline
