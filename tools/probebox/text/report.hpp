#pragma once
#include <cstdio>
#include <optional>
#include <string>
#include <string_view>

#include "firmware/metrology/dataset/result.hpp"
#include "protocol/messages/control.hpp"
#include "protocol/messages/handshake.hpp"
#include "protocol/messages/stream.hpp"
#include "protocol/units/time.hpp"
#include "tools/probebox/cli/console.hpp"

// Formats answers of the box for programs (units in the keys) and for people.
namespace probebox::command {

Json describe(const messages::Descriptor& descriptor);
Json describe(const messages::Status::Answer& status);
Json describe(const messages::Corrections::Answer& corrections);
Json describe(const messages::ProcedureStatus::Answer& procedure);
Json describe(const messages::ResultSummary& result);
Json describe(const messages::ResultTransition& transition);
Json describe(const messages::Trigger& trigger);

std::string page(const messages::Descriptor& descriptor);
std::string page(const messages::Status::Answer& status);
// Line of the status and corrections pages while a cut is on that no connection has declared.
std::string cutLine();

// State of the box at the end of a recording. Text and JSON omit what a recording does not hold.
struct RecordedStatus {
  std::string recording;  // its path
  std::optional<messages::Descriptor> descriptor;
  std::optional<messages::Heartbeat> beat;
  std::optional<TickMap> map;  // of the last samples
};
Json describe(const RecordedStatus& status);
std::string page(const RecordedStatus& status);
// kept: the whole result, where it is at hand: it has the angles at which values hold.
// A result that was held against limits begins with its verdict.
std::string page(const messages::ResultSummary& result, const metrology::Result* kept = nullptr);
// "PASS: ..." with the worst value of a check; empty for others.
std::string verdictOf(const messages::ResultSummary& result);
// Keys of values that verdictOf() has in words.
bool isVerdict(std::string_view key);
// Unit of the residual rms of a result; if the box does not state it, the one that the values suggest.
std::string rmsUnitOf(const messages::ResultSummary& result);
// "17  proposed  delay-multi-speed  tau 5447.1 +/- 5.0 us"
std::string line(const messages::ResultSummary& result);
std::string line(const messages::InhibitHolder& holder);
std::string line(const messages::Corrections::Answer& corrections);
std::string page(const messages::Corrections::Answer& corrections);
// Rows of the status page: the values in use, by their source.
std::string sourcesInUse(const std::vector<messages::ValueInUse>& values);
std::string line(const messages::ResultTransition& transition);

// Reports the outcome of an acceptance. comparison: with the result in force before; null for none.
void tellAccepted(std::uint64_t id, const std::string& asked_by, const messages::AcceptResult::Answer& answer,
                  const Json& comparison, Console& console);

// "tau 5447.1 +/- 5.0 us" for the key "tau_s": the combined standard uncertainty, from an older box the sd, and as many
// digits as it supports. axis: of a rotary axis, "C", whose errors are named as in ISO 230.
std::string readable(const messages::NamedValue& value, std::string_view axis = {});

// "residual rms 0.0001 mm, 20 degrees of freedom of the fit, condition 1".
std::string fitInWords(double rms, const std::string& unit, std::size_t dof, double condition);

// "12.5 us", "830 ns": a duration with three or more digits before its unit changes.
std::string readableNs(double ns);

std::string printed(const char* format, auto... values) {
  std::string text(static_cast<std::size_t>(std::snprintf(nullptr, 0, format, values...)), '\0');
  std::snprintf(text.data(), text.size() + 1, format, values...);
  return text;
}

}  // namespace probebox::command
