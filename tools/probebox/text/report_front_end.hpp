#pragma once
#include <string>
#include <vector>

#include "protocol/messages/status.hpp"

// What is checked of a probe receiver on USB: by selftest on a machine, by factory-test before a box is shipped.
namespace probebox::command {

struct MeasuredCheck {
  enum class Verdict { passed, failed, not_told };
  std::string name;  // "converter-noise"
  std::string title;
  std::string measured;
  std::string limit;
  Verdict verdict{};
  std::string remedy;  // of what did not pass
};

// Serial number, packets and program, for a person.
std::string identityOf(const messages::FrontEndStatus& front_end);

// Empty while no receiver is connected.
std::vector<MeasuredCheck> receiverChecks(const messages::Status::Answer& status);

}  // namespace probebox::command
