#pragma once
#include <array>
#include <cstdint>
#include <string_view>

#include "protocol/step/step.hpp"
#include "protocol/units/time.hpp"

// Declares numbers that host and box share. They are frozen: append only; never change or reuse one.
namespace probebox::messages {

inline constexpr std::uint8_t kProtocolMajor = 1;
inline constexpr std::uint16_t kProtocolMinor = 0;

// Identifies the type of a frame. The ids of HELLO and DESCRIPTOR stay the same in every major version.
enum class MessageType : std::uint8_t {
  hello = 0x01,
  welcome = 0x02,
  descriptor = 0x03,
  test_pattern = 0x04,
  start = 0x05,
  stop = 0x06,
  credit = 0x07,
  samples = 0x08,
  gap = 0x09,
  heartbeat = 0x0A,
  request = 0x0B,
  answer = 0x0C,
  refusal = 0x0D,
  trigger = 0x0E,
  trigger_gap = 0x0F,
  heartbeat_change = 0x10,
  short_samples = 0x11,
  samples_head = 0x12,
};

// Names the reason why a request was refused.
enum class ErrorCode : std::uint16_t {
  ok = 0,
  malformed = 1,
  unknown_operation = 2,
  not_permitted = 3,
  busy = 4,
  not_found = 5,
  refused = 6,
  wrong_state = 7,
  too_large = 8,
  version_mismatch = 9,
  differs = 10,
};

enum class Operation : std::uint16_t {
  status = 1,
  post_marker = 2,
  start_procedure = 3,
  procedure_status = 4,
  abort_procedure = 5,
  list_results = 6,
  accept_result = 7,
  corrections = 8,
  get_dataset = 9,
  rollback_result = 10,
  result_history = 11,
  set_inhibit = 12,
  home_axes = 13,
  enable_sources = 14,
  loop_back = 15,
  tell_pose = 16,
  propose_case = 17,
  follow_case = 18,
  get_result = 19,
  tell_positions = 20,
  provision = 21,
  describe_unit = 22,
  offer_update = 23,
  send_update = 24,
  install_update = 25,
  update_status = 26,
  describe_machine = 27,
  provision_keys = 28,
};

// Selects the coding of the columns of a block.
enum class Profile : std::uint8_t { raw = 0, fast = 1, tight = 2 };

// Selects the samples to keep when the host is too slow: live keeps the newest, record the oldest.
enum class Policy : std::uint8_t { live = 0, record = 1 };

// Names the reason why samples are missing.
enum class GapReason : std::uint8_t {
  source_clock = 0,
  source_probe = 1,
  source_encoders = 2,
  queue_full = 3,
  ring_overrun = 4,
  resume_too_old = 5,
};
// Returns whether the loss happened before the box had a sample, not between box and host.
constexpr bool isSourceLoss(GapReason reason) {
  return reason <= GapReason::source_encoders;
}

enum class ResultState : std::uint8_t { proposed = 0, accepted = 1, active = 2, retired = 3, refused = 4 };

enum class StepPhase : std::uint8_t { begin = 0, end = 1, abandon = 2 };

// Names the type of an entry of a case's config.json.
enum class CaseValue : std::uint8_t { flag = 0, number = 1, text = 2, numbers = 3, matrix = 4 };

// Selects a stored part of a result, as JSON text: the result or refusal, or the measured data.
enum class ResultDocument : std::uint8_t { result = 0, dataset = 1 };

// Names how far an update of the box has come.
enum class UpdateState : std::uint8_t {
  none = 0,
  receiving = 1,
  checking = 2,
  waiting = 3,
  installing = 4,
  installed = 5,
  restarting = 6,
  done = 7,
  not_installed = 8,
  gone_back = 9,
};

using BootId = std::array<std::byte, 16>;

// Return the name for messages and JSON; "unknown" for a number that a later version added.
using probebox::nameOf;  // of a step and a run
std::string_view nameOf(MessageType type);
std::string_view nameOf(ErrorCode code);
std::string_view nameOf(Operation operation);
std::string_view nameOf(Profile profile);
std::string_view nameOf(Policy policy);
std::string_view nameOf(GapReason reason);
std::string_view nameOf(ResultState state);
std::string_view nameOf(StepPhase phase);
std::string_view nameOf(ClockState state);
std::string_view nameOf(UpdateState state);

}  // namespace probebox::messages
