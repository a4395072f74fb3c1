#include "firmware/metrology/selftest/selftest.hpp"

#include <algorithm>
#include <optional>
#include <vector>

#include "firmware/json/dataset_json.hpp"
#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/link/followed_run.hpp"
#include "tools/probebox/link/read_through.hpp"
#include "tools/probebox/link/settled_status.hpp"
#include "tools/probebox/text/report.hpp"
#include "tools/probebox/text/report_front_end.hpp"
#include "tools/probebox/text/report_indexes.hpp"
#include "tools/probebox/text/report_loop_back.hpp"

// The first run of a box on its machine: what is connected, whether its clock runs, and whether every axis and the
// probe mean what the descriptions say.
namespace probebox::command {
namespace {

using metrology::Finding;

class Findings {
 public:
  explicit Findings(Console& console) : console_{console} {}

  // `figures`: what it was found by, for programs.
  void add(const Finding& finding, const Json& figures = Json::object()) {
    wrong_ += finding.good ? 0 : 1;
    ++all_;
    Json object{{"good", finding.good}, {"name", finding.name}, {"what", finding.what}};
    object.update(figures);
    if (console_.json())
      console_.object(object);
    else
      console_.line((finding.good ? "[ok]    " : "[wrong] ") + finding.what);
  }
  // Reports an item that could not be checked; that is no fault.
  void skip(const std::string& what) {
    if (console_.json())
      console_.object({{"skipped", what}});
    else
      console_.line("[--]    " + what);
  }
  ExitStatus conclude() {
    if (console_.json())
      console_.object({{"findings", all_}, {"wrong", wrong_}});
    else if (wrong_ == 0)
      console_.line("All checks passed. Next: probebox calibrate delay-multi-speed");
    else
      console_.line(
          printed("%zu of %zu are wrong: correct them, restart the box, and run selftest again.", wrong_, all_));
    return wrong_ == 0 ? ExitStatus::ok : ExitStatus::failed;
  }

 private:
  Console& console_;
  std::size_t all_{}, wrong_{};
};

void judgeSources(const std::vector<messages::SourceStatus>& sources, Findings& findings) {
  std::size_t well = 0;
  for (const auto& source : sources) {
    if (source.problem.empty())
      ++well;
    else
      findings.add({false, "source-missing", source.name + ": " + source.problem});
    if (!source.faults.empty()) findings.add({false, "source-fault", source.name + ": " + source.faults});
  }
  if (well > 0) findings.add({true, "", printed("%zu of %zu inputs deliver data.", well, sources.size())});
}

void judgeReceiver(const messages::Status::Answer& status, Findings& findings) {
  using Of = MeasuredCheck::Verdict;
  for (const auto& [name, title, measured, limit, verdict, remedy] : receiverChecks(status)) {
    const auto text = "The " + title + ": " + measured;
    if (verdict == Of::passed) findings.add({true, "", text + "."});
    if (verdict == Of::failed) findings.add({false, name, text + " (" + limit + "): " + remedy + "."});
    if (verdict == Of::not_told) findings.skip(text + (remedy.empty() ? "" : "; " + remedy) + ".");
  }
}

Finding judgeClock(const messages::ClockStatus& clock) {
  if (clock.state == ClockState::locked) {
    return {true, "",
            printed("The master clock is locked: ticks are known within %s, %+.1f ppm off nominal.",
                    readableNs(clock.sigma_ns).c_str(), clock.frequency_ppb / 1000)};
  }
  const auto& edges = clock.edges;
  const std::uint64_t arrived = edges.accepted + edges.doubled + edges.spurious + edges.unlocked;
  if (arrived == 0) return {false, "no-sync", "No sync edge has arrived: check the sync cable and [sync] in box.toml."};
  return {false, "clock-unlocked",
          printed("%llu sync edges have arrived but give no stable clock: check sync_period and the active edge in "
                  "box.toml, and the cable for noise.",
                  static_cast<unsigned long long>(arrived))};
}

// How late edges are stamped: it goes into the delay, and its spread into everything.
void judgeStamps(link::Client& box, Console& console, Findings& findings) {
  const auto late = ask<messages::LoopBack>(box, console, {});
  if (late) {
    findings.add(judge(*late), {{"loop_back", describe(*late)}});
  } else if (late.error().name == messages::nameOf(messages::ErrorCode::not_found)) {
    findings.skip("This box has no loop-back, so the latency of its edge stamps is unknown ([loop_back] in box.toml).");
  } else {
    findings.add({false, "loop-back", "The loop-back measurement failed: " + late.error().what});
  }
}

// The jogs were a chance to pass a mark.
std::optional<Trouble> judgeIndexes(const link::Uri& uri, Console& console, Findings& findings) {
  TRY(const auto box, openBox(uri, console));
  TRY(const auto status, ask<messages::Status>(*box, console));
  TRY(const auto corrections, ask<messages::Corrections>(*box, console));
  for (const auto& finding : silentIndexes(status.lines, corrections.axes)) findings.add(finding);
  return std::nullopt;
}

// Findings of the steps, also if the box refused the run because of them.
Outcome<std::vector<Finding>, Trouble> measured(FollowedRun& run) {
  TRY(const auto text, run.dataset());
  const auto dataset = json::datasetFromJson(text);
  if (!dataset) return Trouble{ExitStatus::failed, "not-understood", dataset.error().what};
  auto findings = metrology::selftestFindings(*dataset);
  if (!findings) return Trouble{ExitStatus::failed, findings.error().name, findings.error().reason};
  return std::move(findings).value();
}

}  // namespace

ExitStatus run(const Selftest&, const std::string& given, Console& console) {
  const auto uri = chooseUri(given);
  if (!uri) return console.fail(uri.error());
  if (uri->isFile()) return console.fail(usage("a recording cannot be tested; name a box"));
  Findings findings{console};
  {
    const auto box = openBox(*uri, console);
    if (!box) return console.fail(box.error());
    const auto status = settledStatus(**box, console);
    if (!status) return conclude(status.error(), console);
    judgeSources(status->sources, findings);
    judgeReceiver(*status, findings);
    findings.add(judgeClock(status->clock));
    // Without a clock no step could be recorded.
    if (status->clock.state != ClockState::locked) return findings.conclude();
    judgeStamps(**box, console, findings);
  }
  FollowedRun walk{*uri, console};
  const auto last = walk.go({.method = "selftest"});
  if (!last) return conclude(last.error(), console);
  if (last->state == RunState::aborted)
    return console.fail({ExitStatus::failed, "aborted", "the selftest was aborted; start it again"});
  if (last->step < last->steps) return console.fail({ExitStatus::failed, "refused", last->refusal});
  const auto seen = measured(walk);
  if (!seen) return conclude(seen.error(), console);
  for (const Finding& finding : *seen) findings.add(finding);
  if (const auto trouble = judgeIndexes(*uri, console, findings)) return console.fail(*trouble);
  return findings.conclude();
}

}  // namespace probebox::command
