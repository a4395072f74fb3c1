#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/verdict.hpp"
#include "protocol/messages/corrections.hpp"
#include "protocol/messages/machine.hpp"
#include "protocol/messages/results.hpp"
#include "protocol/messages/status.hpp"
#include "tools/probebox/cli/json.hpp"

// May this machine cut? One answer with its reason, and what is known of each subject. Pure: `watch` and `view` show
// it.
namespace probebox::command {

enum class MayCut {
  unknown,  // no box says anything of a machine: a lost link, or a recording
  yes,      // everything that is required is kept
  check,    // a person has to look first
  stop,     // what is served is not valid, or a limit is exceeded for certain
};
std::string_view nameOf(MayCut may_cut);  // "unknown", "yes", "check", "stop"
// One word for people: "Not known", "Yes", "Check", "Stop".
std::string_view wordOf(MayCut may_cut);

// How the worst value of a result stands to the limit of its subject: "kept", "not proven", "exceeded"; "no limit" for
// nothing.
std::string_view nameOf(std::optional<metrology::Proof> proof);

// The value by which a result is judged: the worst of all that have a limit, by its answer (exceeded, not proven, kept)
// and of equal answers by its ratio, deviations first. Without a limit the largest deviation, of a result that has none
// the first value whose uncertainty is known.
struct DecisiveValue {
  std::string key{};
  std::string name{};             // "deviation XC at 60 deg"
  std::string unit{};             // as shown
  double value{};                 // in that unit, as U
  std::optional<double> u{};      // U, k = 2
  std::string text{};             // "deviation XC at 60 deg -3.1 +/- 0.4 um"; after +/- stands u (k = 1)
  std::optional<double> limit{};  // in that unit; nothing where none is stated
  std::optional<double> ratio{};  // (abs(error) + U) / limit; of a value that is no deviation U / limit
  std::optional<metrology::Proof> proof{};  // nothing without a limit
};
// requirement: null where none is stated. Nothing for a refusal.
std::optional<DecisiveValue> decisiveValue(const messages::ResultSummary& result,
                                           const messages::Requirement* requirement);

// Null where none is stated about the subject.
const messages::Requirement* requirementOf(const std::vector<messages::Requirement>& all, const std::string& subject);
// A sentence about each stated limit that bounds no value of the result, with the names of those that would:
// "limit_urad of delay bounds no value of result 3: state limit_us."
std::vector<std::string> idleLimits(const messages::ResultSummary& result, const messages::Requirement& requirement);

struct TrendPoint {
  std::uint64_t id{};
  std::string utc{};
  double value{};
  std::optional<double> u{};  // U, k = 2
};

// Shewhart's chart of single values: mean, and 2.66 times the mean moving range to either side.
struct ControlLimits {
  double mean{}, low{}, high{};
};
// Nothing below kLeastForControl points: the range would be a guess.
inline constexpr std::size_t kLeastForControl = 5;
std::optional<ControlLimits> controlLimits(std::span<const TrendPoint> points);

inline constexpr std::size_t kTrendPoints = 10;
// The decisive value of the last results about one subject, probe, machine and mounting, oldest first.
struct Trend {
  std::string name{}, unit{};
  std::vector<TrendPoint> points{};
  std::optional<ControlLimits> control{};
  std::optional<double> limit{};
  bool limits_values{};  // the limit is one of the values themselves, as of deviations, and not of their U
};

Trend trendOf(const messages::ResultSummary& newest, const DecisiveValue& decisive,
              const std::vector<messages::ResultSummary>& all);

// What is known of one subject that has a result in force, or that is required.
struct SubjectTile {
  std::string subject{}, title{};
  std::uint64_t id{};  // in force; 0 for none
  std::string method{}, accepted_by{}, accepted_utc{}, stored_utc{};
  std::optional<DecisiveValue> decisive{};
  std::optional<double> age_days{};
  std::optional<published::Due> due{};     // as the box says; nothing where it is never due
  std::vector<std::string> remarks{};      // rests on a retired result, warnings, a newer one that waits for a person
  std::vector<std::string> idle_limits{};  // as idleLimits()
  Trend trend{};
  MayCut may_cut{};  // by this subject alone; unknown: nothing is required of it
};

struct MachineVerdict {
  MayCut may_cut{};
  std::string reason;             // one sentence
  std::vector<std::string> more;  // further reasons, the most serious first
  std::vector<SubjectTile> tiles;
  std::string cut;  // as whoCuts()
};

struct MachineKnown {
  bool link_up{};
  std::optional<messages::Status::Answer> status;
  std::optional<messages::Corrections::Answer> corrections;
  std::vector<messages::ResultSummary> results;       // all that are stored
  std::vector<messages::Requirement> requirements{};  // of machine.toml
};
MachineVerdict judge(const MachineKnown& known);

// Who says that a cut is on; empty for nobody, and where nothing is known.
std::string whoCuts(const std::optional<messages::Status::Answer>& status,
                    const std::optional<messages::Corrections::Answer>& corrections);

// As dueText() of due.hpp, or "no interval stated"; empty where it was never measured.
std::string dueText(const SubjectTile& tile);
// "limit 8 um" or "no limit stated".
std::string limitText(const DecisiveValue& decisive);

Json describe(const DecisiveValue& decisive);
Json describe(const MachineVerdict& verdict);
Json describe(const Trend& trend);

}  // namespace probebox::command
