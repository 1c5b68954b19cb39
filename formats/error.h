// What ends a job: one exception type, composed as a single line that names what, where, found and
// expected. It is thrown anywhere below and caught only by a command's entry, which prints it and
// exits with its code. Bad bytes met while decoding are values (`DecodeError`), turned into an
// `Error` by whoever knows the file's name.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>

namespace cairn::formats {

/// The program's exit codes; see README, "Exit codes".
enum class ErrorKind : int {
  kUsage = 2,      ///< a wrong flag, key or value
  kInput = 3,      ///< a damaged, hostile or unsupported file
  kSystem = 4,     ///< disk, memory, permission
  kInvariant = 5,  ///< a promise of the dataset does not hold, or a bug of ours
};

/// The parts of an error message. Empty parts are left out of the line.
struct ErrorParts {
  std::string what;                          ///< what is wrong, in words of the format
  std::filesystem::path path = {};           ///< the file concerned
  std::optional<std::uint64_t> offset = {};  ///< byte offset in that file
  std::string found = {};
  std::string expected = {};
  int system_errno = 0;  ///< errno of a failed system call, 0 if none
};

class Error : public std::runtime_error {
 public:
  Error(ErrorKind kind, ErrorParts parts);

  ErrorKind kind() const { return kind_; }
  const ErrorParts& parts() const { return parts_; }

 private:
  ErrorKind kind_;
  ErrorParts parts_;
};

/// Shorthands for the three kinds that lower floors throw.
[[noreturn]] void throw_usage(std::string what);
[[noreturn]] void throw_input(ErrorParts parts);
[[noreturn]] void throw_system(std::string what, const std::filesystem::path& path,
                               int system_errno);

/// A programmer's error: throws kInvariant with the condition's text and where it stands.
#define CAIRN_CHECK(condition)                                                       \
  do {                                                                               \
    if (!(condition)) ::cairn::formats::throw_check(#condition, __FILE__, __LINE__); \
  } while (false)
[[noreturn]] void throw_check(const char* condition, const char* file, int line);

/// Why a byte sequence could not be decoded. `byte_offset` counts from the start of the span decoded.
struct DecodeError {
  std::string what;
  std::uint64_t byte_offset = 0;
  std::string found = {};
  std::string expected = {};
};

}  // namespace cairn::formats
