#include <cstdint>
#include <limits>
#include <vector>

#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/link/read_through.hpp"
#include "tools/probebox/link/stored_results.hpp"
#include "tools/probebox/text/report.hpp"
#include "tools/probebox/text/report_unit.hpp"

namespace probebox::command {

namespace {

constexpr std::uint32_t kNewest = 5;

// Collects the last message of each kind that a recording has about its box.
class LastWords : public link::StreamListener {
 public:
  explicit LastWords(std::string path) { status_.recording = std::move(path); }
  const RecordedStatus& status() const { return status_; }

 private:
  void onDescriptor(const messages::Descriptor& descriptor) override { status_.descriptor = descriptor; }
  void onBlock(const link::DecodedBlock& block) override { status_.map = block.header.map; }
  void onHeartbeat(const messages::Heartbeat& beat, const std::optional<link::Balance>&) override {
    status_.beat = beat;
  }

  RecordedStatus status_;
};

ExitStatus ofRecording(const std::string& path, Console& console) {
  LastWords last{path};
  const auto end = readThrough(path, last, console);
  if (!end) return conclude(end.error(), console);
  if (console.json()) {
    console.object(describe(last.status()));
  } else {
    console.line(page(last.status()));
  }
  return ExitStatus::ok;
}

// Warns of facts that make results untraceable.
void warn(const messages::DescribeUnit::Answer& unit, Console& console) {
  if (const auto sentence = overdue(unit, today())) console.line(printed("%-18s %s", "overdue", sentence->c_str()));
  for (const auto& note : unit.notes) console.line(printed("%-18s %s", "unit", note.c_str()));
}

// The newest last. A box of before gives all that it has: the newest of them are kept.
Outcome<std::vector<messages::ResultSummary>, Trouble> newestResults(link::Client& box, const Console& console) {
  auto all = storedResults(box, console, {.after_id = 0, .newest = kNewest}, std::numeric_limits<std::size_t>::max());
  if (all && all->size() > kNewest) all->erase(all->begin(), all->end() - kNewest);
  return all;
}

}  // namespace

ExitStatus run(const Status&, const std::string& given, Console& console) {
  const auto uri = chooseUri(given);
  if (!uri) return console.fail(uri.error());
  if (const auto* file = std::get_if<link::FileAddress>(&uri->address)) return ofRecording(file->path, console);
  const auto box = openBox(*uri, console);
  if (!box) return console.fail(box.error());
  const auto status = ask<messages::Status>(**box, console);
  if (!status) return console.fail(status.error());
  // A recording that is served as a box has no corrections.
  const auto corrections = ask<messages::Corrections>(**box, console);
  if (!corrections && corrections.error().status != ExitStatus::box_refused) return console.fail(corrections.error());
  const bool cut_is_on = corrections && corrections->inhibited;
  // A recording has none, and neither has a box of before.
  const auto unit = ask<messages::DescribeUnit>(**box, console);
  if (!unit && unit.error().status != ExitStatus::box_refused) return console.fail(unit.error());
  // A proposed one is found here after its command has ended.
  const auto results = newestResults(**box, console);
  // The rest is known while another program holds the store.
  if (!results && results.error().status != ExitStatus::box_refused) return console.fail(results.error());
  if (console.json()) {
    Json all = describe(*status);
    all["cut_in_progress"] = corrections ? Json(cut_is_on) : Json(nullptr);
    all["in_use"] = corrections ? describe(*corrections)["in_use"] : Json(nullptr);
    all["unit"] = unit ? describe(*unit, today()) : Json(nullptr);
    all["process"] = describe(status->process);
    all["newest_results"] = results ? Json(Json::array()) : Json(nullptr);
    if (!results) all["storage_problems"].push_back(results.error().what);
    for (std::size_t k = 0; results && k < results->size(); ++k)
      all["newest_results"].push_back(describe((*results)[k]));
    console.object(all);
    return ExitStatus::ok;
  }
  console.line(page(*status));
  if (unit) warn(*unit, console);
  // A line has no name to list among those who hold an inhibit.
  if (cut_is_on && status->inhibits.empty()) console.line(cutLine());
  if (corrections && !corrections->in_use.empty()) console.line(sourcesInUse(corrections->in_use));
  if (!results) {
    console.line("newest results: " + results.error().what);
    return ExitStatus::ok;
  }
  if (!results->empty()) console.line("newest results");
  for (const auto& result : *results) console.line("  " + line(result));
  return ExitStatus::ok;
}

}  // namespace probebox::command
