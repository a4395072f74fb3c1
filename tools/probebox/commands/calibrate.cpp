#include <filesystem>
#include <numbers>
#include <optional>
#include <thread>

#include "tools/case/case_folder.hpp"
#include "tools/probebox/box.hpp"
#include "tools/probebox/commands.hpp"
#include "tools/probebox/dataset_from_json.hpp"
#include "tools/probebox/report.hpp"

namespace probebox::command {
namespace {

using messages::ProcedureState;
using Progress = messages::ProcedureStatus::Answer;

constexpr milliseconds kPeriod{200};
constexpr milliseconds kReconnectPatience{10'000};
constexpr milliseconds kBeginPatience{3000};  // between the answer to "start" and the first word about the run

bool isOver(ProcedureState state) {
  return state == ProcedureState::proposed || state == ProcedureState::refused || state == ProcedureState::aborted;
}

messages::StartProcedure::Request requestOf(const Calibrate& options) {
  constexpr double kRadPerDegree = std::numbers::pi / 180;
  return {.method = options.method,
          .speeds_mm_s = options.speeds_mm_s,
          .overtravel_mm = options.overtravel_mm.value_or(0),
          .clearance_mm = options.clearance_mm.value_or(0),
          .approach_rad = options.approach_deg.value_or(0) * kRadPerDegree,
          .arc_rad = options.arc_deg.value_or(0) * kRadPerDegree,
          .angles = options.angles.value_or(0),
          .balls = options.balls.value_or(0)};
}

// One run of a method, from its start to its result. The run goes on in the box when the link breaks.
class Run {
 public:
  Run(const Calibrate& options, link::Uri uri, Console& console)
      : options_{options}, uri_{std::move(uri)}, console_{console} {}

  ExitStatus go() {
    auto opened = openBox(uri_, console_);
    if (!opened) return console_.fail(opened.error());
    box_ = std::move(opened).value();
    const auto started = ask<messages::StartProcedure>(*box_, console_, requestOf(options_));
    if (!started) return unattended() ? abort() : console_.fail(started.error());
    run_ = started->run;
    const auto last = follow();
    if (!last) return unattended() ? abort() : console_.fail(last.error());
    // Saving comes last: while a large case is written, the box hears nothing and may hang up.
    const ExitStatus concluded = conclude(*last);
    const ExitStatus saved = save();
    return concluded == ExitStatus::ok ? saved : concluded;
  }

 private:
  // Shows the steps as they come; the last word of the box about this run.
  Outcome<Progress, Trouble> follow() {
    std::optional<Progress> shown;
    const auto patient_until = link::now() + kBeginPatience;
    while (true) {
      const auto progress = askAgain();
      if (!progress) return progress.error();
      if (progress->run != run_) {
        if (progress->run > run_ || link::now() > patient_until) return replaced(progress->run);
        rest();
        continue;
      }
      if (!shown || shown->step != progress->step || shown->state != progress->state ||
          shown->prompt != progress->prompt) {
        show(*progress);
        shown = *progress;
      }
      if (isOver(progress->state)) return *progress;
      rest();
      if (unattended()) return interruption();
    }
  }

  // Nobody is there to be told the next step.
  bool unattended() const { return console_.interrupted() || !console_.writable(); }

  // The link is kept alive while nothing is to be asked.
  void rest() {
    const auto wait = patienceOf(console_, kPeriod);
    while (box_->state() != link::LinkState::lost && box_->round(wait)) {
    }
  }

  Outcome<Progress, Trouble> askAgain() {
    auto progress = ask<messages::ProcedureStatus>(*box_, console_);
    const auto deadline = link::now() + kReconnectPatience;
    while (!progress && progress.error().status == ExitStatus::no_box && link::now() < deadline) {
      console_.progress("the link was lost; connecting again");
      std::this_thread::sleep_for(kPeriod);
      if (auto box = openBox(uri_, console_, milliseconds{1000})) {
        box_ = std::move(box).value();
        progress = ask<messages::ProcedureStatus>(*box_, console_);
      }
      if (console_.interrupted()) return interruption();
    }
    return progress;
  }

  static Trouble interruption() { return {ExitStatus::interrupted, "interrupted", "interrupted"}; }

  Trouble replaced(std::uint32_t other) const {
    return {ExitStatus::failed, "run-replaced",
            "run " + std::to_string(run_) + " is gone: the box is at run " + std::to_string(other) +
                "; it was restarted, or somebody else began a calibration"};
  }

  void show(const Progress& progress) {
    if (console_.json()) return console_.object(describe(progress));
    switch (progress.state) {
      case ProcedureState::waiting:
        return console_.line(progress.prompt);
      case ProcedureState::running:
        return console_.progress(printed("step %u of %u: measuring", progress.step + 1, progress.steps));
      case ProcedureState::solving:
        return console_.line("solving");
      default:
        return;
    }
  }

  ExitStatus conclude(const Progress& last) {
    if (last.state == ProcedureState::refused) {
      return console_.fail({ExitStatus::failed, "refused", "the calibration was refused: " + last.refusal});
    }
    if (last.state == ProcedureState::aborted) {
      return console_.fail({ExitStatus::failed, "aborted", "the calibration was aborted; begin it again"});
    }
    const auto results = ask<messages::ListResults>(*box_, console_, {last.result_id - 1});
    if (!results) return console_.fail(results.error());
    for (const auto& result : results->results) {
      if (result.id == last.result_id) return propose(result);
    }
    return console_.fail(
        {ExitStatus::failed, "no-result",
         "the box has no result " + std::to_string(last.result_id) + ", though it proposed it; look at its log"});
  }

  ExitStatus propose(const messages::ResultSummary& result) {
    if (console_.json()) {
      console_.object(describe(result));
    } else {
      console_.line(page(result));
    }
    const auto id = std::to_string(result.id);
    if (!options_.accept) {
      console_.note("not in force yet: probebox accept " + id + " --by NAME");
      return ExitStatus::ok;
    }
    const auto accepted = ask<messages::AcceptResult>(*box_, console_, {result.id, options_.by});
    if (!accepted) return console_.fail(accepted.error());
    tellAccepted(result.id, options_.by, *accepted, console_);
    return ExitStatus::ok;
  }

  // Also what was refused: that is when one wants to look at it.
  ExitStatus save() {
    if (options_.save.empty()) return ExitStatus::ok;
    const auto text = dataset();
    if (!text) return console_.fail(text.error());
    const auto measured = datasetFromJson(*text);
    if (!measured) return console_.fail({ExitStatus::failed, "not-saved", measured.error().what});
    const auto written = casefolder::writeCase(*measured, options_.save);
    if (!written) return console_.fail({ExitStatus::usage, "not-saved", written.error().what});
    if (console_.json()) {
      console_.object({{"saved_case", options_.save}});
    } else {
      console_.line("saved in " + options_.save + "; solve it with: probebox solve " + options_.save);
    }
    return ExitStatus::ok;
  }

  Outcome<std::string, Trouble> dataset() {
    std::string text;
    while (true) {
      const auto piece = ask<messages::GetDataset>(*box_, console_, {run_, text.size()});
      if (!piece) return piece.error();
      if (piece->bytes.empty() && text.size() < piece->total_bytes) {
        return Trouble{ExitStatus::failed, "not-saved", "the box sent only a part of the measured data; try again"};
      }
      text += piece->bytes;
      if (text.size() >= piece->total_bytes) return text;
      console_.progress(printed("fetching what was measured: %zu of %llu bytes", text.size(),
                                static_cast<unsigned long long>(piece->total_bytes)));
    }
  }

  // The machine must not be asked for further steps.
  ExitStatus abort() {
    const auto aborted = box_->request<messages::AbortProcedure>({}, link::patience(milliseconds{2000}));
    console_.note(aborted ? "probebox: the calibration was aborted"
                          : "probebox: the box could not be told to stop; see probebox calibrate --abort");
    return console_.interrupted() ? ExitStatus::interrupted : console_.fail(outputGone());
  }

  const Calibrate& options_;
  link::Uri uri_;
  Console& console_;
  Box box_;
  std::uint32_t run_{};
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
    console.line("no calibration is going on any more");
  }
  return ExitStatus::ok;
}

std::optional<Trouble> objectionTo(const Calibrate& options, const link::Uri& uri) {
  if (uri.isFile()) return usage("a recording cannot be calibrated; name a box");
  if (!options.save.empty() && std::filesystem::exists(std::filesystem::path{options.save} / "config.json")) {
    return usage(options.save + " holds a case already; name another folder");
  }
  return std::nullopt;
}

}  // namespace

ExitStatus run(const Calibrate& options, const std::string& given, Console& console) {
  const auto uri = chooseUri(given);
  if (!uri) return console.fail(uri.error());
  if (const auto objection = objectionTo(options, *uri)) return console.fail(*objection);
  if (options.abort) return abortRun(*uri, console);
  return Run{options, *uri, console}.go();
}

}  // namespace probebox::command
