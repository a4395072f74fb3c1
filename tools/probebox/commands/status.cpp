#include <algorithm>
#include <iterator>
#include <vector>

#include "tools/link/recording.hpp"
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

// How the box was at the end of a recording, as far as that tells.
struct LastStatus : link::StreamListener {
  void onWelcome(const messages::Welcome& welcome) override { status.firmware_version = welcome.firmware_version; }
  void onDescriptor(const messages::Descriptor& descriptor) override {
    status.board = descriptor.board;
    status.firmware_version = descriptor.firmware_version;
    status.active_results.clear();
    if (descriptor.delay.calibrated) status.active_results.push_back(descriptor.delay.result_id);
  }
  void onBlock(const link::DecodedBlock& block) override {
    const auto& map = block.header.map;
    status.clock.tick = map.tick;
    status.clock.state = map.state;
    status.clock.sigma_ns = map.sigma_ns;
  }
  void onHeartbeat(const messages::Heartbeat& beat, const std::optional<link::Balance>&) override {
    status.uptime_ms = beat.uptime_ms;
    status.clock.state = beat.clock_state;
    status.clock.sigma_ns = beat.clock_sigma_ns;
    status.clock.edges = beat.edges;
    status.ledger = {beat.produced, beat.lost_at_source, beat.lost_in_queue};
    status.deadline_misses = beat.deadline_misses;
    status.from_hosts = beat.link;
  }
  messages::Status::Answer status;
};

ExitStatus ofRecording(const std::string& path, Console& console) {
  LastStatus last;
  const auto end = path == "-" ? link::readRecording(console.in(), last) : link::readRecording(path, last);
  if (!end) return console.fail({ExitStatus::usage, "unreadable-recording", end.error().what});
  last.status.procedure = "recorded, of one link: " + path;
  if (console.json()) {
    Json all = describe(last.status);
    all["newest_results"] = Json::array();
    console.object(all);
  } else {
    console.line(page(last.status));
  }
  return ExitStatus::ok;
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
