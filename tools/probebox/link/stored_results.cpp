#include "tools/probebox/link/stored_results.hpp"

#include <algorithm>
#include <iterator>
#include <limits>
#include <set>
#include <utility>

#include "protocol/units/nearest.hpp"

namespace probebox::command {
namespace {

bool isWhole(const messages::ResultSummary& result) {
  return result.first_value + result.values.size() >= result.value_count;
}

// The rest of a result's values goes behind those that came before.
void append(messages::ResultSummary part, std::vector<messages::ResultSummary>& all) {
  if (all.empty() || all.back().id != part.id) return all.push_back(std::move(part));
  std::ranges::move(part.values, std::back_inserter(all.back().values));
}

}  // namespace

Outcome<std::vector<messages::ResultSummary>, Trouble> storedResults(link::Client& box, const Console& console,
                                                                     const ResultRange& range, std::size_t count,
                                                                     std::uint64_t most_parts) {
  std::vector<messages::ResultSummary> all;
  ListWatch watch{most_parts};
  messages::ListResults::Request request{.after_id = range.after_id, .first_value = 0, .newest = range.newest};
  while (true) {
    TRY(auto list, ask<messages::ListResults>(box, console, request));
    // A box that answers in circles is not followed.
    const bool goes_on = !list.results.empty() && list.results.front().id > request.after_id;
    for (auto& result : list.results) append(std::move(result), all);
    const bool is_enough = all.size() >= count && isWhole(all.back());
    if (!goes_on || !list.more || is_enough) break;
    if (const auto trouble = watch.furtherPart(all.back().id)) return *trouble;
    const bool is_whole = isWhole(all.back());
    request.after_id = is_whole ? all.back().id : all.back().id - 1;
    const auto had =
        std::exchange(request.first_value, is_whole ? 0 : static_cast<std::uint32_t>(all.back().values.size()));
    if (!is_whole && request.first_value <= had) break;
  }
  if (all.size() > count) all.resize(count);
  return all;
}

Outcome<std::optional<std::string>, Trouble> subjectOfMethod(const std::string& method, link::Client& box,
                                                             const Console& console) {
  TRY(const auto all, storedResults(box, console, {}, std::numeric_limits<std::size_t>::max()));
  std::set<std::string> subjects;
  for (const auto& result : all) {
    if (result.method == method) subjects.insert(result.subject);
  }
  if (subjects.empty()) return std::optional<std::string>{};
  if (subjects.size() == 1) return std::optional{*subjects.begin()};
  std::string names;
  for (const auto& subject : subjects) names += (names.empty() ? "" : ", ") + subject;
  return Trouble{ExitStatus::failed, "not_found",
                 "results of " + method + " are about " + names + ": name one of them"};
}

std::string subjectMeant(const std::string& word, const std::vector<messages::ResultSummary>& all) {
  std::vector<std::string> known;
  for (const auto& result : all) known.insert(known.end(), {result.subject, result.method});
  // A known word needs no suggestion.
  if (std::ranges::find(known, word) != known.end()) return {};
  return didYouMean(word, known);
}

std::string subjectMeant(const std::string& word, link::Client& box, const Console& console) {
  const auto all = storedResults(box, console, {}, std::numeric_limits<std::size_t>::max());
  return all ? subjectMeant(word, *all) : std::string{};
}

Outcome<std::vector<messages::ResultTransition>, Trouble> storedTransitions(link::Client& box, const Console& console,
                                                                            messages::ResultHistory::Request request) {
  std::vector<messages::ResultTransition> all;
  ListWatch watch;
  while (true) {
    TRY(auto part, ask<messages::ResultHistory>(box, console, request));
    if (part.transitions.empty()) return all;
    if (const auto trouble = watch.part(part.transitions.front().number, part.transitions.back().number))
      return *trouble;
    std::ranges::move(part.transitions, std::back_inserter(all));
    if (!part.more) return all;
    request.after_number = all.back().number;
  }
}

}  // namespace probebox::command
