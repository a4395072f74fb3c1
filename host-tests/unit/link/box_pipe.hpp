#pragma once
#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "drivers/io/byte_pipe.hpp"
#include "firmware/stream/session.hpp"
#include "protocol/codec/block.hpp"
#include "tools/link/wait.hpp"

// A box at the other end of a pipe, on virtual time.
namespace probebox::link {

using Damage = std::function<void(std::vector<std::byte>&)>;

class BoxPipe : public io::BytePipe {
 public:
  BoxPipe(stream::Session& session, const MonoTime& now, stream::Lane lane = stream::Lane::data)
      : session_{session}, now_{now}, lane_{lane} {}

  io::Transfer read(std::span<std::byte> into) override {
    if (closed) return {0, io::PipeState::closed};
    std::vector<std::byte> bytes;
    while (!silent && bytes.size() < into.size()) {
      const auto pending = session_.pending(lane_);
      const auto part = pending.first(std::min(pending.size(), into.size() - bytes.size()));
      if (part.empty()) break;
      bytes.insert(bytes.end(), part.begin(), part.end());
      session_.sent(part.size(), lane_);
    }
    if (towards_host && !bytes.empty()) towards_host(bytes);
    std::ranges::copy(bytes, into.begin());
    return {bytes.size()};
  }
  io::Transfer write(std::span<const std::byte> from) override {
    if (closed) return {0, io::PipeState::closed};
    // A few bytes at a time, as a slow line takes them.
    std::vector<std::byte> bytes{from.begin(),
                                 from.begin() + static_cast<std::ptrdiff_t>(std::min<std::size_t>(from.size(), 37))};
    const auto taken = bytes.size();
    if (towards_box) towards_box(bytes);
    session_.receive(bytes, now_, lane_);
    return {taken};
  }
  int descriptor() const override { return -1; }
  std::string_view name() const override { return "paper"; }

  bool closed{};
  bool silent{};
  Damage towards_host;
  Damage towards_box;

 private:
  stream::Session& session_;
  const MonoTime& now_;
  stream::Lane lane_;
};

// The box, the pipe's box side and the clock. Each wait is 10 ms of virtual time, in which the box makes 10 samples.
class World {
 public:
  explicit World(bool two_lanes = false) : history{200'000, 2000}, session{options(two_lanes), history} {
    messages::Descriptor d;
    d.board = "sim";
    d.channels = {{"a", "nm", 1.0, 4, true, ""}};
    history.setDescriptor(messages::encoded(d));
    auto made = std::make_unique<BoxPipe>(session, now);
    pipe = made.get();
    owned.data = std::move(made);
    if (two_lanes) owned.control = std::make_unique<BoxPipe>(session, now, stream::Lane::control);
  }

  Wait wait(int rounds) {
    return [this, rounds](int, bool) mutable -> std::optional<MonoTime> {
      if (rounds-- == 0) return std::nullopt;
      now += Nanoseconds{10'000'000};
      if (producing) produce();
      session.advance(now, {});
      while (const auto asked = session.nextRequest()) {
        ++requests_seen;
        if (answering) answering(*asked);
      }
      return now;
    };
  }
  void produce() {
    const std::vector<codec::ChannelFormat> formats{{4, true}};
    std::vector<std::int64_t> column(10);
    for (std::size_t k = 0; k < column.size(); ++k) column[k] = next.index + static_cast<std::int64_t>(k);
    std::vector<std::byte> bytes(codec::rawBlockSize(formats, column.size()));
    if (!codec::encodeRaw({.first = next, .count = 10}, formats, column, bytes)) return;
    history.push(stream::EncodedBlock{next, 10, bytes});
    session.offer(stream::EncodedBlock{next, 10, bytes});
    next = next + 10;
  }

  MonoTime now{monoTime(5'000'000'000)};
  SampleIndex next{500};
  bool producing{true};
  int requests_seen{};
  std::function<void(const stream::PendingRequest&)> answering;
  stream::History history;
  stream::Session session;
  BoxPipe* pipe{};
  io::Connection owned;

 private:
  static stream::SessionOptions options(bool two_lanes) {
    stream::SessionOptions o;
    o.two_lanes = two_lanes;
    o.boot_id.fill(std::byte{7});
    o.firmware_version = "0.1.0";
    return o;
  }
};

// Adds up what a listener hears.
struct Tally : StreamListener {
  void onBlock(const DecodedBlock& block) override {
    for (std::size_t k = 0; k < block.header.count; ++k) {
      wrong += block.column(0)[k] != block.header.first.index + static_cast<std::int64_t>(k);
    }
    samples += block.header.count;
  }
  void onGap(const messages::Gap& gap) override { declared += gap.count; }
  void onHole(const messages::Gap& hole) override { inferred += hole.count; }
  void onHeartbeat(const messages::Heartbeat&, const std::optional<Balance>& balance) override {
    if (!balance) return;
    ++balances;
    inexact += !balance->exact;
  }
  std::uint64_t samples{}, wrong{}, declared{}, inferred{}, balances{}, inexact{};
};

// Changes about one byte in `one_in`.
inline Damage noise(std::uint64_t seed, std::uint64_t one_in) {
  return [state = seed, one_in](std::vector<std::byte>& bytes) mutable {
    for (auto& byte : bytes) {
      state = state * 6364136223846793005U + 1442695040888963407U;
      if ((state >> 33U) % one_in == 0) byte ^= static_cast<std::byte>(1U + ((state >> 20U) & 0x7FU));
    }
  };
}

}  // namespace probebox::link
