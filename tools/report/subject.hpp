#pragma once
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "tools/report/before.hpp"

namespace probebox::report {

// One result or refusal to report, with its data.
struct Subject {
  std::string name;  // of the case folder, as it was given
  std::string method;
  std::optional<metrology::Dataset> dataset;  // measured data; empty where only the answer is available
  std::variant<metrology::Result, metrology::Refusal> answer;
  Before before{};                      // empty for a case that no box knows
  std::string about{};                  // what a kept result is about, such as stylus-offset-1; empty for a case
  std::vector<std::string> rests_on{};  // sentences about the results that it was computed with
  bool rests_on_retired{};              // one of them is no longer in force

  const metrology::Result* result() const { return std::get_if<metrology::Result>(&answer); }
  const metrology::Refusal* refusal() const { return std::get_if<metrology::Refusal>(&answer); }
};

}  // namespace probebox::report
