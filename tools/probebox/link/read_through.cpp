#include "tools/probebox/link/read_through.hpp"

#include "tools/probebox/link/box.hpp"
#include "tools/probebox/text/progress_bar.hpp"

namespace probebox::command {

Outcome<link::RecordingEnd, Trouble> readThrough(const std::string& path, link::StreamListener& listener,
                                                 Console& console, const ReadingWishes& wishes) {
  const auto draw = [&](std::uint64_t done, std::uint64_t all) { console.progress(progressBar(done, all)); };
  const auto progress = wishes.shows_progress ? link::ReadingProgress{draw} : link::ReadingProgress{};
  const auto enough = [&] { return console.interrupted() || (wishes.enough && wishes.enough()); };
  const auto end = path == "-" ? link::readRecording(console.in(), listener, progress, enough)
                               : link::readRecording(path, listener, progress, enough);
  if (console.interrupted()) return interruption();
  if (!end) return Trouble{ExitStatus::usage, "unreadable-recording", end.error().what};
  return *end;
}

ExitStatus conclude(const Trouble& trouble, Console& console) {
  return trouble.status == ExitStatus::interrupted ? trouble.status : console.fail(trouble);
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
  say(end.faults.malformed, "frame", "is", "are", " without a message of the type that is stated");
  say(end.faults.other_major, "frame", "is", "are", " of another protocol version");
  say(end.faults.unreadable_blocks, "block", "cannot be read", "cannot be read",
      ": the descriptor is missing or the coding unknown");
  say(end.unexplained, "sample", "is", "are", " missing and not declared lost");
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

}  // namespace probebox::command
