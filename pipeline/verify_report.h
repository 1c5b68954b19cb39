// What verify found, for people and for programs.
#pragma once

#include <filesystem>
#include <string>

#include "pipeline/terminal.h"
#include "stages/verify/verify.h"

namespace cairn::pipeline {

/// An invariant a line: held, not checked and why, or BROKEN with the first failures.
std::string verify_text(const stages::VerifyReport& report, const std::filesystem::path& folder,
                        const Paint& paint = {});

/// {"held": ..., "invariants": [{"name": ..., "held": ..., "checks": ..., ...}], ...}
std::string verify_json(const stages::VerifyReport& report);

/// One line that names the invariants that do not hold. Requires that one does not.
std::string broken_promises(const stages::VerifyReport& report);

}  // namespace cairn::pipeline
