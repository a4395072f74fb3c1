#include "tools/link/client.hpp"

#include <gtest/gtest.h>
#include <sstream>

#include "box_pipe.hpp"
#include "tools/link/recording_maker.hpp"

namespace probebox::link {
namespace {

using messages::ErrorCode;
using messages::Operation;

void answerStatus(World& world) {
  world.answering = [&world](const stream::PendingRequest& asked) {
    if (asked.operation != Operation::status) {
      world.session.answer(asked.ticket, ErrorCode::not_found, "no such run; list the runs");
      return;
    }
    messages::Status::Answer status;
    status.board = "sim";
    status.links = 1;
    world.session.answer(asked.ticket, ErrorCode::ok, {}, messages::encoded(status));
  };
}

// On one lane with delimited frames, and on two with bare ones.
class AnyClient : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(, AnyClient, testing::Bool(),
                         [](const auto& two) { return two.param ? "TwoLanes" : "OneLane"; });

TEST_P(AnyClient, ConnectsAndKnowsTheBox) {
  World world{GetParam()};
  Client client{std::move(world.owned), {}};
  const auto welcome = client.connect(world.wait(20));
  ASSERT_TRUE(welcome.ok());
  EXPECT_EQ(welcome->firmware_version, "0.1.0");
  EXPECT_EQ(client.reader().descriptor()->board, "sim");
}

TEST_P(AnyClient, StreamsWithAnExactLedgerAndClosesIt) {
  World world{GetParam()};
  Tally tally;
  Client client{std::move(world.owned), {}, &tally};
  ASSERT_TRUE(client.connect(world.wait(20)).ok());
  client.start({});
  const auto wait = world.wait(500);
  while (client.round(wait)) {
  }
  const auto balance = client.finish(world.wait(50));
  ASSERT_TRUE(balance.ok());
  EXPECT_TRUE(balance->exact);
  EXPECT_TRUE(client.closed());
  EXPECT_EQ(balance->account.received, tally.samples);
  EXPECT_GT(tally.samples, 4000U);
  EXPECT_EQ(tally.wrong, 0U);
  EXPECT_EQ(tally.inexact, 0U);
  EXPECT_GT(tally.balances, 30U);
}

TEST_P(AnyClient, GrantsCreditAsItReadsSoThatNothingIsLost) {
  World world{GetParam()};
  Tally tally;
  Client client{std::move(world.owned), {.window_bytes = 2000}, &tally};
  ASSERT_TRUE(client.connect(world.wait(20)).ok());
  client.start({});
  const auto wait = world.wait(500);
  while (client.round(wait)) {
  }
  const auto balance = client.finish(world.wait(50));
  ASSERT_TRUE(balance.ok());
  EXPECT_EQ(balance->account.declared_lost, 0U);
  EXPECT_GT(tally.samples, 4000U);
}

TEST(Client, AnswersDoNotWaitBehindSamplesOnALaneOfTheirOwn) {
  World world{true};
  answerStatus(world);
  Client client{std::move(world.owned), {}};
  ASSERT_TRUE(client.connect(world.wait(20)).ok());
  client.start({});
  const auto wait = world.wait(100);
  for (int k = 0; k < 50; ++k) client.round(wait);
  world.pipe->silent = true;  // the data lane stands still, with samples in it
  const auto status = client.request<messages::Status>({}, world.wait(20));
  ASSERT_TRUE(status.ok());
  EXPECT_EQ(status->board, "sim");
}

TEST(Client, FramesOfTheTwoLanesAreCountedApart) {
  World world{true};
  answerStatus(world);
  Tally tally;
  Client client{std::move(world.owned), {}, &tally};
  ASSERT_TRUE(client.connect(world.wait(20)).ok());
  client.start({});
  for (int k = 0; k < 10; ++k) ASSERT_TRUE(client.request<messages::Status>({}, world.wait(20)).ok());
  const auto balance = client.finish(world.wait(50));
  ASSERT_TRUE(balance.ok());
  EXPECT_TRUE(balance->exact);
  EXPECT_EQ(balance->account.inferred_lost, 0U);
  EXPECT_EQ(client.reader().ledger().framesMissing(), 0U);
}

TEST_P(AnyClient, AsksAndGetsAnswersAndTheBoxsOwnWords) {
  World world{GetParam()};
  answerStatus(world);
  Client client{std::move(world.owned), {}};
  ASSERT_TRUE(client.connect(world.wait(20)).ok());
  const auto status = client.request<messages::Status>({}, world.wait(20));
  ASSERT_TRUE(status.ok());
  EXPECT_EQ(status->board, "sim");
  const auto dataset = client.request<messages::GetDataset>({7, 0}, world.wait(20));
  ASSERT_FALSE(dataset.ok());
  EXPECT_EQ(dataset.error().kind, Failure::Kind::box_refused);
  EXPECT_EQ(dataset.error().code, ErrorCode::not_found);
  EXPECT_EQ(dataset.error().what, "no such run; list the runs");
}

TEST(Client, OnABadWireGetsThereAndAsksOnce) {
  World world;
  answerStatus(world);
  world.pipe->towards_host = noise(1, 3000);
  world.pipe->towards_box = noise(2, 300);
  Tally tally;
  Client client{std::move(world.owned), {}, &tally};
  ASSERT_TRUE(client.connect(world.wait(3000)).ok());
  client.start({});
  constexpr int kRequests = 20;
  for (int k = 0; k < kRequests; ++k) ASSERT_TRUE(client.request<messages::Status>({}, world.wait(2000)).ok()) << k;
  const auto balance = client.finish(world.wait(2000));
  ASSERT_TRUE(balance.ok());
  EXPECT_EQ(world.requests_seen, kRequests) << "sent again, done once";
  EXPECT_EQ(tally.wrong, 0U);
  EXPECT_EQ(tally.inexact, 0U);
  EXPECT_GT(tally.inferred, 0U) << "the wire was to be bad";
  EXPECT_GT(client.reader().counters().bad(), 0U);
}

// A source is silent, or the time was short.
TEST_P(AnyClient, ClosesAStreamWithoutASample) {
  World world{GetParam()};
  world.producing = false;
  Client client{std::move(world.owned), {}};
  ASSERT_TRUE(client.connect(world.wait(20)).ok());
  client.start({});
  const auto wait = world.wait(50);
  while (client.round(wait)) {
  }
  EXPECT_FALSE(client.reader().ledger().closed());
  const auto balance = client.finish(world.wait(50));
  ASSERT_TRUE(balance.ok()) << balance.error().what;
  EXPECT_TRUE(balance->exact);
  EXPECT_EQ(balance->produced, 0U);
  EXPECT_TRUE(client.reader().ledger().closed());
}

TEST_P(AnyClient, StreamsAgainAfterAStreamWithoutASample) {
  World world{GetParam()};
  world.producing = false;
  Tally tally;
  Client client{std::move(world.owned), {}, &tally};
  ASSERT_TRUE(client.connect(world.wait(20)).ok());
  client.start({});
  ASSERT_TRUE(client.finish(world.wait(50)).ok());
  world.producing = true;
  client.start({});
  const auto wait = world.wait(100);
  while (client.round(wait)) {
  }
  const auto balance = client.finish(world.wait(50));
  ASSERT_TRUE(balance.ok()) << balance.error().what;
  EXPECT_TRUE(balance->exact);
  EXPECT_EQ(balance->account.received, tally.samples);
  EXPECT_GT(tally.samples, 500U);
  EXPECT_EQ(tally.inexact, 0U);
}

TEST_P(AnyClient, SaysWhyTheBoxRefusedToStream) {
  World world{GetParam()};
  Client client{std::move(world.owned), {}};
  ASSERT_TRUE(client.connect(world.wait(20)).ok());
  client.start({.stream = 2});
  const auto wait = world.wait(50);
  while (client.round(wait)) {
  }
  const auto balance = client.finish(world.wait(50));
  ASSERT_FALSE(balance.ok());
  EXPECT_EQ(balance.error().code, ErrorCode::refused);
  EXPECT_NE(balance.error().what.find("name stream 1"), std::string::npos) << balance.error().what;
}

// Gives what was recorded, and takes everything.
class ScriptedPipe : public io::BytePipe {
 public:
  explicit ScriptedPipe(std::string script) : script_{std::move(script)} {}
  io::Transfer read(std::span<std::byte> into) override {
    const auto part = std::as_bytes(std::span{script_}).subspan(at_).first(std::min(into.size(), script_.size() - at_));
    std::ranges::copy(part, into.begin());
    at_ += part.size();
    return {part.size()};
  }
  io::Transfer write(std::span<const std::byte> from) override { return {from.size()}; }
  int descriptor() const override { return -1; }
  std::string_view name() const override { return "script"; }

