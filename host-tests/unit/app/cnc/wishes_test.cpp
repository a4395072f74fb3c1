#include "firmware/app/cnc/wishes.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>
#include <utility>

#include "firmware/modbus/register_image.hpp"
#include "protocol/messages/control.hpp"
#include "protocol/messages/results.hpp"
#include "protocol/messages/types.hpp"

// When a controller reads that its request is done, the registers beside it show what was done.
namespace probebox::app {
namespace {

constexpr std::uint16_t kInHand = 1, kDone = 2;

// A box that answers at once, before its registers show anything.
Wishes promptly(std::uint32_t run) {
  return {"a controller",
          [run](messages::Operation operation, std::vector<std::byte>, std::function<void(Reply)> then) {
            Reply reply;
            if (operation == messages::Operation::start_procedure) {
              messages::StartProcedure::Answer answer;
              answer.run = run;
              reply.body = messages::encoded(answer);
            }
            then(reply);
          },
          [](std::uint64_t) { return false; }};
}

published::Snapshot showing(std::uint32_t run, published::CalibrationState state) {
  published::Snapshot snapshot;
  snapshot.calibration_run = run;
  snapshot.calibration = state;
  return snapshot;
}

TEST(Wishes, AStartIsDoneWhenTheRunIsShown) {
  auto wishes = promptly(5);
  wishes.make({.commit = 1, .what = modbus::Wish::What::start, .method = 1});
  EXPECT_EQ(wishes.state(showing(4, published::CalibrationState::accepted)).outcome, kInHand);
  EXPECT_EQ(wishes.state(showing(5, published::CalibrationState::running)).outcome, kDone);
}

TEST(Wishes, AnAbortIsDoneWhenTheEndOfTheRunIsShown) {
  for (const std::uint32_t named : {0U, 5U}) {
    auto wishes = promptly(5);
    wishes.make({.commit = 2, .what = modbus::Wish::What::abort, .of = named});
    EXPECT_EQ(wishes.state(showing(5, published::CalibrationState::running)).outcome, kInHand) << named;
    EXPECT_EQ(wishes.state(showing(5, published::CalibrationState::aborted)).outcome, kDone) << named;
    EXPECT_EQ(wishes.state(showing(6, published::CalibrationState::running)).outcome, named == 0 ? kInHand : kDone);
  }
}

// Register 844 as a controller reads it.
TEST(Wishes, AnAcceptedResultWaitsUntilTheCutIsOver) {
  bool cut = true;
  Wishes wishes{"a controller",
                [](messages::Operation, std::vector<std::byte>, std::function<void(Reply)> then) {
                  messages::AcceptResult::Answer answer;
                  answer.waiting_for_cut = true;
                  then(ok(answer));
                },
                [&cut](std::uint64_t result) { return cut && result == 7; }};
  wishes.make({.commit = 3, .what = modbus::Wish::What::accept, .of = 7});
  const auto registerNow = [&](std::uint16_t address) {
    modbus::RegisterImage image;
    const published::Snapshot snapshot;
    published::LineState line;
    line.wish = wishes.state(snapshot);
    image.fill(snapshot, line, nullptr, modbus::WordOrder{});
    return std::as_const(image).registers()[address];
  };
  EXPECT_EQ(registerNow(modbus::address::wish_outcome), kDone);
  EXPECT_EQ(registerNow(modbus::address::wish_waits), 1);
  cut = false;
  EXPECT_EQ(registerNow(modbus::address::wish_waits), 0);
  EXPECT_EQ(registerNow(modbus::address::wish_outcome), kDone);
}

TEST(Wishes, ARefusalIsToldOnceInTheWordsOfTheBox) {
  Wishes wishes{"a controller",
                [](messages::Operation, std::vector<std::byte>, std::function<void(Reply)> then) {
                  then(refused(messages::ErrorCode::wrong_state, "The master clock is not locked."));
                },
                [](std::uint64_t) { return false; }};
  EXPECT_THAT(wishes.newRefusals(), testing::IsEmpty());
  wishes.make({.commit = 1, .what = modbus::Wish::What::start, .method = 1});
  wishes.make({.commit = 2, .what = modbus::Wish::What::start, .method = 999});
  EXPECT_THAT(wishes.newRefusals(),
              testing::ElementsAre("The master clock is not locked.", "This box has no method with the number 999."));
  EXPECT_THAT(wishes.newRefusals(), testing::IsEmpty());
}

}  // namespace
}  // namespace probebox::app
