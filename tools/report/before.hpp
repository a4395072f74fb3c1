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

}  // namespace probebox::report
