// Where the program finds the folders that it is delivered with: scripts that other processes run, pages that browsers show.
#pragma once

#include <filesystem>
#include <string_view>

namespace cairn::formats {

/// The folder `name` beside the running program, as in a build folder or where both were copied; else the one among the
/// program's data where it is installed (share/cairn/NAME of the same prefix, wherever that has been moved to). Links to
/// the program are followed. Throws Error (kSystem), naming both places and `purpose` ("the decoder of LAZ files"), if
/// neither has the file `part`.
std::filesystem::path resource_folder(std::string_view name, std::string_view part,
                                      std::string_view purpose);

}  // namespace cairn::formats
