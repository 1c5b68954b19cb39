#include "pipeline/publish.h"

#include <fcntl.h>
#include <stdio.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <string>
#include <string_view>

#include "formats/error.h"

namespace cairn::pipeline {
namespace {

namespace fs = std::filesystem;
using formats::throw_system;
using formats::throw_usage;

constexpr std::array<std::string_view, 4> kDatasetFiles{"index.bin", "nodes.bin", "metadata.json",
                                                        "run.json"};

fs::path folder_of(const fs::path& path) {
  return path.has_parent_path() ? path.parent_path() : fs::path(".");
}

void sync(const fs::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) throw_system("cannot open", path, errno);
  const int outcome = ::fsync(descriptor);
  const int reason = errno;
  ::close(descriptor);
  if (outcome != 0) throw_system("cannot write to disk", path, reason);
}

void sync_tree(const fs::path& path) {
  if (fs::is_directory(path))
    for (const auto& entry : fs::directory_iterator(path)) sync_tree(entry.path());
  sync(path);
}

[[noreturn]] void refuse_existing(const fs::path& output) {
  throw_usage(output.string() + " exists; --force replaces it once the new one is complete");
}

/// For file systems that cannot exchange two names: the old one steps aside, and back if the new one cannot
/// take its place. Between the two renames the name is free.
void exchange_in_two_steps(const fs::path& from, const fs::path& to) {
  const fs::path aside = from.string() + ".old";
  if (::rename(to.c_str(), aside.c_str()) != 0) throw_system("cannot replace", to, errno);
  if (::rename(from.c_str(), to.c_str()) != 0) {
    const int reason = errno;
    ::rename(aside.c_str(), to.c_str());
    throw_system("cannot replace", to, reason);
  }
  ::rename(aside.c_str(), from.c_str());
}

bool not_supported(int reason) { return reason == EINVAL || reason == ENOSYS || reason == ENOTSUP; }

void rename_to_free_name(const fs::path& from, const fs::path& to) {
  if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return;
  if (errno == EEXIST) refuse_existing(to);
  if (!not_supported(errno)) throw_system("cannot publish", to, errno);
  if (fs::exists(fs::symlink_status(to))) refuse_existing(to);
  if (::rename(from.c_str(), to.c_str()) != 0) throw_system("cannot publish", to, errno);
}

}  // namespace

void require_free_place(const fs::path& output, bool force) {
  if (output.filename().empty() || output.filename() == "." || output.filename() == "..")
    throw_usage("'" + output.string() + "' is no name for an output");
  if (!fs::is_directory(folder_of(output)))
    throw_usage("the folder " + folder_of(output).string() + " of the output does not exist");
  if (!force && fs::exists(fs::symlink_status(output))) refuse_existing(output);
}

void require_dataset_or_nothing(const fs::path& output) {
  if (!fs::exists(fs::symlink_status(output))) return;
  const std::string refusal = "--force replaces datasets only, and " + output.string() + " ";
  if (!fs::is_directory(output)) throw_usage(refusal + "is not a folder");
  for (const auto& entry : fs::directory_iterator(output)) {
    const std::string name = entry.path().filename().string();
    if (std::find(kDatasetFiles.begin(), kDatasetFiles.end(), name) == kDatasetFiles.end())
      throw_usage(refusal + "holds " + name + ", which is no part of one");
  }
  if (!fs::exists(output / "index.bin")) throw_usage(refusal + "holds no index.bin");
}

void publish(const fs::path& from, const fs::path& to, bool replace) {
  sync_tree(from);
  if (replace && fs::exists(fs::symlink_status(to))) {
    if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_EXCHANGE) != 0) {
      if (!not_supported(errno)) throw_system("cannot replace", to, errno);
      exchange_in_two_steps(from, to);
    }
  } else {
    rename_to_free_name(from, to);
  }
  sync(folder_of(to));
}

}  // namespace cairn::pipeline
