#include "formats/scans/laz/worker.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <fstream>
#include <string>
#include <string_view>
#include <system_error>
#include <thread>

#include <fmt/format.h>

#include "formats/bytes.h"
#include "formats/error.h"
#include "formats/resource_folder.h"

namespace cairn::formats {
namespace {

constexpr std::uint32_t kReady = 0;
constexpr std::uint32_t kDone = 0;
constexpr std::uint32_t kFailed = 0xffffffffU;
constexpr std::size_t kRequestBytes = 12;
constexpr std::size_t kSendBytes = std::size_t{64} << 10;
constexpr std::uint32_t kMostMessageBytes = 1000;
// A block takes a fraction of a second; a worker that is silent for so long will never speak.
constexpr timeval kLongestSilence{.tv_sec = 120, .tv_usec = 0};

// How often and how long the end of a process is waited for whose socket is closed.
constexpr int kMostWaits = 200;
constexpr std::chrono::milliseconds kWait{10};

constexpr const char* kNode = "node";
// The decoder needs little of the script engine's own memory, which by default it would take freely.
constexpr std::array<const char*, 2> kNodeFlags{"--max-old-space-size=32",
                                                "--max-semi-space-size=1"};

/// The script, in a folder that laz-perf is in, too.
std::filesystem::path worker_script() {
  constexpr const char* kPurpose = "the decoder of LAZ files";
  for (const char* part : {"worker.cjs", "node_modules/laz-perf/package.json"})
    resource_folder("laz-worker", part, kPurpose);
  return resource_folder("laz-worker", "worker.cjs", kPurpose) / "worker.cjs";
}

/// Memory of workers, for the record of a run. A process has one, as it has one own peak.
class Peaks {
 public:
  static Peaks& of_process() {
    static Peaks peaks;
    return peaks;
  }

  void add(pid_t process) {
    const std::lock_guard lock(mutex_);
    alive_.push_back(process);
  }
  /// Before the process ends.
  void remove(pid_t process) {
    const std::lock_guard lock(mutex_);
    measure();
    std::erase(alive_, process);
  }
  std::uint64_t peak_bytes() {
    const std::lock_guard lock(mutex_);
    measure();
    return peak_bytes_;
  }
  void restart() {
    const std::lock_guard lock(mutex_);
    peak_bytes_ = 0;
  }

 private:
  void measure() {
    std::uint64_t sum = 0;
    for (const pid_t process : alive_) sum += peak_of(process);
    peak_bytes_ = std::max(peak_bytes_, sum);
  }

  static std::uint64_t peak_of(pid_t process) {
    std::ifstream status(fmt::format("/proc/{}/status", process));
    for (std::string word; status >> word;)
      if (std::uint64_t kilobytes = 0; word == "VmHWM:" && status >> kilobytes)
        return kilobytes * 1024;
    return 0;
  }

  std::mutex mutex_;
  std::vector<pid_t> alive_;
  std::uint64_t peak_bytes_ = 0;
};

/// What posix_spawn is told, freed at the end.
class SpawnSettings {
 public:
  explicit SpawnSettings(int socket) {
    ::posix_spawn_file_actions_init(&actions_);
    ::posix_spawn_file_actions_adddup2(&actions_, socket, STDIN_FILENO);
    ::posix_spawn_file_actions_adddup2(&actions_, socket, STDOUT_FILENO);
    ::posix_spawn_file_actions_addopen(&actions_, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    ::posix_spawn_file_actions_addclosefrom_np(&actions_, STDERR_FILENO + 1);
    ::posix_spawnattr_init(&attributes_);
    // A process group of its own: Ctrl-C reaches only this process, which then ends its workers.
    ::posix_spawnattr_setpgroup(&attributes_, 0);
    sigset_t none, all;
    ::sigemptyset(&none);
    ::sigfillset(&all);
    ::posix_spawnattr_setsigmask(&attributes_, &none);
    ::posix_spawnattr_setsigdefault(&attributes_, &all);
    ::posix_spawnattr_setflags(
        &attributes_, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  }
  ~SpawnSettings() {
    ::posix_spawn_file_actions_destroy(&actions_);
    ::posix_spawnattr_destroy(&attributes_);
  }
  SpawnSettings(const SpawnSettings&) = delete;
  SpawnSettings& operator=(const SpawnSettings&) = delete;

  /// Returns 0 or the error's number.
  int spawn(std::vector<std::string> words, std::vector<char*> environment, pid_t& process) const {
    std::vector<char*> arguments;
    arguments.reserve(words.size() + 1);
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    environment.push_back(nullptr);
    return ::posix_spawnp(&process, arguments.front(), &actions_, &attributes_, arguments.data(),
                          environment.data());
  }

 private:
  posix_spawn_file_actions_t actions_;
  posix_spawnattr_t attributes_;
};

/// The environment without what would change how Node.js runs.
std::vector<char*> worker_environment() {
  std::vector<char*> kept;
  for (char** entry = environ; entry != nullptr && *entry != nullptr; ++entry)
    if (!std::string_view(*entry).starts_with("NODE_")) kept.push_back(*entry);
  return kept;
}

}  // namespace

LazWorker::LazWorker() : LazWorker(worker_script()) {
  try {
    expect(kReady);
  } catch (const LazWorkerFailure& failure) {
    throw_system(fmt::format("the decoder of LAZ files does not start: {}", failure.what()), kNode,
                 0);
  }
}

LazWorker::LazWorker(const std::filesystem::path& script) {
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0)
    throw_system("cannot make a socket for the decoder of LAZ files", script, errno);
  socket_ = ends[0];
  ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &kLongestSilence, sizeof kLongestSilence);
  ::setsockopt(socket_, SOL_SOCKET, SO_SNDTIMEO, &kLongestSilence, sizeof kLongestSilence);
  std::vector<std::string> words{kNode};
  words.insert(words.end(), kNodeFlags.begin(), kNodeFlags.end());
  words.push_back(script.string());
  const int failed = SpawnSettings(ends[1]).spawn(std::move(words), worker_environment(), process_);
  ::close(ends[1]);
  if (failed != 0) {
    ::close(socket_);
    throw_system("cannot start Node.js, which decodes LAZ files; is the package nodejs installed?",
                 kNode, failed);
  }
  Peaks::of_process().add(process_);
}

LazWorker::~LazWorker() {
  Peaks::of_process().remove(process_);
  ::close(socket_);
  ::kill(process_, SIGKILL);  // it holds nothing that must be saved
  while (::waitpid(process_, nullptr, 0) < 0 && errno == EINTR) {
  }
}

void LazWorker::expect(std::uint32_t expected) {
  const std::uint32_t number = receive_number();
  if (number == kFailed) throw_told_failure();
  if (number != expected) throw LazWorkerFailure("the decoder does not keep to the protocol");
}

void LazWorker::send_bytes(const std::byte* bytes, std::size_t count) {
  while (count > 0) {
    const ssize_t sent = ::send(socket_, bytes, count, MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent < 0 && (errno == EAGAIN || errno == EWOULDBLOCK))
      throw LazWorkerFailure("the decoder does not answer");
    if (sent < 0) {
      // It may have said why before it ended.
      if (receive_number() == kFailed) throw_told_failure();
      throw_ended();
    }
    bytes += sent;
    count -= static_cast<std::size_t>(sent);
  }
}

void LazWorker::receive_bytes(std::byte* bytes, std::size_t count) {
  while (count > 0) {
    const ssize_t received = ::recv(socket_, bytes, count, 0);
    if (received < 0 && errno == EINTR) continue;
    if (received < 0 && (errno == EAGAIN || errno == EWOULDBLOCK))
      throw LazWorkerFailure("the decoder does not answer");
    if (received <= 0) throw_ended();
    bytes += received;
    count -= static_cast<std::size_t>(received);
  }
}

std::uint32_t LazWorker::receive_number() {
  std::array<std::byte, 4> bytes{};
  receive_bytes(bytes.data(), bytes.size());
  return load_le<std::uint32_t>(bytes.data());
}

void LazWorker::throw_told_failure() {
  std::string text(std::min(receive_number(), kMostMessageBytes), '\0');
  receive_bytes(reinterpret_cast<std::byte*>(text.data()), text.size());
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 0x20) c = ' ';
  throw LazWorkerFailure(text);
}

