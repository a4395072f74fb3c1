#pragma once
#include <optional>
#include <string>
#include <vector>

#include "protocol/messages/machine.hpp"
#include "protocol/units/outcome.hpp"
#include "tools/plan/set_up.hpp"
#include "tools/plan/wanted.hpp"
#include "tools/probebox/cli/console.hpp"
#include "tools/probebox/cli/json.hpp"
#include "tools/probebox/cli/request.hpp"

namespace probebox::command {

// What a box says of its machine.
struct AskedBox {
  std::string uri;
  messages::DescribeMachine::Answer says;
};

// The machine that a forecast is for.
struct PlannedMachine {
  plan::SetUp set_up;
  std::string name;                // empty: a usual machine
  std::string file;                // machine.toml in the place of the box's; empty: none
  std::string probe_file;          // probe.toml in the place of the box's; empty: none
  std::string unit_file;           // unit.toml with the certificate of the sphere; empty: none
  std::string box;                 // address of the box that was asked; empty: none
  std::string name_in_box;         // of its machine
  std::string probe;               // as box or file name it; empty: a usual one
  std::vector<std::string> told;   // rates and noise that box or files say
  std::vector<std::string> usual;  // assumptions that neither file, box nor option states
  std::vector<std::string> notes;  // sentences about files that contradict each other
  std::string why_refused;         // sentence with which a run would be refused there; empty: none
};

// Takes machine and probe from files (--machine, --unit, --probe), from a box, or both: a file then replaces what the
// box says. Options replace either. Trouble: a file cannot be read.
Outcome<PlannedMachine, Trouble> plannedMachine(const Plan& options, const plan::Wanted& wanted,
                                                const std::optional<AskedBox>& box);

// Forecasts for that machine, as `plan` does.
ExitStatus planFor(const Plan& options, const std::optional<AskedBox>& box, Console& console);

Json describe(const PlannedMachine& machine);
// Says for which machine a forecast is: lines without an end.
std::vector<std::string> inWords(const PlannedMachine& machine);

}  // namespace probebox::command
