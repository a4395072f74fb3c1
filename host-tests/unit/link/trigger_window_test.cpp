#include "tools/link/trigger_window.hpp"

#include <gtest/gtest.h>
#include <optional>
#include <vector>

#include "tools/link/stream_reader.hpp"

// What is kept around a trigger when the link is lost and comes back, read as `verify` reads it.
namespace probebox::link {
namespace {

using messages::MessageType;

// A box whose stream has a heartbeat every 100 ms and no samples.
class Box {
 public:
  explicit Box(TriggerWindow& window) : window_{window} { connect(); }

  // A new link: its stream begins after a heartbeat that belongs to none.
  void connect() {
    sequence_ = 0;
    messages::Welcome welcome;
    welcome.boot_id.fill(std::byte{7});
    send(welcome);
    send(messages::Descriptor{});
    beat(0);
  }
  void beat(std::uint32_t stream_number, bool streaming = true) {
    uptime_ms_ += 100;
    messages::Heartbeat beat;
    beat.uptime_ms = uptime_ms_;
    beat.stream_number = stream_number;
    beat.streaming = stream_number != 0 && streaming;
    send(beat);
  }
  void beats(int count) {
    for (int k = 0; k < count; ++k) beat(1);
  }
  void trigger() { send(messages::Trigger{.number = ++triggers_}); }

 private:
  template <class Message>
  void send(const Message& message) {
    const auto payload = messages::encoded(message);
    frame::Header header;
    header.type = static_cast<std::uint8_t>(Message::kType);
    header.sequence = sequence_++;
    header.payload_length = static_cast<std::uint16_t>(payload.size());
    window_.frame({header, payload});
  }

  TriggerWindow& window_;
  std::uint32_t sequence_{};
  std::uint32_t triggers_{};
  std::uint64_t uptime_ms_{5000};
};

// What a reader finds in the frames that were passed on.
struct Reader : StreamListener {
  void read(const frame::Frame& frame) {
    std::vector<std::byte> scratch(frame::bareSize(frame.payload.size()));
    std::vector<std::byte> coded(frame::delimitedMaxSize(frame.payload.size()));
    reader.read(std::span{coded}.first(frame::encodeDelimited(frame.header, frame.payload, scratch, coded)));
    ++frames;
  }
  void onHeartbeat(const messages::Heartbeat& beat, const std::optional<Balance>&) override {
    last_ms = beat.uptime_ms;
    streaming = beat.streaming;
  }
  void onTrigger(const messages::Trigger&) override { ++triggers; }

  StreamReader reader{*this};
  std::size_t frames{}, triggers{};
  std::uint64_t last_ms{};
  bool streaming{};
};

struct Recording {
  Reader reader;
  TriggerWindow window{{.before_ms = 1000, .after_ms = 1000},
                       [this](const frame::Frame& frame) { reader.read(frame); }};
  Box box{window};
};

TEST(TriggerWindow, GoesOnOverALostLinkAfterTheTrigger) {
  Recording recording;
  auto& [reader, window, box] = recording;
  box.beats(20);
  box.trigger();
  box.beats(3);
  box.connect();
  EXPECT_FALSE(window.done()) << "the stream of the new link has not begun yet";
  box.beats(4);
  EXPECT_FALSE(window.done());
  box.beats(20);
  EXPECT_TRUE(window.done());
  EXPECT_FALSE(reader.streaming) << "the ledger is closed";
  EXPECT_EQ(reader.last_ms, 5000 + 100 * (1 + 20 + 1 + 12)) << "1 s and the margin after the first heartbeat";
  EXPECT_EQ(reader.reader.ledger().framesMissing(), 0U);
}

TEST(TriggerWindow, MissesNoFrameOfALinkThatBeganBeforeTheTrigger) {
  Recording recording;
  auto& [reader, window, box] = recording;
  box.beats(5);
  box.connect();
  box.beats(3);
  box.trigger();
  box.beats(20);
  EXPECT_TRUE(window.done());
  EXPECT_EQ(reader.triggers, 1U);
  EXPECT_EQ(reader.reader.ledger().framesMissing(), 0U);
}

TEST(TriggerWindow, EndsWithTheStream) {
  Recording recording;
  auto& [reader, window, box] = recording;
  box.beats(5);
  box.trigger();
  box.beats(2);
  box.beat(1, false);
  EXPECT_TRUE(window.done());
  EXPECT_FALSE(reader.streaming);
}

}  // namespace
}  // namespace probebox::link
