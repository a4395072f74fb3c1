#include "firmware/app/results/standing_keeper.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "firmware/app/log/log.hpp"
#include "firmware/app/results/results_in_force.hpp"
#include "protocol/messages/fields.hpp"

namespace probebox::app {
namespace {

using Correction = StandingKeeper::Correction;

constexpr std::size_t kMostStandingBytes = 200;

// All that the file holds.
struct StandingBounds {
  Correction correction_mm{};
  Correction margin_mm{};
  std::string utc{};
  static constexpr void fields(auto& self, auto&& field) {
    field("correction_mm", self.correction_mm, "");
    field("margin_mm", self.margin_mm, "");
    field("utc", self.utc, "");
  }
};

std::optional<StandingBounds> contentOf(const store::TwinFile& file) {
  if (file.content().empty()) return std::nullopt;
  const auto content = messages::decode<StandingBounds>(std::as_bytes(std::span{file.content()}));
  return content ? std::optional{*content} : std::nullopt;
}

std::string encodedBounds(const StandingBounds& bounds) {
  const auto bytes = messages::encoded(bounds);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// The axes may stand wherever the machine's limits allow.
std::string boundsIfLost(const StandingKeeper::Limits& limits) {
  StandingBounds bounds{.utc = utcNow()};
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) bounds.margin_mm[axis] = limits[axis].size_mm;
  return encodedBounds(bounds);
}

bool alike(const Correction& a, const Correction& b, double difference_mm) {
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    if (!(std::abs(a[axis] - b[axis]) <= difference_mm)) return false;
  }
  return true;
}

ServableWithin within(const Correction& centre_mm, const Correction& margin_mm, MonoTime now) {
  ServableWithin bounds{.least_mm = centre_mm, .greatest_mm = centre_mm, .at = now};
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    bounds.least_mm[axis] -= margin_mm[axis];
    bounds.greatest_mm[axis] += margin_mm[axis];
  }
  return bounds;
}

}  // namespace

StandingKeeper::StandingKeeper(const std::string& path, const Limits& limits,
                               std::function<void(const Event&)> tell_core)
    : file_{store::TwinFile::open(path, kMostStandingBytes, boundsIfLost(limits))},
      limits_{limits},
      tell_core_{std::move(tell_core)} {
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) ahead_mm_[axis] = limits[axis].rate_mm_s * kAhead_s;
  if (!file_.notice().empty()) logWarning(file_.notice());
  if (!file_.whyNotWritable().empty()) setProblem(file_.whyNotWritable());
}

std::string StandingKeeper::problem() const {
  const std::lock_guard lock{mutex_};
  return problem_;
}

void StandingKeeper::setProblem(std::string what) {
  constexpr const char* kMeanwhile =
      "; corrections go no further from where they were kept last, and are degraded then";
  const bool is_new = problem().empty() && !what.empty();
  if (is_new) logError(what + kMeanwhile);
  const std::lock_guard lock{mutex_};
  problem_ = what.empty() ? "" : std::move(what) + kMeanwhile;
}

std::vector<Event> StandingKeeper::restore(MonoTime now, const std::optional<Correction>& exactly,
                                           const std::optional<store::Standing>& of_before) {
  Correction doubt_mm{};
  if (const auto content = contentOf(file_)) {
    kept_mm_ = content->correction_mm;
    margin_mm_ = content->margin_mm;
    doubt_mm = content->margin_mm;
  } else if (of_before) {
    kept_mm_ = of_before->correction_mm;
    doubt_mm = ahead_mm_;  // it was kept once a second
    margin_mm_ = doubt_mm;
  }
  const Correction standing_mm = exactly.value_or(kept_mm_);
  if (exactly) doubt_mm = {};
  const StandingRestored standing{.correction_mm = standing_mm, .at = now, .doubt_mm = doubt_mm};
  // Whatever the axes may stand at stays within what the disk knows, until the box is sure of more.
  const bool is_certain = doubt_mm == Correction{};
  if (is_certain) {
    (void)keep(standing_mm, ahead_mm_);
  } else if (!contentOf(file_)) {
    (void)keep(kept_mm_, margin_mm_);
  }
  return {standing, within(kept_mm_, margin_mm_, now)};
}

void StandingKeeper::look(const published::Snapshot& snapshot) {
  if (!snapshot.valid) return;
  was_valid_ = true;
  const bool is_new = margin_mm_ != ahead_mm_;
  bool is_near = is_new;
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis)
    is_near = is_near || std::abs(snapshot.correction_mm[axis] - kept_mm_[axis]) > margin_mm_[axis] / 2;
  if (!is_near && alike(kept_mm_, snapshot.correction_mm, kLeastChange_mm)) return;
  const bool was_just_tried = tried_at_ && snapshot.at - *tried_at_ < kLeastInterval;
  const bool failed_before = !problem().empty();
  if (was_just_tried && (!is_near || failed_before)) return;
  tried_at_ = snapshot.at;
  // Between the old bounds and the new ones the core keeps to both; also after a failure, which may have left either.
  auto both = either_ ? *either_ : within(kept_mm_, margin_mm_, snapshot.at);
  const auto next = within(snapshot.correction_mm, ahead_mm_, snapshot.at);
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    both.least_mm[axis] = std::max(both.least_mm[axis], next.least_mm[axis]);
    both.greatest_mm[axis] = std::min(both.greatest_mm[axis], next.greatest_mm[axis]);
  }
  both.at = snapshot.at;
  either_ = both;
  tell_core_(both);
  if (!keep(snapshot.correction_mm, ahead_mm_)) return;
  either_.reset();
  tell_core_(within(kept_mm_, margin_mm_, snapshot.at));
}

void StandingKeeper::finish(const published::Snapshot& snapshot, const std::optional<Correction>& exactly) {
  // Not valid since the start: what the axes stand at is what was kept.
  if (was_valid_ || snapshot.valid) (void)keep(exactly.value_or(snapshot.correction_mm), {});
}

bool StandingKeeper::keep(const Correction& correction_mm, const Correction& margin_mm) {
  const auto kept = file_.write(encodedBounds({correction_mm, margin_mm, utcNow()}));
  setProblem(kept ? "" : kept.error().what);
  if (!kept) return false;
  kept_mm_ = correction_mm;
  margin_mm_ = margin_mm;
  return true;
}

}  // namespace probebox::app
