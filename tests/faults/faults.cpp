// A library that is loaded before the C library's and makes the system fail where a test wants it to: at the n-th call that
// changes what is on the disk in or beside a folder. Without CAIRN_FAULT_FOLDER it changes nothing.
//
//   CAIRN_FAULT_FOLDER  calls on files whose paths begin so are counted
//   CAIRN_FAULT_AT      the number of the call, from 1
//   CAIRN_FAULT         kill: the process is killed before the call; ENOSPC: this and all later calls that take space fail
//                       so; EIO: this call fails so; slow: this and all later calls take half a second more. lookup, without
//                       a folder: names of hosts are looked up for ever, which stderr is told
//   CAIRN_FAULT_COUNT   a file that is told, in the end, how many calls there were
#include <dlfcn.h>
#include <fcntl.h>
#include <netdb.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <climits>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace {

enum class Kind { kTakesSpace, kOther };

const char* setting(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : "";
}

std::atomic<long> calls{0};

bool is_watched(const char* path) {
  static const char* const folder = setting("CAIRN_FAULT_FOLDER");
  return *folder != '\0' && std::strncmp(path, folder, std::strlen(folder)) == 0;
}

bool is_watched(int descriptor) {
  char link[64], path[PATH_MAX];
  std::snprintf(link, sizeof link, "/proc/self/fd/%d", descriptor);
  const ssize_t length = ::readlink(link, path, sizeof path - 1);
  if (length <= 0) return false;
  path[length] = '\0';
  return is_watched(path);
}

/// Counts a call on a watched file. Returns the error that it shall fail with, or 0.
int fault(Kind kind) {
  static const long at = std::atol(setting("CAIRN_FAULT_AT"));
  static const char* const what = setting("CAIRN_FAULT");
  const long number = calls.fetch_add(1) + 1;
  if (at == 0 || number < at) return 0;
  if (std::strcmp(what, "kill") == 0) ::raise(SIGKILL);
  if (std::strcmp(what, "slow") == 0) ::usleep(500'000);
  if (std::strcmp(what, "ENOSPC") == 0 && kind == Kind::kTakesSpace) return ENOSPC;
  return std::strcmp(what, "EIO") == 0 && number == at ? EIO : 0;
}

template <typename File>
int fault_on(const File& file, Kind kind) {
  return is_watched(file) ? fault(kind) : 0;
}

template <typename Call>
Call* next(const char* name) {
  return reinterpret_cast<Call*>(::dlsym(RTLD_NEXT, name));
}

/// What a call answers that fails so.
int failed(int error) {
  errno = error;
  return -1;
}

struct CountTeller {
  ~CountTeller() {
    if (FILE* file = std::fopen(setting("CAIRN_FAULT_COUNT"), "w")) {
      std::fprintf(file, "%ld", calls.load());
      std::fclose(file);
    }
  }
} count_teller;

}  // namespace

extern "C" {

ssize_t pwrite(int descriptor, const void* bytes, size_t size, off_t offset) {
  if (const int error = fault_on(descriptor, Kind::kTakesSpace)) return failed(error);
  return next<decltype(pwrite)>("pwrite")(descriptor, bytes, size, offset);
}
ssize_t pwrite64(int descriptor, const void* bytes, size_t size, off64_t offset) {
  if (const int error = fault_on(descriptor, Kind::kTakesSpace)) return failed(error);
  return next<decltype(pwrite64)>("pwrite64")(descriptor, bytes, size, offset);
}
ssize_t write(int descriptor, const void* bytes, size_t size) {
  if (const int error = fault_on(descriptor, Kind::kTakesSpace)) return failed(error);
  return next<decltype(write)>("write")(descriptor, bytes, size);
}
int posix_fallocate(int descriptor, off_t offset, off_t size) {
  if (const int error = fault_on(descriptor, Kind::kTakesSpace)) return error;
  return next<decltype(posix_fallocate)>("posix_fallocate")(descriptor, offset, size);
}
int posix_fallocate64(int descriptor, off64_t offset, off64_t size) {
  if (const int error = fault_on(descriptor, Kind::kTakesSpace)) return error;
  return next<decltype(posix_fallocate64)>("posix_fallocate64")(descriptor, offset, size);
}
int fsync(int descriptor) {
  if (const int error = fault_on(descriptor, Kind::kOther)) return failed(error);
  return next<decltype(fsync)>("fsync")(descriptor);
}
int ftruncate(int descriptor, off_t size) noexcept {
  if (const int error = fault_on(descriptor, Kind::kOther)) return failed(error);
  return next<int(int, off_t)>("ftruncate")(descriptor, size);
}
int ftruncate64(int descriptor, off64_t size) noexcept {
  if (const int error = fault_on(descriptor, Kind::kOther)) return failed(error);
  return next<int(int, off64_t)>("ftruncate64")(descriptor, size);
}
int getaddrinfo(const char* host, const char* service, const addrinfo* hints, addrinfo** found) {
  if (std::strcmp(setting("CAIRN_FAULT"), "lookup") == 0) {
    std::fputs("looking up\n", stderr);
    while (true) ::pause();
  }
  return next<decltype(getaddrinfo)>("getaddrinfo")(host, service, hints, found);
}
int rename(const char* from, const char* to) noexcept {
  if (const int error = fault_on(from, Kind::kOther)) return failed(error);
  return next<int(const char*, const char*)>("rename")(from, to);
}
int renameat2(int from_folder, const char* from, int to_folder, const char* to,
              unsigned flags) noexcept {
  if (const int error = fault_on(from, Kind::kOther)) return failed(error);
  return next<int(int, const char*, int, const char*, unsigned)>("renameat2")(from_folder, from,
                                                                              to_folder, to, flags);
}
int mkdir(const char* path, mode_t mode) noexcept {
  if (const int error = fault_on(path, Kind::kTakesSpace)) return failed(error);
  return next<int(const char*, mode_t)>("mkdir")(path, mode);
}
int remove(const char* path) noexcept {
  if (const int error = fault_on(path, Kind::kOther)) return failed(error);
  return next<int(const char*)>("remove")(path);
}
int unlinkat(int folder, const char* path, int flags) noexcept {
  const bool by_path = *path == '/' || folder == AT_FDCWD;
  if (const int error = by_path ? fault_on(path, Kind::kOther) : fault_on(folder, Kind::kOther))
    return failed(error);
  return next<int(int, const char*, int)>("unlinkat")(folder, path, flags);
}
int unlink(const char* path) noexcept {
  if (const int error = fault_on(path, Kind::kOther)) return failed(error);
  return next<int(const char*)>("unlink")(path);
}

}  // extern "C"
