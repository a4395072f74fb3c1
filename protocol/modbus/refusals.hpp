#pragma once
#include <cstdint>
#include <span>
#include <string_view>

// Numbers of refusals, for controllers that have no screen for a sentence.
namespace probebox::modbus {

struct RefusalCode {
  std::uint16_t code{};
  std::string_view text;
};

// Codes of refusals that come from no solver. Those up to kOfErrors are the error codes of MESSAGES.md.
namespace refusal {
enum : std::uint16_t {
  none = 0,
  of_step = 20,           // plus the fault of the step
  step_never_ended = 60,  // its end marker did not come
  not_in_list = 99,       // a solver's refusal that has no number yet
  of_solver = 100,        // plus the place of its name in the list
};
}  // namespace refusal

// All codes, rising.
std::span<const RefusalCode> refusalCodes();

// Code of a solver's refusal by its stable name ("single-speed").
std::uint16_t codeOfRefusal(std::string_view name);

}  // namespace probebox::modbus
