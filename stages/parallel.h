// The two ways in which stages run in parallel: over numbered pieces whose results do not depend on who
// does which, and inside an arena of as many workers as the runner allows.
#pragma once

#include <cstdint>
#include <functional>

#include "formats/stopped.h"
#include "stages/context.h"

namespace cairn::stages {

/// Thrown when the runner asked to stop.
using formats::Stopped;

inline void throw_if_stopped(const Context& context) {
  if (context.stop.stop_requested()) throw Stopped{};
}

/// Runs `work` with `workers` threads for all parallel loops inside it: no more, and, even where there
/// are fewer processors, no fewer unless an arena around it is smaller.
void run_in_arena(unsigned workers, const std::function<void()>& work);

/// How many workers a stage may have that hold `worker_bytes` each: all threads, or as many as half of
/// the memory has room for, at least one.
unsigned workers_within(const Context& context, std::uint64_t worker_bytes);

/// Calls piece(0) ... piece(count - 1), in any order and side by side. Rethrows the first error. Returns
/// only if every piece was done: a loop that an error elsewhere cut short throws Stopped, so that nobody
/// goes on with pieces missing; the loop around both rethrows the error.
void for_each_piece(std::uint64_t count, const std::function<void(std::uint64_t)>& piece);

}  // namespace cairn::stages
