#include "tools/probebox/link/lasting_stream.hpp"

#include <algorithm>
#include <thread>
#include <utility>

#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

constexpr milliseconds kRound{1000};
constexpr milliseconds kSearchPause{200};
constexpr milliseconds kResumePause{100};
constexpr milliseconds kRightsPatience{2000};
constexpr int kMostRefusals = 20;

}  // namespace

LastingStream::LastingStream(link::Uri uri, const Options& options, link::StreamListener& listener, Console& console)
    : uri_{std::move(uri)}, options_{options}, listener_{listener}, console_{console} {}

std::optional<Trouble> LastingStream::open() {
  return connect(kConnectPatience);
}

bool LastingStream::round() {
  if (trouble_) return false;
  if (!box_) return search();
  box_->round(patienceOf(console_, kRound));
  if (box_->state() == link::LinkState::lost) {
    lose();
    return true;
  }
  return box_->streaming() || startAgain();
}

std::optional<Trouble> LastingStream::connect(milliseconds limit) {
  TRY(auto box, openBox(uri_, console_, limit, this, {.last_boot_id = boot_id_.value_or(messages::BootId{})}));
  box_ = std::move(box);
  refusals_ = 0;
  start();
  return std::nullopt;
}

void LastingStream::start() {
  messages::Start start;
  start.policy = options_.policy;
  start.profile = options_.profile.value_or(link::suitableProfile(uri_, box_->described()));
  start.has_resume = tally_.begun();
  start.resume_from = tally_.next();
  start.triggers = options_.triggers;
  start.triggers_from = next_trigger_;
  box_->start(start);
}

// A stream can be resumed only once the next sample exists, which is a moment after the old link broke.
bool LastingStream::startAgain() {
  if (!tally_.begun() || ++refusals_ > kMostRefusals) {
    trouble_ = troubleOf(*box_->failure(), console_);
    return false;
  }
  std::this_thread::sleep_for(kResumePause);
  start();
  return true;
}

// The old link goes first: a device on USB serves one program at a time.
void LastingStream::lose() {
  loss_ = box_->failure()->what;
  box_.reset();
  obstacle_.clear();
  deadline_ = link::now() + options_.patience;
  console_.note("probebox: " + loss_ + "; waiting for " + uri_.text +
                printed(" to come back (%g s)", toSeconds(options_.patience)));
}

bool LastingStream::search() {
  const auto trouble = connect(kRound);
  if (!trouble) {
    ++reconnections_;
    console_.note("probebox: " + uri_.text + " is back" +
                  (tally_.begun() ? ", resuming at sample " + std::to_string(tally_.next().index) : std::string{}));
    return true;
  }
  // That nothing is there was said already. What keeps this person from a box that is there was not; but rights come a
  // moment after the device.
  const bool withheld = trouble->name == "no-permission" || trouble->name == "busy";
  if (!withheld || trouble->what != obstacle_) {
    obstacle_ = withheld ? trouble->what : "";
    obstacle_since_ = link::now();
    obstacle_said_ = false;
  }
  if (withheld && !obstacle_said_ && link::now() - obstacle_since_ > kRightsPatience) {
    obstacle_said_ = true;
    console_.note("probebox: " + obstacle_);
  }
  if (console_.interrupted()) return true;
  if (link::now() < deadline_) {
    std::this_thread::sleep_for(kSearchPause);
    return true;
  }
  trouble_ = Trouble{ExitStatus::no_box, "link-lost",
                     "the link was lost for good: " + loss_ + (obstacle_.empty() ? "" : "; then " + obstacle_)};
  return false;
}

void LastingStream::onWelcome(const messages::Welcome& welcome) {
  if (boot_id_ && *boot_id_ != welcome.boot_id) {
    tally_.restarted();
    next_trigger_ = 0;
  }
  boot_id_ = welcome.boot_id;
  listener_.onWelcome(welcome);
}

void LastingStream::onBlock(const link::DecodedBlock& block) {
  tally_.block(block.header.first, block.header.count);
  listener_.onBlock(block);
}

void LastingStream::onGap(const messages::Gap& gap) {
  tally_.gap(gap);
  listener_.onGap(gap);
}

void LastingStream::onHole(const messages::Gap& hole) {
  tally_.hole(hole);
  listener_.onHole(hole);
}

void LastingStream::onTrigger(const messages::Trigger& trigger) {
  ++triggers_.received;
  next_trigger_ = trigger.number + 1;
  listener_.onTrigger(trigger);
}

void LastingStream::onTriggerGap(const messages::TriggerGap& gap) {
  triggers_.declared_lost += gap.count;
  next_trigger_ = gap.first + gap.count;
  listener_.onTriggerGap(gap);
}

void LastingStream::onTriggerHole(const messages::TriggerGap& hole) {
  triggers_.inferred_lost += hole.count;
  listener_.onTriggerHole(hole);
}

void LastingStream::onHeartbeat(const messages::Heartbeat& beat, const std::optional<link::Balance>& balance) {
  tally_.heartbeat(beat, balance);
  if (options_.triggers) next_trigger_ = std::max(next_trigger_, beat.next_trigger);
  listener_.onHeartbeat(beat, balance);
}

}  // namespace probebox::command
