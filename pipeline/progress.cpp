#include "pipeline/progress.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>

#include "pipeline/progress_lines.h"
#include "pipeline/terminal.h"

namespace cairn::pipeline {
namespace {

using Clock = std::chrono::steady_clock;

/// One write a line, so that lines of two threads never mix.
void write_stderr(const std::string& text) { std::fwrite(text.data(), 1, text.size(), stderr); }

/// What differs between the ways of showing.
class View {
 public:
  virtual ~View() = default;
  virtual std::chrono::milliseconds interval() const = 0;
  virtual void begin(const ProgressState&) {}
  virtual void look(const ProgressState& state) = 0;
  virtual void end(const ProgressState& state) = 0;
  /// The job ends inside a stage.
  virtual void leave() {}
};

class BarView : public View {
 public:
  std::chrono::milliseconds interval() const override { return std::chrono::milliseconds(100); }
  void begin(const ProgressState&) override { drawn_ = false; }
  void look(const ProgressState& state) override {
    write_stderr("\r" + bar_line(state, terminal_columns(STDERR_FILENO, 80) - 1) + "\x1b[K");
    drawn_ = true;
  }
  void end(const ProgressState& state) override {
    write_stderr("\r" + plain_line(state) + "\x1b[K\n");
  }
  void leave() override {
    if (drawn_) write_stderr("\n");
  }

 private:
  bool drawn_ = false;  ///< a line of the running stage stands on the terminal
};

class PlainView : public View {
 public:
  std::chrono::milliseconds interval() const override { return std::chrono::seconds(5); }
  void look(const ProgressState& state) override { write_stderr(plain_line(state) + "\n"); }
  void end(const ProgressState& state) override { look(state); }
};

class JsonView : public View {
 public:
  std::chrono::milliseconds interval() const override { return std::chrono::milliseconds(500); }
  void begin(const ProgressState& state) override {
    write_stderr(json_line(state, "begin") + "\n");
  }
  void look(const ProgressState& state) override {
    write_stderr(json_line(state, "progress") + "\n");
  }
  void end(const ProgressState& state) override { write_stderr(json_line(state, "end") + "\n"); }
};

class Silence : public stages::ProgressSink {
 public:
  void begin(std::string_view, std::uint64_t) override {}
  void advance(std::uint64_t) override {}
  void end() override {}
};

/// Counts in the workers' threads, shows from its own.
class Display : public stages::ProgressSink {
 public:
  Display(std::unique_ptr<View> view, std::optional<std::chrono::milliseconds> interval)
      : view_(std::move(view)),
        interval_(interval.value_or(view_->interval())),
        drawer_([this](const std::stop_token& stop) { draw(stop); }) {}

  ~Display() override {
    drawer_.request_stop();
    drawer_.join();
    if (running_) view_->leave();
  }

  void begin(std::string_view stage, std::uint64_t total_points) override {
    const std::lock_guard lock(mutex_);
    stage_ = stage;
    total_ = total_points;
    done_ = 0;
    start_ = Clock::now();
    running_ = true;
    view_->begin(state());
    wake_.notify_all();
  }

  void advance(std::uint64_t points) override {
    done_.fetch_add(points, std::memory_order_relaxed);
  }

  void end() override {
    const std::lock_guard lock(mutex_);
    if (!running_) return;
    running_ = false;
    ProgressState last = state();
    last.finished = true;
    view_->end(last);
  }

 private:
  /// Requires the mutex.
  ProgressState state() const {
    return {.stage = stage_,
            .done = done_.load(std::memory_order_relaxed),
            .total = total_,
            .elapsed_s = std::chrono::duration<double>(Clock::now() - start_).count()};
  }

  void draw(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    while (!stop.stop_requested()) {
      wake_.wait(lock, stop, [this] { return running_; });
      // Woken early only by the end of the job: the next stage keeps the beat of the one before.
      wake_.wait_for(lock, stop, interval_, [] { return false; });
      if (running_ && !stop.stop_requested()) view_->look(state());
    }
  }

  std::unique_ptr<View> view_;
  std::chrono::milliseconds interval_;
  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::string stage_;
  std::uint64_t total_ = 0;
  std::atomic<std::uint64_t> done_ = 0;
  Clock::time_point start_;
  bool running_ = false;
  std::jthread drawer_;  // last: it uses all of the above
};

}  // namespace

std::optional<ProgressMode> progress_mode_named(std::string_view name) {
  const auto at = std::find(kProgressModeNames.begin(), kProgressModeNames.end(), name);
  if (at == kProgressModeNames.end()) return std::nullopt;
  return static_cast<ProgressMode>(at - kProgressModeNames.begin());
}

std::unique_ptr<stages::ProgressSink> make_progress(
    ProgressMode mode, std::optional<std::chrono::milliseconds> interval) {
  if (mode == ProgressMode::kAuto)
    mode = is_capable_terminal(STDERR_FILENO) ? ProgressMode::kBar : ProgressMode::kPlain;
  switch (mode) {
    case ProgressMode::kBar:
      return std::make_unique<Display>(std::make_unique<BarView>(), interval);
    case ProgressMode::kJson:
      return std::make_unique<Display>(std::make_unique<JsonView>(), interval);
    case ProgressMode::kNone:
      return std::make_unique<Silence>();
    default:
      return std::make_unique<Display>(std::make_unique<PlainView>(), interval);
  }
}

}  // namespace cairn::pipeline
