// The processes that decode LAZ: laz-perf, compiled to WebAssembly, run by Node.js (worker.cjs, which
// tells the protocol). A process apart keeps whatever a damaged chunk does to the decoder out of this
// one. Workers are started when they are first needed, used again, and end with the last reader.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <vector>

#include "formats/random_access_file.h"

namespace cairn::formats {

/// A worker that said it cannot decode, or that ended or fell silent. It cannot be used again.
class LazWorkerFailure : public std::runtime_error {
 public:
  explicit LazWorkerFailure(const std::string& what, bool was_killed = false)
      : std::runtime_error(what), was_killed_(was_killed) {}

  /// Whether it was ended from outside, as where the system is short of memory: no fault of the chunk.
  bool was_killed() const { return was_killed_; }

 private:
  bool was_killed_;
};

struct LazRequest {
  std::uint64_t offset = 0;      ///< of the chunk in the file
  std::uint32_t size_bytes = 0;  ///< of the chunk
  std::uint32_t points = 0;      ///< at least 1
  std::uint16_t record_bytes = 0;
  std::uint8_t point_format = 0;
};

class LazWorker {
 public:
  /// Starts the process. Throws kSystem, saying what is missing, if that fails.
  LazWorker();
  ~LazWorker();
  LazWorker(const LazWorker&) = delete;
  LazWorker& operator=(const LazWorker&) = delete;

  /// Hands over a chunk. Before the next, all its records must be received and finish called. Throws
  /// LazWorkerFailure, and kInput where the file ends within the chunk.
  void send(const RandomAccessFile& file, const LazRequest& request);

  /// Fills `records` with the next LAS records of the chunk; their number, at least 1 and at most
  /// `most`. Throws LazWorkerFailure.
  std::uint32_t receive(std::uint32_t most, std::uint16_t record_bytes,
                        std::vector<std::byte>& records);

  /// After the last record: throws LazWorkerFailure if the chunk was not used up exactly.
  void finish();

 private:
  explicit LazWorker(const std::filesystem::path& script);
  void expect(std::uint32_t expected);
  void send_bytes(const std::byte* bytes, std::size_t count);
  void receive_bytes(std::byte* bytes, std::size_t count);
  std::uint32_t receive_number();
  [[noreturn]] void throw_told_failure();
  [[noreturn]] void throw_ended() const;

  pid_t process_ = -1;
  int socket_ = -1;
};

/// The idle workers of this process. May be used by several threads.
class LazWorkers {
 public:
  /// One pool for all that hold it at the same time.
  static std::shared_ptr<LazWorkers> shared();

  /// An idle worker or a new one; see LazWorker().
  std::unique_ptr<LazWorker> take();
  /// Only after LazWorker::finish.
  void give_back(std::unique_ptr<LazWorker> worker);

 private:
  std::mutex mutex_;
  std::vector<std::unique_ptr<LazWorker>> idle_;
};

/// The largest resident memory that the workers alive at one time have had together, since the first of them or
/// since restart_laz_workers_peak.
std::uint64_t laz_workers_peak_bytes();
void restart_laz_workers_peak();

}  // namespace cairn::formats
