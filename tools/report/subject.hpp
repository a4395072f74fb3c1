#pragma once
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/dataset/verdict.hpp"

namespace probebox::report {

// An earlier result about the same subject (docs/results.md), as the box keeps it.
struct Earlier {
  std::string name;  // how a person finds it: "result 12"
  std::string utc;   // when it was measured, ISO 8601
  metrology::Result result;
};

// Earlier results that a page compares its result with; filled in by a caller that knows the box:
//
//   Subject subject{"result 17", result.method, dataset, result};
//   subject.before.in_force = Earlier{"result 12", "2026-11-20T08:00:00Z", active};
//   subject.before.history = {oldest, ..., newest};
//   page(std::span{&subject, 1}, version);
//
// in_force: about the same subject; empty if the result itself is in force. history: measured before the result, in any
// state but refused. The page shows the change against in_force with its sd, and the trend over the last nine of the
// history and this result. Values are compared by key, so the history may hold results of other methods of the subject;
// keys that are missing on one side are omitted.
struct Before {
  std::optional<Earlier> in_force;
  std::vector<Earlier> history;
};

// How a result stands to the limits that are stated for its subject; filled in by a caller that knows them.
struct Conformity {
  metrology::Proof proof{};  // of the value that stands worst
  std::string worst;         // "deviation XC at 60 deg -3.1 +/- 0.4 um, limit 8 um"
  bool is_deviation{};       // else the limit is one of U
};

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
  // To [[requirement]] of machine.toml. Nothing where none bounds a value of it, and for a check, which has its own.
  std::optional<Conformity> conformity{};

  const metrology::Result* result() const { return std::get_if<metrology::Result>(&answer); }
  const metrology::Refusal* refusal() const { return std::get_if<metrology::Refusal>(&answer); }
};

}  // namespace probebox::report
