#include "firmware/app/cnc/wishes.hpp"

#include <gtest/gtest.h>
#include <utility>

#include "protocol/messages/control.hpp"
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
          }};
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

}  // namespace
}  // namespace probebox::app
