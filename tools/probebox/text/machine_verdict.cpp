#include "tools/probebox/text/machine_verdict.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "firmware/metrology/dataset/subject.hpp"
#include "protocol/units/calendar.hpp"
#include "protocol/units/wording.hpp"
#include "tools/case/readable.hpp"
#include "tools/probebox/text/due.hpp"
#include "tools/probebox/text/report.hpp"
#include "tools/probebox/text/subject_words.hpp"

namespace probebox::command {
namespace {

using messages::Requirement;
using messages::ResultState;
using messages::ResultSummary;
using metrology::Proof;

// Only results of these can replace each other.
bool areAlike(const ResultSummary& one, const ResultSummary& other) {
  return one.subject == other.subject && one.probe == other.probe && one.machine == other.machine &&
         one.mounting == other.mounting;
}

bool isInForce(const ResultSummary& result) {
  return result.state == ResultState::active && result.why_not_in_force.empty();
}

bool hasLimit(const Requirement& requirement) {
  return requirement.limit_um > 0 || requirement.limit_us > 0 || requirement.limit_urad > 0;
}

std::vector<std::string> remarksOn(const ResultSummary& result, const std::vector<ResultSummary>& all) {
  std::vector<std::string> remarks;
  for (const auto& other : result.rests_on)
    if (other.retired)
      remarks.push_back("It rests on result " + std::to_string(other.id) + " (" + subjectTitle(other.subject) +
                        "), which is retired: repeat this one.");
  if (!result.warnings.empty())
    remarks.push_back(result.warnings.size() == 1
                          ? result.warnings.front()
                          : std::to_string(result.warnings.size()) + " warnings: read them in Results.");
  for (const auto& other : all) {
    if (other.id <= result.id || !areAlike(other, result)) continue;
    if (other.state == ResultState::proposed)
      remarks.push_back("Result " + std::to_string(other.id) + " is newer and waits for a person to accept it.");
    if (other.waiting_for_cut)
      remarks.push_back("Result " + std::to_string(other.id) + " comes into force at the end of the cut.");
  }
  return remarks;
}

const published::Due* dueOf(const MachineKnown& known, const std::string& subject) {
  if (!known.status) return nullptr;
  const auto found = std::ranges::find(known.status->due, subject, &published::Due::name);
  return found == known.status->due.end() ? nullptr : &*found;
}

// Also of what is never due.
bool isKnownGood(const std::optional<published::Due>& due) {
  return !due || due->state == published::DueState::good;
}

SubjectTile tileOf(const ResultSummary& result, const MachineKnown& known,
                   std::optional<std::chrono::sys_seconds> now) {
  const auto* requirement = requirementOf(known.requirements, result.subject);
  SubjectTile tile{.subject = result.subject,
                   .title = subjectTitle(result.subject),
                   .id = result.id,
                   .method = methodTitle(result.method),
                   .accepted_by = result.accepted_by,
                   .accepted_utc = result.accepted_utc,
                   .stored_utc = result.proposed_utc,
                   .decisive = decisiveValue(result, requirement)};
  if (const auto stored = timeOf(result.proposed_utc); stored && now)
    tile.age_days = std::max(0.0, std::chrono::duration<double, std::chrono::days::period>(*now - *stored).count());
  if (const auto* due = dueOf(known, result.subject)) tile.due = *due;
  tile.remarks = remarksOn(result, known.results);
  if (requirement != nullptr) tile.idle_limits = idleLimits(result, *requirement);
  if (tile.decisive) tile.trend = trendOf(result, *tile.decisive, known.results);
  const auto proof = tile.decisive ? tile.decisive->proof : std::nullopt;
  const bool rests_on_retired = std::ranges::any_of(result.rests_on, &messages::RestsOn::retired);
  if (proof == Proof::fails) {
    tile.may_cut = MayCut::stop;
  } else if (proof == Proof::not_proven || !isKnownGood(tile.due) || rests_on_retired || !result.warnings.empty() ||
             !tile.idle_limits.empty()) {
    tile.may_cut = MayCut::check;
  } else if (proof == Proof::conforms || tile.due) {
    tile.may_cut = MayCut::yes;
  }
  return tile;
}

SubjectTile neverMeasured(const Requirement& requirement) {
  SubjectTile tile{.subject = requirement.subject, .title = subjectTitle(requirement.subject)};
  tile.remarks.push_back(parseSubject(requirement.subject)
                             ? "Required, and nothing about it is in force: measure it."
                             : "Required by machine.toml, and no result is about such a subject: correct its name.");
  tile.may_cut = MayCut::check;
  return tile;
}

double remainingTime(const SubjectTile& tile) {
  return tile.due && tile.due->has_time ? tile.due->remaining_s : std::numeric_limits<double>::infinity();
}

// The worst first; of equal ones the one that is due first.
void sortTiles(std::vector<SubjectTile>& tiles) {
  std::ranges::stable_sort(tiles, [](const SubjectTile& one, const SubjectTile& other) {
    if (one.may_cut != other.may_cut) return one.may_cut > other.may_cut;
    return remainingTime(one) < remainingTime(other);
  });
}

std::vector<SubjectTile> tilesOf(const MachineKnown& known) {
  const auto now = known.status ? timeOf(known.status->utc) : std::nullopt;
  std::vector<SubjectTile> tiles;
  for (const auto& result : known.results)
    if (isInForce(result)) tiles.push_back(tileOf(result, known, now));
  for (const auto& requirement : known.requirements) {
    if (std::ranges::find(tiles, requirement.subject, &SubjectTile::subject) == tiles.end())
      tiles.push_back(neverMeasured(requirement));
  }
  sortTiles(tiles);
  return tiles;
}

// Reasons in words, each with what it means for cutting.
class Reasons {
 public:
  void add(MayCut may_cut, std::string sentence) { all_.emplace_back(may_cut, std::move(sentence)); }
  void into(MachineVerdict& verdict) {
    std::ranges::stable_sort(all_, std::ranges::greater{}, [](const auto& one) { return one.first; });
    verdict.may_cut = all_.empty() ? MayCut::yes : all_.front().first;
    if (!all_.empty()) verdict.reason = std::move(all_.front().second);
    for (std::size_t k = 1; k < all_.size(); ++k) verdict.more.push_back(std::move(all_[k].second));
  }

