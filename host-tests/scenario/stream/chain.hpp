#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "firmware/app/host/host_link.hpp"
#include "firmware/box/box.hpp"
#include "firmware/stream/history.hpp"
#include "firmware/stream/transcoder.hpp"
#include "tools/link/client.hpp"

// The whole way of a sample in one thread and on virtual time: events, clock, latch, codec, session, a real connection,
// and the reader of a host.
namespace probebox::chain {

inline constexpr std::int32_t kSamplesPerTick = 100;  // of a clock of 1 kHz: 100 kS/s
inline constexpr double kSamplesPerSecond = 1000.0 * kSamplesPerTick;

// The reference scan as a probe of 100 kHz, encoders of 10 kHz and a sync line give it, and time every 10 ms.
// Samples of the probe are missing for so long once a second.
std::vector<Event> scanEvents(std::chrono::seconds lasts, Nanoseconds probe_silent = {});

class Chain : private box::Outputs, private link::StreamListener {
 public:
  // Connects and starts; throws when this machine has no loopback network.
  explicit Chain(messages::Profile profile);
  ~Chain() override;

  void run(std::span<const Event> events);
  // STOP, and what is still on its way: until all is accounted for, or a minute of virtual time is over.
  void finish();

  // Of the box, of the link, and of the host.
  const box::State& box() const { return box_->state(); }
  const stream::SampleFeed::Ledger& sent() const { return host_link_->session().feed().ledger(); }
  const link::Account& account() const { return client_->reader().ledger().account(); }
  // Of every sample exactly one fate, the same on both sides, at the last heartbeat.
  bool exact() const;
  std::uint64_t wireBytes() const { return wire_bytes_; }
  // Heartbeats whose sums did not agree.
  std::uint64_t inexact() const { return inexact_; }
  // Sums over all values that the box encoded and the host decoded, whatever the order of the columns.
  std::uint64_t encodedSum() const { return encoded_sum_; }
  std::uint64_t decodedSum() const { return decoded_sum_; }
  // Adds those up; costs time.
  void addUp(bool wanted) { adds_up_ = wanted; }

 private:
  bool block(SampleIndex first, std::uint32_t count, std::span<const std::byte> bytes) override;
  bool lost(const latch::Lost& lost) override;
  void trigger(const box::PlacedTrigger&) override {}
  void state(const box::State&) override {}
  void solve(std::uint32_t) override {}
  void onFrame(const frame::Frame& frame) override;
  void onBlock(const link::DecodedBlock& block) override;
  void onHeartbeat(const messages::Heartbeat& beat, const std::optional<link::Balance>& balance) override;
  void offer(const stream::EncodedBlock& block);
  void carry();

  MonoTime now_{};
  stream::History history_;
  stream::Transcoder transcoder_;
  std::unique_ptr<app::HostLink> host_link_;
  std::unique_ptr<link::Client> client_;
  std::unique_ptr<box::Box> box_;
  bool adds_up_{};
  std::uint64_t wire_bytes_{};
  std::uint64_t inexact_{};
  std::uint64_t encoded_sum_{};
  std::uint64_t decoded_sum_{};
};

}  // namespace probebox::chain
