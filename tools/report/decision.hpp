#pragma once
#include <string>
#include <vector>

#include "tools/report/subject.hpp"

namespace probebox::report {

enum class Verdict {
  pass,      // within every stated limit, with U, and no warning
  warn,      // a value less than U from its limit, or a warning beside values within their limits
  fail,      // a value beyond its limit
  no_limit,  // no limit to decide against; `warned`: whether there are warnings
  refused,
};

// The decision about a result: a headline with the verdict, and the largest errors (or the first values) with U.
struct Decision {
  Verdict verdict{Verdict::no_limit};
  std::string headline;
  std::vector<std::string> lines;
  bool warned{};  // warnings, a value without uncertainty, or one that rests on a retired result: the box is not green
};
Decision decide(const Subject& subject);

// The box with the decision at the head of an article, as HTML.
// more: sentences that follow those of the decision.
std::string decisionBox(const Subject& subject, const std::vector<std::string>& more = {});

}  // namespace probebox::report
