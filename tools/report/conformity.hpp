#pragma once
#include <optional>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/verdict.hpp"
#include "tools/report/subject.hpp"

// Values of a check beside the limits that they were held against.
namespace probebox::report {

// The answer to a result that was held against limits. Nothing for others, nor for one about something else that the
// readings of a check gave as well, such as the offset of the stylus.
std::optional<metrology::Proof> verdictOn(const Subject& subject);

// One value of a check: what it deviates from the accepted one, and the answer of the decision rule.
struct Judged {
  const metrology::Estimate* deviation{};
  std::optional<double> limit{};            // in the unit of the key; nothing where the dataset is not kept
  std::optional<metrology::Proof> proof{};  // nothing without a limit
};
std::vector<Judged> judgedValues(const Subject& subject);  // where there is a verdict

// PASS, FAIL, NOT PROVEN, or "not on record".
const char* wordOf(const Judged& judged);

// Name of a judged value, with what it is: "Xcen B0, mean X of the ball at B = 0".
std::string judgedName(const Subject& subject, const Judged& judged);

// "12.5": a limit in the unit of its deviation, with all its digits.
std::string limitDigits(const metrology::Estimate& deviation, double limit);

// The rule that answers pass, fail or not proven, in a sentence.
std::string decisionRule();

// Deviation, its U, limit and verdict of each, and the decision rule; empty for a result that was held against no
// limit.
std::string conformityTable(const Subject& subject);

}  // namespace probebox::report
