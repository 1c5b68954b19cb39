#include "formats/error.h"

#include <cstring>

namespace cairn::formats {
namespace {

std::string compose(const ErrorParts& parts) {
  std::string line = parts.what;
  // "cannot open FILE: ..." but "bad magic in FILE: ..."
  if (!parts.path.empty()) line += (parts.system_errno != 0 ? " " : " in ") + parts.path.string();
  if (parts.offset) line += " at byte " + std::to_string(*parts.offset);
  if (!parts.found.empty()) line += ": found " + parts.found;
  if (!parts.expected.empty())
    line += (parts.found.empty() ? ": expected " : ", expected ") + parts.expected;
  if (parts.system_errno != 0) line += std::string(": ") + std::strerror(parts.system_errno);
  // Names and values may come from outside: the message stays one printable line.
  for (char& c : line)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  return line;
}

}  // namespace

Error::Error(ErrorKind kind, ErrorParts parts)
    : std::runtime_error(compose(parts)), kind_(kind), parts_(std::move(parts)) {}

void throw_usage(std::string what) { throw Error(ErrorKind::kUsage, {.what = std::move(what)}); }

void throw_input(ErrorParts parts) { throw Error(ErrorKind::kInput, std::move(parts)); }

void throw_system(std::string what, const std::filesystem::path& path, int system_errno) {
  throw Error(ErrorKind::kSystem,
              {.what = std::move(what), .path = path, .system_errno = system_errno});
}

void throw_check(const char* condition, const char* file, int line) {
  const std::string name = std::filesystem::path(file).filename().string();
  throw Error(ErrorKind::kInvariant, {.what = "internal check failed: " + std::string(condition) +
                                              " (" + name + ":" + std::to_string(line) + ")"});
}

}  // namespace cairn::formats