 private:
  std::vector<std::pair<MayCut, std::string>> all_;
};

void addCorrections(const messages::Corrections::Answer& corrections, Reasons& reasons) {
  std::string invalid, held;
  for (std::size_t kind = 0; kind < kSourceKinds; ++kind) {
    if (!hasSource(corrections.mask, kind)) continue;
    auto& list = corrections.health[kind] == published::Health::held ? held : invalid;
    if (corrections.health[kind] == published::Health::good) continue;
    list += (list.empty() ? "" : ", ") + std::string{kSources[kind].name};
  }
  if (corrections.mask != 0 && !corrections.valid) {
    reasons.add(MayCut::stop, invalid.empty() ? "The corrections are not valid."
                                              : "The corrections are not valid: no value of " + invalid + ".");
  } else if (corrections.degraded) {
    reasons.add(MayCut::check, held.empty() ? "A correction has reached its limit."
                                            : "The correction of " + held + " is held at its last good value.");
  }
}

void addTile(const SubjectTile& tile, Reasons& reasons) {
  if (tile.id == 0) return reasons.add(MayCut::check, tile.title + " is r" + tile.remarks.front().substr(1));
  const auto proof = tile.decisive ? tile.decisive->proof : std::nullopt;
  const auto what = tile.decisive ? tile.decisive->text + ", " + limitText(*tile.decisive) : std::string{};
  if (proof == Proof::fails) reasons.add(MayCut::stop, tile.title + " is beyond its limit: " + what + ".");
  if (proof == Proof::not_proven)
    reasons.add(MayCut::check, tile.title + " is not proven to be within its limit: " + what + ".");
  if (!isKnownGood(tile.due)) reasons.add(MayCut::check, tile.title + ": " + dueText(tile) + ".");
  for (const auto& sentence : tile.idle_limits) reasons.add(MayCut::check, sentence);
  if (tile.may_cut == MayCut::check && proof != Proof::not_proven && !tile.remarks.empty())
    reasons.add(MayCut::check, tile.title + ": " + tile.remarks.front());
}

// A check that fails, or that proves nothing, counts before anybody has accepted it.
void addUnacceptedCheck(const std::vector<ResultSummary>& results, Reasons& reasons) {
  const ResultSummary* newest = nullptr;
  for (const auto& one : results)
    if (isAbout(one.subject, SubjectKind::check) && one.state != ResultState::refused && one.why_not_in_force.empty())
      if (newest == nullptr || one.id > newest->id) newest = &one;
  if (newest == nullptr || isInForce(*newest) || newest->state == ResultState::retired) return;
  const auto decisive = decisiveValue(*newest, nullptr);
  if (!decisive) return;
  if (decisive->proof == Proof::fails) reasons.add(MayCut::stop, "The last check fails: " + decisive->text + ".");
  if (decisive->proof == Proof::not_proven)
    reasons.add(MayCut::check, "The last check is not proven to be within its limits: " + decisive->text + ".");
}

void addMissingLimits(const MachineKnown& known, const std::vector<SubjectTile>& tiles, Reasons& reasons) {
  const bool any_limit =
      std::ranges::any_of(known.requirements, hasLimit) ||
      std::ranges::any_of(tiles, [](const auto& tile) { return tile.decisive && tile.decisive->limit; });
  if (!any_limit)
    reasons.add(MayCut::check,
                "No limits are stated: write [[requirement]] with subject and limit_um or limit_us into machine.toml.");
}

void addBox(const messages::Status::Answer& status, Reasons& reasons) {
  if (status.clock.state != ClockState::locked)
    reasons.add(MayCut::check,
                "The master clock is not locked: it is " + std::string{messages::nameOf(status.clock.state)} + ".");
  for (const auto& problem : status.storage_problems) reasons.add(MayCut::check, problem);
  for (const auto& source : status.sources)
    if (!source.problem.empty()) reasons.add(MayCut::check, source.name + ": " + source.problem);
}

}  // namespace

std::string_view nameOf(MayCut may_cut) {
  constexpr std::array<std::string_view, 4> kNames{"unknown", "yes", "check", "stop"};
  return kNames[static_cast<std::size_t>(may_cut)];
}

std::string_view wordOf(MayCut may_cut) {
  constexpr std::array<std::string_view, 4> kWords{"Not known", "Yes", "Check", "Stop"};
  return kWords[static_cast<std::size_t>(may_cut)];
}

std::string_view nameOf(std::optional<Proof> proof) {
  constexpr std::array<std::string_view, 3> kNames{"kept", "not proven", "exceeded"};
  return proof ? kNames[static_cast<std::size_t>(*proof)] : "no limit";
}

const Requirement* requirementOf(const std::vector<Requirement>& all, const std::string& subject) {
  const auto found = std::ranges::find(all, subject, &Requirement::subject);
  return found == all.end() ? nullptr : &*found;
}

Trend trendOf(const ResultSummary& newest, const DecisiveValue& decisive, const std::vector<ResultSummary>& all) {
  Trend trend{.name = decisive.name,
              .unit = decisive.unit,
              .limit = decisive.limit,
              .limits_values = casefolder::hasIdealZero(decisive.key) || isVerdict(decisive.key)};
  for (const auto& one : all) {
    if (one.state == ResultState::refused || !areAlike(one, newest)) continue;
    const auto value = std::ranges::find(one.values, decisive.key, &messages::NamedValue::key);
    if (value == one.values.end()) continue;
    ResultSummary alone = one;
    if (!isVerdict(decisive.key)) {
      alone.values = {*value};
      alone.about_count = 0;
    }
    const auto shown = decisiveValue(alone, nullptr);
    if (shown) trend.points.push_back({one.id, one.proposed_utc, shown->value, shown->u});
  }
  std::ranges::sort(trend.points, {}, &TrendPoint::id);
  if (trend.points.size() > kTrendPoints) trend.points.erase(trend.points.begin(), trend.points.end() - kTrendPoints);
  trend.control = controlLimits(trend.points);
  return trend;
}

std::string dueText(const SubjectTile& tile) {
  if (tile.id == 0) return {};
  return tile.due ? dueText(*tile.due) : "no interval stated";
}

std::string whoCuts(const std::optional<messages::Status::Answer>& status,
                    const std::optional<messages::Corrections::Answer>& corrections) {
  std::string who;
  if (status) {
    for (const auto& holder : status->inhibits) who += (who.empty() ? "" : "; ") + line(holder);
  }
  return who.empty() && corrections && corrections->inhibited ? "an inhibit line of the box" : who;
}

MachineVerdict judge(const MachineKnown& known) {
  MachineVerdict verdict;
  verdict.tiles = tilesOf(known);
  verdict.cut = whoCuts(known.status, known.corrections);
  if (!known.link_up || !known.status || !known.corrections) {
    verdict.reason = known.link_up
                         ? "Nothing here says how a machine stands: this is a recording, or a box that does not answer."
                         : "The link to the box is lost: what is below was true before.";
    return verdict;
  }
  Reasons reasons;
  addCorrections(*known.corrections, reasons);
  addUnacceptedCheck(known.results, reasons);
  if (std::ranges::none_of(verdict.tiles, [](const auto& tile) { return tile.id != 0; }))
    reasons.add(MayCut::check, "Nothing is calibrated: begin with the delay.");
  for (const auto& tile : verdict.tiles) addTile(tile, reasons);
  addBox(*known.status, reasons);
  addMissingLimits(known, verdict.tiles, reasons);
  reasons.into(verdict);
  if (verdict.reason.empty()) verdict.reason = "Every limit is kept, and nothing is due.";
  return verdict;
}

Json describe(const DecisiveValue& decisive) {
  const auto number = [](const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); };
  return {{"key", decisive.key},
          {"name", casefolder::typeset(decisive.name)},
          {"unit", casefolder::typeset(decisive.unit)},
          {"value", decisive.value},
          {"expanded_k2", number(decisive.u)},
          {"text", casefolder::typeset(decisive.text)},
          {"limit", number(decisive.limit)},
          {"limit_text", casefolder::typeset(limitText(decisive))},
          {"ratio", number(decisive.ratio)},
          {"keeping", nameOf(decisive.proof)}};
}

