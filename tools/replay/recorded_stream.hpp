#pragma once
#include <cstdint>
#include <deque>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "protocol/units/outcome.hpp"
#include "tools/link/recording.hpp"
#include "tools/link/stream_reader.hpp"
#include "tools/replay/recording.hpp"

namespace probebox::replay {

// Reads a recording piece by piece on demand. Samples come in rising order, each once: repeats of a resumed link are
// omitted, and reading ends at a restart of the box, where indices begin anew.
class RecordedStream : public Recording, private link::StreamListener {
 public:
  // Fails when the file cannot be read or has no descriptor at its beginning. `listener` hears all of the recording,
  // repeats too, and outlives the stream.
  static Outcome<std::unique_ptr<RecordedStream>> open(const std::string& path,
                                                       link::StreamListener* listener = nullptr);

  std::optional<Recorded> next() override;
  const messages::Descriptor& firstDescriptor() const override { return *first_; }
  // Reads the rest of the file.
  link::RecordingEnd end();

 private:
  RecordedStream(std::ifstream file, link::StreamListener* listener)
      : file_{std::move(file)}, listener_{listener != nullptr ? *listener : nobody_}, reader_{*this} {}

  void onWelcome(const messages::Welcome& welcome) override;
  void onDescriptor(const messages::Descriptor& descriptor) override;
  void onBlock(const link::DecodedBlock& block) override;
  void onGap(const messages::Gap& gap) override;
  void onHole(const messages::Gap& hole) override;
  void onTrigger(const messages::Trigger& trigger) override;
  void onTriggerGap(const messages::TriggerGap& gap) override;
  void onTriggerHole(const messages::TriggerGap& hole) override;
  void onHeartbeat(const messages::Heartbeat& beat, const std::optional<link::Balance>& balance) override;
  void add(const messages::Gap& gap);
  void add(const messages::TriggerGap& gap);
  bool readMore();

  std::ifstream file_;
  link::StreamListener nobody_;
  link::StreamListener& listener_;
  link::StreamReader reader_;
  std::uint64_t bytes_{};
  std::deque<Recorded> waiting_;
  std::optional<messages::Descriptor> first_;
  std::optional<messages::BootId> boot_id_;
  std::vector<std::byte> described_;  // as encoded: repeated ones are left out
  std::optional<SampleIndex> next_;
  bool over_{};
};

}  // namespace probebox::replay
