#include <optional>

#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/commands/recorder.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/link/lasting_stream.hpp"
#include "tools/probebox/link/read_through.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

constexpr milliseconds kClosingPatience{3000};

// One recording, over as many links as it takes.
class Session {
 public:
  Session(const Record& options, link::Uri uri, Console& console)
      : options_{options},
        console_{console},
        recorder_{options, console.out()},
        stream_{std::move(uri),
                {.policy = options.live ? messages::Policy::live : messages::Policy::record,
                 .profile = options.profile,
                 .patience = inMilliseconds(options.patience_s),
                 .triggers = true},
                recorder_,
                console},
        begin_{link::now()} {}

  ExitStatus run() {
    if (const auto trouble = stream_.open()) return console_.fail(*trouble);
    while (!finished()) {
      if (!stream_.round()) return giveUp();
      drawProgress();
    }
    return stream_.box() != nullptr ? close() : giveUp();
  }

 private:
  bool finished() const {
    const bool time_is_over = options_.seconds && seconds() >= *options_.seconds;
    return time_is_over || console_.interrupted() || recorder_.failure();
  }

  ExitStatus close() {
    const auto finished = stream_.box()->finish(link::patience(kClosingPatience));
    recorder_.flush();
    if (recorder_.failure()) return console_.fail({ExitStatus::usage, "not-written", *recorder_.failure()});
    if (!finished) {
      report(false);
      return console_.interrupted() ? ExitStatus::interrupted : console_.fail(troubleOf(finished.error(), console_));
    }
    report(true);
    if (stream_.tally().now().accounted() == 0)
      console_.note("no sample came; probebox status says whether a source is silent");
    if (console_.interrupted()) return ExitStatus::interrupted;
    return stream_.tally().exact() ? ExitStatus::ok : ExitStatus::failed;
  }

  ExitStatus giveUp() {
    recorder_.flush();
    report(false);
    if (console_.interrupted()) return ExitStatus::interrupted;
    if (recorder_.failure()) return console_.fail({ExitStatus::usage, "not-written", *recorder_.failure()});
    return console_.fail(stream_.trouble().value_or(awayAtTheEnd()));
  }

  // The time was over before the box came back.
  Trouble awayAtTheEnd() const {
    return {ExitStatus::no_box, "link-lost",
            "the link was lost, and the box did not come back in time; the samples from sample " +
                std::to_string(stream_.tally().next().index) + " on are unknown"};
  }

  // closed: the box itself said where the stream ended.
  void report(bool closed) {
    tellRecorded(options_,
                 {stream_.tally(), stream_.triggers(), stream_.reconnections(), recorder_.bytes(), seconds(), closed},
                 console_);
  }

  void drawProgress() {
    if (const auto now = link::now(); now - last_drawn_ >= milliseconds{200}) {
      last_drawn_ = now;
      const auto& sums = stream_.tally().now();
      const std::string limit = options_.seconds ? printed(" of %g", *options_.seconds) : "";
      console_.progress(printed("recording %s  %.1f%s s  %llu samples  %llu lost  %.2f MB", options_.output.c_str(),
                                seconds(), limit.c_str(), static_cast<unsigned long long>(sums.received),
                                static_cast<unsigned long long>(sums.declaredLost() + sums.lost_on_link),
                                static_cast<double>(recorder_.bytes()) * 1e-6));
    }
  }

  double seconds() const { return toSeconds(link::now() - begin_); }

  const Record& options_;
  Console& console_;
  Recorder recorder_;
  LastingStream stream_;
  MonoTime begin_;
  MonoTime last_drawn_{};
};

// The good frames of a recording once more: what was damaged or cut is left out, and accounted for.
class Copy : private RecordedTally {
 public:
  Copy(const Record& options, Console& console)
      : options_{options}, console_{console}, recorder_{options, console.out()} {}

  ExitStatus run(const std::string& path) {
    const auto begin = link::now();
    const auto full = [this] { return recorder_.failure().has_value(); };
    const auto end = readThrough(path, *this, console_, {.shows_progress = path != "-", .enough = full});
    recorder_.flush();
    const bool interrupted = console_.interrupted();
    if (!end && !interrupted) return console_.fail(end.error());
    if (recorder_.failure()) return console_.fail({ExitStatus::usage, "not-written", *recorder_.failure()});
    const bool closed = end && end->closed;
    tellRecorded(
        options_,
        {samples, triggers, samples.reconnections(), recorder_.bytes(), toSeconds(link::now() - begin), closed},
        console_);
    if (interrupted) return ExitStatus::interrupted;
    return samples.exact() ? ExitStatus::ok : ExitStatus::failed;
  }

 private:
  void onFrame(const frame::Frame& frame) override { recorder_.onFrame(frame); }

  const Record& options_;
  Console& console_;
  Recorder recorder_;
};

std::optional<Trouble> objectionTo(const Record& options, const link::Uri& uri, const Console& console) {
  if (uri.isFile() && options.seconds) return usage("--for is for a box; a recording is read to its end");
  if (uri.isFile() && !options.for_box.empty())
    return usage(options.for_box + " is for a box; the frames of a recording are copied as they are");
  const auto* file = std::get_if<link::FileAddress>(&uri.address);
  if (file != nullptr && Output::isSameFile(options.output, file->path))
    return usage(options.output + " is the recording itself; name another file");
  if (options.output == "-" && console.outIsTerminal()) {
    return usage("a recording is not for a terminal; name a file, or send the standard output into a pipe");
  }
  if (const auto objection = Output::objectionTo(options.output, options.force)) return usage(*objection);
  return std::nullopt;
}

}  // namespace

ExitStatus run(const Record& options, const std::string& given, Console& console) {
  if (options.output == "-") console.keepOutputForData();
  const auto uri = chooseUri(given);
  if (!uri) return console.fail(uri.error());
  if (const auto objection = objectionTo(options, *uri, console)) return console.fail(*objection);
  if (options.on_trigger) return recordOnTrigger(options, *uri, console);
  if (const auto* file = std::get_if<link::FileAddress>(&uri->address)) return Copy{options, console}.run(file->path);
  return Session{options, *uri, console}.run();
}

}  // namespace probebox::command
