#include "firmware/app/update/update_request_handler.hpp"

#include <random>
#include <utility>

#include "firmware/app/log/log.hpp"
#include "protocol/units/wording.hpp"

namespace probebox::app {
namespace {

using messages::ErrorCode;
using messages::InstallUpdate;
using messages::OfferUpdate;
using messages::Operation;
using messages::SendUpdate;
using messages::UpdateState;
using messages::UpdateStatus;

// Between two of them the disk may lose what it has not acknowledged: seconds of a slow line, fractions of one
// elsewhere.
constexpr std::uint64_t kStoreBytes = 1U << 20U;
constexpr std::chrono::seconds kStoreEvery{2};
constexpr std::chrono::seconds kFollowEvery{1};

constexpr const char* kNoUpdater =
    "no-updater: this box is no image that replaces itself: update the package or program that probeboxd came with "
    "(docs/vendor.md).";
constexpr const char* kNotConfirmed =
    "not-confirmed: the version that runs has not been found healthy since the box was started, and an update would "
    "overwrite the other one, which is the only one known to work. Wait up to 5 minutes: it is confirmed, or the box "
    "restarts, and goes back to the version before after three starts. Where neither happens, switch it off and on.";
constexpr const char* kLost =
    "the box does not know this offer any more: it was restarted, or took another bundle. Offer the bundle again.";

// Even a host that keeps nothing else can tell it from those before.
std::uint64_t randomNumber() {
  std::random_device random;
  return (std::uint64_t{random()} << 32U | random()) >> 1U | 1U;
}

std::string sentence(const UpdateStatus::Answer& now) {
  const auto version = now.version.empty() ? "a bundle" : "version " + now.version;
  const auto with = [&](const std::string& what) {
    return version + " " + what + (now.text.empty() ? "" : ": " + now.text);
  };
  switch (now.state) {
    case UpdateState::receiving:
      return version + " is being received, " + std::to_string(now.received_bytes) + " of " +
             std::to_string(now.total_bytes) + " bytes";
    case UpdateState::checking:
    case UpdateState::waiting:
      return version + " waits to be installed";
    case UpdateState::installing:
      return with("is being installed, " + std::to_string(now.percent) + " %");
    case UpdateState::installed:
      return with("waits for the restart of the box");
    case UpdateState::restarting:
      return version + " has been started and is not yet found healthy";
    case UpdateState::done:
      return with("runs");
    case UpdateState::not_installed:
      return with("was not installed");
    case UpdateState::gone_back:
      return with("was given up");
    case UpdateState::none:
      break;
  }
  return {};
}

}  // namespace

UpdateRequestHandler::UpdateRequestHandler(const std::filesystem::path& folder, const std::filesystem::path& reports,
                                           Dependencies dependencies)
    : deps_{std::move(dependencies)}, handed_over_{Clock::now()} {
  if (reports.empty()) return;
  parts_.emplace(Parts{.updater = {reports, folder}, .file = BundleFile{folder}});
  report_ = parts_->updater.report();
  tellWords();
}

bool UpdateRequestHandler::answers(Operation operation) {
  return operation == Operation::offer_update || operation == Operation::send_update ||
         operation == Operation::install_update || operation == Operation::update_status;
}

Reply UpdateRequestHandler::answer(Operation operation, std::span<const std::byte> body, const Caller& caller,
                                   Clock::time_point now) {
  if (operation == Operation::update_status) return status();
  if (!caller.may.allow_update) return notPermitted("allow_update");
  if (!parts_) return refused(ErrorCode::refused, kNoUpdater);
  if (operation == Operation::offer_update) return offer(body, now);
  if (operation == Operation::send_update) return send(body, now);
  return install(body);
}

std::optional<Error> UpdateRequestHandler::whyNotNow() const {
  if (!parts_) return Error{kNoUpdater};
  if (!deps_.confirmed()) return Error{kNotConfirmed};
  return whyNotAtRest(deps_.activity());
}

Reply UpdateRequestHandler::offer(std::span<const std::byte> body, Clock::time_point now) {
  const auto request = messages::decode<OfferUpdate::Request>(body);
  if (!request) return malformed(Operation::offer_update);
  if (request->total_bytes == 0) return refused(ErrorCode::malformed, "An empty file is no bundle.");
  if (const auto why = whyNotNow()) return refused(ErrorCode::wrong_state, why->what);
  auto& file = parts_->file;
  if (checking_ || file.installation() != 0)
    return refused(ErrorCode::busy,
                   "update-busy: the box is installing an update: wait for its end (probebox update).");
  const Bundle* before = file.bundle();
  if (offer_ != 0 && before != nullptr && before->sha256 != request->sha256 && now - heard_ < kAbandoned) {
    return refused(ErrorCode::busy, "update-busy: another host is sending " + shown(before->name) +
                                        ": wait until it is done, or half a minute after it has stopped.");
  }
  const Bundle bundle{.name = request->name,
                      .version = request->version,
                      .total_bytes = request->total_bytes,
                      .sha256 = request->sha256};
  if (const auto why = file.begin(bundle)) {
    offer_ = 0;
    return refused(ErrorCode::refused, why->what);
  }
  offer_ = ++last_offer_;
  heard_ = stored_at_ = now;
  failed_installation_ = 0;
  tellWords();
  return ok(OfferUpdate::Answer{.offer = offer_, .received_bytes = file.received()});
}

std::optional<Reply> UpdateRequestHandler::whyNotThis(std::uint32_t offer) const {
  if (offer_ == 0 || offer != offer_ || parts_->file.bundle() == nullptr)
    return refused(ErrorCode::not_found, std::string{"update-lost: "} + kLost);
  if (const auto why = whyNotNow()) return refused(ErrorCode::wrong_state, why->what);
  return std::nullopt;
}

Reply UpdateRequestHandler::send(std::span<const std::byte> body, Clock::time_point now) {
  const auto request = messages::decode<SendUpdate::Request>(body);
  if (!request) return malformed(Operation::send_update);
  if (auto refusal = whyNotThis(request->offer)) return *refusal;
  auto& file = parts_->file;
  heard_ = now;
  const std::uint64_t end = request->offset + request->bytes.size();
  if (end < request->offset || end > file.bundle()->total_bytes)
    return refused(ErrorCode::malformed, "This part ends after the end of the bundle.");
  // A part that begins later has lost its predecessor; one that ends earlier is stored already.
  if (request->offset <= file.received() && end > file.received()) {
    const auto fresh = std::span{request->bytes}.subspan(file.received() - request->offset);
    if (const auto why = file.append(fresh)) {
      offer_ = 0;
      return refused(ErrorCode::refused, why->what);
    }
    if (file.received() - file.stored() >= kStoreBytes || file.complete()) {
      stored_at_ = now;
      if (const auto why = file.store()) {
        offer_ = 0;
        return refused(ErrorCode::refused, why->what);
      }
    }
  }
  return ok(SendUpdate::Answer{.received_bytes = file.received(), .stored_bytes = file.stored()});
}

Reply UpdateRequestHandler::install(std::span<const std::byte> body) {
  const auto request = messages::decode<InstallUpdate::Request>(body);
  if (!request) return malformed(Operation::install_update);
  if (checking_) return refused(ErrorCode::busy, "update-busy: the box is checking this bundle already.");
  if (auto refusal = whyNotThis(request->offer)) return *refusal;
  auto& file = parts_->file;
  if (!file.complete()) {
    return refused(ErrorCode::wrong_state,
                   "The bundle is not complete: " + std::to_string(file.bundle()->total_bytes - file.received()) +
                       " bytes are missing. Send them first.");
  }
  checking_ = Asked{.installation = randomNumber(), .although_not_newer = request->although_not_newer};
  file.beginCheck();
  deps_.look_again();
  return ok(InstallUpdate::Answer{.installation = checking_->installation});
}

Reply UpdateRequestHandler::status() {
  // The first report of a box comes after the start of this program.
  if (parts_) report_ = parts_->updater.report();
  auto answer = current();
  if (const auto why = whyNotNow()) answer.why_not = why->what;
  return ok(answer);
}

UpdateStatus::Answer UpdateRequestHandler::current() const {
  UpdateStatus::Answer answer;
  if (!parts_) return answer;
  const auto& file = parts_->file;
  if (report_) {
    answer.running_version = report_->running_version;
    answer.state = report_->state;
    answer.installation = report_->installation;
    answer.version = report_->version;
    answer.percent = report_->percent;
    answer.text = report_->text;
  }
  if (const Bundle* bundle = file.bundle()) {
    answer.name = bundle->name;
    answer.received_bytes = file.received();
    answer.total_bytes = bundle->total_bytes;
  }
  const auto instead = [&](UpdateState state, std::uint64_t installation) {
    answer.state = state;
    answer.installation = installation;
    answer.version = file.bundle() == nullptr ? "" : file.bundle()->version;
    answer.percent = 0;
    answer.text.clear();
  };
  if (checking_) {
    instead(UpdateState::checking, checking_->installation);
    answer.percent = file.checkedPercent();
  } else if (file.installation() != 0) {
    if (answer.installation != file.installation()) instead(UpdateState::waiting, file.installation());
  } else if (failed_installation_ != 0) {
    instead(UpdateState::not_installed, failed_installation_);
    answer.text = why_failed_;
  } else if (offer_ != 0) {
    instead(UpdateState::receiving, 0);
  }
  return answer;
}

void UpdateRequestHandler::look(Clock::time_point now) {
  if (!parts_) return;
  if (checking_) return check(now);
  if (parts_->file.received() > parts_->file.stored() && now - stored_at_ >= kStoreEvery) {
    stored_at_ = now;
    if (const auto why = parts_->file.store()) {
      offer_ = 0;
      logError("An update is lost: " + why->what);
    }
    tellWords();
  }
  if (parts_->file.installation() != 0 && now - followed_ >= kFollowEvery) follow(now);
}

void UpdateRequestHandler::check(Clock::time_point now) {
  auto& file = parts_->file;
  const auto checked = file.check();
  if (!checked) return end(checked.error().what);
  if (*checked == BundleFile::Check::going_on) return deps_.look_again();
  if (*checked == BundleFile::Check::bad) {
    file.drop();
    return end(
        "hash-mismatch: what the box received is not the bundle that was offered, and is removed: send it again.");
  }
  const auto [installation, although_not_newer] = *checking_;
  if (const auto why = file.setInstallation(installation)) return end(why->what);
  if (const auto why = parts_->updater.askInstall(installation, although_not_newer)) {
    static_cast<void>(file.setInstallation(0));
    return end(why->what);
  }
  logInfo("The bundle " + shown(file.bundle()->name) + " is handed to the updater.");
  checking_.reset();
  offer_ = 0;
  restart_asked_ = false;
  handed_over_ = now;
  tellWords();
}

// Follows what the updater does with the bundle that it was handed.
void UpdateRequestHandler::follow(Clock::time_point now) {
  followed_ = now;
  auto& [updater, file] = *parts_;
  report_ = updater.report();
  if (!report_ || report_->installation != file.installation()) {
    const auto waited = now - handed_over_;
    if (waited < kUntaken || (!updater.takeBack() && waited < kUnreported)) return tellWords();
    const auto installation = file.installation();
    static_cast<void>(file.setInstallation(0));
    failed_installation_ = installation;
    why_failed_ =
        "updater-silent: the updater of this box reports nothing about the bundle: restart the box and try again.";
    logError(why_failed_);
  } else if (report_->state == UpdateState::installed && !restart_asked_ && !whyNotAtRest(deps_.activity())) {
    const auto why = updater.askRestart();
    if (why) logError(why->what);
    restart_asked_ = !why;
  } else if (report_->state == UpdateState::not_installed) {
    static_cast<void>(file.setInstallation(0));  // it may be wanted although it is not newer
  } else if (isOver(report_->state)) {
    file.drop();
  }
  tellWords();
}

// The installation ends before the updater has it.
void UpdateRequestHandler::end(const std::string& why) {
  failed_installation_ = std::exchange(checking_, std::nullopt)->installation;
  why_failed_ = why;
  offer_ = 0;
  logWarning("An update was not installed: " + why);
  tellWords();
}

void UpdateRequestHandler::tellWords() {
  auto words = sentence(current());
  const std::lock_guard lock{mutex_};
  words_ = std::move(words);
}

std::string UpdateRequestHandler::inWords() const {
  const std::lock_guard lock{mutex_};
  return words_;
}

}  // namespace probebox::app
