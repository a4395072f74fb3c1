#pragma once
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "drivers/io/byte_pipe.hpp"
#include "firmware/app/host/host_link.hpp"
#include "firmware/stream/history.hpp"
#include "firmware/stream/transcoder.hpp"
#include "host-tests/emulation/scenario.hpp"
#include "tools/link/client.hpp"

// Hosts of an emulated box on virtual time, over wires that hold some bytes and can be cut anywhere.
namespace probebox::scenario {

// One direction.
struct WireState {
  std::deque<std::byte> bytes;
  std::size_t room{64 * 1024};  // as the buffers of a socket
  bool blocked{};               // the reader does not read
  bool cut{};
};

// One end of a wire.
class WireEnd : public io::BytePipe {
 public:
  WireEnd(std::shared_ptr<WireState> in, std::shared_ptr<WireState> out) : in_{std::move(in)}, out_{std::move(out)} {}

  io::Transfer read(std::span<std::byte> into) override;
  io::Transfer write(std::span<const std::byte> from) override;
  int descriptor() const override { return -1; }
  std::string_view name() const override { return "wire"; }

 private:
  std::shared_ptr<WireState> in_;
  std::shared_ptr<WireState> out_;
};

// What a host wants.
struct StreamOptions {
  messages::Policy policy{messages::Policy::record};
  messages::Profile profile{messages::Profile::fast};
};

// A host and its link, over as many connections as it takes. Each sample index counts once: received or declared lost.
class VirtualHost : private link::StreamListener {
 public:
  explicit VirtualHost(const StreamOptions& options) : options_{options} {}

  // A new connection; from the first sample that it does not have, if it had one before.
  void connect(const stream::SessionOptions& session, const stream::History& history);
  // Both sides do what they have to do.
  void carry(MonoTime now, const stream::Vitals& vitals);

  void stopReading(bool stopped = true);
  // The connection ends after so many more bytes, in whatever frame that is.
  void cutAfter(std::size_t bytes) { cut_after_ = bytes; }
  bool connected() const { return client_ != nullptr; }
  void hangUp();

  stream::Session* session() { return link_ && !link_->closed() ? &link_->session() : nullptr; }
  std::uint64_t received() const { return received_; }
  std::uint64_t declaredLost() const { return declared_; }
  std::uint64_t declaredLost(messages::GapReason reason) const;
  // Of the first connection to the end of the last: all samples there were.
  std::uint64_t total() const { return first_ ? static_cast<std::uint64_t>(next_ - *first_) : 0; }
  SampleIndex next() const { return next_; }
  const std::vector<messages::Trigger>& triggers() const { return triggers_; }
  std::uint64_t lostTriggers() const { return lost_triggers_; }
  // Heartbeats whose sums did not agree, frames that nobody could read, holes that nobody declared.
  std::uint64_t faults() const { return faults_ + (client_ ? client_->reader().counters().bad() : 0); }
  std::uint64_t heartbeats() const { return heartbeats_; }
  std::uint64_t connections() const { return connections_; }

 private:
  void onWelcome(const messages::Welcome& welcome) override { boot_id_ = welcome.boot_id; }
  void onBlock(const link::DecodedBlock& block) override;
  void onGap(const messages::Gap& gap) override;
  void onHole(const messages::Gap& hole) override { faults_ += hole.count; }
  void onTrigger(const messages::Trigger& trigger) override;
  void onTriggerGap(const messages::TriggerGap& gap) override;
  void onTriggerHole(const messages::TriggerGap& hole) override { faults_ += hole.count; }
  void onHeartbeat(const messages::Heartbeat& beat, const std::optional<link::Balance>& balance) override;
  std::uint64_t newOf(SampleIndex first, std::uint64_t count);

  StreamOptions options_;
  std::shared_ptr<WireState> to_host_;
  std::shared_ptr<WireState> to_box_;
  std::unique_ptr<app::HostLink> link_;
  std::unique_ptr<link::Client> client_;
  std::optional<std::size_t> cut_after_;
  bool asked_{};
  messages::BootId boot_id_{};
  std::optional<SampleIndex> first_;
  SampleIndex next_{};
  std::uint64_t received_{};
  std::uint64_t declared_{};
  std::vector<std::uint64_t> by_reason_ = std::vector<std::uint64_t>(8);
  std::uint64_t faults_{};
  std::uint64_t heartbeats_{};
  std::vector<messages::Trigger> triggers_;
  std::uint64_t lost_triggers_{};
  std::uint32_t next_trigger_{};
  std::uint64_t connections_{};
};

// A scenario whose box has hosts, as the links' thread of the daemon would serve them.
class Office : private box::Outputs {
 public:
  explicit Office(std::size_t history_bytes = 2U << 20U, std::size_t triggers = stream::TriggerHistory::kKept,
                  const world::Config& config = usualWorld(), std::uint64_t seed = 1);
  ~Office() override;

  Scenario& scenario() { return scenario_; }
  VirtualHost& add(const StreamOptions& options = {});
  void connect(VirtualHost& host);
  void run(Nanoseconds duration);
  // Another boot of the daemon: nobody remembers anything but what is `restored`.
  void restartBox(std::span<const Event> restored = {});

 private:
  bool block(SampleIndex first, std::uint32_t count, std::span<const std::byte> bytes) override;
  bool lost(const latch::Lost& lost) override;
  void trigger(const box::PlacedTrigger& trigger) override;
  void state(const box::State&) override {}
  void solve(std::uint32_t) override {}
  void offer(const stream::EncodedBlock& block);
  void boot();

  std::size_t history_bytes_;
  std::size_t triggers_;
  std::unique_ptr<stream::History> history_;
  stream::Transcoder transcoder_;
  std::uint8_t boots_{};
  stream::SessionOptions session_;
  std::vector<std::unique_ptr<VirtualHost>> hosts_;
  Scenario scenario_;
};

}  // namespace probebox::scenario
