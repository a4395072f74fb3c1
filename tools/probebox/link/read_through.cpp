#include "tools/probebox/link/read_through.hpp"

#include "tools/probebox/link/box.hpp"
#include "tools/probebox/text/progress_bar.hpp"

namespace probebox::command {

Outcome<link::RecordingEnd, Trouble> readThrough(const std::string& path, link::StreamListener& listener,
                                                 Console& console, const ReadingOptions& options) {
  const auto draw = [&](std::uint64_t done, std::uint64_t all) { console.progress(progressBar(done, all)); };
  const auto progress = options.shows_progress ? link::ReadingProgress{draw} : link::ReadingProgress{};
  const auto enough = [&] { return console.interrupted() || (options.enough && options.enough()); };
  const auto end = path == "-" ? link::readRecording(console.in(), listener, progress, enough)
                               : link::readRecording(path, listener, progress, enough);
  if (console.interrupted()) return interruption();
  if (!end) return Trouble{ExitStatus::usage, "unreadable-recording", end.error().what};
  return *end;
}

ExitStatus conclude(const Trouble& trouble, Console& console) {
  return trouble.status == ExitStatus::interrupted ? trouble.status : console.fail(trouble);
}

void RecordingSums::onWelcome(const messages::Welcome& welcome) {
  const auto restarts = joined_.restarts();
  follows_end_ = !open_;
  joined_.link(welcome.boot_id);
  if (joined_.restarts() == restarts) return;
  ends_unknown += open_;
  open_ = false;
}

// Samples between two recordings that both have their ends were not asked for; those that the next has again are there
// twice. A link that resumes a stream may repeat some.
template <class Tell>
void RecordingSums::follow(std::uint64_t count, Tell tell) {
  const auto before = joined_.now();
  tell();
  const auto after = joined_.now();
  if (open_) missing_between += after.unexplained - before.unexplained;
  if (follows_end_) repeated += count - (after.accounted() - before.accounted());
  open_ = true;
}

void RecordingSums::onBlock(const link::DecodedBlock& block) {
  received += block.header.count;
  follow(block.header.count, [&] { joined_.block(block.header.first, block.header.count); });
}

void RecordingSums::onGap(const messages::Gap& gap) {
  declared_lost += gap.count;
  follow(gap.count, [&] { joined_.gap(gap); });
}

void RecordingSums::onHole(const messages::Gap& hole) {
  lost_on_link += hole.count;
  follow(hole.count, [&] { joined_.hole(hole); });
}

void RecordingSums::onHeartbeat(const messages::Heartbeat& beat, const std::optional<link::Balance>& balance) {
  if (!balance) return;
  ++heartbeats;
  inexact += !balance->exact;
  const auto before = joined_.now().lost_on_link;
  joined_.heartbeat(beat, balance);
  lost_on_link += joined_.now().lost_on_link - before;
  open_ = beat.streaming;
}

std::vector<std::string> faultsOf(const RecordingSums& sums, const link::RecordingEnd& end) {
  std::vector<std::string> faults;
  const auto say = [&](std::uint64_t count, const std::string& what, const std::string& of_one,
                       const std::string& of_many, const std::string& more = {}) {
    if (count > 0)
      faults.push_back(std::to_string(count) + " " + what + (count == 1 ? " " : "s ") +
                       (count == 1 ? of_one : of_many) + more);
  };
  say(end.frames.bad(), "frame", "is damaged", "are damaged");
  say(end.frames_missing, "frame", "is missing", "are missing",
      ", with " + std::to_string(sums.lost_on_link) + (sums.lost_on_link == 1 ? " sample" : " samples"));
  say(end.frames_missing == 0 ? sums.lost_on_link : 0, "sample", "is missing", "are missing",
      " with frames that have no number, such as before a beginning that is cut off");
  say(end.faults.malformed, "frame", "is", "are", " without a message of the type that is stated");
  say(end.faults.other_major, "frame", "is", "are", " of another protocol version");
  say(end.faults.baseless, "short frame", "refers to", "refer to", " a whole one that is missing");
  say(end.faults.keyless_blocks, "block", "continues", "continue",
      " one that is missing: in profile tight none can be decoded from there to the next key block");
  say(end.faults.unreadable_blocks, "block", "cannot be read", "cannot be read",
      ": the descriptor is missing or the coding unknown");
  say(end.unexplained, "sample", "is", "are", " missing and not declared lost");
  say(sums.missing_between, "sample", "is missing", "are missing",
      " between two links, of which the first has no closing ledger");
  say(sums.ends_unknown, "stream", "has no end", "have no end",
      ": the box was restarted, and what it produced before is unknown");
  say(sums.inexact, "heartbeat", "does", "do", " not balance: received + declared lost differs from produced");
  if (!end.triggers_exact) faults.emplace_back("the numbers of its triggers do not agree with its heartbeats");
  if (end.cut_bytes > 0) {
    faults.push_back("it is cut in the middle of a frame, which begins at byte " +
                     std::to_string(end.bytes - end.cut_bytes) + " of " + std::to_string(end.bytes));
  }
  if (!end.closed) {
    faults.push_back("it ends before its stream did: the samples from sample " + std::to_string(end.next.index) +
                     " on are unknown");
  }
  return faults;
}

ExitStatus tellFaults(const std::string& input, const std::string& rest, const RecordingSums& sums,
                      const link::RecordingEnd& end, Console& console) {
  const auto faults = faultsOf(sums, end);
  if (faults.empty()) return ExitStatus::ok;
  std::string what = input + " is not whole, and " + rest;
  for (const auto& fault : faults) what += "; " + fault;
  return console.fail({ExitStatus::failed, "damaged-recording", what});
}

}  // namespace probebox::command
