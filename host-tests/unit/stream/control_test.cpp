#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "box.hpp"

namespace probebox::stream {
namespace {

using namespace std::chrono_literals;
using messages::ErrorCode;
using messages::MessageType;
using messages::Operation;

messages::Request request(std::uint32_t id, Operation operation = Operation::status, std::size_t body = 0) {
  return {id, operation, std::vector<std::byte>(body, std::byte{1})};
}

TEST(Control, ARequestSurfacesOnceAndItsAnswerGoesOut) {
  Box box;
  Host host;
  begin(box, host);
  box.hear(request(1, Operation::get_dataset, 3));
  const auto asked = box.session.nextRequest();
  ASSERT_TRUE(asked.has_value());
  EXPECT_EQ(asked->operation, Operation::get_dataset);
  EXPECT_EQ(asked->body.size(), 3U);
  EXPECT_FALSE(box.session.nextRequest().has_value());
  EXPECT_TRUE(box.session.answer(asked->ticket, ErrorCode::not_found, "no such run"));
  host.read(box.take());
  ASSERT_EQ(host.answers.size(), 1U);
  EXPECT_EQ(host.answers[0].id, 1U);
  EXPECT_EQ(host.answers[0].code, ErrorCode::not_found);
  EXPECT_EQ(host.answers[0].text, "no such run");
}

TEST(Control, ARequestSentAgainIsDoneOnceAndAnsweredTheSame) {
  Box box;
  Host host;
  begin(box, host);
  box.hear(request(1));
  box.hear(request(1));
  const auto asked = box.session.nextRequest();
  ASSERT_TRUE(asked.has_value());
  EXPECT_FALSE(box.session.nextRequest().has_value());
  box.session.answer(asked->ticket, ErrorCode::ok, {}, std::vector<std::byte>(5, std::byte{9}));
  box.hear(request(1));
  EXPECT_FALSE(box.session.nextRequest().has_value());
  host.read(box.take());
  ASSERT_EQ(host.answers.size(), 2U);
  EXPECT_EQ(messages::encoded(host.answers[0]), messages::encoded(host.answers[1]));
}

// A host that was away may ask again for all that it had asked for.
TEST(Control, EachOfTheLatestRequestsIsAnsweredTheSameAgain) {
  Box box;
  Host host;
  begin(box, host);
  const auto askAll = [&](auto&& answer) {
    for (std::uint32_t id = 1; id <= ControlChannel::kRemembered; ++id) {
      box.hear(request(id));
      answer(id);
    }
    host.read(box.take());
  };
  askAll([&](std::uint32_t id) {
    box.session.answer(box.session.nextRequest()->ticket, ErrorCode::ok, {}, std::vector<std::byte>(id, std::byte{9}));
  });
  const auto before = std::move(host.answers);
  host.answers.clear();
  askAll([&](std::uint32_t id) { EXPECT_FALSE(box.session.nextRequest().has_value()) << id << " is done twice"; });
  ASSERT_EQ(host.answers.size(), before.size());
  for (std::size_t k = 0; k < before.size(); ++k)
    EXPECT_EQ(messages::encoded(host.answers[k]), messages::encoded(before[k])) << k;
}

TEST(Control, AnIdThatIsUsedForSomethingElseIsRefused) {
  Box box;
  Host host;
  begin(box, host);
  box.hear(request(1));
  box.hear(request(1, Operation::status, 2));
  host.read(box.take());
  ASSERT_EQ(host.answers.size(), 1U);
  EXPECT_EQ(host.answers[0].code, ErrorCode::malformed);
}

TEST(Control, TooManyAtOnceAreRefusedByNameAndMayBeAskedAgain) {
  Box box;
  Host host;
  begin(box, host);
  for (std::uint32_t id = 1; id <= ControlChannel::kPending + 1; ++id) box.hear(request(id));
  host.read(box.take());
  ASSERT_EQ(host.answers.size(), 1U);
  EXPECT_EQ(host.answers[0].code, ErrorCode::busy);
  box.session.answer(box.session.nextRequest()->ticket, ErrorCode::ok);
  for (std::size_t k = 1; k < ControlChannel::kPending; ++k) box.session.nextRequest();
  EXPECT_FALSE(box.session.nextRequest().has_value());
  box.hear(request(ControlChannel::kPending + 1));
  EXPECT_TRUE(box.session.nextRequest().has_value());
}

TEST(Control, AnAnswerBeyondOneFrameBecomesANamedError) {
  Box box;
  Host host;
  begin(box, host);
  box.hear(request(1));
  box.session.answer(box.session.nextRequest()->ticket, ErrorCode::ok, {}, std::vector<std::byte>(frame::kMaxPayload));
  host.read(box.take());
  ASSERT_EQ(host.answers.size(), 1U);
  EXPECT_EQ(host.answers[0].code, ErrorCode::too_large);
}

TEST(Control, AnAnswerToTheHostBeforeDoesNotReachTheNext) {
  Box box;
  Host host;
  begin(box, host);
  box.hear(request(1));
  const auto stale = box.session.nextRequest();
  begin(box, host);
  box.hear(request(1));
  EXPECT_FALSE(box.session.answer(stale->ticket, ErrorCode::ok));
  const auto fresh = box.session.nextRequest();
  ASSERT_TRUE(fresh.has_value());
  EXPECT_TRUE(box.session.answer(fresh->ticket, ErrorCode::ok));
}

// The queue is full of samples and the wire is stuck in the middle of a frame: the answer is the next frame.
TEST(Control, NeverWaitsBehindSamples) {
  Box box;
  Host host;
  begin(box, host);
  host.read(box.take());
  for (int k = 0; k < 50; ++k) box.produce(64);
  host.read(box.take(100));
  box.hear(request(1));
  box.session.answer(box.session.nextRequest()->ticket, ErrorCode::ok);
  host.types.clear();
  host.read(box.take(1000));
  ASSERT_GE(host.types.size(), 2U);
  EXPECT_EQ(host.types[0], MessageType::samples) << "the frame that was on its way";
  EXPECT_EQ(host.types[1], MessageType::answer);
}

TEST(Control, NeedsNoCredit) {
  Box box;
  Host host;
  begin(box, host, {.credit_bytes = 0});
  box.produce(10);
  box.hear(request(1));
  box.session.answer(box.session.nextRequest()->ticket, ErrorCode::ok);
  box.advance(100ms);
  host.read(box.take());
  EXPECT_EQ(host.answers.size(), 1U);
  EXPECT_FALSE(host.beats.empty());
  EXPECT_EQ(host.received, 0U);
  box.hear(messages::Credit{10'000});
  host.read(box.take());
  EXPECT_EQ(host.received, 10U);
}

}  // namespace
}  // namespace probebox::stream
