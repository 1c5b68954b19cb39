#include "formats/random_access_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <limits>
#include <string>
#include <utility>

#include "formats/error.h"

namespace cairn::formats {

RandomAccessFile::RandomAccessFile(std::filesystem::path path) : path_(std::move(path)) {
  // Without O_NONBLOCK opening a pipe that nobody writes would wait for ever.
  descriptor_ = ::open(path_.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor_ < 0) throw_system("cannot open", path_, errno);
  struct stat status {};
  if (::fstat(descriptor_, &status) != 0) {
    const int failure = errno;
    ::close(descriptor_);
    throw_system("cannot stat", path_, failure);
  }
  if (!S_ISREG(status.st_mode)) {
    ::close(descriptor_);
    throw_input({.what = "not a regular file", .path = path_});
  }
  size_bytes_ = static_cast<std::uint64_t>(status.st_size);
}

RandomAccessFile::~RandomAccessFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

RandomAccessFile::RandomAccessFile(RandomAccessFile&& other) noexcept
    : path_(std::move(other.path_)),
      size_bytes_(other.size_bytes_),
      descriptor_(std::exchange(other.descriptor_, -1)) {}

void RandomAccessFile::read_exactly(std::uint64_t offset, std::span<std::byte> out) const {
  const std::size_t got = read_at_most(offset, out);
  if (got < out.size())
    throw_input({.what = "the file ends too early",
                 .path = path_,
                 .offset = offset,
                 .found = std::to_string(got) + " bytes",
                 .expected = std::to_string(out.size()) + " bytes"});
}

std::size_t RandomAccessFile::read_at_most(std::uint64_t offset, std::span<std::byte> out) const {
  constexpr auto kMaxOffset = static_cast<std::uint64_t>(std::numeric_limits<off_t>::max());
  if (offset > kMaxOffset || out.size() > kMaxOffset - offset) return 0;
  std::size_t done = 0;
  while (done < out.size()) {
    const ssize_t got = ::pread(descriptor_, out.data() + done, out.size() - done,
                                static_cast<off_t>(offset + done));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw_system("cannot read", path_, errno);
    if (got == 0) break;
    done += static_cast<std::size_t>(got);
  }
  return done;
}

}  // namespace cairn::formats
