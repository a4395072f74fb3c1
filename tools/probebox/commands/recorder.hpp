#pragma once
#include <cstdint>
#include <optional>
#include <string>

#include "tools/link/recording.hpp"
#include "tools/link/uri.hpp"
#include "tools/probebox/cli/console.hpp"
#include "tools/probebox/cli/output.hpp"
#include "tools/probebox/cli/request.hpp"
#include "tools/probebox/text/sample_tally.hpp"

namespace probebox::command {

// Writes received frames to a file. The first frame opens it, so a box that does not answer leaves no empty file.
class Recorder : public link::StreamListener {
 public:
  // Options and stream must outlive the recorder.
  Recorder(const Record& options, std::ostream& standard) : options_{options}, standard_{standard} {}

  void onFrame(const frame::Frame& frame) override {
    if (!output_ && !failure_) open();
    if (writer_ && !failure_ && !writer_->write(frame)) failure_ = output_->failure();
  }
  // Profile tight is for the line; in a file it is where it was asked for by name: readers elsewhere know it less.
  bool needsBlocksThatStandAlone() const override { return !options_.profile; }
  void onHeartbeat(const messages::Heartbeat&, const std::optional<link::Balance>&) override { flush(); }

  // Flushes the received frames, so that they survive a kill of this process.
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

// Counts what became of the samples and triggers of a recording.
struct RecordedTally : link::StreamListener {
  void onWelcome(const messages::Welcome& welcome) override { samples.link(welcome.boot_id); }
  void onBlock(const link::DecodedBlock& block) override { samples.block(block.header.first, block.header.count); }
  void onGap(const messages::Gap& gap) override { samples.gap(gap); }
  void onHole(const messages::Gap& hole) override { samples.hole(hole); }
  void onTrigger(const messages::Trigger&) override { ++triggers.received; }
  void onTriggerGap(const messages::TriggerGap& gap) override { triggers.declared_lost += gap.count; }
  void onTriggerHole(const messages::TriggerGap& hole) override { triggers.inferred_lost += hole.count; }
  void onHeartbeat(const messages::Heartbeat& beat, const std::optional<link::Balance>& balance) override {
    samples.heartbeat(beat, balance);
  }

  SampleTally samples;
  link::TriggerAccount triggers;
};

// Holds the totals of a recording.
struct Done {
  const SampleTally& tally;
  const link::TriggerAccount& triggers;
  std::uint64_t reconnections{};
  std::uint64_t bytes{};
  double seconds{};
  bool closed{};  // the box itself said where the stream ended
};

// Prints the account of a recording: an equation for people, a JSON object for programs.
void tellRecorded(const Record& options, const Done& done, Console& console);

// Waits for a trigger and writes what came before and comes after it.
ExitStatus recordOnTrigger(const Record& options, const link::Uri& uri, Console& console);

}  // namespace probebox::command
