#include "tests/support/web_server.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fstream>
#include <stdexcept>
#include <utility>

namespace cairn::test {
namespace {

constexpr int kTick = 20;  ///< ms after which threads look whether the server ends

void close_with_reset(int socket) {
  const linger now{.l_onoff = 1, .l_linger = 0};
  ::setsockopt(socket, SOL_SOCKET, SO_LINGER, &now, sizeof(now));
}

bool send_all(int socket, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = ::send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(sent));
  }
  return true;
}

/// The head of a request; empty at the end of the connection.
std::string read_head(int socket, const std::atomic<bool>& ending) {
  std::string head;
  while (!ending && !head.ends_with("\r\n\r\n")) {
    pollfd waiting{.fd = socket, .events = POLLIN, .revents = 0};
    if (::poll(&waiting, 1, kTick) == 0) continue;
    char c = 0;
    if (::recv(socket, &c, 1, 0) <= 0) return {};
    head += c;
  }
  return ending ? "" : head;
}

std::string lower(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

WebRequest parse(const std::string& head) {
  WebRequest request;
  const std::size_t path = head.find('/') + 1;
  request.path = head.substr(path, head.find(' ', path) - path);
  for (std::size_t at = head.find("\r\n") + 2; at + 2 < head.size();) {
    const std::size_t end = head.find("\r\n", at), colon = head.find(": ", at);
    if (colon < end)
      request.headers[lower(head.substr(at, colon - at))] = head.substr(colon + 2, end - colon - 2);
    at = end + 2;
  }
  if (const auto range = request.headers.find("range"); range != request.headers.end()) {
    char* rest = nullptr;
    request.first = std::strtoull(range->second.c_str() + 6, &rest, 10);  // "bytes="
    request.last = std::strtoull(rest + 1, nullptr, 10);
  }
  return request;
}

/// A hash in the manner of FNV-1a, by words, as a strong tag: all of a file is hashed for each answer.
std::string tag_of(const std::string& content) {
  std::uint64_t hash = 0xcbf29ce484222325 ^ content.size();
  for (std::size_t at = 0; at < content.size(); at += sizeof(std::uint64_t)) {
    std::uint64_t word = 0;
    std::memcpy(&word, &content[at], std::min(sizeof word, content.size() - at));
    hash = (hash ^ word ^ (hash >> 32)) * 0x100000001b3;
  }
  return "\"" + std::to_string(hash) + "\"";
}

std::string content_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::string content(std::filesystem::file_size(file), '\0');
  in.read(content.data(), static_cast<std::streamsize>(content.size()));
  content.resize(static_cast<std::size_t>(in.gcount()));
  return content;
}

constexpr const char* kDate = "%a, %d %b %Y %H:%M:%S GMT";

std::string date_of(const std::filesystem::path& file) {
  struct stat status {};
  ::stat(file.c_str(), &status);
  std::tm parts{};
  ::gmtime_r(&status.st_mtim.tv_sec, &parts);
  char text[64];
  std::strftime(text, sizeof text, kDate, &parts);
  return text;
}

std::time_t time_of(const std::string& date) {
  std::tm parts{};
  ::strptime(date.c_str(), kDate, &parts);
  return ::timegm(&parts);
}

std::string header_of(const WebRequest& request, const char* name) {
  const auto found = request.headers.find(name);
  return found == request.headers.end() ? "" : found->second;
}

/// The status that the conditions of a request lead to; 200 where they hold.
int status_under_conditions(const WebRequest& request, const std::string& tag,
                            const std::string& date) {
  if (!tag.empty()) {
    if (header_of(request, "if-none-match") == tag) return 304;
    const std::string match = header_of(request, "if-match");
    return match.empty() || match == tag ? 200 : 412;
  }
  if (const std::string since = header_of(request, "if-modified-since");
      !since.empty() && time_of(date) <= time_of(since))
    return 304;
  const std::string since = header_of(request, "if-unmodified-since");
  return since.empty() || time_of(date) <= time_of(since) ? 200 : 412;
}

}  // namespace

struct WebServer::Answer {
  int status = 200;
  std::uint64_t first = 0, total = 0;
  std::string etag, last_modified, body;
};

WebServer::WebServer(std::filesystem::path root, WebVersions versions)
    : root_(std::move(root)), versions_(versions) {
  ::setenv("no_proxy", "*", 1);
  listening_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof(address);
  if (listening_ < 0 || ::bind(listening_, reinterpret_cast<sockaddr*>(&address), size) != 0 ||
      ::listen(listening_, 64) != 0 ||
      ::getsockname(listening_, reinterpret_cast<sockaddr*>(&address), &size) != 0)
    throw std::runtime_error("cannot listen");
  port_ = ntohs(address.sin_port);
  acceptor_ = std::thread([this] { accept_all(); });
}

WebServer::~WebServer() {
  ending_ = true;
  acceptor_.join();
  for (std::thread& thread : threads_) thread.join();
  ::close(listening_);
}

std::string WebServer::url(const std::string& path) const {
  return "http://127.0.0.1:" + std::to_string(port_) + "/" + path;
}

void WebServer::set_script(Script script) {
  const std::lock_guard lock(mutex_);
  script_ = std::move(script);
}

std::vector<WebRequest> WebServer::requests() const {
  const std::lock_guard lock(mutex_);
  return requests_;
}

