#pragma once
#include <optional>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/result.hpp"

namespace probebox::report {

// An earlier result about the same subject (docs/results.md), as the box keeps it.
struct Earlier {
  std::string name;  // how a person finds it: "result 12"
  std::string utc;   // when it was measured, ISO 8601
  metrology::Result result;
};

// What a page compares its result with. Whoever knows the box fills it in:
//
//   Subject subject{"result 17", result.method, dataset, result};
//   subject.before.in_force = Earlier{"result 12", "2026-11-20T08:00:00Z", active};  // about the same subject
//   subject.before.history = {oldest, ..., newest};  // measured before this one, any state but refused; in order of
//   time page(std::span{&subject, 1}, version);
//
// The page shows the change against the result in force with its sd, and the trend of the last nine of the history with
// this one. Values are compared by key, so results of another method of the subject may stand in it: a key that one of
// them does not have is omitted there. Where the result itself is in force, leave in_force empty.
struct Before {
  std::optional<Earlier> in_force;
  std::vector<Earlier> history;
};

}  // namespace probebox::report
