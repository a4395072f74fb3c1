#pragma once
#include <optional>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/dataset/subject.hpp"

namespace probebox::metrology {

// Tests for the keys that every method accepts for the record: probe, probe_tool (number of the tool that carries it),
// delay_result, pre_travel_result, machine, mounting, measured_utc, date_source, measured_by, temperature_c, note,
// sphere_certificate, sphere_next_due, stylus_ball, machine_check, cutting_s.
bool isCondition(std::string_view key);

// What the result is about that this key names by number; nothing for a key that names no result.
std::optional<SubjectKind> subjectNamedByCondition(std::string_view key);

// Diameter of the stylus ball that a case relies on, in words, with its standard deviation as stated; or it ends with
// kAssumedExact.
inline constexpr std::string_view kStylusBall = "stylus_ball";
inline constexpr std::string_view kAssumedExact = "assumed to be exact: U holds no error of it";

// Number of the machine check whose lost motion and drift a case states.
inline constexpr std::string_view kMachineCheckKey = "machine_check";

// How long the machine had cut until then, as the box counts it: "3600 of 1a2b3c4d", s of a counter.
inline constexpr std::string_view kCuttingKey = "cutting_s";

// What is taken of the machine's own errors, where a case does not state them and they count.
inline constexpr std::string_view kAccuracyAssumed = "accuracy";

// Those keys that the case states, in this order.
std::vector<Condition> conditionsOf(const Dataset& dataset);

}  // namespace probebox::metrology
