// Files of which each may be named once.
#pragma once

#include <filesystem>
#include <span>

namespace cairn::pipeline {

/// Throws Error (kUsage), naming both, where two of the paths are one file: the same path, another spelling of it, or a
/// link to it. A path that leads nowhere is left to whoever opens it.
void require_distinct_files(std::span<const std::filesystem::path> paths);

}  // namespace cairn::pipeline
