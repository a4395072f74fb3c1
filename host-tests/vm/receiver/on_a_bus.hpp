#pragma once
#include <cstdint>
#include <functional>
#include <gtest/gtest.h>
#include <memory>
#include <optional>
#include <poll.h>
#include <string>
#include <vector>

#include "box_user.hpp"
#include "drivers/usb_probe/linux_receiver.hpp"
#include "firmware/clock/counter_clock.hpp"
#include "receiver_gadget.hpp"

namespace probebox::vm {

// The real driver and the receiver's clock, without privileges, on a receiver that another process plays.
//
// dummy_hcd looks for data at fixed intervals, up to a jiffy long, so what arrives is late by a part of one. Packets
// come at an interval that has nothing to do with that, so that it is noise and no beat.
class ReceiverOnABus : public testing::Test {
 protected:
  static constexpr double kRateHz = 1973;
  static constexpr std::uint64_t kSamplesAPacket = 7;

  void play(std::vector<std::string> more = {}) {
    for (const char* const word : {"--rate", "1973", "--samples", "7"}) more.emplace_back(word);
    player = std::make_unique<ReceiverPlayer>(more);
  }

  // Reads what comes until `done`, or until nothing has come for a while.
  bool readUntil(const std::function<bool()>& done) {
    const AsBoxUser unprivileged;
    EXPECT_TRUE(unprivileged.taken());
    std::vector<Event> events(256);
    for (int idle = 0; idle < 2000;) {
      pollfd waiting{source.descriptor(), POLLIN, 0};
      poll(&waiting, 1, 10);
      const std::size_t count = source.read(events, now_ += std::chrono::milliseconds{10});
      idle = count > 0 ? 0 : idle + 1;
      for (std::size_t i = 0; i < count; ++i) take(events[i]);
      if (done()) return true;
    }
    return false;
  }
  bool readUntilLocked() {
    return readUntil([this] { return clock.state() == ClockState::locked; });
  }
  bool readSamples(std::uint64_t more) {
    const auto wanted = samples + more;
    return readUntil([&] { return samples >= wanted; });
  }

  // What the player's controller has handed over is here, or came damaged; what it did not is missing in the counter.
  void expectExactCounts() {
    auto counts = player->tell("mute");
    const auto is_quiet = [&] {
      counts = player->counts();
      return counts.taken == counts.delivered + counts.withheld + counts.refused + counts.returned;
    };
    EXPECT_TRUE(readUntil(is_quiet));
    EXPECT_TRUE(readUntil([&] { return fromThisPlayer() >= counts.delivered; }));
    EXPECT_EQ(fromThisPlayer(), counts.delivered);
    player->tell("speak");
  }

  void take(const Event& event) {
    if (std::holds_alternative<SourceLost>(event)) {
      ++losses;
      clock.restart();
      first_.reset();
      return;
    }
    const auto& sample = std::get<CountedDeflection>(event);
    ++samples;
    if (!first_) first_ = sample.counter - clock.counters().samples - clock.counters().missing;
    const auto stamp = clock.push(sample);
    const auto expected = static_cast<std::uint32_t>(*first_ + clock.counters().samples + clock.counters().missing - 1);
    if (clock.counters().restarts == 0) {
      EXPECT_EQ(sample.counter, expected);
    }
    if (stamp && measure) measure(sample, *stamp);
  }
  // Another player counts for itself.
  void forgetPlayer() { before_ = samples, bad_before_ = source.packets().bad_crc; }

  ReceiverGadget gadget;
  std::unique_ptr<ReceiverPlayer> player;
  usb_probe::LinuxReceiver source{""};
  clock::CounterClock clock{{.rate_hz = kRateHz}};
  std::function<void(const CountedDeflection&, const clock::CounterStamp&)> measure;
  std::uint64_t samples{};
  std::uint64_t losses{};

 private:
  std::uint64_t fromThisPlayer() const {
    return samples - before_ + (source.packets().bad_crc - bad_before_) * kSamplesAPacket;
  }

  std::optional<std::uint64_t> first_;
  std::uint64_t before_{};
  std::uint64_t bad_before_{};
  MonoTime now_ = monoTime(1'000'000'000);
};

}  // namespace probebox::vm
