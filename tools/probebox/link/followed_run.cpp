#include "tools/probebox/link/followed_run.hpp"

#include <optional>
#include <thread>

#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

using messages::StepPhase;

constexpr milliseconds kPeriod{200};
constexpr milliseconds kReconnectPatience{10'000};
constexpr milliseconds kBeginPatience{3000};  // between the answer to "start" and the first word about the run

bool isOver(RunState state) {
  return state == RunState::proposed || state == RunState::refused || state == RunState::aborted;
}

}  // namespace

Outcome<FollowedRun::Progress, Trouble> FollowedRun::go(const messages::StartProcedure::Request& request) {
  TRY(auto opened, openBox(uri_, console_));
  box_ = std::move(opened);
  // Ctrl-C waits for the answer: it alone says which run is to be given up.
  const auto started = box_->request<messages::StartProcedure>(request, link::patience(kAnswerPatience));
  if (!started) return troubleOf(started.error(), console_);
  run_ = started->run;
  auto last = follow();
  if (!last && unattended() && !replaced_) return aborted();
  return last;
}

Outcome<FollowedRun::Progress, Trouble> FollowedRun::follow() {
  std::optional<Progress> shown;
  const auto patient_until = link::now() + kBeginPatience;
  while (true) {
    TRY(const auto progress, askAgain());
    if (progress.run != run_) {
      if (progress.run > run_ || link::now() > patient_until) return replaced(progress.run);
      rest();
      continue;
    }
    if (!shown || shown->step != progress.step || shown->state != progress.state || shown->prompt != progress.prompt) {
      show(progress);
      shown = progress;
    }
    if (isOver(progress.state)) return progress;
    rest();
    if (console_.enterPressed()) markByHand(progress);
    if (unattended()) return interruption();
  }
}

// The link is kept alive while nothing is to be asked.
void FollowedRun::rest() {
  const auto wait = patienceOf(console_, kPeriod);
  while (box_->state() != link::LinkState::lost && box_->round(wait)) {
  }
}

Outcome<FollowedRun::Progress, Trouble> FollowedRun::askAgain() {
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

// The person at the keyboard says that the step begins, or that it is done.
void FollowedRun::markByHand(const Progress& progress) {
  const bool begins = progress.state == RunState::waiting;
  if (!begins && progress.state != RunState::running) return;
  const auto marked = ask<messages::PostMarker>(*box_, console_,
                                                {.procedure = run_,
                                                 .step = progress.step,
                                                 .phase = begins ? StepPhase::begin : StepPhase::end,
                                                 .rotary_angles_rad = progress.rotary_angles_rad,
                                                 .tool = progress.tool,
                                                 .nominal_speed_mm_s = progress.nominal_speed_mm_s,
                                                 .at_rest = true});
  if (!marked) console_.note("probebox: " + marked.error().what);
}

Trouble FollowedRun::replaced(std::uint32_t other) {
  replaced_ = true;
  return {ExitStatus::failed, "run-replaced",
          "run " + std::to_string(run_) + " is gone: the box is at run " + std::to_string(other) +
              "; it was restarted, or another calibration was started"};
}

void FollowedRun::show(const Progress& progress) {
  if (console_.json()) return console_.object(describe(progress));
  switch (progress.state) {
    case RunState::waiting:
      if (progress.steps == 0) return console_.progress(progress.prompt);
      console_.line(progress.prompt);
      if (!told_of_keys_ && console_.hasKeys())
        console_.note(
            "A controller that follows the box performs the steps itself. By hand: press Enter, perform the step, "
            "press Enter.");
      told_of_keys_ = true;
      return;
    case RunState::running:
      return console_.progress(printed("step %u of %u: measuring%s", progress.step + 1, progress.steps,
                                       console_.hasKeys() ? "; press Enter when it is done" : ""));
    case RunState::solving:
      return console_.line("solving");
    default:
      return;
  }
}

Outcome<std::string, Trouble> FollowedRun::dataset() {
  std::string text;
  while (true) {
    TRY(const auto piece, ask<messages::GetDataset>(*box_, console_, {run_, text.size()}));
    if (piece.bytes.empty() && text.size() < piece.total_bytes) {
      return Trouble{ExitStatus::failed, "not-saved", "the box sent only a part of the measured data; try again"};
    }
    text += piece.bytes;
    if (text.size() >= piece.total_bytes) return text;
    console_.progress(printed("fetching what was measured: %zu of %llu bytes", text.size(),
                              static_cast<unsigned long long>(piece.total_bytes)));
  }
}

bool FollowedRun::abortRun() {
  return box_->request<messages::AbortProcedure>({run_}, link::patience(milliseconds{2000})).ok();
}

Trouble FollowedRun::aborted() {
  console_.note(abortRun() ? "probebox: the run was aborted"
                           : "probebox: the stop request did not reach the box; see probebox calibrate --abort");
  return console_.interrupted() ? interruption() : outputGone();
}

}  // namespace probebox::command
