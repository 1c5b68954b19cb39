#include "pipeline/publish.h"

#include <fcntl.h>
#include <stdio.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <string>
#include <string_view>
#include <system_error>

#include "formats/dataset/dataset_reader.h"
#include "formats/error.h"
#include "formats/file_names.h"
#include "formats/random_access_file.h"
#include "pipeline/run_record.h"

namespace cairn::pipeline {
namespace {

namespace fs = std::filesystem;
using formats::folder_of;
using formats::throw_system;
using formats::throw_usage;
namespace dataset_file = formats::dataset_file;

constexpr std::array<std::string_view, 4> kDatasetFiles{dataset_file::kIndex, dataset_file::kNodes,
                                                        dataset_file::kMetadata, kRunRecord};

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

bool begins_like_an_index(const fs::path& path) {
  std::array<std::byte, formats::kIndexSignature.size()> bytes{};
  const formats::RandomAccessFile file(path);
  return file.read_at_most(0, bytes) == bytes.size() &&
         std::ranges::equal(bytes, std::as_bytes(std::span(formats::kIndexSignature)));
}

fs::path free_name_beside(const fs::path& path) {
  fs::path aside = formats::with_suffix(path, ".old");
  for (int number = 2; fs::exists(fs::symlink_status(aside)); ++number)
    aside = formats::with_suffix(path, ".old" + std::to_string(number));
  return aside;
}

/// Between the first two renames nothing stands at `to`; killed there, the next build moves the old one back.
void exchange_in_two_steps(const fs::path& from, const fs::path& to,
                           const OnStepAside& on_step_aside, const Renames& renames) {
  const fs::path aside = free_name_beside(to);
  on_step_aside(aside);
  if (renames.rename(to, aside) != 0) throw_system("cannot replace", to, errno);
  if (renames.rename(from, to) != 0) {
    const int reason = errno;
    if (renames.rename(aside, to) == 0) throw_system("cannot replace", to, reason);
    throw_system("the old dataset is now " + aside.string() + ", the new one " + from.string() +
                     "; cannot make one of them",
                 to, reason);
  }
  std::error_code ignored;  // the result stands
  if (renames.rename(aside, from) != 0) fs::remove_all(aside, ignored);
}

}  // namespace

Renames Renames::of_system() {
  return {.exchange =
              [](const fs::path& a, const fs::path& b) {
                return ::renameat2(AT_FDCWD, a.c_str(), AT_FDCWD, b.c_str(), RENAME_EXCHANGE);
              },
          .rename = [](const fs::path& a,
                       const fs::path& b) { return ::rename(a.c_str(), b.c_str()); }};
}

void require_free_place(const fs::path& output, bool force) {
  if (output.filename().empty() || output.filename() == "." || output.filename() == "..")
    throw_usage("'" + output.string() + "' is no name for an output");
  if (!fs::is_directory(folder_of(output)))
    throw_usage("the folder " + folder_of(output).string() + " of the output does not exist");
  if (!force && fs::exists(fs::symlink_status(output))) formats::refuse_existing(output);
}

void require_dataset_or_nothing(const fs::path& output) {
  if (!fs::exists(fs::symlink_status(output))) return;
  const std::string refusal = "--force replaces datasets only, and " + output.string() + " ";
  if (!fs::is_directory(output)) throw_usage(refusal + "is not a folder");
  for (const auto& entry : fs::directory_iterator(output)) {
    const std::string name = entry.path().filename().string();
    if (std::ranges::find(kDatasetFiles, name) == kDatasetFiles.end())
      throw_usage(refusal + "holds " + name + ", which is no part of one");
  }
  if (!fs::is_regular_file(output / dataset_file::kIndex))
    throw_usage(refusal + "holds no " + dataset_file::kIndex);
  if (!begins_like_an_index(output / dataset_file::kIndex))
    throw_usage(refusal + "holds an " + dataset_file::kIndex + " that is not Cairn's");
}

void publish_new(const fs::path& from, const fs::path& to) {
  sync_tree(from);
  formats::FolderSync folder(folder_of(to));
  formats::rename_to_free_name(from, to);
  folder.sync();
}

void publish_over(const fs::path& from, const fs::path& to, const OnStepAside& on_step_aside,
                  const Renames& renames) {
  sync_tree(from);
  formats::FolderSync folder(folder_of(to));
  if (renames.exchange(from, to) != 0) {
    if (!formats::rename_not_supported(errno)) throw_system("cannot replace", to, errno);
    exchange_in_two_steps(from, to, on_step_aside, renames);
  }
  folder.sync();
}

}  // namespace cairn::pipeline
