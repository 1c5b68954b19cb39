// What the terminal at the other end of a stream takes: how wide it is, and whether it shows colors.
#pragma once

#include <string>
#include <string_view>

namespace cairn::pipeline {

/// Columns of the terminal behind an open file; `otherwise` where there is none, or it does not tell.
unsigned terminal_columns(int descriptor, unsigned otherwise);

/// A terminal that can redraw a line and show colors.
bool is_capable_terminal(int descriptor);

/// Whether what is written to an open file may be colored: a terminal that can, and nobody who asks for none by the
/// environment (NO_COLOR, https://no-color.org; CLICOLOR=0).
bool wants_color(int descriptor);

/// Puts text into colors, or leaves it as it is: nothing else may know of escape sequences. Colored text is longer
/// than it looks, so fill columns first.
class Paint {
 public:
  /// Leaves everything plain.
  Paint() = default;
  explicit Paint(bool colored) : colored_(colored) {}
  static Paint for_stdout();
  static Paint for_stderr();

  std::string heading(std::string_view text) const { return in("1", text); }
  std::string name(std::string_view text) const { return in("36", text); }
  std::string good(std::string_view text) const { return in("32", text); }
  std::string doubtful(std::string_view text) const { return in("33", text); }
  std::string bad(std::string_view text) const { return in("1;31", text); }

  /// The report with its headings marked: the lines that begin at the margin, as the others are indented.
  std::string headings_of(std::string_view report) const;

 private:
  std::string in(const char* color, std::string_view text) const;

  bool colored_ = false;
};

}  // namespace cairn::pipeline
