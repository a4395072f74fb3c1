#pragma once
#include <cmath>
#include <optional>
#include <string_view>

#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/dataset/subject.hpp"
#include "protocol/units/result_keys.hpp"

namespace probebox::metrology {

// Answers of ISO 14253-1 to a value held against a limit, with U (k = 2) as its doubt. Numbers as in results and
// registers.
enum class Proof {
  conforms = 0,    // even with U added it is within the limit
  not_proven = 1,  // the limit lies within U of it, or U is unknown: neither is proven
  fails = 2,       // even with U taken off it is beyond the limit
};

// doubt: U of the deviation (k = 2); nothing is proven where it is unknown.
inline Proof proofOf(double deviation, std::optional<double> doubt, double limit) {
  if (!doubt) return Proof::not_proven;
  const double off = std::abs(deviation);
  if (off - *doubt > limit) return Proof::fails;
  return off + *doubt > limit ? Proof::not_proven : Proof::conforms;
}

// Key of the worst one among all values of a result that have a limit.
inline constexpr std::string_view kVerdict = result_key::kVerdict;
// (|deviation| + U) / limit of that one.
inline constexpr std::string_view kWorstRatio = result_key::kWorstRatio;

inline Proof proofNumbered(double verdict) {
  if (verdict > 1.5) return Proof::fails;
  return verdict < 0.5 ? Proof::conforms : Proof::not_proven;
}

// Nothing for a result that was held against no limit.
inline std::optional<Proof> proofOf(const Result& result) {
  const auto* verdict = result.find(kVerdict);
  if (verdict == nullptr || verdict->values.empty()) return std::nullopt;
  return proofNumbered(verdict->value());
}

// The same of a result about one subject: that of the periodic check. Other results of a check's case, such as the
// offset of the stylus, are no verdicts.
inline std::optional<Proof> proofAbout(const Result& result, std::string_view subject) {
  return isAbout(subject, SubjectKind::check) ? proofOf(result) : std::nullopt;
}

// Prefixes of the warnings about values whose conformity is disproved or not proven.
inline constexpr std::string_view kFailWarning = "fail: ";
inline constexpr std::string_view kNotProvenWarning = "not proven: ";

}  // namespace probebox::metrology
