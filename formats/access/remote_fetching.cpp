// What the thread of remote files does: it sends requests for what is most urgent, takes what comes, and decides what a failure
// means.
#include <algorithm>
#include <csignal>
#include <exception>
#include <utility>

#include "formats/access/remote_files.h"
#include "formats/access/remote_wishes.h"
#include "formats/checksum.h"

namespace cairn::formats {
namespace {

using Clock = FetchJob::Clock;

/// The thread is woken for what is new; this is for what nobody thought of.
constexpr std::chrono::milliseconds kLongestStep{1000};

Failure failure_of(const Judgement& judgement, const std::string& url, std::uint64_t offset,
                   unsigned attempts) {
  Failure failure{.kind = judgement.kind,
                  .parts = {.what = judgement.what,
                            .path = url,
                            .offset = offset,
                            .found = judgement.found,
                            .expected = judgement.expected}};
  if (attempts > 1) failure.parts.found += " after " + std::to_string(attempts) + " attempts";
  return failure;
}

}  // namespace

void RemoteFiles::run() {
  // Signals are for the threads of who uses this.
  sigset_t all;
  ::sigfillset(&all);
  ::pthread_sigmask(SIG_BLOCK, &all, nullptr);
  try {
    while (true) {
      {
        const std::lock_guard lock(mutex_);
        if (ending_) return;
      }
      step();
    }
  } catch (const Error& error) {
    break_down({error.kind(), error.parts()});
  } catch (const std::exception& error) {
    break_down({ErrorKind::kSystem, {.what = "fetching has ended", .found = error.what()}});
  }
}

void RemoteFiles::step() {
  send_due_jobs();  // before what is new, or it might never come to their turn
  begin_jobs();
  for (const HttpEnd& end : transfers_.step(time_to_next())) finish(end);
  link_.tick(Clock::now(), transfers_.under_way() > 0);
  if (std::exchange(news_, false)) tell_arrival();
  for (const auto& [name, bytes] : std::exchange(to_keep_, {})) disk_.write(name, *bytes);
  for (const std::string& name : std::exchange(to_remove_, {})) disk_.remove(name);
}

/// Takes from the table what is most urgent, as much as the link bears.
void RemoteFiles::begin_jobs() {
  while (transfers_.under_way() < options_.connections) {
    const std::uint64_t most = link_.bytes_under_way(), now = bytes_under_way();
    std::vector<RangeKey> keys;
    bool again = false;
    {
      const std::lock_guard lock(mutex_);
      keys = table_.take_next(most > now ? most - now : 0, {});
      if (keys.empty()) return;
      again = table_.at(keys.front()).again;
    }
    FetchJob& job = jobs_.emplace_back();
    job.number = next_number_++;
    job.keys = std::move(keys);
    job.again = again;
    send(job);
  }
}

void RemoteFiles::send_due_jobs() {
  for (FetchJob& job : jobs_)
    if (!job.sent && job.due <= Clock::now() && transfers_.under_way() < options_.connections)
      send(job);
}

void RemoteFiles::send(FetchJob& job) {
  HttpRequest request;
  {
    const std::lock_guard lock(mutex_);
    const File& file = files_[job.file()];
    request.url = file.url;
    request.fresh = job.again || file.fresh;
    request.question = {.first = job.first() + job.received.size(),
                        .last = job.end() - 1,
                        .size_bytes = file.size_bytes,
                        .validators = file.validators};
    const bool conditional =
        job.is_front() && file.stored_front && !job.again && job.received.empty();
    if (conditional) {
      request.question.validators = file.stored_front->validators;
      request.question.unless_same = true;
    }
    ++statistics_.requests;
    statistics_.retries += job.failures > 0 ? 1 : 0;
  }
  job.sent = true;
  transfers_.start(job.number, request,
                   [this, &job](std::span<const std::byte> bytes) { take(job, bytes); });
}

std::chrono::milliseconds RemoteFiles::time_to_next() const {
  std::chrono::milliseconds wait = kLongestStep;
  // While all connections are busy, the end of a request is what the next one waits for.
  if (transfers_.under_way() >= options_.connections) return wait;
  for (const FetchJob& job : jobs_)
    if (!job.sent)
      wait = std::min(wait, std::chrono::ceil<std::chrono::milliseconds>(job.due - Clock::now()));
  return std::max(wait, std::chrono::milliseconds(0));
}

std::uint64_t RemoteFiles::bytes_under_way() const {
  std::uint64_t bytes = 0;
  for (const FetchJob& job : jobs_)
    if (job.sent && !job.is_front()) bytes += job.left_bytes();
  return bytes;
}

/// Hands over each range as soon as it is whole: those behind it in the same answer may take long.
void RemoteFiles::take(FetchJob& job, std::span<const std::byte> bytes) {
  link_.add(bytes.size());
  last_success_ = Clock::now();
  job.received.insert(job.received.end(), bytes.begin(), bytes.end());
  {
    const std::lock_guard lock(mutex_);
    statistics_.fetched_bytes += bytes.size();
  }
  if (job.is_front()) return;
  while (job.delivered < job.keys.size()) {
    const RangeKey& key = job.keys[job.delivered];
    if (key.end() - job.first() > job.received.size()) return;
    const auto begin = job.received.begin() + static_cast<std::ptrdiff_t>(key.offset - job.first());
    deliver(key, {begin, begin + static_cast<std::ptrdiff_t>(key.size_bytes)});
    ++job.delivered;
    if (job.delivered < job.keys.size()) {
      const std::lock_guard lock(mutex_);
      statistics_.gap_bytes += job.keys[job.delivered].offset - key.end();
    }
  }
}

/// Wrong bytes are asked for once more, past all caches on the way: they may be to blame. Then they are the server's.
void RemoteFiles::deliver(const RangeKey& key, std::vector<std::byte> bytes) {
  const std::uint64_t sum = checksum_of(bytes);
  std::string name;
  SharedBytes shared;
  {
    const std::lock_guard lock(mutex_);
    RangeEntry& entry = table_.at(key);
    news_ = true;
    if (entry.checksum && *entry.checksum != sum) {
      if (entry.again) {
        fail_checksum(key, sum, *entry.checksum);
        return;
      }
      statistics_.repeated_bytes += bytes.size();
      table_.want_again(key);
      return;
    }
    name = disk_key(key.file, {key.offset, key.size_bytes, entry.checksum});
    shared = std::make_shared<const std::vector<std::byte>>(std::move(bytes));
    table_.put(key, shared);
  }
  arrived_.notify_all();
  if (!name.empty()) to_keep_.emplace_back(std::move(name), std::move(shared));
}

/// Either the server's bytes are damaged, or the front that told their checksum is of another version: a later run must not
/// take it for the same.
void RemoteFiles::fail_checksum(const RangeKey& key, std::uint64_t found, std::uint64_t expected) {
  for (const File& file : files_) to_remove_.push_back(front_key(file));
  table_.fail(key, {ErrorKind::kInput,
                    {.what = "the checksum of what was fetched does not match, twice",
                     .path = files_[key.file].url,
                     .offset = key.offset,
                     .found = std::to_string(found),
                     .expected = std::to_string(expected)}});
  arrived_.notify_all();
}

void RemoteFiles::finish(const HttpEnd& end) {
  const auto at = std::ranges::find(jobs_, end.number, &FetchJob::number);
  CAIRN_CHECK(at != jobs_.end());
  FetchJob& job = *at;
  job.sent = false;
  reached_ |= end.reached;
  link_.add_latency(end.latency);
  const Judgement& judgement = end.judgement;
  if (judgement.verdict != Verdict::kGood && !job.is_front() && job.delivered == job.keys.size()) {
    // Nothing is missing, however it ended.
    jobs_.erase(at);
    last_success_ = Clock::now();
    return;
  }
  if (judgement.verdict == Verdict::kTransient) return try_again(job, end);
  if (judgement.verdict == Verdict::kOther) {
    job.again = true;  // without the condition, past all caches, at once
    return;
  }
  if (judgement.verdict == Verdict::kFinal) {
    const std::lock_guard lock(mutex_);
    return give_up(job,
                   failure_of(judgement, files_[job.file()].url, job.first() + job.received.size(),
                              job.failures + 1),
                   /*unreachable=*/false);
  }
  const std::lock_guard lock(mutex_);
  if (auto failure = pin(job, end)) return give_up(job, *failure, /*unreachable=*/false);
  last_success_ = Clock::now();
  if (job.is_front()) finish_front(job, judgement.verdict == Verdict::kSame);
  jobs_.erase(at);
}

/// What the first answer tells of a file holds for all later ones.
std::optional<Failure> RemoteFiles::pin(FetchJob& job, const HttpEnd& end) {
  File& file = files_[job.file()];
  const bool same = end.judgement.verdict == Verdict::kSame;
  if (!file.size_bytes) {
    file.size_bytes = same ? file.stored_front->file_size_bytes : end.judgement.range.total;
    file.validators = same ? file.stored_front->validators : end.validators;
  }
  if (!file.expected_size_bytes || *file.expected_size_bytes == *file.size_bytes)
    return std::nullopt;
  return Failure{ErrorKind::kInput,
                 {.what = "the file has not the size that the index tells",
                  .path = file.url,
                  .found = std::to_string(*file.size_bytes) + " bytes",
                  .expected = std::to_string(*file.expected_size_bytes) + " bytes"}};
}

void RemoteFiles::finish_front(FetchJob& job, bool same) {
  File& file = files_[job.file()];
  SharedBytes bytes;
  if (same) {
    bytes = file.stored_front->bytes;
    ++statistics_.cache_hits;
    statistics_.cache_bytes += bytes->size();
  } else {
    file.stored_front.reset();
    bytes = std::make_shared<const std::vector<std::byte>>(std::move(job.received));
  }
  table_.put(job.keys.front(), std::move(bytes));
  news_ = true;
  arrived_.notify_all();
}

void RemoteFiles::try_again(FetchJob& job, const HttpEnd& end) {
  if (job.failures++ == 0) job.first_failure = Clock::now();
  // A server that was never there is a wrong address rather than a passing failure.
  const bool never = !reached_;
  const std::lock_guard lock(mutex_);
  if (never || too_many_failures(options_, job.failures, job.received.size()))
    return give_up(job,
                   failure_of(end.judgement, files_[job.file()].url,
                              job.first() + job.received.size(), job.failures),
                   /*unreachable=*/last_success_ < job.first_failure);
  job.due = Clock::now() + retry_delay(options_, job.failures, end.retry_after);
}

/// Where the server cannot be reached what else is wanted fails with it, or each would take as long to.
void RemoteFiles::give_up(FetchJob& job, const Failure& failure, bool unreachable) {
  for (std::size_t i = job.delivered; i < job.keys.size(); ++i) table_.fail(job.keys[i], failure);
  if (unreachable) table_.fail_wanted(failure);
  jobs_.remove_if([&](const FetchJob& other) { return &other == &job; });
  news_ = true;
  arrived_.notify_all();
}

/// Nothing comes any more: whoever waits, or asks later, is told why.
void RemoteFiles::break_down(Failure failure) {
  {
    const std::lock_guard lock(mutex_);
    broken_ = std::move(failure);
  }
  arrived_.notify_all();
  tell_arrival();
}

void RemoteFiles::tell_arrival() {
  const std::lock_guard lock(listeners_mutex_);
  for (const Wishes* wishes : listeners_) wishes->tell();
}

}  // namespace cairn::formats
