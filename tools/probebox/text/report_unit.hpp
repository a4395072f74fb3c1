#pragma once
#include <optional>
#include <string>

#include "protocol/messages/status.hpp"
#include "protocol/messages/unit.hpp"
#include "tools/probebox/cli/json.hpp"

// Formats the identity of a box, and its daemon as the kernel sees it.
namespace probebox::command {

// In place of a date where the clock of this computer shows none that can be.
inline constexpr const char* kNoDate = "unknown";

// Today by the clock of this computer, UTC: "2026-11-26"; or kNoDate.
std::string today();

// Now: "2026-11-26T08:15:00Z"; or kNoDate.
std::string nowUtc();

Json describe(const messages::DescribeUnit::Answer& unit, const std::string& today);
// Null if the box does not report it.
Json describe(const messages::ProcessStatus& process);
// Rows as in `probebox info`; for a box without an identity one row that says so.
std::string page(const messages::DescribeUnit::Answer& unit, const std::string& today);

// A sentence for status where the certificate of the sphere has run out.
std::optional<std::string> overdue(const messages::DescribeUnit::Answer& unit, const std::string& today);

}  // namespace probebox::command
