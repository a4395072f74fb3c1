#include "drivers/tcp/emulator.hpp"

#include <algorithm>
#include <poll.h>
#include <utility>

namespace probebox::tcp {
namespace {

constexpr std::size_t kBufferBytes = 65536;
constexpr std::chrono::milliseconds kConnectPatience{1000};

// splitmix64 (Steele, Lea and Flood 2014): the same numbers on every machine.
std::uint64_t next(std::uint64_t& state) {
  std::uint64_t z = (state += 0x9E3779B97F4A7C15ULL);
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
  return z ^ (z >> 31);
}

double uniform(std::uint64_t& state) {
  return static_cast<double>(next(state) >> 11) * 0x1.0p-53;
}

}  // namespace

Outcome<EmulatedWire> EmulatedWire::open(const Address& listen_at, Address box) {
  TRY(auto listener, Listener::open(listen_at));
  return EmulatedWire{std::move(listener), std::move(box)};
}

void EmulatedWire::disturb(const WireFaults& towards_host, const WireFaults& towards_box) {
  directions_[0].faults = towards_host;
  directions_[1].faults = towards_box;
  for (auto& direction : directions_) direction.random = direction.faults.seed;
}

std::size_t EmulatedWire::pump(std::chrono::milliseconds patience) {
  wait(patience);
  welcome();
  if (stalled_) return 0;
  std::size_t moved = 0;
  for (auto& connection : connections_) moved += carry(connection, 0) + carry(connection, 1);
  std::erase_if(connections_, [](const Connection& connection) { return connection.closed; });
  return moved;
}

void EmulatedWire::wait(std::chrono::milliseconds patience) const {
  std::vector<pollfd> waits{{listener_.descriptor(), POLLIN, 0}};
  for (const auto& connection : connections_) {
    if (stalled_) break;
    for (std::size_t i = 0; i < 2; ++i) {
      const bool room = connection.waiting[1 - i].size() < kBufferBytes;
      const int events = (room ? POLLIN : 0) | (connection.waiting[i].empty() ? 0 : POLLOUT);
      waits.push_back({connection.ends[i]->descriptor(), static_cast<short>(events), 0});
    }
  }
  poll(waits.data(), waits.size(), static_cast<int>(patience.count()));
}

void EmulatedWire::welcome() {
  while (auto host = listener_.accept()) {
    auto box = connectTcp(box_, kConnectPatience);
    // A host of a box that is not there sees its connection end.
    if (!box) continue;
    Connection connection;
    connection.ends = {std::move(host), std::move(box).value()};
    connections_.push_back(std::move(connection));
  }
}

std::size_t EmulatedWire::carry(Connection& connection, std::size_t to) {
  auto& waiting = connection.waiting[to];
  bool ended = false;
  if (waiting.size() < kBufferBytes) {
    std::array<std::byte, 16384> buffer{};
    const auto got = connection.ends[1 - to]->read(buffer);
    damage(directions_[to], std::span{buffer}.first(got.bytes), waiting);
    ended = got.state == io::PipeState::closed;
  }
  const auto sent = connection.ends[to]->write(waiting);
  waiting.erase(waiting.begin(), waiting.begin() + static_cast<std::ptrdiff_t>(sent.bytes));
  connection.closed = connection.closed || sent.state == io::PipeState::closed || (ended && waiting.empty());
  return sent.bytes;
}

void EmulatedWire::damage(Direction& direction, std::span<const std::byte> bytes, std::vector<std::byte>& out) {
  const auto& faults = direction.faults;
  for (auto byte : bytes) {
    if (faults.drop_probability > 0 && uniform(direction.random) < faults.drop_probability) {
      ++direction.counts.dropped;
      continue;
    }
    if (faults.corrupt_probability > 0 && uniform(direction.random) < faults.corrupt_probability) {
      // Never by 0: a corrupted byte is another byte.
      byte ^= static_cast<std::byte>(1 + next(direction.random) % 255);
      ++direction.counts.corrupted;
    }
    ++direction.counts.carried;
    out.push_back(byte);
  }
}

}  // namespace probebox::tcp
