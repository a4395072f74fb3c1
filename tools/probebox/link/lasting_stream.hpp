#pragma once
#include <cstdint>
#include <optional>
#include <string>

#include "tools/probebox/link/box.hpp"
#include "tools/probebox/text/sample_tally.hpp"

namespace probebox::command {

// Receives the samples of one box over successive links. When a link breaks (a pulled cable, a box that restarts), it
// reports that, waits for the box at the same place, and resumes after the last sample: the box keeps the last
// seconds and declares what is missing.
class LastingStream : private link::StreamListener {
 public:
  struct Options {
    messages::Policy policy{};
    std::optional<messages::Profile> profile{};  // nothing: the one that suits the link
    milliseconds patience{};                     // how long to wait for a box that has gone
    bool triggers{};                             // also ask for triggers
  };

  // `listener` receives what comes over every link; it and `console` outlive the stream.
  LastingStream(link::Uri uri, const Options& options, link::StreamListener& listener, Console& console);

  // Connects and sends START. Returns why that failed.
  std::optional<Trouble> open();
  // Serves the link, or the search for a new one, for a short while. False at the end: see trouble().
  bool round();

  // Null while there is no link.
  link::Client* box() { return box_.get(); }
  const SampleTally& tally() const { return tally_; }
  // Over all links.
  const link::TriggerAccount& triggers() const { return triggers_; }
  std::uint64_t reconnections() const { return reconnections_; }
  const std::optional<Trouble>& trouble() const { return trouble_; }
  // Why the last link was lost.
  const std::string& loss() const { return loss_; }

 private:
  void onFrame(const frame::Frame& frame) override { listener_.onFrame(frame); }
  bool needsBlocksThatStandAlone() const override { return listener_.needsBlocksThatStandAlone(); }
  void onWelcome(const messages::Welcome& welcome) override;
  void onDescriptor(const messages::Descriptor& descriptor) override { listener_.onDescriptor(descriptor); }
  void onBlock(const link::DecodedBlock& block) override;
  void onGap(const messages::Gap& gap) override;
  void onHole(const messages::Gap& hole) override;
  void onTrigger(const messages::Trigger& trigger) override;
  void onTriggerGap(const messages::TriggerGap& gap) override;
  void onTriggerHole(const messages::TriggerGap& hole) override;
  void onHeartbeat(const messages::Heartbeat& beat, const std::optional<link::Balance>& balance) override;

  std::optional<Trouble> connect(milliseconds limit);
  void start();
  bool startAgain();
  void lose();
  bool search();

  link::Uri uri_;
  Options options_;
  link::StreamListener& listener_;
  Console& console_;
  SampleTally tally_;
  link::TriggerAccount triggers_;
  std::uint32_t next_trigger_{};  // 0: whichever comes next
  std::optional<messages::BootId> boot_id_;
  Box box_;
  std::optional<Trouble> trouble_;
  std::string loss_;
  std::string obstacle_;  // why this user cannot open a box that is back
  MonoTime obstacle_since_{};
  bool obstacle_said_{};
  MonoTime deadline_{};  // of the search
  int refusals_{};
  std::uint64_t reconnections_{};
};

}  // namespace probebox::command
