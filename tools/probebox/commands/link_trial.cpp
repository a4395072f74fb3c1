#include "tools/probebox/commands/link_trial.hpp"

#include <optional>

#include "protocol/frame/frame.hpp"
#include "tools/probebox/text/report.hpp"
#include "tools/probebox/text/sample_tally.hpp"

namespace probebox::command {
namespace {

struct Received : link::StreamListener {
  void onFrame(const frame::Frame& frame) override {
    if (frame.header.type != static_cast<std::uint8_t>(messages::MessageType::samples)) return;
    bytes += frame.payload.size() + frame::kOverhead;
    last_at = link::now();
  }
  void onBlock(const link::DecodedBlock& block) override {
    if (!first) first = block.header.first;
    tally.block(block.header.first, block.header.count);
  }
  void onGap(const messages::Gap& gap) override { tally.gap(gap); }
  void onHole(const messages::Gap& hole) override { tally.hole(hole); }
  void onHeartbeat(const messages::Heartbeat& beat, const std::optional<link::Balance>& balance) override {
    tally.heartbeat(beat, balance);
  }

  SampleTally tally;
  std::optional<SampleIndex> first;
  std::uint64_t bytes{};
  MonoTime last_at{};
};

}  // namespace

Outcome<StreamTrial, Trouble> tryStream(const link::Uri& uri, double seconds, Console& console) {
  Received received;
  TRY(const auto box, openBox(uri, console, kConnectPatience, &received));
  StreamTrial trial;
  TRY(auto before, ask<messages::Status>(*box, console));
  trial.before = std::move(before);
  trial.boot_id = box->reader().welcome()->boot_id;
  const auto begin = link::now();
  box->start({.profile = messages::Profile::fast, .policy = messages::Policy::record});
  for (const auto all = patienceOf(console, inMilliseconds(seconds)); box->round(all);)
    console.progress(printed("receiving samples, %.0f of %g s", toSeconds(link::now() - begin), seconds));
  if (console.interrupted()) return interruption();
  trial.seconds = toSeconds(link::now() - begin);
  const auto closing = box->finish(patienceOf(console, kAnswerPatience));
  if (!closing) return troubleOf(closing.error(), console);
  TRY(auto after, ask<messages::Status>(*box, console));
  trial.after = std::move(after);
  const auto& sums = received.tally.now();
  trial.samples = sums.received;
  trial.bytes = received.bytes;
  trial.lost_at_source = sums.lost_at_source;
  trial.lost_in_queue = sums.lost_in_queue;
  trial.lost_on_link = sums.lost_on_link;
  trial.balances = received.tally.exact();
  trial.first = received.first.value_or(SampleIndex{});
  return trial;
}

Outcome<BacklogTrial, Trouble> tryBacklog(const link::Uri& uri, const StreamTrial& stream, Console& console) {
  constexpr milliseconds kLongest{5000};
  Received received;
  TRY(const auto box, openBox(uri, console, kConnectPatience, &received, {.last_boot_id = stream.boot_id}));
  const auto end = stream.first + static_cast<std::int64_t>(stream.samples);
  const auto begin = link::now();
  box->start({.profile = messages::Profile::raw,
              .policy = messages::Policy::record,
              .has_resume = true,
              .resume_from = stream.first});
  for (const auto all = patienceOf(console, kLongest); received.tally.next() < end && box->round(all);)
    console.progress("measuring the link");
  if (console.interrupted()) return interruption();
  return BacklogTrial{.seconds = toSeconds(received.last_at - begin), .bytes = received.bytes};
}

}  // namespace probebox::command
