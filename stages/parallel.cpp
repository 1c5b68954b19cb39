#include "stages/parallel.h"

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>

namespace cairn::stages {

void run_in_arena(unsigned workers, const std::function<void()>& work) {
  // Without it there are no more workers than processors, whatever the arena has room for. Of nested
  // controls the smallest counts.
  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, workers);
  tbb::task_arena arena(static_cast<int>(workers));
  arena.execute(work);
}

unsigned workers_within(const Context& context, std::uint64_t worker_bytes) {
  const std::uint64_t room = context.memory_bytes / 2 / std::max<std::uint64_t>(1, worker_bytes);
  return static_cast<unsigned>(std::clamp<std::uint64_t>(room, 1, std::max(1U, context.threads)));
}

void for_each_piece(std::uint64_t count, const std::function<void(std::uint64_t)>& piece) {
  if (count == 1) return piece(0);
  tbb::task_group_context context;
  tbb::parallel_for(
      tbb::blocked_range<std::uint64_t>(0, count, 1),
      [&](const auto& range) {
        for (std::uint64_t i = range.begin(); i != range.end(); ++i) piece(i);
      },
      tbb::simple_partitioner{}, context);
  // A loop around this one that fails cancels this one too, which then returns without an exception.
  if (context.is_group_execution_cancelled()) throw Stopped{};
}

}  // namespace cairn::stages
