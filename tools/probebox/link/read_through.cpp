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

}  // namespace probebox::command
