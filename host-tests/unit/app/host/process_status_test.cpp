#include "firmware/app/host/process_status.hpp"

#include <gtest/gtest.h>

namespace probebox::app {
namespace {

TEST(ProcessStatus, IsReadFromWhatTheKernelSays) {
  const auto confined = processStatusIn(
      "Name:\tprobeboxd\nUid:\t990\t990\t990\t990\nVmRSS:\t   24812 kB\nCapEff:\t0000000000000000\n"
      "NoNewPrivs:\t1\nSeccomp:\t2\nSeccomp_filters:\t3\n");
  EXPECT_EQ(confined.resident_bytes, 24812U * 1024);
  EXPECT_FALSE(confined.is_root);
  EXPECT_EQ(confined.capabilities, 0U);
  EXPECT_TRUE(confined.no_new_privileges);
  EXPECT_TRUE(confined.calls_filtered);
  const auto root = processStatusIn(
      "Name:\tprobeboxd\nUid:\t0\t0\t0\t0\nVmRSS:\t 10 kB\nCapEff:\t000001ffffffffff\nNoNewPrivs:\t0\nSeccomp:\t0\n");
  EXPECT_TRUE(root.is_root);
  EXPECT_EQ(root.capabilities, 0x1ffffffffffU);
  EXPECT_FALSE(root.no_new_privileges);
  EXPECT_FALSE(root.calls_filtered);
}

TEST(ProcessStatus, IsNotKnownWhereTheKernelSaysNothing) {
  for (const auto* text : {"", "Uid:", "Name:\tx\nUid:\t\nVmRSS:\t1 kB\n", "Name:\tx\nUid:\t0\n"}) {
    EXPECT_EQ(processStatusIn(text).resident_bytes, 0U) << text;
    EXPECT_FALSE(processStatusIn(text).is_root) << text;
  }
}

TEST(ProcessStatus, OfThisProcessHasMemory) {
  EXPECT_GT(processStatus().resident_bytes, 1'000'000U);
}

}  // namespace
}  // namespace probebox::app