void WebServer::accept_all() {
  while (!ending_) {
    pollfd waiting{.fd = listening_, .events = POLLIN, .revents = 0};
    if (::poll(&waiting, 1, kTick) == 0) continue;
    const int socket = ::accept4(listening_, nullptr, nullptr, SOCK_CLOEXEC);
    if (socket < 0) continue;
    const std::lock_guard lock(mutex_);
    threads_.emplace_back([this, socket, number = connections_++] { serve(socket, number); });
  }
}

void WebServer::serve(int socket, std::size_t connection) {
  for (std::string head; !(head = read_head(socket, ending_)).empty();) {
    WebRequest request = parse(head);
    request.connection = connection;
    if (!answer(socket, std::move(request))) break;
  }
  ::close(socket);
}

/// Whether the connection goes on.
bool WebServer::answer(int socket, WebRequest request) {
  std::optional<WebFault> fault;
  {
    const std::lock_guard lock(mutex_);
    request.number = requests_.size();
    requests_.push_back(request);
    if (script_) fault = script_(request);
  }
  if (fault) std::this_thread::sleep_for(fault->delay);
  return send_answer(socket, good_answer(request), fault);
}

WebServer::Answer WebServer::good_answer(const WebRequest& request) const {
  Answer answer;
  const std::filesystem::path file = root_ / request.path;
  if (!std::filesystem::is_regular_file(file)) {
    answer.status = 404;
    return answer;
  }
  const std::string content = content_of(file);
  answer.total = content.size();
  if (versions_ == WebVersions::kTags)
    answer.etag = tag_of(content);
  else
    answer.last_modified = date_of(file);
  answer.status = status_under_conditions(request, answer.etag, answer.last_modified);
  if (answer.status == 200 && request.first && *request.first >= answer.total) answer.status = 416;
  if (answer.status != 200) return answer;
  answer.first = request.first.value_or(0);
  answer.body = content.substr(answer.first, request.last.value_or(UINT64_MAX) - answer.first + 1);
  if (request.first) answer.status = 206;
  return answer;
}

bool WebServer::send_slowly(int socket, std::string_view bytes, std::size_t at_a_time) const {
  for (; !bytes.empty(); bytes.remove_prefix(std::min(at_a_time, bytes.size()))) {
    if (ending_ || !send_all(socket, bytes.substr(0, at_a_time))) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(kTick));
  }
  return true;
}

bool WebServer::send_answer(int socket, const Answer& good, const std::optional<WebFault>& fault) {
  Answer answer = good;
  const auto is = [&](WebFault::Kind kind) { return fault && fault->kind == kind; };
  if (is(WebFault::kDrop)) return false;
  if (is(WebFault::kGarbage)) return send_all(socket, fault->text) && false;
  std::string more = is(WebFault::kHeader) || is(WebFault::kStatus) ? fault->text : "";
  if (is(WebFault::kWhole))
    answer = {.status = 200,
              .etag = good.etag,
              .last_modified = good.last_modified,
              .body = std::string(100'000, 'w')};
  if (is(WebFault::kStatus)) answer = {.status = fault->status, .body = "not this"};
  if (is(WebFault::kTag)) answer.etag = fault->text;
  if (is(WebFault::kOtherTotal)) answer.total = fault->bytes;
  if (is(WebFault::kDamage) && fault->bytes < answer.body.size())
    answer.body[fault->bytes] = static_cast<char>(answer.body[fault->bytes] ^ 0x55);
  if (answer.status == 304 || answer.status == 412 || answer.status == 416) answer.body.clear();
  std::uint64_t length = answer.body.size();
  if (is(WebFault::kLongLength)) length += fault->bytes;
  if (is(WebFault::kShortLength)) length -= fault->bytes;
  const std::uint64_t first = answer.first + (is(WebFault::kOtherRange) ? fault->bytes : 0);
  std::string head = "HTTP/1.1 " + std::to_string(answer.status) + " So\r\n";
  head += "Content-Length: " + std::to_string(length) + "\r\n";
  if (!answer.etag.empty()) head += "ETag: " + answer.etag + "\r\n";
  if (!answer.last_modified.empty()) head += "Last-Modified: " + answer.last_modified + "\r\n";
  if (answer.status == 206 && !is(WebFault::kNoRange))
    head += "Content-Range: bytes " + std::to_string(first) + "-" +
            std::to_string(first + answer.body.size() - 1) + "/" + std::to_string(answer.total) +
            "\r\n";
  if (!more.empty()) head += more + "\r\n";
  if (!send_all(socket, head + "\r\n")) return false;
  const bool cut = is(WebFault::kReset) || is(WebFault::kStall) || is(WebFault::kShort);
  const std::string_view body =
      cut ? std::string_view(answer.body).substr(0, fault->bytes) : std::string_view(answer.body);
  body_bytes_ += body.size();
  if (!(is(WebFault::kSlow) ? send_slowly(socket, body, fault->bytes) : send_all(socket, body)))
    return false;
  if (is(WebFault::kReset)) close_with_reset(socket);
  if (is(WebFault::kStall)) {
    char c = 0;
    pollfd waiting{.fd = socket, .events = POLLIN, .revents = 0};
    while (!ending_ && (::poll(&waiting, 1, kTick) == 0 || ::recv(socket, &c, 1, 0) > 0)) {
    }
  }
  return !cut && !is(WebFault::kLongLength) && !is(WebFault::kShortLength);
}

}  // namespace cairn::test
