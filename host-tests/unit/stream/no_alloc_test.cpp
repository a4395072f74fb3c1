#include "host-tests/support/no_alloc.hpp"

#include <gtest/gtest.h>

#include "box.hpp"

namespace probebox::stream {
namespace {

using namespace std::chrono_literals;

// Samples, triggers, drops, heartbeats, requests and answers: after construction a link takes no memory.
TEST(Session, TakesNoMemoryOnceItExists) {
  Box box{{.live_bytes = 2000}, 5000};
  Host host;
  messages::Start start;
  start.triggers = true;
  begin(box, host, start);
  host.read(box.take());
  const auto bytes = block({0}, 50);
  const auto credit = messages::encoded(messages::Credit{1});
  std::vector<std::byte> scratch(frame::bareSize(credit.size()));
  std::vector<std::byte> coded(frame::delimitedMaxSize(credit.size()));
  coded.resize(frame::encodeDelimited({.type = static_cast<std::uint8_t>(messages::MessageType::credit)}, credit,
                                      scratch, coded));
  History history{5000, 64};
  auto now = box.now();
  std::size_t sent = 0;

  const support::NoAlloc guard;
  for (std::int64_t k = 0; k < 200; ++k) {
    const EncodedBlock made{{2000 + 60 * k}, 50, bytes};
    history.push(made);
    if (k % 5 == 0) box.push(messages::Trigger{.number = static_cast<std::uint32_t>(1 + 3 * k)});
    box.session.offer(made);
    box.session.offer(GapNotice{{2050 + 60 * k}, 10, GapReason::source_probe});
    now += 10ms;
    box.session.receive(coded, now);
    box.session.advance(now, {});
    // Slower than the samples come, so that some are dropped.
    const auto pending = box.session.pending();
    const auto part = std::min<std::size_t>(pending.size(), 150);
    box.session.sent(part);
    sent += part;
  }
  EXPECT_EQ(guard.allocations(), 0U);
  EXPECT_GT(sent, 10'000U);
  EXPECT_GT(box.session.feed().ledger().lost_in_queue, 0U);
  EXPECT_EQ(box.session.triggers().ledger().sent, 40U);
  EXPECT_GT(box.session.triggers().ledger().lost, 400U);
}

}  // namespace
}  // namespace probebox::stream