Json describe(const Trend& trend) {
  Json points = Json::array();
  for (const auto& point : trend.points)
    points.push_back({{"id", point.id},
                      {"utc", point.utc},
                      {"value", point.value},
                      {"expanded_k2", point.u ? Json(*point.u) : Json(nullptr)}});
  Json control = nullptr;
  if (trend.control)
    control = Json{{"mean", trend.control->mean}, {"low", trend.control->low}, {"high", trend.control->high}};
  return {{"name", casefolder::typeset(trend.name)},
          {"unit", casefolder::typeset(trend.unit)},
          {"points", points},
          {"control", control},
          {"limit", trend.limit && trend.limits_values ? Json(*trend.limit) : Json(nullptr)}};
}

Json describe(const MachineVerdict& verdict) {
  Json tiles = Json::array(), more = Json::array();
  for (const auto& sentence : verdict.more) more.push_back(casefolder::typeset(sentence));
  for (const auto& tile : verdict.tiles) {
    Json remarks = Json::array();
    for (const auto& sentence : tile.idle_limits) remarks.push_back(casefolder::typeset(sentence));
    for (const auto& remark : tile.remarks) remarks.push_back(casefolder::typeset(remark));
    tiles.push_back({{"subject", tile.subject},
                     {"title", tile.title},
                     {"id", tile.id},
                     {"method", tile.method},
                     {"accepted_by", tile.accepted_by},
                     {"accepted_utc", tile.accepted_utc},
                     {"stored_utc", tile.stored_utc},
                     {"decisive", tile.decisive ? describe(*tile.decisive) : Json(nullptr)},
                     {"age", tile.age_days ? Json(durationText(*tile.age_days)) : Json(nullptr)},
                     {"due", dueText(tile)},
                     {"overdue", tile.due && tile.due->state == published::DueState::overdue},
                     {"remarks", remarks},
                     {"trend", describe(tile.trend)},
                     {"may_cut", nameOf(tile.may_cut)}});
  }
  return {{"may_cut", nameOf(verdict.may_cut)},
          {"word", wordOf(verdict.may_cut)},
          {"reason", casefolder::typeset(verdict.reason)},
          {"more", more},
          {"cut", verdict.cut},
          {"tiles", tiles}};
}

}  // namespace probebox::command
