#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "protocol/messages/status.hpp"
#include "protocol/messages/unit.hpp"
#include "tools/probebox/text/report_front_end.hpp"

// What a vendor's fixture, or a hand, moves and drives while a box is tested: its lines, encoders and controller; and
// what a box must not be shipped with.
namespace probebox::command {

// An axis while samples were received.
struct AxisMotion {
  std::string channel;  // "position_x"
  double least_mm{}, most_mm{};
};

// Every line of box.toml but sync, by the edges between two statuses.
std::vector<MeasuredCheck> lineChecks(const messages::Status::Answer& before, const messages::Status::Answer& after);
// Every linear axis; index_pulses: samples with one, of any axis.
std::vector<MeasuredCheck> encoderChecks(const std::vector<AxisMotion>& axes, std::uint64_t index_pulses);
// Every line and port of a controller, by the requests between two statuses.
std::vector<MeasuredCheck> controllerChecks(const messages::Status::Answer& before,
                                            const messages::Status::Answer& after);
// Numbers on USB are the vendor's own, and updates are taken from the vendor's key alone.
MeasuredCheck usbNumbersCheck(const messages::DescribeUnit::Answer& unit);
MeasuredCheck updateKeyCheck(const messages::DescribeUnit::Answer& unit);
// Results are dated.
MeasuredCheck timeSourceCheck(const messages::Status::Answer& status);

}  // namespace probebox::command
