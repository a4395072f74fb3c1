#include "protocol/messages/types.hpp"

#include <cstddef>
#include <span>

#include "protocol/messages/fields.hpp"

namespace probebox::messages {
namespace {

std::string_view pick(std::span<const std::string_view> names, std::size_t number, std::size_t first = 0) {
  return number < first || number - first >= names.size() ? "unknown" : names[number - first];
}

constexpr auto kMessageTypes = std::to_array<std::string_view>(
    {"HELLO", "WELCOME", "DESCRIPTOR", "TEST_PATTERN", "START", "STOP", "CREDIT", "SAMPLES", "GAP", "HEARTBEAT",
     "REQUEST", "ANSWER", "REFUSAL", "TRIGGER", "TRIGGER_GAP", "HEARTBEAT_CHANGE", "SHORT_SAMPLES", "SAMPLES_HEAD"});
constexpr auto kErrorCodes =
    std::to_array<std::string_view>({"ok", "malformed", "unknown_operation", "not_permitted", "busy", "not_found",
                                     "refused", "wrong_state", "too_large", "version_mismatch", "differs"});
constexpr auto kOperations = std::to_array<std::string_view>(
    {"status",         "post_marker",    "start_procedure",  "procedure_status", "abort_procedure", "list_results",
     "accept_result",  "corrections",    "get_dataset",      "rollback_result",  "result_history",  "set_inhibit",
     "home_axes",      "enable_sources", "loop_back",        "tell_pose",        "propose_case",    "follow_case",
     "get_result",     "tell_positions", "provision",        "describe_unit",    "offer_update",    "send_update",
     "install_update", "update_status",  "describe_machine", "provision_keys"});
constexpr auto kProfiles = std::to_array<std::string_view>({"raw", "fast", "tight"});
constexpr auto kPolicies = std::to_array<std::string_view>({"live", "record"});
constexpr auto kGapReasons = std::to_array<std::string_view>(
    {"source_clock", "source_probe", "source_encoders", "queue_full", "ring_overrun", "resume_too_old"});
constexpr auto kResultStates =
    std::to_array<std::string_view>({"proposed", "accepted", "active", "retired", "refused"});
constexpr auto kStepPhases = std::to_array<std::string_view>({"begin", "end", "abandon"});
constexpr auto kClockStates = std::to_array<std::string_view>({"unlocked", "locked", "holdover", "ambiguous"});
constexpr auto kUpdateStates =
    std::to_array<std::string_view>({"none", "receiving", "checking", "waiting", "installing", "installed",
                                     "restarting", "done", "not_installed", "gone_back"});
constexpr auto kWireErrors = std::to_array<std::string_view>(
    {"a field is cut off", "no room for it", "a text or list is longer than 65535", "unknown alternative"});

}  // namespace

std::string_view nameOf(MessageType type) {
  return pick(kMessageTypes, static_cast<std::size_t>(type), 1);
}
std::string_view nameOf(ErrorCode code) {
  return pick(kErrorCodes, static_cast<std::size_t>(code));
}
std::string_view nameOf(Operation operation) {
  return pick(kOperations, static_cast<std::size_t>(operation), 1);
}
std::string_view nameOf(Profile profile) {
  return pick(kProfiles, static_cast<std::size_t>(profile));
}
std::string_view nameOf(Policy policy) {
  return pick(kPolicies, static_cast<std::size_t>(policy));
}
std::string_view nameOf(GapReason reason) {
  return pick(kGapReasons, static_cast<std::size_t>(reason));
}
std::string_view nameOf(ResultState state) {
  return pick(kResultStates, static_cast<std::size_t>(state));
}
std::string_view nameOf(StepPhase phase) {
  return pick(kStepPhases, static_cast<std::size_t>(phase));
}
std::string_view nameOf(ClockState state) {
  return pick(kClockStates, static_cast<std::size_t>(state));
}
std::string_view nameOf(UpdateState state) {
  return pick(kUpdateStates, static_cast<std::size_t>(state));
}
std::string_view nameOf(WireError error) {
  return pick(kWireErrors, static_cast<std::size_t>(error));
}

}  // namespace probebox::messages
