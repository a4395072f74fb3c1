#include <algorithm>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "protocol/units/megabytes.hpp"
#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/commands/update_front_end.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/link/bundle_to_send.hpp"
#include "tools/probebox/link/update_transfer.hpp"
#include "tools/probebox/text/progress_bar.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

using messages::UpdateState;
using messages::UpdateStatus;

constexpr milliseconds kPollEvery{500};
constexpr int kMostOffers = 5;  // each time that the box has forgotten one, such as by a restart

bool linkIsLost(const Trouble& trouble) {
  return trouble.name == "link-lost" || trouble.name == "timed-out" || trouble.name == "no-box";
}

Json describe(const UpdateStatus::Answer& status) {
  return {{"state", nameOf(status.state)},
          {"bundle", status.name},
          {"version", status.version},
          {"running_version", status.running_version},
          {"received_bytes", status.received_bytes},
          {"total_bytes", status.total_bytes},
          {"percent", status.percent},
          {"text", status.text},
          {"why_not", status.why_not}};
}

std::string inWords(const UpdateStatus::Answer& status) {
  switch (status.state) {
    case UpdateState::checking:
      return "the box checks the bundle";
    case UpdateState::waiting:
      return "the box has the bundle and begins to install it";
    case UpdateState::installing:
      return "installing";
    case UpdateState::installed:
      return "installed; the box restarts as soon as neither a cut nor a calibration is on";
    case UpdateState::restarting:
      return "the box restarts, and has to be found healthy";
    default:
      return std::string{nameOf(status.state)};
  }
}

// Brings one bundle to a box and follows it to its end, over as many links as that takes.
class BundleUpdate {
 public:
  BundleUpdate(const Update& options, link::Uri uri, BundleToSend bundle, Console& console)
      : options_{options}, uri_{std::move(uri)}, bundle_{std::move(bundle)}, console_{console} {}

  ExitStatus go() {
    while (true) {
      auto trouble = overOneLink();
      if (!trouble) return outcome();
      if (console_.interrupted()) return console_.fail(stopped());
      if (!linkIsLost(*trouble)) return console_.fail(std::move(*trouble));
      if (!reached_) return console_.fail(*trouble);
      trouble = wait(*trouble);
      if (trouble) return console_.fail(console_.interrupted() ? stopped() : *trouble);
    }
  }

 private:
  // Nothing when the update is done.
  std::optional<Trouble> overOneLink() {
    if (!box_) {
      auto box = openBox(uri_, console_, kConnectPatience, nullptr, kUpdateLink);
      if (!box) return box.error();
      box_ = std::move(*box);
      reached_ = true;
    }
    while (true) {
      if (installation_ == 0) {
        if (auto trouble = deliver()) {
          // It was restarted: what it holds it says itself.
          if (trouble->name != nameOf(messages::ErrorCode::not_found) || ++offers_ >= kMostOffers) return trouble;
          continue;
        }
      }
      if (options_.no_wait) return std::nullopt;
      if (auto trouble = follow()) return trouble;
      if (installation_ != 0) return std::nullopt;
      if (++offers_ >= kMostOffers)
        return Trouble{ExitStatus::box_refused, "update-lost",
                       "the box forgets the update again and again: look at its log"};
    }
  }

  std::optional<Trouble> deliver() {
    if (was_lost_) {
      if (auto trouble = awaitConfirmation()) return trouble;
    }
    const auto status = ask<UpdateStatus>(*box_, console_);
    if (!status) return status.error();
    if (!options_.force && !bundle_.version().empty() && bundle_.version() == status->running_version) {
      return Trouble{ExitStatus::box_refused, "not-newer",
                     "the box runs version " + bundle_.version() + " already: add --force to install it once more"};
    }
    UpdateTransfer transfer{*box_, bundle_, console_, [this](std::uint64_t held) { showReceived(held); }};
    const auto offer = transfer.run();
    sent_ += transfer.sentBytes();
    if (!offer) return offer.error();
    if (!said_whole_) console_.note("the box has the bundle (" + inMegabytes(bundle_.bytes()) + ")");
    said_whole_ = true;
    const auto begun =
        ask<messages::InstallUpdate>(*box_, console_, {.offer = *offer, .although_not_newer = options_.force});
    if (!begun) return begun.error();
    installation_ = begun->installation;
    return std::nullopt;
  }

  // A box that has restarted meanwhile takes nothing before its version is confirmed. Where that takes too long, it
  // refuses.
  std::optional<Trouble> awaitConfirmation() {
    const auto deadline = link::now() + std::chrono::duration_cast<Nanoseconds>(inMilliseconds(options_.patience_s));
    while (link::now() < deadline) {
      if (console_.interrupted()) return interruption();
      const auto status = ask<UpdateStatus>(*box_, console_);
      if (!status) return status.error();
      if (!status->why_not.starts_with("not-confirmed")) break;
      const std::string words = "the box has restarted, and has to be found healthy before it goes on";
      if (std::exchange(said_, words) != words) console_.note(words);
      for (const auto pause = patienceOf(console_, kPollEvery); box_->round(pause);) {
      }
    }
    return std::nullopt;
  }

  // Ends when the installation is over, or is not known to the box any more (then it is 0).
  std::optional<Trouble> follow() {
    while (true) {
      if (console_.interrupted()) return interruption();
      auto status = ask<UpdateStatus>(*box_, console_);
      if (!status) return status.error();
      if (status->installation != installation_) {
        installation_ = 0;
        return std::nullopt;
      }
      last_ = std::move(*status);
      if (isOver(last_.state)) return std::nullopt;
      showInstalling();
      for (const auto pause = patienceOf(console_, kPollEvery); box_->round(pause);) {
      }
    }
  }

