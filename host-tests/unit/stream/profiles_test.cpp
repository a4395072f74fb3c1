#include <gtest/gtest.h>
#include <memory>
#include <rapidcheck.h>

#include "box.hpp"

// Several hosts at once, in different profiles and policies, while the descriptor changes under them.
namespace probebox::stream {
namespace {

using namespace std::chrono_literals;
using messages::Policy;
using messages::Profile;

messages::Descriptor underResult(std::uint64_t id) {
  auto d = descriptor();
  if (id > 0) d.delay = {true, {1e-3 * static_cast<double>(id), 0, 0}, {1e-6, 1e-6, 1e-6}, id};
  return d;
}

// One box, one history, a link for each host.
class Party {
 public:
  explicit Party(std::size_t history_bytes = 20'000) : history_{history_bytes, 512, {Profile::fast}} { describe(0); }

  struct Guest {
    Guest(const SessionOptions& options, const History& history) : session{options, history} {}
    Session session;
    Host host;
    std::uint32_t sequence{};
  };

  Guest& invite(const messages::Start& start, SessionOptions options = {}) {
    options.boot_id = bootId();
    auto& guest = *guests.emplace_back(std::make_unique<Guest>(options, history_));
    hear(guest, messages::Hello::current(bootId()));
    carry(guest);
    hear(guest, start);
    return guest;
  }
  template <class Message>
  void hear(Guest& guest, const Message& message) {
    const auto payload = messages::encoded(message);
    std::vector<std::byte> scratch(frame::bareSize(payload.size()));
    std::vector<std::byte> coded(frame::delimitedMaxSize(payload.size()));
    coded.resize(frame::encodeDelimited(
        {.type = static_cast<std::uint8_t>(Message::kType), .sequence = guest.sequence++}, payload, scratch, coded));
    guest.session.receive(coded, now_);
  }
  static void carry(Guest& guest, std::size_t most = ~std::size_t{0}) {
    std::vector<std::byte> all;
    while (all.size() < most) {
      const auto pending = guest.session.pending();
      const auto part = pending.first(std::min(pending.size(), most - all.size()));
      if (part.empty()) break;
      all.insert(all.end(), part.begin(), part.end());
      guest.session.sent(part.size());
    }
    guest.host.read(all);
  }
  void describe(std::uint64_t result) {
    result_ = result;
    history_.setDescriptor(messages::encoded(underResult(result)));
  }
  void produce(std::uint16_t count) {
    const auto bytes = block(next_, count);
    const EncodedBlock raw{next_, count, bytes};
    const auto fast = transcoder_.fast(raw);
    for (const auto& made : {raw, fast}) {
      history_.push(made);
      for (const auto& guest : guests) guest->session.offer(made);
    }
    produced_under[next_.index] = result_;
    next_ = next_ + count;
  }
  void tick() {
    now_ += 100ms;
    for (const auto& guest : guests) {
      hear(*guest, messages::Credit{0});
      guest->session.advance(now_, {});
    }
  }
  SampleIndex next() const { return next_; }
  std::uint64_t result() const { return result_; }

  std::vector<std::unique_ptr<Guest>> guests;
  std::map<std::int64_t, std::uint64_t> produced_under;

 private:
  MonoTime now_{monoTime(1'000'000'000)};
  SampleIndex next_{1000};
  std::uint64_t result_{};
  History history_;
  Transcoder transcoder_{kFormats, 512};
};

void expectSound(const Party& party, const Host& host) {
  RC_ASSERT(host.inexact == 0U);
  RC_ASSERT(host.wrong_values == 0U);
  RC_ASSERT(host.contiguous());
  RC_ASSERT(host.refusals.empty());
  RC_ASSERT(host.reader.faults().unreadable_blocks == 0U);
  RC_ASSERT(host.reader.faults().keyless_blocks == 0U);
  RC_ASSERT(host.reader.ledger().unexplained() == 0U);
  for (const auto& [first, result] : host.under) RC_ASSERT(party.produced_under.at(first) == result);
}

TEST(Profiles, SeveralHostsEachGetTheirOwnWithAnExactLedgerWhileTheDescriptorChanges) {
  EXPECT_TRUE(rc::check("every host, every heartbeat", [] {
    Party party;
    std::uint64_t result = 0;
    for (int k = 0; k < 120; ++k) {
      const auto what = *rc::gen::inRange(0, 12);
      if (what < 5) {
        party.produce(*rc::gen::inRange<std::uint16_t>(1, 60));
      } else if (what == 5) {
        party.tick();
      } else if (what == 6) {
        party.describe(*rc::gen::arbitrary<bool>() ? ++result : result / 2);
      } else if (what == 7 && party.guests.size() < 4) {
        const bool resumes = *rc::gen::arbitrary<bool>() && party.next() > SampleIndex{1000};
        party.invite({.profile = *rc::gen::element(Profile::raw, Profile::fast, Profile::tight),
                      .policy = *rc::gen::element(Policy::live, Policy::record),
                      .has_resume = resumes,
                      .resume_from = {*rc::gen::inRange<std::int64_t>(1000, party.next().index + 1)}},
                     {.queue_bytes = *rc::gen::element<std::size_t>(600, 20'000), .live_bytes = 600});
      } else if (!party.guests.empty()) {
        Party::carry(*party.guests[*rc::gen::inRange<std::size_t>(0, party.guests.size())],
                     *rc::gen::inRange<std::size_t>(0, 3000));
      }
    }
    party.tick();
    for (const auto& guest : party.guests) {
      Party::carry(*guest);
      party.tick();
      Party::carry(*guest);
      expectSound(party, guest->host);
      if (guest->host.pieces.empty()) continue;
      RC_ASSERT(guest->host.beats.back().position == party.next());
      RC_ASSERT(guest->host.reader.descriptor()->delay.result_id == party.result());
    }
  }));
}

TEST(Profiles, AResumedHostGetsTheDescriptorOfEachBlockBeforeIt) {
  for (const auto profile : {Profile::raw, Profile::fast, Profile::tight}) {
    Party party;
    for (const std::uint64_t result : {0U, 1U, 2U, 1U}) {
      party.describe(result);
      for (int k = 0; k < 3; ++k) party.produce(10);
    }
    auto& guest = party.invite({.profile = profile, .has_resume = true, .resume_from = {1000}});
    Party::carry(guest);
    EXPECT_EQ(guest.host.received, 120U);
    EXPECT_EQ(guest.host.under, party.produced_under);
    EXPECT_EQ(guest.host.reader.faults().unreadable_blocks, 0U);
  }
}

TEST(Profiles, AnIdleHostLearnsOfAChangeAtOnceAndALostDescriptorComesAgain) {
  Party party;
  auto& guest = party.invite({});
  Party::carry(guest);
  const auto heard = [&] { return std::ranges::count(guest.host.types, messages::MessageType::descriptor); };
  ASSERT_EQ(heard(), 1);
  party.describe(5);
  Party::carry(guest);
  EXPECT_EQ(heard(), 2);
  EXPECT_EQ(guest.host.reader.descriptor()->delay.result_id, 5U);
  for (int k = 0; k < 10; ++k) {
    party.tick();
    Party::carry(guest);
  }
  EXPECT_EQ(heard(), 5) << "three times more, with heartbeats";
}

TEST(Profiles, ADescriptorTooOldToBeKnownMakesALossAndNoRiddle) {
  Party party;
  party.produce(10);
  for (std::uint64_t k = 1; k <= DescriptorBook::kKept; ++k) party.describe(k);
  party.produce(10);
  auto& guest = party.invite({.has_resume = true, .resume_from = {1000}});
  Party::carry(guest);
  ASSERT_EQ(guest.host.gaps.size(), 1U);
  EXPECT_EQ(guest.host.gaps[0].count, 10U);
  EXPECT_EQ(guest.host.gaps[0].reason, messages::GapReason::ring_overrun);
  EXPECT_EQ(guest.host.received, 10U);
  EXPECT_EQ(guest.host.inexact, 0U);
}

TEST(Profiles, FastSendsLess) {
  Party party;
  auto& raw = party.invite({});
  auto& fast = party.invite({.profile = Profile::fast});
  for (int k = 0; k < 50; ++k) party.produce(200);
  for (auto* guest : {&raw, &fast}) Party::carry(*guest);
  party.tick();
  for (auto* guest : {&raw, &fast}) Party::carry(*guest);
  ASSERT_EQ(raw.host.received, fast.host.received);
  EXPECT_LT(2 * fast.host.beats.back().sent_bytes, raw.host.beats.back().sent_bytes);
}

TEST(Profiles, OneThatTheBoxDoesNotSendIsRefusedByName) {
  const History raw_only{1000, 8};
  Session session{{}, raw_only};
  EXPECT_FALSE(raw_only.has(Profile::fast));
  Party party;
  auto& guest = party.invite({.profile = static_cast<Profile>(7)});
  Party::carry(guest);
  ASSERT_EQ(guest.host.refusals.size(), 1U);
  EXPECT_EQ(guest.host.refusals[0].code, messages::ErrorCode::refused);
}

}  // namespace
}  // namespace probebox::stream
