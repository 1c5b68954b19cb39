// Turns the first SIGINT, SIGTERM or SIGHUP into a stop request, so that work folders are cleaned on the
// way out. A second one ends the process at once.
#pragma once

#include <atomic>
#include <csignal>
#include <stop_token>
#include <thread>

namespace cairn::pipeline {

/// Make one before any other thread, in the main thread: signals are blocked in this thread and all that it
/// starts, and taken by the watch's own. Signals that were ignored (nohup) stay so.
class SignalWatch {
 public:
  SignalWatch();
  ~SignalWatch();
  SignalWatch(const SignalWatch&) = delete;
  SignalWatch& operator=(const SignalWatch&) = delete;

  std::stop_token stop_token() const { return source_.get_token(); }
  /// The signal that asked to stop; 0 if none did.
  int caught() const { return caught_.load(); }

 private:
  void watch();

  std::stop_source source_;
  std::atomic<int> caught_ = 0;
  std::atomic<bool> leaving_ = false;
  sigset_t watched_{};
  sigset_t mask_before_{};
  std::thread watcher_;
};

}  // namespace cairn::pipeline
