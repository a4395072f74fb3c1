#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "protocol/state/snapshot.hpp"

// Text that the box sends on a serial line of a control: records and tapes.
namespace probebox::tape {

// How a control reads values from a tape.
enum class Dialect : std::uint8_t {
  g10,    // G10 L2 P..: into its work offsets
  macro,  // #500=..: into its variables
  nv,     // N1 V..: numbered values
};

enum class Ask : std::uint8_t { status, corrections, centreline, delay, all };

struct Form {
  Dialect dialect{};
  std::uint16_t first{500};  // variable or number of the first value
  std::uint8_t offset{0};  // P of G10 L2 for the correction, 0: the external offset; the centreline takes the next one
};

// "X-0.0125 Y+0.0000 Z+0.0000 S1 N42 A3*CS" and a line end: correction in mm, status, sequence, age in 0.1 s; CS: all
// characters before the asterisk by exclusive or, two hexadecimal digits.
std::string record(const published::Snapshot& snapshot);

// Whether the box sends such a line itself: a record, or an answer to a line of input. A line that echoes returns them.
bool isSentByTheBox(std::string_view line);

// Whether the text that is asked for has the correction.
bool hasCorrection(Ask ask);

// A tape between two lines of "%". Without a valid value it has a comment in the place of it: a control that reads it
// keeps what it has.
std::string tape(const published::Snapshot& snapshot, Ask ask, const Form& form);

}  // namespace probebox::tape