 private:
  std::string script_;
  std::size_t at_{};
};

// A slow line, on which HELLO was repeated: the second WELCOME is here, the second DESCRIPTOR on its way.
TEST(Client, KnowsItsBoxAlsoBehindASecondWelcome) {
  std::ostringstream out;
  RecordingMaker maker{out, messages::Profile::fast, 64};
  messages::Descriptor descriptor;
  descriptor.board = "a board whose name is on the heap";
  ASSERT_TRUE(maker.begin(descriptor));
  const auto greeting = out.str();
  const auto welcome = greeting.substr(0, greeting.find('\0', 1) + 1);
  World world;
  Client client{io::Connection{std::make_unique<ScriptedPipe>(greeting + welcome)}, {}};
  ASSERT_TRUE(client.connect(world.wait(20)).ok());
  EXPECT_EQ(client.described().board, descriptor.board);
}

// A key block comes by itself only after 16384 samples, which this box needs 16 s for.
TEST(Client, AsksForAKeyBlockWhenOneOfProfileTightIsLost) {
  World world;
  Tally tally;
  Client client{std::move(world.owned), {}, &tally};
  ASSERT_TRUE(client.connect(world.wait(20)).ok());
  client.start({.profile = messages::Profile::tight, .policy = messages::Policy::record});
  const auto run = [&](int rounds) {
    const auto wait = world.wait(rounds);
    while (client.round(wait)) {
    }
  };
  run(80);
  const auto before = tally.samples;
  EXPECT_GT(before, 700U);
  world.pipe->towards_host = [](std::vector<std::byte>& bytes) { bytes[bytes.size() / 2] ^= std::byte{1}; };
  run(2);
  world.pipe->towards_host = {};
  run(150);
  EXPECT_GT(tally.samples, before + 800);
  EXPECT_GT(tally.inferred, 0U);
  EXPECT_EQ(tally.wrong, 0U);
  const auto balance = client.finish(world.wait(100));
  ASSERT_TRUE(balance.ok());
  EXPECT_TRUE(balance->exact);
  EXPECT_EQ(tally.wrong, 0U);
  EXPECT_EQ(tally.inexact, 0U);
}

TEST(Client, SaysWhenNobodyAnswers) {
  World world;
  world.pipe->silent = true;
  Client client{std::move(world.owned), {}};
  const auto welcome = client.connect(world.wait(100));
  ASSERT_FALSE(welcome.ok());
  EXPECT_EQ(welcome.error().kind, Failure::Kind::timed_out);
}

TEST(Client, SeesASilentBoxAndAClosedPipeAsALostLink) {
  World silent;
  Client client{std::move(silent.owned), {}};
  ASSERT_TRUE(client.connect(silent.wait(20)).ok());
  silent.pipe->silent = true;
  const auto status = client.request<messages::Status>({}, silent.wait(1000));
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().kind, Failure::Kind::link_lost);

