#pragma once
#include <cstdint>
#include <deque>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "protocol/units/outcome.hpp"
#include "tools/link/stream_reader.hpp"
#include "tools/replay/recording.hpp"

namespace probebox::replay {

// Reads a recording piece by piece on demand. Samples come in rising order, each once: repeats of a resumed link are
// omitted, and reading ends at a restart of the box, where indices begin anew.
class RecordedStream : public Recording, private link::StreamListener {
 public:
  // Fails when the file cannot be read or has no descriptor at its beginning.
  static Outcome<std::unique_ptr<RecordedStream>> open(const std::string& path);

  std::optional<Recorded> next() override;
  const messages::Descriptor& firstDescriptor() const override { return *first_; }

 private:
  explicit RecordedStream(std::ifstream file) : file_{std::move(file)}, reader_{*this} {}

  void onWelcome(const messages::Welcome& welcome) override;
  void onDescriptor(const messages::Descriptor& descriptor) override;
  void onBlock(const link::DecodedBlock& block) override;
  void onGap(const messages::Gap& gap) override;
  void onHole(const messages::Gap& hole) override { onGap(hole); }
  void onTrigger(const messages::Trigger& trigger) override;
  void onTriggerGap(const messages::TriggerGap& gap) override;
  void onTriggerHole(const messages::TriggerGap& hole) override { onTriggerGap(hole); }
  bool readMore();

  std::ifstream file_;
  link::StreamReader reader_;
  std::deque<Recorded> waiting_;
  std::optional<messages::Descriptor> first_;
  std::optional<messages::BootId> boot_id_;
  std::vector<std::byte> described_;  // as encoded: repeated ones are left out
  std::optional<SampleIndex> next_;
  bool over_{};
};

}  // namespace probebox::replay
