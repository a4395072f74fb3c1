#pragma once
#include <cstdint>
#include <string>

#include "firmware/metrology/dataset/result.hpp"

namespace probebox::campaign {

// A result that was measured elsewhere: a delay, the reading of a cold screw's sensor (which is off, and moves what is
// served), or the errors of a table.
struct Proposal {
  std::string subject;
  metrology::Result result;
};
inline constexpr std::uint64_t kProposals = 120;

Proposal proposalOf(std::uint64_t number);

}  // namespace probebox::campaign
