// A small HTTP server on the loopback that serves a folder by ranges, and misbehaves where a test tells it to. Nothing of it
// is shared with what it tests: sockets and text alone.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

namespace cairn::test {

struct WebRequest {
  std::string path;                            ///< without the first slash: "site.cairn/index.bin"
  std::map<std::string, std::string> headers;  ///< names in lower case
  std::optional<std::uint64_t> first, last;    ///< the range asked for, if there is one
  std::size_t number = 0;                      ///< counts from 0
  std::size_t connection = 0;                  ///< counts from 0

  bool asks_for(const std::string& file) const { return path.ends_with(file); }
};

/// What is done instead of a good answer.
struct WebFault {
  enum Kind {
    kReset,       ///< the connection is reset after `bytes` of the body
    kStall,       ///< nothing comes after `bytes` of the body
    kShort,       ///< the connection is closed after `bytes` of the body
    kDrop,        ///< it is closed before an answer
    kWhole,       ///< 200, as from a server that sends all of a file
    kStatus,      ///< `status`, with `text` among the header lines
    kOtherRange,  ///< a Content-Range that begins `bytes` later
    kNoRange,     ///< 206 without Content-Range
    kOtherTotal,  ///< a Content-Range with `bytes` as the file's size
    kLongLength,  ///< a Content-Length that is `bytes` longer than the body, then the connection is closed
    kShortLength,  ///< one that is `bytes` shorter; the body is whole
    kDamage,       ///< byte `bytes` of the body is another
    kHeader,       ///< a good answer with `text` among the header lines
    kTag,          ///< a good answer with `text` as its ETag, empty: none
    kGarbage,      ///< `text` instead of an answer
    kSlow,         ///< a good answer, whose body comes `bytes` at a time, fifty times a second
  };
  Kind kind = kDrop;
  std::uint64_t bytes = 0;
  int status = 0;
  std::string text{};
  std::chrono::milliseconds delay{};  ///< before all of it
};

/// By what answers tell one version of a file from another.
enum class WebVersions {
  kTags,   ///< an ETag that follows from the content
  kTimes,  ///< Last-Modified alone, in whole seconds: a file that replaces another may have the same, or an older one
};

class WebServer {
 public:
  using Script = std::function<std::optional<WebFault>(const WebRequest&)>;

  /// Serves what is below `root`. From now on no proxy of the user's stands between this process or its children and it.
  explicit WebServer(std::filesystem::path root, WebVersions versions = WebVersions::kTags);
  ~WebServer();
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;

  /// "http://127.0.0.1:PORT/" and `path`.
  std::string url(const std::string& path = "") const;
  /// Asked about every request, one at a time; nothing: a good answer.
  void set_script(Script script);
  /// All requests so far.
  std::vector<WebRequest> requests() const;
  std::uint64_t body_bytes() const { return body_bytes_; }  ///< sent so far
  std::size_t connections() const { return connections_; }

 private:
  struct Answer;
  void accept_all();
  void serve(int socket, std::size_t connection);
  bool answer(int socket, WebRequest request);
  bool send_answer(int socket, const Answer& answer, const std::optional<WebFault>& fault);
  bool send_slowly(int socket, std::string_view bytes, std::size_t at_a_time) const;
  Answer good_answer(const WebRequest& request) const;

  std::filesystem::path root_;
  WebVersions versions_;
  int listening_ = -1;
  std::uint16_t port_ = 0;
  std::atomic<bool> ending_ = false;
  std::atomic<std::uint64_t> body_bytes_ = 0;
  std::atomic<std::size_t> connections_ = 0;
  mutable std::mutex mutex_;  ///< of the next three
  Script script_;
  std::vector<WebRequest> requests_;
  std::vector<std::thread> threads_;
  std::thread acceptor_;
};

}  // namespace cairn::test