void LazWorker::throw_ended() const {
  // The socket is closed a moment before the process can be waited for. What is told stays for the destructor.
  siginfo_t ended{};
  for (int i = 0; i < kMostWaits && ended.si_pid == 0; ++i) {
    if (i > 0) std::this_thread::sleep_for(kWait);
    if (::waitid(P_PID, static_cast<id_t>(process_), &ended, WEXITED | WNOHANG | WNOWAIT) != 0)
      break;
  }
  const bool was_killed =
      ended.si_code == CLD_KILLED && (ended.si_status == SIGKILL || ended.si_status == SIGTERM);
  throw LazWorkerFailure(was_killed ? "the decoder was killed" : "the decoder has ended",
                         was_killed);
}

void LazWorker::send(const RandomAccessFile& file, const LazRequest& request) {
  CAIRN_CHECK(request.points > 0 && request.record_bytes > 0);
  std::array<std::byte, kRequestBytes> head{};
  store_le(head.data(), request.size_bytes);
  store_le(head.data() + 4, request.points);
  store_le(head.data() + 8, request.record_bytes);
  store_le(head.data() + 10, request.point_format);
  send_bytes(head.data(), head.size());
  std::vector<std::byte> part(std::min<std::size_t>(kSendBytes, request.size_bytes));
  for (std::size_t done = 0; done < request.size_bytes; done += part.size()) {
    part.resize(std::min(kSendBytes, request.size_bytes - done));
    file.read_exactly(request.offset + done, part);
    send_bytes(part.data(), part.size());
  }
}

std::uint32_t LazWorker::receive(std::uint32_t most, std::uint16_t record_bytes,
                                 std::vector<std::byte>& records) {
  const std::uint32_t count = receive_number();
  if (count == kFailed) throw_told_failure();
  if (count == 0 || count > most) throw LazWorkerFailure("the decoder miscounts its points");
  records.resize(std::size_t{count} * record_bytes);
  receive_bytes(records.data(), records.size());
  return count;
}

void LazWorker::finish() { expect(kDone); }

std::shared_ptr<LazWorkers> LazWorkers::shared() {
  static std::mutex mutex;
  static std::weak_ptr<LazWorkers> current;
  const std::lock_guard lock(mutex);
  auto workers = current.lock();
  if (workers == nullptr) current = workers = std::make_shared<LazWorkers>();
  return workers;
}

std::unique_ptr<LazWorker> LazWorkers::take() {
  {
    const std::lock_guard lock(mutex_);
    if (!idle_.empty()) {
      auto worker = std::move(idle_.back());
      idle_.pop_back();
      return worker;
    }
  }
  return std::make_unique<LazWorker>();
}

void LazWorkers::give_back(std::unique_ptr<LazWorker> worker) {
  const std::lock_guard lock(mutex_);
  idle_.push_back(std::move(worker));
}

std::uint64_t laz_workers_peak_bytes() { return Peaks::of_process().peak_bytes(); }
void restart_laz_workers_peak() { Peaks::of_process().restart(); }

}  // namespace cairn::formats