  // Until the box is back.
  std::optional<Trouble> wait(const Trouble& loss) {
    box_.reset();
    was_lost_ = true;
    if (last_.state != UpdateState::restarting && last_.state != UpdateState::installed)
      console_.note("probebox: " + loss.what + "; waiting for " + uri_.text + " to come back");
    const auto deadline = link::now() + std::chrono::duration_cast<Nanoseconds>(inMilliseconds(options_.patience_s));
    while (link::now() < deadline && !console_.interrupted()) {
      auto box = openBox(uri_, console_, milliseconds{1000}, nullptr, kUpdateLink);
      if (box) {
        box_ = std::move(*box);
        return std::nullopt;
      }
      std::this_thread::sleep_for(milliseconds{200});
    }
    auto trouble = loss;
    trouble.what += "; " + uri_.text + " did not come back within " + printed("%g s", options_.patience_s) +
                    ". Look at the box; the same command goes on where it was";
    return trouble;
  }

  Trouble stopped() const {
    auto trouble = interruption();
    trouble.what += installation_ != 0 ? "; the box goes on installing: probebox update shows what comes of it"
                                       : "; the box keeps what it has: the same command goes on there";
    return trouble;
  }

  void showReceived(std::uint64_t held) {
    console_.progress("sending " + progressBar(held, bundle_.bytes()) + "  " + inMegabytes(held));
    const auto tenth = 10 * held / bundle_.bytes();
    if (!console_.errIsTerminal() && tenth > said_tenth_ && tenth < 10)
      console_.note("sent " + std::to_string(10 * tenth) + " %");
    said_tenth_ = tenth;
  }

  void showInstalling() {
    auto words = inWords(last_);
    if (last_.state == UpdateState::installing) {
      console_.progress(words + " " + progressBar(last_.percent, 100) + "  " + last_.text);
    } else if (last_.state == UpdateState::installed) {
      for (const auto& why : {last_.text, last_.why_not}) words += why.empty() ? "" : " (" + why + ")";
    }
    if (std::exchange(said_, words) != words) console_.note(words);
  }

  ExitStatus outcome() {
    const bool handed_over = options_.no_wait && !isOver(last_.state);
    if (console_.json()) {
      Json all = describe(last_);
      all["bundle"] = bundle_.name();
      all["version"] = last_.version.empty() ? bundle_.version() : last_.version;
      all["total_bytes"] = bundle_.bytes();
      all["sent_bytes"] = sent_;
      if (handed_over) all["state"] = nameOf(UpdateState::waiting);
      console_.object(all);
    }
    if (handed_over) {
      if (!console_.json()) console_.line("the box installs it and restarts; probebox update shows what comes of it");
      return ExitStatus::ok;
    }
    if (last_.state == UpdateState::done) {
      if (!console_.json()) console_.line("done: the box runs version " + last_.running_version);
      return ExitStatus::ok;
    }
    const bool back = last_.state == UpdateState::gone_back;
    const auto what = back ? "the box has gone back to version " + last_.running_version + ": " + last_.text
                           : "not installed: " + last_.text;
    console_.note("probebox: " + what);
    return back ? ExitStatus::failed : ExitStatus::box_refused;
  }

  const Update& options_;
  link::Uri uri_;
  BundleToSend bundle_;
  Console& console_;
  Box box_;
  bool reached_{};
  bool was_lost_{};
  int offers_{};
  std::uint64_t installation_{};
  std::uint64_t sent_{};
  UpdateStatus::Answer last_;
  bool said_whole_{};
  std::uint64_t said_tenth_{};
  std::string said_;
};

ExitStatus showHowItStands(const std::string& given, Console& console) {
  const auto box = openBox(given, console);
  if (!box) return console.fail(box.error());
  const auto status = ask<UpdateStatus>(**box, console);
  if (!status) return console.fail(status.error());
  if (console.json()) {
    console.object(describe(*status));
    return ExitStatus::ok;
  }
  if (!status->running_version.empty()) console.line("running    version " + status->running_version);
  if (status->state != UpdateState::none) {
    std::string state{nameOf(status->state)};
    std::ranges::replace(state, '_', ' ');
    console.line("update     " + state + (status->version.empty() ? "" : ", version " + status->version) +
                 (status->text.empty() ? "" : ": " + status->text));
  }
  if (status->total_bytes > 0) {
    console.line("received   " + status->name + ", " + inMegabytes(status->received_bytes) + " of " +
                 inMegabytes(status->total_bytes));
  }
  console.line(status->why_not.empty() ? "an update is possible: probebox update BUNDLE"
                                       : "not now    " + status->why_not);
  return ExitStatus::ok;
}

}  // namespace

ExitStatus run(const Update& options, const std::string& given, Console& console) {
  if (!options.front_end.empty()) return updateFrontEnd(options, given, console);
  if (options.bundle.empty()) return showHowItStands(given, console);
  auto bundle = BundleToSend::open(options.bundle);
  if (!bundle) return console.fail(bundle.error());
  const auto uri = chooseUri(given);
  if (!uri) return console.fail(uri.error());
  if (uri->isFile()) return console.fail(usage(uri->text + " is a recording: name a box with -u"));
  return BundleUpdate{options, *uri, std::move(*bundle), console}.go();
}

}  // namespace probebox::command
