#pragma once
#include <cstdint>
#include <optional>

#include "protocol/messages/handshake.hpp"
#include "protocol/state/snapshot.hpp"
#include "protocol/units/time.hpp"

namespace probebox::app {

// Facts about probe and machine that the stream descriptor needs and the core does not report.
struct ProbeOnMachine {
  bool switches{};                         // a touch-trigger probe: no channels
  bool head_swivels{};                     // B turns the probe
  std::optional<std::uint32_t> head_tool;  // number of the sensor head, whose sensors take the place of the channels
};

// Keeps the descriptor of the samples: what does not change, with the delay, gain, references and screws of the block
// that comes next.
class SampleDescription {
 public:
  // descriptor: without what is in force.
  SampleDescription(messages::Descriptor descriptor, const ProbeOnMachine& probe);

  // Returns true when the descriptor has changed. A screw that goes on warming up changes it every few seconds at most.
  bool update(const published::DelayInForce& delay, const published::ToolInSamples& tool, MonoTime now);
  const messages::Descriptor& descriptor() const { return descriptor_; }

 private:
  messages::TipDescription tipOf(const published::DelayInForce& delay, const published::ToolInSamples& tool) const;
  bool differs(std::uint64_t delay_result, const messages::TipDescription& tip, MonoTime now) const;

  messages::Descriptor stated_;
  ProbeOnMachine probe_;
  messages::Descriptor descriptor_;
  std::optional<MonoTime> changed_;
};

}  // namespace probebox::app
