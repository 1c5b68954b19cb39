// From a command line to an exit code: the one place that catches errors, prints their line and decides
// what the process returns.
#pragma once

namespace cairn::pipeline {

/// Runs the command that the arguments name. Results go to stdout; on stderr stand progress and, after a
/// failure, one line "cairn: error: ...". Returns 0, or: 2 for a wrong flag, key or value; 3 for a bad
/// input file; 4 for a disk, memory or permission problem; 5 for a broken promise of a dataset or a bug;
/// 128 + the signal's number if SIGINT, SIGTERM or SIGHUP stopped it.
int run_program(int argc, char** argv);

}  // namespace cairn::pipeline
