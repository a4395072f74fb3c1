#include <optional>
#include <utility>
#include <vector>

#include "firmware/json/dataset_json.hpp"
#include "protocol/messages/procedures.hpp"
#include "tools/case/case_folder.hpp"
#include "tools/probebox/commands/acceptance.hpp"
#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/commands/kept_result.hpp"
#include "tools/probebox/commands/run_choices.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/link/followed_run.hpp"
#include "tools/probebox/link/stored_results.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

constexpr std::size_t kMostOfOneRun = 3;  // results: no method has more subjects

Outcome<messages::StartProcedure::Request, Trouble> requestOf(const Calibrate& choices) {
  TRY(auto options, optionsOf(choices));
  options.stations = choices.stations.value_or(0);
  options.mounts = choices.mounts.value_or(0);
  options.has_temperature = choices.temperature_c.has_value();
  options.temperature_c = choices.temperature_c.value_or(0);
  return messages::StartProcedure::Request{choices.method, options};
}

// One run of a method, from its start to its result.
class Run {
 public:
  Run(const Calibrate& options, link::Uri uri, Console& console)
      : options_{options}, console_{console}, run_{std::move(uri), console} {}

  ExitStatus go() {
    const auto request = requestOf(options_);
    if (!request) return console_.fail(request.error());
    const auto last = run_.go(*request);
    if (!last) {
      if (last.error().status == ExitStatus::interrupted) return ExitStatus::interrupted;
      return console_.fail(last.error());
    }
    // Saving comes last: while a large case is written, the box hears nothing and may hang up.
    const ExitStatus concluded = conclude(*last);
    const ExitStatus saved = save(last->result_id);
    return concluded == ExitStatus::ok ? saved : concluded;
  }

 private:
  ExitStatus conclude(const FollowedRun::Progress& last) {
    if (last.state == RunState::refused) {
      return console_.fail({ExitStatus::failed, "refused", "the calibration was refused: " + last.refusal});
    }
    if (last.state == RunState::aborted) {
      return console_.fail({ExitStatus::failed, "aborted", "the calibration was aborted; start it again"});
    }
    if (last.result_id == 0) return tellDone(last.method);
    const auto results =
        storedResults(run_.box(), console_, {.after_id = last.result_id - 1, .newest = 0}, kMostOfOneRun);
    if (!results) return console_.fail(results.error());
    if (!results->empty() && results->front().id == last.result_id) {
      const ExitStatus concluded = propose(results->front());
      noteOthers(*results);
      return concluded;
    }
    return console_.fail(
        {ExitStatus::failed, "no-result",
         "the box has no result " + std::to_string(last.result_id) + ", though it proposed it; look at its log"});
  }

  // Further results of the same run are accepted separately.
  void noteOthers(const std::vector<messages::ResultSummary>& results) {
    const auto& first = results.front();
    for (const auto& other : results) {
      const bool of_this_run = other.method == first.method && other.proposed_utc == first.proposed_utc;
      if (other.id == first.id || other.state != messages::ResultState::proposed || !of_this_run) continue;
      const auto id = std::to_string(other.id);
      console_.note("result " + id + " about " + other.subject + " is proposed by the same run: probebox accept " + id +
                    " --by NAME");
    }
  }

  // No calibration after all.
  ExitStatus tellDone(const std::string& method) {
    if (console_.json())
      console_.object({{"method", method}, {"done", true}});
    else
      console_.line(method + " is done; it has no result to accept");
    return ExitStatus::ok;
  }

  ExitStatus propose(const messages::ResultSummary& result) {
    if (console_.json()) {
      console_.object(describe(result));
    } else {
      const auto kept = keptResult(run_.box(), console_, result.id);
      console_.line(page(result, kept ? kept->result() : nullptr));
    }
    const auto id = std::to_string(result.id);
    if (!options_.accept) {
      console_.note("not in force yet: probebox accept " + id + " --by NAME");
      return ExitStatus::ok;
    }
    return acceptOn(run_.box(), {result.id, options_.by, options_.although_it_differs}, console_);
  }

  // Also what was refused: that is when one wants to look at it.
  ExitStatus save(std::uint64_t id) {
    if (options_.save.empty()) return ExitStatus::ok;
    const auto text = run_.dataset();
    if (!text) return console_.fail(text.error());
    const auto measured = json::datasetFromJson(*text);
    if (!measured) return console_.fail({ExitStatus::failed, "not-saved", measured.error().what});
    const auto written = casefolder::writeCase(*measured, options_.save);
    if (!written) return notSaved(written.error().what, id);
    if (console_.json()) {
      console_.object({{"saved_case", options_.save}});
    } else {
      console_.line("saved in " + options_.save + "; solve it with: probebox solve " + options_.save);
    }
    return ExitStatus::ok;
  }

  // What was measured may have taken hours.
  ExitStatus notSaved(std::string why, std::uint64_t id) {
    if (id != 0) why += "; the box keeps what was measured: probebox report " + std::to_string(id) + " -o FILE.html";
    return console_.fail({ExitStatus::usage, "not-saved", why});
  }

  const Calibrate& options_;
  Console& console_;
  FollowedRun run_;
};

// For a run whose command was killed.
ExitStatus abortRun(const link::Uri& uri, Console& console) {
  const auto box = openBox(uri, console);
  if (!box) return console.fail(box.error());
  const auto aborted = ask<messages::AbortProcedure>(**box, console);
  if (!aborted) return console.fail(aborted.error());
  if (console.json()) {
    console.object({{"aborted", true}});
  } else {
    console.line("no calibration is running any more");
  }
  return ExitStatus::ok;
}

std::optional<Trouble> objectionTo(const Calibrate& options, const link::Uri& uri) {
  if (uri.isFile()) return usage("a recording cannot be calibrated; name a box");
  if (options.save.empty() || options.abort) return std::nullopt;
  if (const auto why = casefolder::whyNoPlaceForCase(options.save)) return usage("--save " + why->what);
  return std::nullopt;
}

}  // namespace

ExitStatus run(const Calibrate& options, const std::string& given, Console& console) {
  const auto uri = chooseUri(given);
  if (!uri) return console.fail(uri.error());
  if (const auto objection = objectionTo(options, *uri)) return console.fail(*objection);
  if (options.abort) return abortRun(*uri, console);
  auto with_name = options;
  if (options.accept) with_name.by = signer(options.by, given);
  return Run{with_name, *uri, console}.go();
}

}  // namespace probebox::command
