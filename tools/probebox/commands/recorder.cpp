#include "tools/probebox/commands/recorder.hpp"

#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

Json summary(const Record& options, const Done& done) {
  const auto& sums = done.tally.atHeartbeat();
  return {{"recording", options.output},
          {"produced_samples", sums.produced},
          {"received_samples", sums.received},
          {"declared_lost_samples", sums.declaredLost()},
          {"lost_at_source_samples", sums.lost_at_source},
          {"lost_in_queue_samples", sums.lost_in_queue},
          {"lost_on_link_samples", sums.lost_on_link},
          {"balanced", done.tally.exact()},
          {"end_known", done.closed},
          {"next_sample", done.tally.next().index},
          {"received_triggers", done.triggers.received},
          {"declared_lost_triggers", done.triggers.declared_lost},
          {"lost_on_link_triggers", done.triggers.inferred_lost},
          {"reconnections", done.reconnections},
          {"box_restarts", done.tally.restarts()},
          {"size_bytes", done.bytes},
          {"duration_s", done.seconds}};
}

std::string equation(const Done& done) {
  const auto& tally = done.tally;
  const auto& sums = tally.atHeartbeat();
  std::string text = "produced " + std::to_string(sums.produced) + " = received " + std::to_string(sums.received) +
                     " + declared lost " + std::to_string(sums.declaredLost());
  if (sums.lost_on_link > 0) text += " + lost on the link " + std::to_string(sums.lost_on_link);
  const bool only_restarted = tally.restarts() > 0 && sums.unexplained == 0;
  text += tally.exact() ? "   (exact, in samples)" : only_restarted ? "" : "   DOES NOT BALANCE (in samples)";
  if (sums.declaredLost() > 0) {
    text += "\n  declared lost: " + std::to_string(sums.lost_at_source) + " at the source, " +
            std::to_string(sums.lost_in_queue) + " in the box's queue";
  }
  if (done.triggers.total() > 0) {
    text += "\n  triggers: " + std::to_string(done.triggers.received) + " received, " +
            std::to_string(done.triggers.declared_lost + done.triggers.inferred_lost) + " lost";
  }
  if (tally.restarts() > 0)
    text +=
        "\n  the box was restarted: how many samples it produced just before is unknown, so the balance cannot be "
        "checked";
  if (!done.closed) text += "\n  as of the last heartbeat: the end of the stream is unknown";
  return text;
}

}  // namespace

void tellRecorded(const Record& options, const Done& done, Console& console) {
  if (console.json()) {
    console.object(summary(options, done));
  } else {
    console.line(equation(done));
  }
}

}  // namespace probebox::command