  World closed;
  Client other{std::move(closed.owned), {}};
  ASSERT_TRUE(other.connect(closed.wait(20)).ok());
  closed.pipe->closed = true;
  EXPECT_FALSE(other.request<messages::Status>({}, closed.wait(1000)).ok());
  EXPECT_EQ(other.state(), LinkState::lost);
}

TEST(Client, ThatIsAloneForLongKeepsItsLink) {
  World world;
  Client client{std::move(world.owned), {}};
  ASSERT_TRUE(client.connect(world.wait(20)).ok());
  const auto wait = world.wait(2000);
  while (client.round(wait)) {
  }
  EXPECT_EQ(client.state(), LinkState::ready);
  EXPECT_EQ(world.session.state(), stream::SessionState::greeted);
}

TEST(Client, ReconnectsAndResumesWithoutLoss) {
  World world;
  Tally first;
  SampleIndex next;
  {
    Client client{std::move(world.owned), {}, &first};
    ASSERT_TRUE(client.connect(world.wait(20)).ok());
    client.start({});
    const auto wait = world.wait(50);
    while (client.round(wait)) {
    }
    next = client.reader().ledger().next();
  }
  for (int k = 0; k < 40; ++k) world.wait(1)(-1, false);
  Tally second;
  messages::BootId boot;
  boot.fill(std::byte{7});
  Client again{io::Connection{std::make_unique<BoxPipe>(world.session, world.now)}, {.last_boot_id = boot}, &second};
  ASSERT_TRUE(again.connect(world.wait(20)).ok());
  again.start({.has_resume = true, .resume_from = next});
  const auto wait = world.wait(100);
  while (again.round(wait)) {
  }
  ASSERT_TRUE(again.finish(world.wait(50)).ok());
  EXPECT_EQ(second.inexact, 0U);
  EXPECT_EQ(second.declared, 0U);
  EXPECT_EQ(second.samples, static_cast<std::uint64_t>(again.reader().ledger().next() - next));
  EXPECT_GT(second.samples, 400U) << "those made while nobody listened are among them";
}

}  // namespace
}  // namespace probebox::link
