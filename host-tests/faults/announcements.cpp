#include "host-tests/faults/announcements.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

namespace probebox::faults {
namespace {

constexpr double kDigits_mm = 1e-6;  // to which a served value is kept

std::vector<std::string> wordsOf(std::string_view line) {
  std::istringstream in{std::string{line}};
  std::vector<std::string> words;
  for (std::string word; in >> word;) words.push_back(word);
  return words;
}

Correction correctionFrom(const std::vector<std::string>& words, std::size_t first) {
  return {std::stod(words.at(first)), std::stod(words.at(first + 1)), std::stod(words.at(first + 2))};
}

bool alike(const Correction& a, const Correction& b, const Correction& doubt = {}) {
  for (std::size_t axis = 0; axis < a.size(); ++axis)
    if (std::abs(a[axis] - b[axis]) > doubt[axis] + kDigits_mm) return false;
  return true;
}

bool isOfTheUnit(std::string_view change) {
  return change.starts_with("unit ");
}

bool isOfAConnection(std::string_view change) {
  return change.starts_with("hold ") || change.starts_with("end ") || change.starts_with("order ");
}

std::string um(const Correction& value) {
  return std::to_string(value[0] * 1e3) + " " + std::to_string(value[1] * 1e3) + " " + std::to_string(value[2] * 1e3) +
         " um";
}

std::string told(const std::map<store::Id, std::string>& states) {
  std::string all;
  for (const auto& [id, state] : states) all += " " + std::to_string(id) + " " + state;
  return all;
}

}  // namespace

struct Acknowledged::Found {
  Kept kept;
  std::optional<Correction> before;
  Correction applied{}, doubt{};
  std::string notice;
};

void Acknowledged::hear(std::string_view line) {
  const auto rest = line.substr(std::min(line.size(), line.find(' ') + 1));
  if (line.starts_with("doing ")) {
    doing_ = rest;
  } else if (line == "done") {
    if (isOfAConnection(doing_)) {
      storeUncertain();
    } else if (!isOfTheUnit(doing_)) {
      before_ = kept_;
      may_be_undone_ = false;
    }
    apply(doing_, kept_);
    doing_.clear();
    ++changes_;
  } else if (line.starts_with("failed ")) {
    if (isOfAConnection(doing_) || isOfTheUnit(doing_)) {
      uncertain_.insert(doing_);
    } else if (refused_change_.empty()) {
      refused_change_ = doing_;
    }
    failed_ = std::exchange(doing_, {});
    ++refused_;
  } else if (line.starts_with("sees")) {
    see(rest);
  } else if (line == "ready" || line == "unready") {
    ready_ = line == "ready";
  } else if (line.starts_with("serving ")) {
    serving_ = correctionFrom(wordsOf(line), 1);
  } else if (line.starts_with("served ")) {
    served_ = correctionFrom(wordsOf(line), 1);
    serving_.reset();
  }
}

// A cut that could not be stored is in the box's memory, and is stored with the next change of a connection.
void Acknowledged::storeUncertain() {
  for (const auto& change : uncertain_)
    if (change.starts_with("hold ")) apply(change, kept_);
  uncertain_.clear();
}

// A commit may fail behind its last write: then it is done, and nobody knows whether a cut of the power would undo it.
void Acknowledged::see(std::string_view states) {
  const auto words = wordsOf(states);
  std::map<store::Id, std::string> seen;
  for (std::size_t k = 0; k + 1 < words.size(); k += 2) seen[std::stoull(words[k])] = words[k + 1];
  refused_change_.clear();
  if (seen == kept_.states || seen.empty()) return;
  before_ = kept_;
  may_be_undone_ = true;
  apply(failed_, kept_);
  if (seen != kept_.states)
    broken_ = "after '" + failed_ + "' was refused the box has" + told(seen) + ", not" + told(kept_.states);
}

// Results in this state, one at most, are replaced.
void Acknowledged::retire(std::string_view state, Kept& kept) {
  for (auto& [id, present] : kept.states) {
    if (present != state) continue;
    present = "retired";
    if (state == "active") kept.retired.push_back(id);
  }
}

void Acknowledged::apply(std::string_view change, Kept& kept) {
  const auto words = wordsOf(change);
  if (words.empty()) return;
  const auto& what = words.front();
  const auto id = [&] { return static_cast<store::Id>(std::stoull(words.at(1))); };
  if (what == "propose") kept.states[id()] = "proposed";
  if (what == "refuse") kept.states[id()] = "refused";
  if (what == "await") {
    retire("accepted", kept);
    kept.states[id()] = "accepted";
  }
  if (what == "accept") {
    retire("accepted", kept);
    retire("active", kept);
    kept.states[id()] = "active";
  }
  if (what == "activate") {
    retire("active", kept);
    kept.states[id()] = "active";
  }
  if (what == "back") {
    const auto again = kept.retired.empty() ? store::Id{} : kept.retired.back();
    if (again != 0) kept.retired.pop_back();
    retire("active", kept);
    if (again != 0) kept.states[again] = "active";
  }
  if (what == "unit") kept.unit = words.at(1);
  if (what == "hold") kept.held.insert(words.at(1));
  if (what == "end") kept.held.erase(words.at(1));
  if (what == "order") {
    kept.orders[words.at(1)] = words.at(2);
    if (words.at(2) == "0") kept.orders.erase(words.at(1));  // as at the start
  }
}

Acknowledged::Found Acknowledged::read(const std::vector<std::string>& lines) {
  Found found;
  for (const auto& line : lines) {
    const auto words = wordsOf(line);
    if (words.size() < 3 || words[0] != "found") continue;
    if (words[1] == "state") found.kept.states[std::stoull(words[2])] = words.at(3);
    if (words[1] == "unit") found.kept.unit = words[2];
    if (words[1] == "held") found.kept.held.insert(words[2]);
    if (words[1] == "order") found.kept.orders[words[2]] = words.at(3);
    if (words[1] == "before") found.before = correctionFrom(words, 2);
    if (words[1] == "applied") found.applied = correctionFrom(words, 2), found.doubt = correctionFrom(words, 5);
    if (words[1] == "notice") found.notice = line;
  }
  return found;
}

std::optional<std::string> Acknowledged::whyBroken(const std::vector<std::string>& lines, const After& after) const {
  const auto found = read(lines);
  if (broken_) return broken_;
  // A file of nothing, which a first start leaves that is interrupted before its first commit, is put aside and named.
  const bool never_began = kept_.states.empty() && found.notice.find("was empty") != std::string::npos;
  if (!found.notice.empty() && !never_began) return found.notice;
  auto then = kept_;
  apply(doing_, then);
  auto refused = kept_;
  apply(refused_change_, refused);
  const bool done_all_the_same = after.disk_died && found.kept.states == refused.states;
  const bool undone =
      after.power_was_cut && (after.folder_failed || may_be_undone_) && found.kept.states == before_.states;
  if (found.kept.states != kept_.states && found.kept.states != then.states && !undone && !done_all_the_same)
    return "results:" + told(found.kept.states) + " where were acknowledged" + told(kept_.states);
  if (auto connections = whyConnectionsBroken(kept_, found, after)) return connections;
  if (auto unit = whyUnitBroken(found, after)) return unit;
  return whyCorrectionBroken(found, after);
}

std::optional<std::string> Acknowledged::whyConnectionsBroken(const Kept& expected, const Found& found,
                                                              const After& after) const {
  const auto fits = [&](const Kept& kept) { return found.kept.held == kept.held && found.kept.orders == kept.orders; };
  auto then = expected;
  apply(doing_, then);
  if (fits(expected) || fits(then)) return std::nullopt;
  // The begin of a cut that could not be stored holds until the box ends, and may or may not be there afterwards.
  for (const auto& change : uncertain_) {
    if (!after.disk_died && !change.starts_with("hold ")) continue;
    auto with = expected;
    apply(change, with);
    auto with_then = with;
    apply(doing_, with_then);
    if (fits(with) || fits(with_then)) return std::nullopt;
  }
  std::string text = "inhibits and word orders:";
  for (const auto& connection : found.kept.held) text += " " + connection;
  for (const auto& [connection, order] : found.kept.orders) text += " " + connection + "=" + order;
  text += " where were acknowledged";
  for (const auto& connection : expected.held) text += " " + connection;
  for (const auto& [connection, order] : expected.orders) text += " " + connection + "=" + order;
  return text;
}

// What was acknowledged is there; what was refused is not, unless the disk took nothing any more in the middle of it.
std::optional<std::string> Acknowledged::whyUnitBroken(const Found& found, const After& after) const {
  auto then = kept_;
  apply(doing_, then);
  if (found.kept.unit == kept_.unit || found.kept.unit == then.unit) return std::nullopt;
  if (after.disk_died && uncertain_.contains("unit " + found.kept.unit)) return std::nullopt;
  return "the box is '" + found.kept.unit + "' where was acknowledged '" + kept_.unit + "'";
}

std::optional<std::string> Acknowledged::whyCorrectionBroken(const Found& found, const After& after) const {
  // A disk that could not be read at the start, and can be read again, has what a box before it knew.
  if (!served_ || (after.disk_died && !ready_)) return std::nullopt;
  const auto fits = [&](const Correction& value) {
    if (after.power_was_cut) return alike(value, found.applied, found.doubt);
    return found.before && alike(value, *found.before) && alike(value, found.applied);
  };
  if (fits(*served_) || (serving_ && fits(*serving_))) return std::nullopt;
  return "served was " + um(*served_) + ", and the box sets out from " + um(found.applied) + " +/- " + um(found.doubt);
}

}  // namespace probebox::faults
