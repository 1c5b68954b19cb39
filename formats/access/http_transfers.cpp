#include "formats/access/http_transfers.h"

#include <curl/curl.h>

#include <array>
#include <exception>
#include <list>
#include <mutex>
#include <new>
#include <string_view>
#include <utility>

namespace cairn::formats {
namespace {

constexpr long kMostRedirections = 5;
constexpr long kLeastBytesPerSecond = 100;

/// Once in a process, before its first transfer; what it takes is never given back, as others may use it, too.
void start_curl() {
  static std::once_flag once;
  std::call_once(once, [] {
    if (curl_global_init(CURL_GLOBAL_DEFAULT) != CURLE_OK) throw std::bad_alloc();
  });
}

struct EasyEnd {
  void operator()(CURL* easy) const { curl_easy_cleanup(easy); }
};
struct HeadersEnd {
  void operator()(curl_slist* list) const { curl_slist_free_all(list); }
};
struct MultiEnd {
  void operator()(CURLM* multi) const { curl_multi_cleanup(multi); }
};

/// One request and what has come of it.
struct Transfer {
  std::uint64_t number = 0;
  RangeQuestion question;
  HttpTransfers::Sink sink;
  std::unique_ptr<CURL, EasyEnd> easy;
  std::unique_ptr<curl_slist, HeadersEnd> headers;
  HttpAnswer answer;
  std::optional<Judgement> judgement;  ///< once there is a body
  std::uint64_t received_bytes = 0;
  bool too_long = false;
  std::exception_ptr error;  ///< of the sink
  std::array<char, CURL_ERROR_SIZE> reason{};

