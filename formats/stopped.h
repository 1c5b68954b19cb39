// How work that the user asked to stop ends.
#pragma once

namespace cairn::formats {

/// Thrown where the user asked to stop; the command's entry tells the user.
struct Stopped {};

}  // namespace cairn::formats
