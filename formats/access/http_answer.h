// What a server answered to a request for a range of bytes, and whether that may be believed. Every byte of it comes from
// outside. No connections here.
//
// Based on: RFC 9110, "HTTP Semantics", sections 8.8 (validators), 13 (conditions) and 14 (ranges).
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "formats/error.h"

namespace cairn::formats {

/// By what a server tells one version of a file from another. What it does not tell is empty.
struct Validators {
  std::string etag;           ///< with its quotes and, if it is a weak one, the W/ before them
  std::string last_modified;  ///< as it was sent

  bool is_strong() const { return etag.starts_with('"'); }
  bool any() const { return !etag.empty() || !last_modified.empty(); }
  friend bool operator==(const Validators&, const Validators&) = default;
};

/// "bytes 0-99/1000".
struct ContentRange {
  std::uint64_t first = 0;
  std::uint64_t last = 0;  ///< within the file
  std::uint64_t total = 0;
};
/// Nothing for what is no range of a file whose size is told.
std::optional<ContentRange> parse_content_range(std::string_view text);

/// The parts of an answer that decide, collected line by line.
class HttpAnswer {
 public:
  /// Takes a line of the head, with or without its line break. A status line begins anew, as redirections and interim
  /// answers do.
  void take_line(std::string_view line);

  int status() const { return status_; }
  const Validators& validators() const { return validators_; }
  const std::optional<std::string>& content_range() const { return content_range_; }
  const std::string& content_encoding() const { return content_encoding_; }
  /// What the server asks to wait before the next attempt; dates are not understood.
  std::optional<std::chrono::seconds> retry_after() const { return retry_after_; }

 private:
  int status_ = 0;
  Validators validators_;
  std::optional<std::string> content_range_;
  std::string content_encoding_;
  std::optional<std::chrono::seconds> retry_after_;
};

/// What was asked for, and what is known of the file.
struct RangeQuestion {
  std::uint64_t first = 0;
  std::uint64_t last = 0;  ///< of a file whose size is not known it may lie behind the end
  std::optional<std::uint64_t> size_bytes;  ///< of the file
  Validators validators;                    ///< of the version that is read
  bool unless_same = false;  ///< only wanted if the file is no longer the version of `validators`
};

enum class Verdict {
  kGood,
  kSame,  ///< as what was kept
  kOther,  ///< said to be the same, but it is of another version: it must be asked for again, unconditionally
  kTransient,
  kFinal
};

struct Judgement {
  Verdict verdict = Verdict::kFinal;
  ContentRange range;  ///< kGood: what the body holds
  // kTransient, kFinal: why.
  ErrorKind kind = ErrorKind::kSystem;
  std::string what, found, expected;
};

/// Judges an answer before its body is read.
Judgement judge(const RangeQuestion& question, const HttpAnswer& answer);

}  // namespace cairn::formats
