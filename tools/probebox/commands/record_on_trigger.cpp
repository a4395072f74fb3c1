#include <cmath>

#include "protocol/frame/frame.hpp"
#include "tools/link/trigger_window.hpp"
#include "tools/probebox/commands/recorder.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/link/lasting_stream.hpp"
#include "tools/probebox/link/read_through.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

std::uint64_t inWholeMilliseconds(double seconds) {
  return static_cast<std::uint64_t>(std::llround(seconds * 1e3));
}

// The history of a stream and what follows its first trigger, written and counted as a reader of the file will see it.
class Window : public link::StreamListener {
 public:
  Window(const Record& options, Console& console)
      : recorder_{options, console.out()},
        window_{{inWholeMilliseconds(options.before_s), inWholeMilliseconds(options.after_s)},
                [this](const frame::Frame& frame) { write(frame); }} {}

  void onFrame(const frame::Frame& frame) override { window_.frame(frame); }
  bool needsBlocksThatStandAlone() const override { return true; }

  // The recording is complete, or cannot be written.
  bool over() const { return window_.done() || recorder_.failure(); }
  const link::TriggerWindow& window() const { return window_; }
  Recorder& recorder() { return recorder_; }
  const RecordedTally& tally() const { return tally_; }

 private:
  void write(const frame::Frame& frame) {
    recorder_.onFrame(frame);
    scratch_.resize(frame::bareSize(frame.payload.size()));
    coded_.resize(frame::delimitedMaxSize(frame.payload.size()));
    const auto size = frame::encodeDelimited(frame.header, frame.payload, scratch_, coded_);
    reader_.read(std::span{coded_}.first(size));
  }

  Recorder recorder_;
  RecordedTally tally_;
  link::StreamReader reader_{tally_};
  std::vector<std::byte> scratch_, coded_;
  link::TriggerWindow window_;
};

ExitStatus conclude(const Record& options, Window& window, double seconds, Console& console) {
  auto& recorder = window.recorder();
  recorder.flush();
  if (recorder.failure()) return console.fail({ExitStatus::usage, "not-written", *recorder.failure()});
  if (!window.window().trigger()) {
    if (console.interrupted()) return ExitStatus::interrupted;
    return console.fail({ExitStatus::failed, "no-trigger", "no trigger came, so nothing was written"});
  }
  const auto& [samples, triggers] =
      std::pair<const SampleTally&, const link::TriggerAccount&>{window.tally().samples, window.tally().triggers};
  tellRecorded(options, {samples, triggers, samples.reconnections(), recorder.bytes(), seconds, window.window().done()},
               console);
  if (console.interrupted()) return ExitStatus::interrupted;
  return window.window().done() && samples.exact() ? ExitStatus::ok : ExitStatus::failed;
}

ExitStatus fromRecording(const Record& options, const std::string& path, Console& console) {
  const auto begin = link::now();
  Window window{options, console};
  const auto end =
      readThrough(path, window, console, {.shows_progress = path != "-", .enough = [&] { return window.over(); }});
  if (!end && !console.interrupted()) return console.fail(end.error());
  return conclude(options, window, toSeconds(link::now() - begin), console);
}

ExitStatus fromBox(const Record& options, const link::Uri& uri, Console& console) {
  const auto begin = link::now();
  const auto seconds = [&] { return toSeconds(link::now() - begin); };
  Window window{options, console};
  LastingStream stream{uri,
                       {.policy = options.live ? messages::Policy::live : messages::Policy::record,
                        .profile = options.profile,
                        .patience = inMilliseconds(options.patience_s),
                        .triggers = true},
                       window,
                       console};
  if (const auto trouble = stream.open()) return console.fail(*trouble);
  while (!window.over() && !console.interrupted() && !(options.seconds && seconds() >= *options.seconds)) {
    if (!stream.round()) {
      // Without a trigger there is no recording to speak of: what ended the link is all there is to say.
      if (window.window().trigger()) conclude(options, window, seconds(), console);
      return console.interrupted() ? ExitStatus::interrupted : console.fail(*stream.trouble());
    }
    const auto& trigger = window.window().trigger();
    console.progress(trigger ? "recording " + options.output + "  trigger " + std::to_string(*trigger)
                             : printed("waiting for a trigger  %.1f s", seconds()));
  }
  return conclude(options, window, seconds(), console);
}

}  // namespace

ExitStatus recordOnTrigger(const Record& options, const link::Uri& uri, Console& console) {
  const auto* file = std::get_if<link::FileAddress>(&uri.address);
  return file != nullptr ? fromRecording(options, file->path, console) : fromBox(options, uri, console);
}

}  // namespace probebox::command
