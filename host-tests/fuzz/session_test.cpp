#include <gtest/gtest.h>
#include <random>
#include <vector>

#include "protocol/frame/frame.hpp"
#include "protocol/messages/handshake.hpp"
#include "protocol/messages/request.hpp"
#include "protocol/messages/stream.hpp"
#include "session_entry.hpp"

// The fuzzer's entry without a fuzzer: conversations that make sense, then the same ones damaged, the same every time.
namespace probebox {
namespace {

using Bytes = std::vector<std::uint8_t>;

class Conversation {
 public:
  template <class Message>
  Conversation& say(const Message& message) {
    const auto payload = messages::encoded(message);
    std::vector<std::byte> scratch(frame::bareSize(payload.size()));
    std::vector<std::byte> coded(frame::delimitedMaxSize(payload.size()));
    coded.resize(frame::encodeDelimited({.type = static_cast<std::uint8_t>(Message::kType), .sequence = sequence_++},
                                        payload, scratch, coded));
    for (const auto byte : coded) bytes_.push_back(std::to_integer<std::uint8_t>(byte));
    return *this;
  }
  Bytes bytes() const { return bytes_; }

 private:
  Bytes bytes_;
  std::uint32_t sequence_{};
};

std::vector<Bytes> corpus() {
  const auto hello = messages::Hello::current();
  messages::Request request{1, messages::Operation::status, std::vector<std::byte>(20)};
  const messages::Start resume{.credit_bytes = 500, .has_resume = true, .resume_from = {8}};
  return {
      Conversation{}.say(hello).say(messages::Start{}).say(messages::Credit{100}).say(messages::Stop{}).bytes(),
      Conversation{}
          .say(hello)
          .say(resume)
          .say(messages::Credit{2000})
          .say(request)
          .say(request)
          .say(messages::Credit{9000})
          .bytes(),
      Conversation{}
          .say(hello)
          .say(messages::Start{
              .profile = messages::Profile::fast, .policy = messages::Policy::record, .credit_bytes = 0})
          .say(messages::Credit{4000})
          .say(messages::Stop{})
          .say(messages::Start{})
          .say(hello)
          .say(messages::Start{})
          .bytes(),
      Conversation{}
          .say(messages::Welcome{})
          .say(messages::Descriptor{})
          .say(messages::Heartbeat{})
          .say(messages::Gap{})
          .bytes(),
  };
}

Bytes mutated(const std::vector<Bytes>& seeds, std::mt19937_64& random) {
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
  Bytes made;
  for (std::size_t parts = 1 + below(3); parts > 0; --parts) {
    const auto& seed = seeds[below(seeds.size())];
    made.insert(made.end(), seed.begin(), seed.end());
  }
  for (std::size_t times = below(6); times > 0; --times) {
    const auto at = below(made.size());
    switch (below(4)) {
      case 0:
        made[at] = static_cast<std::uint8_t>(random());
        break;
      case 1:
        made.erase(made.begin() + static_cast<std::ptrdiff_t>(at));
        break;
      case 2:
        made.insert(made.begin() + static_cast<std::ptrdiff_t>(at), 1 + below(60), static_cast<std::uint8_t>(random()));
        break;
      default:
        made[at] = 0;
    }
    if (made.empty()) made.push_back(0);
  }
  return made;
}

TEST(SessionFuzz, SurvivesSensibleConversations) {
  for (const auto& seed : corpus()) EXPECT_EQ(feedSession(seed.data(), seed.size()), 0);
  EXPECT_EQ(feedSession(nullptr, 0), 0);
}

TEST(SessionFuzz, SurvivesDamagedConversations) {
  const auto seeds = corpus();
  std::mt19937_64 random{20260101};
  for (int round = 0; round < 5000; ++round) {
    const auto input = mutated(seeds, random);
    ASSERT_EQ(feedSession(input.data(), input.size()), 0) << round;
  }
}

TEST(SessionFuzz, SurvivesNoise) {
  std::mt19937_64 random{7};
  for (int round = 0; round < 500; ++round) {
    Bytes noise(1 + random() % 3000);
    for (auto& byte : noise) byte = static_cast<std::uint8_t>(random());
    ASSERT_EQ(feedSession(noise.data(), noise.size()), 0) << round;
  }
}

}  // namespace
}  // namespace probebox
