#include "pipeline/signal_watch.h"

#include <pthread.h>
#include <unistd.h>

namespace cairn::pipeline {
namespace {

/// Ends the watcher's wait; not one that users send.
constexpr int kLeave = SIGUSR2;

bool is_ignored(int signal) {
  struct sigaction action {};
  return ::sigaction(signal, nullptr, &action) == 0 && action.sa_handler == SIG_IGN;
}

}  // namespace

SignalWatch::SignalWatch() {
  ::sigemptyset(&watched_);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP})
    if (!is_ignored(signal)) ::sigaddset(&watched_, signal);
  ::sigaddset(&watched_, kLeave);
  ::pthread_sigmask(SIG_BLOCK, &watched_, &mask_before_);
  watcher_ = std::thread([this] { watch(); });
}

SignalWatch::~SignalWatch() {
  leaving_ = true;
  ::pthread_kill(watcher_.native_handle(), kLeave);
  watcher_.join();
  ::pthread_sigmask(SIG_SETMASK, &mask_before_, nullptr);
}

void SignalWatch::watch() {
  while (true) {
    int signal = 0;
    if (::sigwait(&watched_, &signal) != 0) continue;
    if (signal == kLeave && leaving_) return;
    if (signal == kLeave) continue;
    // A second wish: no cleaning, no destructors. The next build takes over what is left.
    if (caught_.load() != 0) ::_exit(128 + signal);
    caught_ = signal;
    source_.request_stop();
  }
}

}  // namespace cairn::pipeline
