// Many readers of snapshots that one writer publishes at full speed: each read is of one instant.
#include <array>
#include <atomic>
#include <bit>
#include <cstdint>
#include <gtest/gtest.h>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "firmware/app/cnc/register_handler.hpp"
#include "firmware/app/threads/core_thread.hpp"
#include "host-tests/numbered/snapshot.hpp"

namespace probebox::app {
namespace {

using support::numbered;
using support::whyTorn;

constexpr std::size_t kReaders = 4;

// As the core does: one buffer a reader, the state copied into each.
class Published {
 public:
  Published() {
    writer_ = std::jthread{[this](const std::stop_token& stop) {
      box::State state;
      for (std::uint32_t number = 1; !stop.stop_requested(); ++number) {
        state.snapshot = numbered(number);
        for (auto& buffer : buffers_) buffer.publish(state);
      }
    }};
  }
  StateBuffer& buffer(std::size_t reader) { return buffers_.at(reader); }

 private:
  std::array<StateBuffer, kReaders> buffers_;
  std::jthread writer_;
};

template <class Read>
void inThreads(const Read& read) {
  std::vector<std::jthread> readers;
  for (std::size_t reader = 0; reader < kReaders; ++reader) readers.emplace_back([&read, reader] { read(reader); });
}

TEST(SnapshotReads, AreNeverTornInAMillionAtFullSpeed) {
  constexpr std::uint64_t kReads = 1'000'000 / kReaders;
  constexpr std::uint64_t kNew = 2'000;  // of these at least: the others see the same once more
  Published published;
  std::atomic<std::uint64_t> torn{}, backwards{};
  inThreads([&](std::size_t reader) {
    std::uint64_t last = 0;
    for (std::uint64_t reads = 0, seen = 0; reads < kReads || seen < kNew; ++reads) {
      const auto& snapshot = published.buffer(reader).newest().snapshot;
      if (whyTorn(snapshot)) ++torn;
      if (snapshot.ledger.produced < last) ++backwards;
      if (snapshot.ledger.produced != last) ++seen;
      last = snapshot.ledger.produced;
    }
  });
  EXPECT_EQ(torn, 0U);
  EXPECT_EQ(backwards, 0U);
}

// The same through all that makes an answer of a snapshot: 122 registers, in three formats of a correction.
TEST(SnapshotReads, AreAnsweredWholeByEveryDesk) {
  constexpr int kAnswers = 5'000, kNew = 100;
  Published published;
  std::array<std::optional<std::string>, kReaders> torn;
  inThreads([&](std::size_t reader) {
    RegisterHandler handler{1,
                            "1.2.3",
                            {.snapshot = [&] { return published.buffer(reader).newest().snapshot; },
                             .take = [](std::span<const Event>) { return false; },
                             .kept = [] { return RegisterHandler::Kept{}; },
                             // The instant of the snapshot, not that of the question.
                             .line =
                                 [](const published::Snapshot& snapshot) {
                                   published::LineState line;
                                   line.boots = static_cast<std::uint16_t>(snapshot.ledger.produced);
                                   return line;
                                 }}};
    const auto request = support::readRequest(0, support::kNumberedRegisters);
    std::uint32_t last = 0;
    for (int answers = 0, seen = 0; (answers < kAnswers || seen < kNew) && !torn.at(reader); ++answers) {
      const auto [kind, frame] = handler.answer(request);
      if (kind != RegisterHandler::Answer::Kind::answered) {
        torn.at(reader) = "no answer";
        break;
      }
      const auto values = support::registersOf(frame);
      torn.at(reader) = whyTorn(values);
      if (!torn.at(reader) && values[50] != values[117])
        torn.at(reader) = "the line's own values are of another instant";
      if (values[117] != last) ++seen;
      last = values[117];
    }
  });
  for (const auto& why : torn) EXPECT_FALSE(why) << *why;
}

}  // namespace
}  // namespace probebox::app
