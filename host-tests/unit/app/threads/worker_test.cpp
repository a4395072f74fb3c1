#include "firmware/app/threads/worker.hpp"

#include <array>
#include <atomic>
#include <chrono>
#include <future>
#include <gtest/gtest.h>
#include <unistd.h>
#include <vector>

#include "firmware/app/threads/wake_up.hpp"

namespace probebox::app {
namespace {

TEST(Worker, RunsJobsInTheirOrderAndAllOfThemBeforeItEnds) {
  std::vector<int> done;
  {
    Worker worker{[] {}};
    for (int i = 0; i < 100; ++i) ASSERT_TRUE(worker.post([&done, i] { done.push_back(i); }));
  }
  ASSERT_EQ(done.size(), 100U);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(done[static_cast<std::size_t>(i)], i);
}

// What a cut has to hear must not wait behind what takes seconds.
TEST(Worker, DoesJobsOfALowerRankWhenNothingElseWaits) {
  std::promise<void> gate;
  std::vector<int> done;
  {
    Worker worker{[] {}};
    worker.post([opened = gate.get_future().share()] { opened.wait(); });
    ASSERT_TRUE(worker.post([&] { done.push_back(4); }, Worker::Rank::without_rights));
    ASSERT_TRUE(worker.post([&] { done.push_back(3); }, Worker::Rank::patient));
    ASSERT_TRUE(worker.post([&] { done.push_back(1); }));
    ASSERT_TRUE(worker.post([&] { done.push_back(2); }));
    gate.set_value();
  }
  EXPECT_EQ(done, (std::vector<int>{1, 2, 3, 4}));
}

TEST(Worker, SaysWhenTooMuchIsWaiting) {
  std::promise<void> gate;
  Worker worker{[] {}};
  worker.post([opened = gate.get_future().share()] { opened.wait(); });
  int taken = 0;
  while (worker.post([] {}, Worker::Rank::without_rights)) ASSERT_LT(++taken, 10'000);
  EXPECT_GT(taken, 100);
  EXPECT_TRUE(worker.post([] {})) << "hosts without rights take no place of others";
  gate.set_value();
}

// Such as the end of a process: an hour's wait is over at once.
TEST(WakeUp, EndsItsWaitWhenTheOtherDescriptorIsReadable) {
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  ASSERT_EQ(write(ends[1], "x", 1), 1);
  WakeUp wake_up;
  wake_up.wait(std::chrono::hours{1}, ends[0]);
  char byte{};
  EXPECT_EQ(read(ends[0], &byte, 1), 1) << "it is left to whom it is for";
  for (const int end : ends) close(end);
}

TEST(Worker, LooksRoundWhenItIsNotified) {
  std::promise<void> looked;
  std::atomic<bool> first{true};
  std::atomic<bool> armed{false};
  Worker worker{[&] {
    if (armed && first.exchange(false)) looked.set_value();
  }};
  armed = true;
  worker.notify();
  looked.get_future().wait();
}

}  // namespace
}  // namespace probebox::app
