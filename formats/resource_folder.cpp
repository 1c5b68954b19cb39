#include "formats/resource_folder.h"

#include <fmt/format.h>

#include <cerrno>
#include <system_error>

#include "formats/error.h"

// The build tells where the program's data lie, seen from the folder of the installed program.
#ifndef CAIRN_DATA_FROM_PROGRAM
#error "CAIRN_DATA_FROM_PROGRAM is not defined"
#endif

namespace cairn::formats {

std::filesystem::path resource_folder(std::string_view name, std::string_view part,
                                      std::string_view purpose) {
  namespace fs = std::filesystem;
  std::error_code failed;
  const fs::path program = fs::read_symlink("/proc/self/exe", failed);
  if (failed)
    throw_system("cannot tell the folder of this program", "/proc/self/exe", failed.value());
  const fs::path beside = program.parent_path() / name;
  if (fs::exists(beside / part, failed)) return beside;
  const fs::path installed =
      (program.parent_path() / CAIRN_DATA_FROM_PROGRAM / name).lexically_normal();
  if (fs::exists(installed / part, failed)) return installed;
  throw_system(fmt::format("{} is not beside the program, in {}, nor installed in", purpose,
                           beside.string()),
               installed / part, ENOENT);
}

}  // namespace cairn::formats
