// Requests under way over connections that are kept alive, by libcurl. For one thread; only wake() may be called by others.
//
// HTTP/1.1 alone: over several connections a lost packet holds up one answer, not all.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "formats/access/access_options.h"
#include "formats/access/http_answer.h"

namespace cairn::formats {

/// Whether libcurl was built for addresses that begin so: "https".
bool speaks(std::string_view scheme);

struct HttpRequest {
  std::string url;
  RangeQuestion question;
  bool fresh = false;  ///< proxies must not answer from what they keep
};

/// How a request ended. kGood: all bytes of the range were handed over.
struct HttpEnd {
  std::uint64_t number = 0;  ///< as it was started
  Judgement judgement;
  Validators validators;  ///< of the answer
  std::optional<std::chrono::seconds> retry_after;
  bool reached = false;  ///< a connection was made
  /// From the request to the first byte of the answer; 0 if none came.
  std::chrono::microseconds latency{0};
};

class HttpTransfers {
 public:
  /// Takes the bytes of a good answer, in order, while step() runs.
  using Sink = std::function<void(std::span<const std::byte> bytes)>;

  explicit HttpTransfers(const AccessOptions& options);
  ~HttpTransfers();
  HttpTransfers(const HttpTransfers&) = delete;
  HttpTransfers& operator=(const HttpTransfers&) = delete;

  std::size_t under_way() const;
  void start(std::uint64_t number, const HttpRequest& request, Sink sink);
  /// Waits until something comes, or so long, or for wake(); takes it, and returns what has ended.
  std::vector<HttpEnd> step(std::chrono::milliseconds wait);
  void wake();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace cairn::formats
