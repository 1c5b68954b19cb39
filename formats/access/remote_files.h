// The files of a dataset behind a network: ranges are fetched, checked against their checksums, held in bounded memory and
// kept in the disk's cache; nothing is fetched twice while there is room.
//
// Departs from "formats knows no threads": a thread of its own keeps the requests going, or nothing would come while the caller
// draws or decodes. It alone talks to the network and holds no lock while it does; the table of ranges is what it
// shares with callers.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "formats/access/access_options.h"
#include "formats/access/byte_source.h"
#include "formats/access/disk_cache.h"
#include "formats/access/fetch_job.h"
#include "formats/access/http_transfers.h"
#include "formats/access/link_meter.h"
#include "formats/access/range_table.h"

namespace cairn::formats {

class RemoteFiles {
 public:
  /// Asks for nothing yet. Throws Error (kSystem) if a cache's folder that must be cannot be made.
  explicit RemoteFiles(const AccessOptions& options);
  /// Drops what is under way.
  ~RemoteFiles();
  RemoteFiles(const RemoteFiles&) = delete;
  RemoteFiles& operator=(const RemoteFiles&) = delete;

  // The files, by the number that add() returns; see ByteSource. All but add() for any thread.
  std::size_t add(const std::string& url);
  std::uint64_t size_bytes(std::size_t file) const;
  void expect_front(std::size_t file, std::size_t size_bytes);
  bool has_stored_front(std::size_t file);
  SharedBytes front(std::size_t file, std::size_t size_bytes, Fresh fresh);
  void keep_front(std::size_t file, std::span<const std::byte> bytes);
  void expect_size(std::size_t file, std::uint64_t size_bytes);
  void identify(std::size_t file, std::uint64_t content);
  std::vector<SharedBytes> read(std::size_t file, std::span<const ByteRange> ranges,
                                const std::stop_token& stop);
  bool ready(std::size_t file, const ByteRange& range);
  std::unique_ptr<WishList> make_wish_list(std::size_t file, std::function<void()> arrived,
                                           std::uint64_t together_bytes);

  AccessStatistics statistics() const;

 private:
  class Wishes;
  struct File {
    std::string url;
    Validators validators;  ///< of the version that is read
    std::optional<std::uint64_t> size_bytes;
    std::optional<std::uint64_t> expected_size_bytes;
    std::optional<std::uint64_t> content;
    bool fresh = false;  ///< no cache on the way may answer
    bool looked_for_front = false;
    std::optional<StoredFront> stored_front;
  };

  // For callers.
  void forget(std::size_t file, const RangeKey& front);
  void begin_waiting(std::unique_lock<std::mutex>& lock, const RangeKey& key,
                     const ByteRange& range);
  bool find_in_front(std::unique_lock<std::mutex>& lock, const RangeKey& key,
                     const ByteRange& range);
  bool find_on_disk(std::unique_lock<std::mutex>& lock, const RangeKey& key,
                    const ByteRange& range);
  void wait_for(std::unique_lock<std::mutex>& lock, const std::vector<RangeKey>& keys,
                const std::stop_token& stop);
  bool wait_until(std::unique_lock<std::mutex>& lock, const std::stop_token& stop,
                  const std::function<bool()>& over);
  bool is_stopped(std::unique_lock<std::mutex>& lock, const std::stop_token& stop) const;
  std::vector<SharedBytes> end_waiting(const std::vector<RangeKey>& keys);
  std::string disk_key(std::size_t file, const ByteRange& range) const;
  static RangeKey key_of(std::size_t file, const ByteRange& range) {
    return {.file = file, .front = false, .offset = range.offset, .size_bytes = range.size_bytes};
  }
  static std::string front_key(const File& file) { return "front " + file.url; }

  // For the thread; see remote_fetching.cpp.
  void run();
  void step();
  void begin_jobs();
  void send_due_jobs();
  void send(FetchJob& job);
  std::chrono::milliseconds time_to_next() const;
  std::uint64_t bytes_under_way() const;
  void take(FetchJob& job, std::span<const std::byte> bytes);
  void deliver(const RangeKey& key, std::vector<std::byte> bytes);
  void fail_checksum(const RangeKey& key, std::uint64_t found, std::uint64_t expected);
  void finish(const HttpEnd& end);
  std::optional<Failure> pin(FetchJob& job, const HttpEnd& end);
  void finish_front(FetchJob& job, bool same);
  void try_again(FetchJob& job, const HttpEnd& end);
  void give_up(FetchJob& job, const Failure& failure, bool unreachable);
  void break_down(Failure failure);
  void tell_arrival();

  const AccessOptions options_;
  DiskCache disk_;

  mutable std::mutex mutex_;  ///< of all down to the next comment
  std::condition_variable_any arrived_;
  std::vector<File> files_;
  RangeTable table_;
  AccessStatistics statistics_;
  bool ending_ = false;
  std::optional<Failure> broken_;  ///< the thread has ended early, and why

  std::mutex
      listeners_mutex_;  ///< of the next; nobody who holds mutex_ or a lock that listeners take takes it
  std::vector<Wishes*> listeners_;

  // The thread's own.
  HttpTransfers transfers_;
  std::list<FetchJob> jobs_;
  std::uint64_t next_number_ = 0;
  LinkMeter link_;
  bool reached_ = false;                        ///< a connection was made
  FetchJob::Clock::time_point last_success_{};  ///< when bytes came last
  bool news_ = false;                           ///< something has become ready in this step
  /// Came in this step: is written to the disk once everybody has been told.
  std::vector<std::pair<std::string, SharedBytes>> to_keep_;
  std::vector<std::string> to_remove_;  ///< and from the disk

  std::thread thread_;  ///< the last member: it uses all else
};

/// One file of them, which keeps all alive.
class RemoteSource : public ByteSource {
 public:
  RemoteSource(std::shared_ptr<RemoteFiles> files, const std::filesystem::path& url)
      : files_(std::move(files)), number_(files_->add(url.string())), path_(url) {}

  const std::filesystem::path& path() const override { return path_; }
  std::uint64_t size_bytes() const override { return files_->size_bytes(number_); }
  SharedBytes front(std::size_t size_bytes, Fresh fresh) override {
    return files_->front(number_, size_bytes, fresh);
  }
  std::vector<SharedBytes> read(std::span<const ByteRange> ranges,
                                const std::stop_token& stop) const override {
    return files_->read(number_, ranges, stop);
  }
  void expect_front(std::size_t size_bytes) override { files_->expect_front(number_, size_bytes); }
  bool has_stored_front() const override { return files_->has_stored_front(number_); }
  void keep_front(std::span<const std::byte> bytes) override { files_->keep_front(number_, bytes); }
  void expect_size(std::uint64_t size_bytes) override { files_->expect_size(number_, size_bytes); }
  void identify(std::uint64_t content) override { files_->identify(number_, content); }
  std::unique_ptr<WishList> make_wish_list(std::function<void()> arrived,
                                           std::uint64_t together_bytes) const override {
    return files_->make_wish_list(number_, std::move(arrived), together_bytes);
  }
  bool ready(const ByteRange& range) const override { return files_->ready(number_, range); }
  bool is_remote() const override { return true; }

 private:
  std::shared_ptr<RemoteFiles> files_;
  std::size_t number_;
  std::filesystem::path path_;
};

}  // namespace cairn::formats
