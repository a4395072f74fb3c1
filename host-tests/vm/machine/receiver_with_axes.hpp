#pragma once
#include <memory>

#include "played_machine.hpp"
#include "played_receiver.hpp"
#include "receiver_gadget.hpp"

namespace probebox::vm {

// Probe and encoders on one front end: a receiver on USB that samples both at the same instants.
class ReceiverWithAxes : public PlayedSensors {
 public:
  static constexpr double kRateHz = 1973;

  ReceiverWithAxes(const world::Config& config, const world::Machine& machine);

  void play(const world::Machine& machine) override;
  const Truth& truth() const { return truth_; }
  ReceiverGadget& gadget() { return gadget_; }

 private:
  Truth truth_;
  ReceiverGadget gadget_;
  std::unique_ptr<PlayedReceiver> device_;
};

}  // namespace probebox::vm
