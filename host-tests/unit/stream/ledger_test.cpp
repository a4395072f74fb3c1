#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "box.hpp"

// received + declared lost == produced at every heartbeat, exactly, whatever happens.
namespace probebox::stream {
namespace {

using namespace std::chrono_literals;

class Story {
 public:
  explicit Story(SessionOptions options, std::size_t history_bytes) : box_{std::move(options), history_bytes} {}

  void open() {
    messages::Start start;
    start.profile = *rc::gen::element(messages::Profile::raw, messages::Profile::fast, messages::Profile::tight);
    start.policy = *rc::gen::element(messages::Policy::live, messages::Policy::record);
    start.credit_bytes = *rc::gen::element<std::uint64_t>(0, 3000, messages::kUnlimitedCredit);
    granted_ = start.credit_bytes;
    start.has_resume = *rc::gen::arbitrary<bool>() && box_.history().begun();
    start.resume_from = {*rc::gen::inRange<std::int64_t>(900, box_.next().index + 1)};
    begin(box_, host_, start);
  }

  void step() {
    switch (*rc::gen::weightedElement<int>({{8, 0}, {2, 1}, {6, 2}, {2, 3}, {3, 4}, {1, 5}})) {
      case 0:
        return box_.produce(*rc::gen::inRange<std::uint16_t>(1, 60));
      case 1:
        return box_.lose(*rc::gen::inRange<std::uint64_t>(1, 200), static_cast<GapReason>(*rc::gen::inRange(0, 3)));
      case 2:
        return carry(*rc::gen::inRange<std::size_t>(0, 1500));
      case 3:
        granted_ += granted_ == messages::kUnlimitedCredit ? 0 : 2000;
        return box_.hear(messages::Credit{granted_});
      case 4:
        return tick();
      default:
        return box_.hear(messages::Request{++id_, messages::Operation::status, {}});
    }
  }

  void drain() {
    box_.hear(messages::Credit{messages::kUnlimitedCredit});
    carry(~std::size_t{0});
    tick();
    carry(~std::size_t{0});
  }

  Box& box() { return box_; }
  Host& host() { return host_; }

 private:
  void carry(std::size_t most) { host_.read(box_.take(most)); }
  void tick() {
    box_.hear(messages::Credit{0});
    box_.advance(100ms);
    if (const auto asked = box_.session.nextRequest()) box_.session.answer(asked->ticket, messages::ErrorCode::ok);
  }

  Box box_;
  Host host_;
  std::uint64_t granted_{};
  std::uint32_t id_{};
};

TEST(Ledger, BalancesAtEveryHeartbeatUnderStallsCreditsGapsAndDrops) {
  EXPECT_TRUE(rc::check("received + declared lost == produced", [] {
    SessionOptions options;
    options.queue_bytes = *rc::gen::element<std::size_t>(400, 2000, 20'000);
    options.live_bytes = *rc::gen::element<std::size_t>(400, 1500);
    options.queue_pieces = *rc::gen::element<std::size_t>(2, 3, 8, 64);
    Story story{options, *rc::gen::element<std::size_t>(600, 5000)};
    const auto before = *rc::gen::inRange(0, 20);
    for (int k = 0; k < before; ++k) story.box().produce(30);
    story.open();
    for (int k = 0; k < 150; ++k) story.step();
    story.drain();
    auto& host = story.host();
    RC_ASSERT(host.inexact == 0U);
    RC_ASSERT(host.wrong_values == 0U);
    RC_ASSERT(host.contiguous());
    RC_ASSERT(host.refusals.empty());
    RC_ASSERT(!host.beats.empty());
    // Against what this test made, not against what the box says of itself.
    const auto& last = host.beats.back();
    if (!host.pieces.empty()) {
      RC_ASSERT(last.queued_samples == 0U);
      RC_ASSERT(last.position == story.box().next());
      RC_ASSERT(host.received + host.declared ==
                static_cast<std::uint64_t>(story.box().next() - host.pieces.front().first));
    }
    RC_ASSERT(host.reader.ledger().unexplained() == 0U);
    RC_ASSERT(host.reader.ledger().framesMissing() == 0U);
  }));
}

// Frames that the wire lost are inferred by the host, and then the equation holds as well.
TEST(Ledger, BalancesWithWhatTheHostInfersOnABadWire) {
  EXPECT_TRUE(rc::check("received + declared + inferred == produced", [] {
    Box box;
    Host host;
    begin(box, host);
    host.read(box.take());
    std::uint64_t good_beats = 0;
    for (int k = 0; k < 60; ++k) {
      box.produce(*rc::gen::inRange<std::uint16_t>(1, 60));
      if (*rc::gen::inRange(0, 4) == 0) box.lose(5);
      box.hear(messages::Credit{0});
      box.advance(40ms);
      auto bytes = box.take();
      if (!bytes.empty() && *rc::gen::inRange(0, 2) == 0) {
        bytes[*rc::gen::inRange<std::size_t>(0, bytes.size())] ^= std::byte{0x41};
      }
      host.read(bytes);
    }
    for (int k = 0; k < 11; ++k) {  // one heartbeat of them stands by itself
      box.hear(messages::Credit{0});
      box.advance(100ms);
      host.read(box.take());
    }
    for (const auto& balance : host.balances) {
      if (!balance) continue;
      ++good_beats;
      RC_ASSERT(balance->exact);
    }
    RC_ASSERT(good_beats > 0U);
    RC_ASSERT(host.reader.ledger().unexplained() == 0U);
    const auto& account = host.reader.ledger().account();
    RC_ASSERT(account.total() == host.beats.back().produced);
    RC_ASSERT(account.total() == static_cast<std::uint64_t>(box.next() - SampleIndex{1000}));
    RC_ASSERT(host.wrong_values == 0U);
  }));
}

TEST(Ledger, SeesABoxThatHidesALoss) {
  link::HostLedger ledger;
  ledger.frame(1);
  ledger.samples({0}, 10, true);
  ledger.frame(2);
  ledger.samples({20}, 10, true);
  EXPECT_EQ(ledger.unexplained(), 10U) << "no frame is missing, and no GAP stands there";
  ledger.frame(3);
  messages::Heartbeat beat{
      .streaming = true, .stream_number = 1, .start = {0}, .position = {30}, .produced = 20, .sent_samples = 20};
  ledger.heartbeat(beat);
  EXPECT_FALSE(ledger.balance()->exact);
}

}  // namespace
}  // namespace probebox::stream
