#pragma once
#include <optional>
#include <string>
#include <vector>

#include "tools/probebox/tables/mcap_file.hpp"
#include "tools/probebox/tables/row_writer.hpp"
#include "tools/probebox/tables/scale.hpp"

namespace probebox::command {

// Writes a recording as MCAP, for Foxglove and PlotJuggler. Topics: /probebox/samples (one message per sample, channels
// as float64 in their units), /probebox/gaps (missing samples, with the reason), /probebox/triggers, /probebox/delay
// (in force from there on), and /probebox/points (samples whose tip is known) if they are wanted. Times: ns, monotonic
// since the boot of the box. The metadata "probebox" names the box.
class McapRows : public RowWriter {
 public:
  McapRows(const TableJob& job, std::ostream& standard) : job_{job}, standard_{standard} {}

  void begin(const messages::Descriptor& descriptor) override;
  void enter(const messages::Descriptor& descriptor) override;
  void row(const link::DecodedBlock& block, std::size_t k, SampleIndex sample) override;
  void missing(SampleIndex first, std::uint64_t count, std::string_view reason) override;
  void trigger(const messages::Trigger& trigger) override;
  bool holdsTriggers() const override { return true; }
  void end() override;
  const std::optional<std::string>& failure() const override { return failure_; }

 private:
  void declare(const messages::Descriptor& descriptor);
  void tellDelay(const messages::DelayInForce& delay, std::uint64_t time_ns);
  void tellPoint(const link::DecodedBlock& block, std::size_t k, SampleIndex sample);
  void put(McapFile::Id channel, std::uint64_t time_ns, const CdrMessage& message);

  const TableJob& job_;
  std::ostream& standard_;
  std::optional<Output> output_;
  std::optional<McapFile> file_;
  std::optional<std::string> failure_;
  std::vector<Scale> scales_;
  std::optional<std::uint64_t> delay_told_;  // number of the result
  McapFile::Id samples_{}, gaps_{}, triggers_{}, delays_{}, points_{};
  std::uint64_t newest_ns_{};
};

}  // namespace probebox::command
