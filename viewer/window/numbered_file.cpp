#include "viewer/window/numbered_file.h"

#include <fmt/format.h>

#include <cerrno>
#include <system_error>

#include "formats/error.h"

namespace cairn::viewer {

std::filesystem::path next_free_name(const std::filesystem::path& folder, std::string_view stem,
                                     std::string_view suffix) {
  for (int number = 1; number <= 9999; ++number) {
    std::filesystem::path path = folder / fmt::format("{}-{:04}{}", stem, number, suffix);
    std::error_code error;
    if (std::filesystem::symlink_status(path, error).type() ==
        std::filesystem::file_type::not_found)
      return path;
    if (error) formats::throw_system("cannot look for", path, error.value());
  }
  formats::throw_system(fmt::format("no free name {}-NNNN{} in", stem, suffix), folder, EEXIST);
}

}  // namespace cairn::viewer
