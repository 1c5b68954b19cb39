#include "formats/access/fetch_job.h"

#include <gtest/gtest.h>

#include <cstring>

namespace cairn::formats {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

TEST(FetchJob, DelaysGrowUpToTheLongest) {
  const AccessOptions options{.first_delay = milliseconds(100), .longest_delay = milliseconds(700)};
  EXPECT_EQ(retry_delay(options, 1, {}), milliseconds(100));
  EXPECT_EQ(retry_delay(options, 2, {}), milliseconds(200));
  EXPECT_EQ(retry_delay(options, 3, {}), milliseconds(400));
  EXPECT_EQ(retry_delay(options, 4, {}), milliseconds(700));
  EXPECT_EQ(retry_delay(options, 4'000'000'000U, {}), milliseconds(700));
}

TEST(FetchJob, AServerMayAskForALongerWaitWithinReason) {
  const AccessOptions options;
  EXPECT_EQ(retry_delay(options, 1, seconds(3)), seconds(3));
  EXPECT_EQ(retry_delay(options, 1, seconds(0)), options.first_delay);
  EXPECT_EQ(retry_delay(options, 1, seconds(86'400)), seconds(30));
}

TEST(FetchJob, ProgressForgivesFailures) {
  const AccessOptions options{.attempts = 3};
  EXPECT_FALSE(too_many_failures(options, 2, 0));
  EXPECT_TRUE(too_many_failures(options, 3, 0));
  EXPECT_FALSE(too_many_failures(options, 3, 64 << 10));
  EXPECT_TRUE(too_many_failures(options, 4, 64 << 10));
}

TEST(StoredFront, ComesBackAndAnythingElseDoesNot) {
  const std::vector<std::byte> bytes(100, std::byte{7});
  const Validators validators{"\"tag\"", "Fri, 07 Nov 2014 23:59:59 GMT"};
  const std::vector<std::byte> encoded = encode_front(validators, 1000, bytes);
  const auto front = decode_front(encoded);
  ASSERT_TRUE(front);
  EXPECT_EQ(front->validators, validators);
  EXPECT_EQ(front->file_size_bytes, 1000u);
  EXPECT_EQ(*front->bytes, bytes);
  const std::size_t before_bytes = encoded.size() - bytes.size();
  for (std::size_t size = 0; size <= before_bytes; ++size)
    EXPECT_FALSE(decode_front(std::span(encoded).first(size))) << size;
  EXPECT_FALSE(decode_front(encode_front({}, 1000, bytes))) << "no version is told";
  EXPECT_FALSE(decode_front(encode_front(validators, 99, bytes))) << "more bytes than the file";
}

}  // namespace
}  // namespace cairn::formats
