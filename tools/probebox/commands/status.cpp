#include <algorithm>
#include <iterator>
#include <vector>

#include "tools/probebox/box.hpp"
#include "tools/probebox/commands.hpp"
#include "tools/probebox/report.hpp"

namespace probebox::command {

namespace {

constexpr std::size_t kNewest = 5;

// The newest stored results, the newest last: a proposed one is found here after its command has ended.
Outcome<std::vector<messages::ResultSummary>, Trouble> newestResults(link::Client& box, const Console& console) {
  std::vector<messages::ResultSummary> newest;
  bool more = true;
  while (more) {
    auto list = ask<messages::ListResults>(box, console, {newest.empty() ? 0 : newest.back().id});
    if (!list) return list.error();
    more = list->more && !list->results.empty();
    std::ranges::move(list->results, std::back_inserter(newest));
    if (newest.size() > kNewest) newest.erase(newest.begin(), newest.end() - kNewest);
  }
  return newest;
}

}  // namespace

ExitStatus run(const Status&, const std::string& uri, Console& console) {
  const auto box = openBox(uri, console);
  if (!box) return console.fail(box.error());
  const auto status = ask<messages::Status>(**box, console);
  if (!status) return console.fail(status.error());
  const auto results = newestResults(**box, console);
  if (!results) return console.fail(results.error());
  if (console.json()) {
    Json all = describe(*status);
    all["newest_results"] = Json::array();
    for (const auto& result : *results) all["newest_results"].push_back(describe(result));
    console.object(all);
    return ExitStatus::ok;
  }
  console.line(page(*status));
  if (!results->empty()) console.line("newest results");
  for (const auto& result : *results) console.line("  " + line(result));
  return ExitStatus::ok;
}

}  // namespace probebox::command
