#include "formats/access/link_meter.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace cairn::formats {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

class LinkMeterTest : public testing::Test {
 protected:
  void bring(double bytes_per_s, int lasting_s) {
    for (int i = 0; i < 20 * lasting_s; ++i) {
      meter_.tick(now_, true);
      now_ += milliseconds(50);
      meter_.add(static_cast<std::uint64_t>(bytes_per_s / 20));
    }
  }
  double under_way() const { return static_cast<double>(meter_.bytes_under_way()); }

  LinkMeter meter_;
  LinkMeter::Clock::time_point now_{};
};

TEST_F(LinkMeterTest, TwiceWhatFillsTheLinkUntilAnAnswerBeginsIsUnderWay) {
  EXPECT_EQ(meter_.bytes_under_way(), LinkMeter::kLeast);
  meter_.add_latency(milliseconds(50));
  bring(4e6, 10);
  EXPECT_NEAR(under_way(), 4e6 * (2 * 0.05 + 0.02), 4e6 * 0.006);
  bring(1e9, 1);
  EXPECT_EQ(meter_.bytes_under_way(), LinkMeter::kMost);
  bring(1e5, 20);
  EXPECT_EQ(meter_.bytes_under_way(), LinkMeter::kLeast);
}

TEST_F(LinkMeterTest, TheLeastLatencyCountsAndNoneTellsNothing) {
  meter_.add_latency(microseconds(0));
  bring(1e7, 10);
  EXPECT_NEAR(under_way(), 1e7 * (2 * 0.1 + 0.02), 1e7 * 0.01) << "the usual one";
  meter_.add_latency(milliseconds(30));
  meter_.add_latency(milliseconds(400));
  EXPECT_NEAR(under_way(), 1e7 * (2 * 0.03 + 0.02), 1e7 * 0.01);
}

/// Of a link that is never filled: what comes in a round trip is all that is under way.
TEST_F(LinkMeterTest, MoreAndMoreIsAskedOfALinkThatBearsIt) {
  constexpr double kRoundTrip = 0.2, kLink = 12.5e6;
  meter_.add_latency(milliseconds(200));
  int windows = 0;
  while (under_way() < kRoundTrip * kLink && windows < 100) {
    meter_.tick(now_, true);
    now_ += milliseconds(200);
    meter_.add(static_cast<std::uint64_t>(std::min(kLink, under_way() / kRoundTrip) * 0.2));
    ++windows;
  }
  EXPECT_LE(windows, 10) << "two seconds";
}

TEST_F(LinkMeterTest, WhereNothingIsAskedForNothingIsLearned) {
  bring(1e9, 10);
  for (int i = 0; i < 10; ++i) meter_.tick(now_ += seconds(1), false);
  EXPECT_EQ(meter_.bytes_under_way(), LinkMeter::kMost);
}

}  // namespace
}  // namespace cairn::formats
