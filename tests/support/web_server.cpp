#include "tests/support/web_server.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
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

}  // namespace

struct WebServer::Answer {
  int status = 200;
  std::uint64_t first = 0, total = 0;
  std::string etag, body;
};

WebServer::WebServer(std::filesystem::path root) : root_(std::move(root)) {
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
  return send_answer(socket, good_answer(request), fault);
}

WebServer::Answer WebServer::good_answer(const WebRequest& request) const {
  Answer answer;
  const std::filesystem::path file = root_ / request.path;
  if (!std::filesystem::is_regular_file(file)) {
    answer.status = 404;
    return answer;
  }
  answer.total = std::filesystem::file_size(file);
  const auto written = std::filesystem::last_write_time(file).time_since_epoch().count();
  answer.etag = "\"" + std::to_string(written) + "-" + std::to_string(answer.total) + "\"";
  const auto header = [&](const char* name) {
    const auto found = request.headers.find(name);
    return found == request.headers.end() ? "" : found->second;
  };
  const std::string match = header("if-match");
  if (header("if-none-match") == answer.etag)
    answer.status = 304;
  else if (!match.empty() && match != answer.etag)
    answer.status = 412;
  else if (request.first && *request.first >= answer.total)
    answer.status = 416;
  if (answer.status != 200) return answer;
  answer.first = request.first.value_or(0);
  answer.body.resize(std::min(request.last.value_or(UINT64_MAX - 1) + 1, answer.total) -
                     answer.first);
  std::ifstream in(file, std::ios::binary);
  in.seekg(static_cast<std::streamoff>(answer.first));
  in.read(answer.body.data(), static_cast<std::streamsize>(answer.body.size()));
  if (request.first) answer.status = 206;
  return answer;
}

bool WebServer::send_answer(int socket, const Answer& good, const std::optional<WebFault>& fault) {
  Answer answer = good;
  const auto is = [&](WebFault::Kind kind) { return fault && fault->kind == kind; };
  if (is(WebFault::kDrop)) return false;
  if (is(WebFault::kGarbage)) return send_all(socket, fault->text) && false;
  std::string more = is(WebFault::kHeader) || is(WebFault::kStatus) ? fault->text : "";
  if (is(WebFault::kWhole))
    answer = {.status = 200, .etag = good.etag, .body = std::string(100'000, 'w')};
  if (is(WebFault::kStatus)) answer = {.status = fault->status, .etag = {}, .body = "not this"};
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
  if (!send_all(socket, body)) return false;
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