  std::uint64_t expected_bytes() const {
    return judgement->range.last - judgement->range.first + 1;
  }
};

/// False: nothing is read of an answer that is no good.
bool take_body(Transfer& transfer, std::span<const char> bytes) {
  if (!transfer.judgement) transfer.judgement = judge(transfer.question, transfer.answer);
  if (transfer.judgement->verdict != Verdict::kGood) return false;
  if (bytes.size() > transfer.expected_bytes() - transfer.received_bytes) {
    transfer.too_long = true;
    return false;
  }
  transfer.received_bytes += bytes.size();
  transfer.sink(std::as_bytes(bytes));
  return true;
}

/// What libcurl calls. It is C: no exception may pass through it, and step() throws what there was. Returning less than was
/// offered ends the transfer.
template <typename Take>
std::size_t guarded(Transfer& transfer, std::size_t bytes, const Take& take) {
  try {
    return take() ? bytes : 0;
  } catch (...) {
    transfer.error = std::current_exception();
    return 0;
  }
}

std::size_t on_header(char* data, std::size_t size, std::size_t count, void* user) {
  Transfer& transfer = *static_cast<Transfer*>(user);
  return guarded(transfer, size * count, [&] {
    transfer.answer.take_line({data, size * count});
    return true;
  });
}

std::size_t on_body(char* data, std::size_t size, std::size_t count, void* user) {
  Transfer& transfer = *static_cast<Transfer*>(user);
  return guarded(transfer, size * count,
                 [&] { return take_body(transfer, std::span(data, size * count)); });
}

/// Failures that another attempt may not meet.
bool is_transient(CURLcode code) {
  switch (code) {
    case CURLE_COULDNT_RESOLVE_PROXY:
    case CURLE_COULDNT_RESOLVE_HOST:
    case CURLE_COULDNT_CONNECT:
    case CURLE_WEIRD_SERVER_REPLY:
    case CURLE_PARTIAL_FILE:
    case CURLE_OPERATION_TIMEDOUT:
    case CURLE_SSL_CONNECT_ERROR:
    case CURLE_GOT_NOTHING:
    case CURLE_SEND_ERROR:
    case CURLE_RECV_ERROR:
      return true;
    default:
      return false;
  }
}

bool was_reached(const Transfer& transfer, CURLcode code) {
  if (code == CURLE_COULDNT_RESOLVE_PROXY || code == CURLE_COULDNT_RESOLVE_HOST ||
      code == CURLE_COULDNT_CONNECT)
    return false;
  if (code != CURLE_OPERATION_TIMEDOUT) return true;
  curl_off_t connected = 0;
  curl_easy_getinfo(transfer.easy.get(), CURLINFO_CONNECT_TIME_T, &connected);
  return connected > 0;
}

Judgement failed(Verdict verdict, std::string found, std::string expected) {
  return {
      verdict, {}, ErrorKind::kSystem, "a request failed", std::move(found), std::move(expected)};
}

Judgement judge_end(const Transfer& transfer, CURLcode code) {
  // An answer that was refused is the cause of whatever curl says of its body.
  if (transfer.judgement && transfer.judgement->verdict != Verdict::kGood)
    return *transfer.judgement;
  // All is there: that a length was wrong, or the connection broke then, does no harm.
  if (transfer.judgement && !transfer.too_long &&
      transfer.received_bytes == transfer.expected_bytes())
    return *transfer.judgement;
  if (transfer.too_long)
    return failed(Verdict::kTransient, "more bytes than the answer's range tells",
                  std::to_string(transfer.expected_bytes()) + " bytes");
  if (code != CURLE_OK) {
    const char* reason =
        transfer.reason[0] != '\0' ? transfer.reason.data() : curl_easy_strerror(code);
    // What came was no answer: perhaps the rest of one that was longer than it told.
    const bool garbage = code == CURLE_UNSUPPORTED_PROTOCOL && transfer.answer.status() == 0;
    return failed(is_transient(code) || garbage ? Verdict::kTransient : Verdict::kFinal,
                  "'" + std::string(reason) + "'", "");
  }
  if (!transfer.judgement) {
    Judgement judgement = judge(transfer.question, transfer.answer);
    if (judgement.verdict != Verdict::kGood) return judgement;
    return failed(Verdict::kTransient, "an answer without a body", "bytes");
  }
  return failed(Verdict::kTransient, std::to_string(transfer.received_bytes) + " bytes",
                std::to_string(transfer.expected_bytes()) + " bytes");
}

/// Conditions that keep another version's bytes from coming at all. A weak tag can be no condition of a range; then the
/// answer's tag is compared alone, as it is in any case.
std::string condition_of(const RangeQuestion& question) {
  const Validators& known = question.validators;
  if (!known.any()) return {};
  if (question.unless_same)
    return known.etag.empty() ? "If-Modified-Since: " + known.last_modified
                              : "If-None-Match: " + known.etag;
  if (known.is_strong()) return "If-Match: " + known.etag;
  return known.last_modified.empty() ? "" : "If-Unmodified-Since: " + known.last_modified;
}

/// Of the last request, if redirections led from one to the next.
std::chrono::microseconds latency_of(const Transfer& transfer) {
  curl_off_t sent = 0, answered = 0;
  curl_easy_getinfo(transfer.easy.get(), CURLINFO_PRETRANSFER_TIME_T, &sent);
  curl_easy_getinfo(transfer.easy.get(), CURLINFO_STARTTRANSFER_TIME_T, &answered);
  return std::chrono::microseconds(answered > sent ? answered - sent : 0);
}

void add_header(Transfer& transfer, const std::string& line) {
  if (line.empty()) return;
  curl_slist* list = curl_slist_append(transfer.headers.get(), line.c_str());
  if (list == nullptr) throw std::bad_alloc();
  static_cast<void>(transfer.headers.release());  // it is part of the longer list
  transfer.headers.reset(list);
}

template <typename Value>
void set(const Transfer& transfer, CURLoption option, Value value) {
  const CURLcode code = curl_easy_setopt(transfer.easy.get(), option, value);
  if (code == CURLE_OUT_OF_MEMORY) throw std::bad_alloc();
  if (code != CURLE_OK)
    throw Error(ErrorKind::kSystem, {.what = "libcurl refused an option",
                                     .found = std::to_string(option) + ": '" +
                                              std::string(curl_easy_strerror(code)) + "'"});
}

void set_options(Transfer& transfer, const HttpRequest& request, const AccessOptions& options) {
  add_header(transfer, "Accept-Encoding: identity");
  add_header(transfer, condition_of(request.question));
  if (request.fresh) add_header(transfer, "Cache-Control: no-cache");
  const std::string range =
      std::to_string(request.question.first) + "-" + std::to_string(request.question.last);
  const bool secure = request.url.starts_with("https");
  set(transfer, CURLOPT_URL, request.url.c_str());
  set(transfer, CURLOPT_RANGE, range.c_str());
  set(transfer, CURLOPT_HTTPHEADER, transfer.headers.get());
  set(transfer, CURLOPT_USERAGENT, "cairn");
  set(transfer, CURLOPT_HTTP_VERSION, static_cast<long>(CURL_HTTP_VERSION_1_1));
  set(transfer, CURLOPT_FOLLOWLOCATION, 1L);
  set(transfer, CURLOPT_MAXREDIRS, kMostRedirections);
  set(transfer, CURLOPT_PROTOCOLS_STR, "http,https");
  // What was asked for in private is not sent on in the open.
  set(transfer, CURLOPT_REDIR_PROTOCOLS_STR, secure ? "https" : "http,https");
  set(transfer, CURLOPT_NOSIGNAL, 1L);
  set(transfer, CURLOPT_QUICK_EXIT, 1L);  // does not wait for a name that is being looked up
  set(transfer, CURLOPT_CONNECTTIMEOUT_MS, static_cast<long>(options.connect_timeout.count()));
  set(transfer, CURLOPT_LOW_SPEED_LIMIT, kLeastBytesPerSecond);
  set(transfer, CURLOPT_LOW_SPEED_TIME, static_cast<long>(options.stall_timeout.count()));
  set(transfer, CURLOPT_ERRORBUFFER, transfer.reason.data());
  set(transfer, CURLOPT_HEADERFUNCTION, &on_header);
  set(transfer, CURLOPT_HEADERDATA, &transfer);
  set(transfer, CURLOPT_WRITEFUNCTION, &on_body);
  set(transfer, CURLOPT_WRITEDATA, &transfer);
  set(transfer, CURLOPT_PRIVATE, &transfer);
}

}  // namespace

bool speaks(std::string_view scheme) {
  start_curl();
  const char* const* known = curl_version_info(CURLVERSION_NOW)->protocols;
  while (*known != nullptr && *known != scheme) ++known;
  return *known != nullptr;
}

struct HttpTransfers::State {
  AccessOptions options;
  std::unique_ptr<CURLM, MultiEnd> multi;
  std::list<Transfer> transfers;  ///< libcurl knows their addresses; they go before `multi`
};

HttpTransfers::HttpTransfers(const AccessOptions& options) : state_(std::make_unique<State>()) {
  start_curl();
  state_->options = options;
  state_->multi.reset(curl_multi_init());
  if (!state_->multi) throw std::bad_alloc();
  curl_multi_setopt(state_->multi.get(), CURLMOPT_MAX_HOST_CONNECTIONS,
                    static_cast<long>(options.connections));
  curl_multi_setopt(state_->multi.get(), CURLMOPT_MAXCONNECTS,
                    static_cast<long>(2 * options.connections));
}

HttpTransfers::~HttpTransfers() {
  for (const Transfer& transfer : state_->transfers)
    curl_multi_remove_handle(state_->multi.get(), transfer.easy.get());
}

std::size_t HttpTransfers::under_way() const { return state_->transfers.size(); }

void HttpTransfers::start(std::uint64_t number, const HttpRequest& request, Sink sink) {
  Transfer& transfer = state_->transfers.emplace_back();
  transfer.number = number;
  transfer.question = request.question;
  transfer.sink = std::move(sink);
  transfer.easy.reset(curl_easy_init());
  if (!transfer.easy) throw std::bad_alloc();
  set_options(transfer, request, state_->options);
  if (curl_multi_add_handle(state_->multi.get(), transfer.easy.get()) != CURLM_OK)
    throw std::bad_alloc();
}

std::vector<HttpEnd> HttpTransfers::step(std::chrono::milliseconds wait) {
  CURLM* multi = state_->multi.get();
  // What was started since is due at once, and ends the wait.
  curl_multi_poll(multi, nullptr, 0, static_cast<int>(wait.count()), nullptr);
  int running = 0;
  if (curl_multi_perform(multi, &running) != CURLM_OK) throw std::bad_alloc();
  std::vector<HttpEnd> ends;
  int left = 0;
  while (const CURLMsg* message = curl_multi_info_read(multi, &left)) {
    if (message->msg != CURLMSG_DONE) continue;
    char* user = nullptr;
    curl_easy_getinfo(message->easy_handle, CURLINFO_PRIVATE, &user);
    const CURLcode code = message->data.result;
    Transfer& transfer = *reinterpret_cast<Transfer*>(user);
    if (transfer.error) std::rethrow_exception(transfer.error);
    curl_multi_remove_handle(multi, transfer.easy.get());
    ends.push_back({.number = transfer.number,
                    .judgement = judge_end(transfer, code),
                    .validators = transfer.answer.validators(),
                    .retry_after = transfer.answer.retry_after(),
                    .reached = was_reached(transfer, code),
                    .latency = latency_of(transfer)});
    std::erase_if(state_->transfers, [&](const Transfer& t) { return &t == &transfer; });
  }
  return ends;
}

void HttpTransfers::wake() { curl_multi_wakeup(state_->multi.get()); }

}  // namespace cairn::formats
