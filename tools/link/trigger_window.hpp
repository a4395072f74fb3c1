#pragma once
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "protocol/frame/frame.hpp"
#include "protocol/messages/handshake.hpp"
#include "protocol/messages/stream.hpp"

namespace probebox::link {

// Keeps the last seconds of a stream until a trigger comes, then passes them and the frames that follow for a while to
// the sink, as a recording of its own that `verify` finds complete: it begins with the handshake and a heartbeat whose
// ledger is zero, later heartbeats count from there, and the last one closes the ledger.
//
// The history begins at a heartbeat (ten per second), so it is up to 0.2 s longer than requested, and shorter only if
// the stream itself is.
class TriggerWindow {
 public:
  using Sink = std::function<void(const frame::Frame&)>;
  struct Lengths {
    std::uint64_t before_ms{};
    std::uint64_t after_ms{};
  };

  TriggerWindow(Lengths lengths, Sink sink) : lengths_{lengths}, sink_{std::move(sink)} {}

  // Takes every good frame of the box in order.
  void frame(const frame::Frame& frame);

  // Number of the trigger that began the recording; nothing while none has come.
  const std::optional<std::uint32_t>& trigger() const { return trigger_; }
  // The recording is complete: nothing more is passed on.
  bool done() const { return done_; }

 private:
  struct Kept {
    frame::Header header;
    std::vector<std::byte> payload;
    std::optional<messages::Heartbeat> beat{};  // that the payload is
  };
  using Stretch = std::vector<Kept>;  // from a heartbeat of the stream up to the next one

  void heartbeat(Kept frame);
  void forgetOld(std::uint64_t now_ms);
  void keepHandshake(const Kept& frame);
  void begin();
  void pass(const Kept& frame);
  messages::Heartbeat counted(messages::Heartbeat beat) const;

  Lengths lengths_;
  Sink sink_;
  std::map<std::uint8_t, Kept> handshake_;  // received before the first stretch, by type
  std::deque<Stretch> history_;
  std::optional<messages::Heartbeat> base_;  // where the ledger of the recording begins; none on a later link
  std::optional<messages::BootId> boot_id_;
  std::optional<std::uint32_t> trigger_;
  std::optional<std::uint64_t> triggered_ms_;  // uptime at the first heartbeat after the trigger
  bool done_{};
};

}  // namespace probebox::link
