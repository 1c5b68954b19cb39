// Remote files, and a server of one file that misbehaves as told. What tests expect are the bytes of the served file, or one
// clear line.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "formats/access/remote_files.h"
#include "formats/checksum.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/web_server.h"

namespace cairn::formats {

class RemoteFilesTest : public testing::Test {
 protected:
  using Bytes = std::vector<std::byte>;
  using milliseconds = std::chrono::milliseconds;
  using WebFault = test::WebFault;
  using WebRequest = test::WebRequest;

  static constexpr std::size_t kFileBytes = 1'000'000;

  RemoteFilesTest() : server_(folder_.path()) {
    std::mt19937_64 random(1);
    content_.resize(kFileBytes);
    for (std::byte& b : content_) b = static_cast<std::byte>(random());
    folder_.write("file.bin", content_);
  }

  AccessOptions quick() const {
    return {.cache_folder = {},
            .connect_timeout = milliseconds(2000),
            .stall_timeout = std::chrono::seconds(5),
            .attempts = 4,
            .first_delay = milliseconds(1)};
  }
  AccessOptions kept() const {
    AccessOptions options = quick();
    options.cache_folder = folder_ / "cache";
    return options;
  }
  /// The file, its front read.
  std::unique_ptr<RemoteSource> open(const AccessOptions& options) {
    files_.reset();  // one after the other, as programs are started: all is on the disk
    files_ = std::make_shared<RemoteFiles>(options);
    auto source = std::make_unique<RemoteSource>(files_, server_.url("file.bin"));
    source->front(1, Fresh::kNo);
    return source;
  }
  Bytes part(std::uint64_t offset, std::uint64_t size) const {
    const auto begin = content_.begin() + static_cast<std::ptrdiff_t>(offset);
    return {begin, begin + static_cast<std::ptrdiff_t>(size)};
  }
  ByteRange range(std::uint64_t offset, std::uint64_t size) const {
    return {offset, size, checksum_of(part(offset, size))};
  }
  Bytes read(const RemoteSource& source, std::uint64_t offset, std::uint64_t size) const {
    const ByteRange wanted = range(offset, size);
    return *source.read(std::span(&wanted, 1), {}).front();
  }
  /// The one line that reading some range ends with.
  Error failure(const RemoteSource& source) const {
    try {
      read(source, 5000, 1000);
    } catch (const Error& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
      EXPECT_THAT(error.what(), testing::HasSubstr(server_.url("file.bin")));
      return error;
    }
    ADD_FAILURE() << "no failure";
    return Error(ErrorKind::kInvariant, {});
  }
  /// Answers so many requests for ranges behind the front by a fault, all others well.
  void fail(WebFault fault, int times = 1'000'000) {
    server_.set_script(
        [fault, times](const WebRequest& request) mutable -> std::optional<WebFault> {
          if (request.first == 0u || times == 0) return std::nullopt;
          --times;
          return fault;
        });
  }

  test::TemporaryFolder folder_;
  Bytes content_;
  test::WebServer server_;
  std::shared_ptr<RemoteFiles> files_;
};

}  // namespace cairn::formats
