#include "formats/access/location.h"

#include <algorithm>

#include "formats/error.h"
#include "formats/file_names.h"
#include "formats/lower_case.h"

namespace cairn::formats {
namespace {

[[noreturn]] void refuse(const std::string& text, const char* expected) {
  // The text is left out where it may hold a password.
  const bool secret = text.find('@') != std::string::npos;
  throw Error(ErrorKind::kUsage, {.what = "an address of a dataset",
                                  .found = secret ? "one with a user name" : "'" + text + "'",
                                  .expected = expected});
}

/// RFC 3986 knows no others; a space or a line break would reach the server as part of another line.
bool may_be_in_address(char c) {
  const auto code = static_cast<unsigned char>(c);
  return code > 0x20 && code < 0x7F && std::string_view("\"<>\\^`{|}").find(c) == std::string::npos;
}

std::size_t scheme_size(std::string_view text) { return text.find("://") + 3; }

void check_address(const std::string& text) {
  const std::string_view rest = std::string_view(text).substr(scheme_size(text));
  const std::string_view authority = rest.substr(0, rest.find_first_of("/?#"));
  if (authority.find('@') != std::string_view::npos)
    refuse(text, "http(s)://HOST[:PORT]/FOLDER, without a user name");
  if (authority.empty() || authority.front() == ':')
    refuse(text, "http(s)://HOST[:PORT]/FOLDER, with a host");
  if (rest.find_first_of("?#") != std::string_view::npos)
    refuse(text, "http(s)://HOST[:PORT]/FOLDER, without a query or fragment");
  if (!std::ranges::all_of(text, may_be_in_address))
    refuse(text, "http(s)://HOST[:PORT]/FOLDER, other characters written as %XX");
}

}  // namespace

bool is_address(std::string_view text) {
  const std::string start = lower_case(std::string(text.substr(0, 8)));
  return start.starts_with("http://") || start == "https://";
}

Location::Location(std::string text) : remote_(is_address(text)) {
  if (!remote_) {
    path_ = std::move(text);
    return;
  }
  check_address(text);
  // Redirections from https to http are told apart by the scheme, which may be written in any case.
  const std::size_t scheme = text.find(':');
  text.replace(0, scheme, lower_case(text.substr(0, scheme)));
  while (text.back() == '/' && text.size() > scheme_size(text)) text.pop_back();
  path_ = std::move(text);
}

std::filesystem::path Location::file(std::string_view name) const { return path_ / name; }

std::string Location::name() const { return without_trailing_slash(path_).filename().string(); }

}  // namespace cairn::formats
