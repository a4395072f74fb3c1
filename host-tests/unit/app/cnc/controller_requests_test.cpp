#include "firmware/app/cnc/controller_requests.hpp"

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
ControllerRequests promptly(std::uint32_t run) {
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

TEST(ControllerRequests, AStartIsDoneWhenTheRunIsShown) {
  auto requests = promptly(5);
  requests.make({.commit = 1, .what = modbus::ControllerRequest::What::start, .method = 1});
  EXPECT_EQ(requests.state(showing(4, published::CalibrationState::accepted)).outcome, kInHand);
  EXPECT_EQ(requests.state(showing(5, published::CalibrationState::running)).outcome, kDone);
}

TEST(ControllerRequests, AnAbortIsDoneWhenTheEndOfTheRunIsShown) {
  for (const std::uint32_t named : {0U, 5U}) {
    auto requests = promptly(5);
    requests.make({.commit = 2, .what = modbus::ControllerRequest::What::abort, .of = named});
    EXPECT_EQ(requests.state(showing(5, published::CalibrationState::running)).outcome, kInHand) << named;
    EXPECT_EQ(requests.state(showing(5, published::CalibrationState::aborted)).outcome, kDone) << named;
    EXPECT_EQ(requests.state(showing(6, published::CalibrationState::running)).outcome, named == 0 ? kInHand : kDone);
  }
}

// Register 844 as a controller reads it.
TEST(ControllerRequests, AnAcceptedResultWaitsUntilTheCutIsOver) {
  bool cut = true;
  ControllerRequests requests{"a controller",
                              [](messages::Operation, std::vector<std::byte>, std::function<void(Reply)> then) {
                                messages::AcceptResult::Answer answer;
                                answer.waiting_for_cut = true;
                                then(ok(answer));
                              },
                              [&cut](std::uint64_t result) { return cut && result == 7; }};
  requests.make({.commit = 3, .what = modbus::ControllerRequest::What::accept, .of = 7});
  const auto registerNow = [&](std::uint16_t address) {
    modbus::RegisterImage image;
    const published::Snapshot snapshot;
    published::LineState line;
    line.controller_request = requests.state(snapshot);
    image.fill(snapshot, line, nullptr, modbus::WordOrder{});
    return std::as_const(image).registers()[address];
  };
  EXPECT_EQ(registerNow(modbus::address::request_outcome), kDone);
  EXPECT_EQ(registerNow(modbus::address::request_waits), 1);
  cut = false;
  EXPECT_EQ(registerNow(modbus::address::request_waits), 0);
  EXPECT_EQ(registerNow(modbus::address::request_outcome), kDone);
}

TEST(ControllerRequests, ARefusalIsToldOnceInTheWordsOfTheBox) {
  ControllerRequests requests{"a controller",
                              [](messages::Operation, std::vector<std::byte>, std::function<void(Reply)> then) {
                                then(refused(messages::ErrorCode::wrong_state, "The master clock is not locked."));
                              },
                              [](std::uint64_t) { return false; }};
  EXPECT_THAT(requests.newRefusals(), testing::IsEmpty());
  requests.make({.commit = 1, .what = modbus::ControllerRequest::What::start, .method = 1});
  requests.make({.commit = 2, .what = modbus::ControllerRequest::What::start, .method = 999});
  EXPECT_THAT(requests.newRefusals(),
              testing::ElementsAre("The master clock is not locked.", "This box has no method with the number 999."));
  EXPECT_THAT(requests.newRefusals(), testing::IsEmpty());
}

}  // namespace
}  // namespace probebox::app
