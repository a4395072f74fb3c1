#include <filesystem>
#include <optional>

#include "tools/link/recording.hpp"
#include "tools/probebox/cli/output.hpp"
#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/link/lasting_stream.hpp"
#include "tools/probebox/link/read_through.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

constexpr milliseconds kClosingPatience{3000};

// Writes what comes. The file is opened by the first frame: a box that does not answer leaves none.
class Recorder : public link::StreamListener {
 public:
  Recorder(const Record& options, std::ostream& standard) : options_{options}, standard_{standard} {}

  void onFrame(const frame::Frame& frame) override {
    if (!output_ && !failure_) open();
    if (writer_ && !failure_ && !writer_->write(frame)) failure_ = output_->failure();
  }
  void onHeartbeat(const messages::Heartbeat&, const std::optional<link::Balance>&) override { flush(); }

  // What was heard until now is in the file, whatever happens to this process.
  void flush() {
    if (output_ && !failure_ && !output_->flush()) failure_ = output_->failure();
  }

  const std::optional<std::string>& failure() const { return failure_; }
  std::uint64_t bytes() const { return writer_ ? writer_->bytes() : 0; }

 private:
  void open() {
    auto output = Output::open(options_.output, options_.force, standard_, Output::Appears::as_it_grows);
    if (!output) {
      failure_ = output.error().what;
      return;
    }
    output_.emplace(std::move(output).value());
    writer_.emplace(output_->stream());
  }

  const Record& options_;
  std::ostream& standard_;
  std::optional<Output> output_;
  std::optional<link::RecordingWriter> writer_;
  std::optional<std::string> failure_;
};

// What a recording has come to.
struct Done {
  const SampleTally& tally;
  const link::TriggerAccount& triggers;
  std::uint64_t reconnections{};
  std::uint64_t bytes{};
  double seconds{};
  bool closed{};  // the box itself said where the stream ended
};

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

void tell(const Record& options, const Done& done, Console& console) {
  if (console.json()) {
    console.object(summary(options, done));
  } else {
    console.line(equation(done));
  }
}

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
    tell(options_, {stream_.tally(), stream_.triggers(), stream_.reconnections(), recorder_.bytes(), seconds(), closed},
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
class Copy : private link::StreamListener {
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
    tell(options_,
         {tally_, triggers_, tally_.reconnections(), recorder_.bytes(), toSeconds(link::now() - begin), closed},
         console_);
    if (interrupted) return ExitStatus::interrupted;
    return tally_.exact() ? ExitStatus::ok : ExitStatus::failed;
  }

 private:
  void onFrame(const frame::Frame& frame) override { recorder_.onFrame(frame); }
  void onWelcome(const messages::Welcome& welcome) override { tally_.link(welcome.boot_id); }
  void onBlock(const link::DecodedBlock& block) override { tally_.block(block.header.first, block.header.count); }
  void onGap(const messages::Gap& gap) override { tally_.gap(gap); }
  void onHole(const messages::Gap& hole) override { tally_.hole(hole); }
  void onTrigger(const messages::Trigger&) override { ++triggers_.received; }
  void onTriggerGap(const messages::TriggerGap& gap) override { triggers_.declared_lost += gap.count; }
  void onTriggerHole(const messages::TriggerGap& hole) override { triggers_.inferred_lost += hole.count; }
  void onHeartbeat(const messages::Heartbeat& beat, const std::optional<link::Balance>& balance) override {
    tally_.heartbeat(beat, balance);
  }

  const Record& options_;
  Console& console_;
  Recorder recorder_;
  SampleTally tally_;
  link::TriggerAccount triggers_;
};

std::optional<Trouble> objectionTo(const Record& options, const link::Uri& uri, const Console& console) {
  if (uri.isFile() && options.seconds) return usage("--for is for a box; a recording is read to its end");
  std::error_code different;
  const auto* file = std::get_if<link::FileAddress>(&uri.address);
  if (file != nullptr && std::filesystem::equivalent(file->path, options.output, different))
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
  if (const auto* file = std::get_if<link::FileAddress>(&uri->address)) return Copy{options, console}.run(file->path);
  return Session{options, *uri, console}.run();
}

}  // namespace probebox::command
