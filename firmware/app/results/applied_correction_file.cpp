#include "firmware/app/results/applied_correction_file.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "firmware/app/log/log.hpp"
#include "firmware/app/results/results_in_force.hpp"
#include "protocol/messages/fields.hpp"

namespace probebox::app {
namespace {

using Correction = AppliedCorrectionFile::Correction;

// Never change it: a file of another size is unreadable.
constexpr std::size_t kMostAppliedBytes = 200;

// All that the file holds.
struct AppliedBounds {
  Correction correction_mm{};
  Correction margin_mm{};
  std::string utc{};
  // The start that wrote this, and the one whose record of what a CNC has read last holds until that has one of its
  // own.
  std::uint64_t start{};
  std::uint64_t no_later_than{};
  std::uint64_t count{};  // of the newest record of reads
  static constexpr void fields(auto& self, auto&& field) {
    field("correction_mm", self.correction_mm, "");
    field("margin_mm", self.margin_mm, "");
    field("utc", self.utc, "");
    field("start", self.start, "");
    field("no_later_than", self.no_later_than, "");
    field("count", self.count, "");
  }
};

std::optional<AppliedBounds> contentOf(const store::TwinFile& file) {
  if (file.content().empty()) return std::nullopt;
  const auto content = messages::decode<AppliedBounds>(std::as_bytes(std::span{file.content()}));
  return content ? std::optional{*content} : std::nullopt;
}

std::string encodedBounds(const AppliedBounds& bounds) {
  const auto bytes = messages::encoded(bounds);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// The axes may stand wherever the machine's limits allow.
std::string boundsIfLost(const AppliedCorrectionFile::Limits& limits) {
  AppliedBounds bounds{.utc = utcNow()};
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

bool isWithin(const Correction& at_mm, const AppliedBounds& bounds) {
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    constexpr double kResolution_mm = 1e-6;
    if (!(std::abs(at_mm[axis] - bounds.correction_mm[axis]) <= bounds.margin_mm[axis] + kResolution_mm)) return false;
  }
  return true;
}

constexpr const char* kUntilNoStep = ": corrections are valid once no axis can see a step";

// What a lost file leaves unknown, behind what became of it.
std::string noticeOf(const store::TwinFile& file) {
  return file.lost() ? file.notice() + ". Where the axes stand is lost" + kUntilNoStep : file.notice();
}

}  // namespace

AppliedCorrectionFile::AppliedCorrectionFile(const std::string& path, const Limits& limits,
                                             std::function<void(const Event&)> tell_core, store::Before before)
    : file_{store::TwinFile::open(path, kMostAppliedBytes, boundsIfLost(limits), before)},
      notice_{noticeOf(file_)},
      limits_{limits},
      tell_core_{std::move(tell_core)} {
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) ahead_mm_[axis] = limits[axis].rate_mm_s * kAhead_s;
  file_.replaceUnread();
  if (!notice().empty()) logWarning(notice());
  if (!file_.whyNotWritable().empty()) setProblem(file_.whyNotWritable());
}

std::string AppliedCorrectionFile::problem() const {
  const std::lock_guard lock{mutex_};
  return problem_;
}

void AppliedCorrectionFile::setProblem(std::string what) {
  constexpr const char* kMeanwhile =
      "; corrections go no further from where they were kept last, and are degraded then";
  const std::lock_guard lock{mutex_};
  const bool is_new = problem_.empty() && !what.empty();
  if (is_new) logError(what + kMeanwhile);
  problem_ = what.empty() ? "" : std::move(what) + kMeanwhile;
}

// A record that was left by an earlier start than the last one, or before the last write to the disk, is older than
// what the disk has. One whose start found the disk as it is now, and could not write to it, is newer. None that is
// true lies outside of the bounds.
std::optional<Correction> AppliedCorrectionFile::exactly(const LastServedAtStart& served) const {
  const auto content = contentOf(file_);
  if (!served.found_mm || !content || served.found_start == 0) return std::nullopt;
  const bool is_newest = served.found_start == content->start || served.found_start == content->no_later_than ||
                         (content->start != 0 && served.found_on_disk == content->start);
  const bool is_true = is_newest && served.found_count >= content->count && isWithin(*served.found_mm, *content);
  return is_true ? served.found_mm : std::nullopt;
}

std::vector<Event> AppliedCorrectionFile::restore(MonoTime now, const LastServedAtStart& served) {
  const auto exactly = this->exactly(served);
  start_ = served.start;
  no_later_than_ = exactly && served.is_kept ? served.found_start : 0;
  count_ = std::max(served.found_count, countOnDisk());
  Correction doubt_mm{};
  if (const auto content = contentOf(file_)) {
    kept_mm_ = content->correction_mm;
    margin_mm_ = content->margin_mm;
    if (served.found_mm && !exactly && !isWithin(*served.found_mm, *content)) reachAlso(*served.found_mm);
    doubt_mm = margin_mm_;
  }
  const Correction applied_mm = exactly.value_or(kept_mm_);
  if (contentOf(file_)) applied_before_mm_ = applied_mm;
  if (exactly) doubt_mm = {};
  if (applied_before_mm_) {
    // Until somebody reads, the axes stay where they were, as far as that is known.
    unread_ = LastRead{applied_mm, applied_mm, applied_mm, count_};
    for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
      unread_->least_mm[axis] -= doubt_mm[axis];
      unread_->greatest_mm[axis] += doubt_mm[axis];
    }
  }
  const AppliedRestored applied{.correction_mm = applied_mm, .at = now, .doubt_mm = doubt_mm};
  // Whatever the axes may stand at stays within what the disk knows, until the box is sure of more.
  const bool is_certain = doubt_mm == Correction{};
  const bool told = is_certain ? keep(applied_mm, ahead_mm_) : keep(kept_mm_, margin_mm_);
  // The next start will believe what was found, so nothing else may be served.
  if (!told && exactly && !served.is_kept) kept_mm_ = applied_mm, margin_mm_ = {};
  return {applied, within(kept_mm_, margin_mm_, now)};
}

// Either file may be one of before, put back from a copy: the axes stand at what one of them says.
void AppliedCorrectionFile::reachAlso(const Correction& recorded_mm) {
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis)
    margin_mm_[axis] = std::max(margin_mm_[axis], std::abs(recorded_mm[axis] - kept_mm_[axis]) + ahead_mm_[axis]);
  const std::string what =
      std::string{"served and served-last contradict each other, so one of them is of an earlier start"} + kUntilNoStep;
  logWarning(what);
  notice_ += (notice_.empty() ? "" : ". ") + what;
}

std::uint64_t AppliedCorrectionFile::startOnDisk() const {
  const auto content = contentOf(file_);
  return content ? content->start : 0;
}

std::uint64_t AppliedCorrectionFile::countOnDisk() const {
  const auto content = contentOf(file_);
  return content ? content->count : 0;
}

// How far the present value, and what other readers have read last, lie from where the axes are taken to stand.
Correction AppliedCorrectionFile::reach(const Correction& from_mm, const published::Snapshot& snapshot,
                                        const std::optional<LastRead>& read) {
  Correction reach_mm{};
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    reach_mm[axis] = std::abs(snapshot.correction_mm[axis] - from_mm[axis]);
    if (!read) continue;
    reach_mm[axis] =
        std::max({reach_mm[axis], from_mm[axis] - read->least_mm[axis], read->greatest_mm[axis] - from_mm[axis]});
  }
  return reach_mm;
}

void AppliedCorrectionFile::look(const published::Snapshot& snapshot, const std::optional<LastRead>& read_since) {
  if (!snapshot.valid) return;
  const auto& read = read_since ? read_since : unread_;
  was_valid_ = true;
  if (read) count_ = std::max(count_, read->count);
  const auto applied_mm = read ? read->newest_mm : snapshot.correction_mm;
  auto margin_mm = reach(applied_mm, snapshot, read);
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) margin_mm[axis] += ahead_mm_[axis];
  bool is_near = false;
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    const double left_mm = margin_mm_[axis] - std::abs(snapshot.correction_mm[axis] - kept_mm_[axis]);
    is_near = is_near || left_mm < ahead_mm_[axis] / 2;
  }
  const bool is_as_kept = alike(kept_mm_, applied_mm, kLeastChange_mm) && alike(margin_mm_, margin_mm, kLeastChange_mm);
  if (!is_near && is_as_kept) return;
  const bool was_just_tried = tried_at_ && snapshot.at - *tried_at_ < kLeastInterval;
  const bool failed_before = failing_;
  if (was_just_tried && (!is_near || failed_before)) return;
  tried_at_ = snapshot.at;
  // Between the old bounds and the new ones the core keeps to both; also after a failure, which may have left either.
  auto both = either_ ? *either_ : within(kept_mm_, margin_mm_, snapshot.at);
  const auto next = within(applied_mm, margin_mm, snapshot.at);
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    both.least_mm[axis] = std::max(both.least_mm[axis], next.least_mm[axis]);
    both.greatest_mm[axis] = std::min(both.greatest_mm[axis], next.greatest_mm[axis]);
  }
  both.at = snapshot.at;
  either_ = both;
  tell_core_(both);
  if (!keep(applied_mm, margin_mm)) return;
  either_.reset();
  tell_core_(within(kept_mm_, margin_mm_, snapshot.at));
}

void AppliedCorrectionFile::finish(const published::Snapshot& snapshot, const std::optional<LastRead>& read_since) {
  const auto& read = read_since ? read_since : unread_;
  // Not valid since the start: what the axes stand at is what was kept.
  if (!was_valid_ && !snapshot.valid) return;
  if (read) count_ = std::max(count_, read->count);
  auto at_the_end = snapshot;
  if (read) at_the_end.correction_mm = read->newest_mm;
  (void)keep(at_the_end.correction_mm, reach(at_the_end.correction_mm, at_the_end, read));
}

bool AppliedCorrectionFile::keep(const Correction& correction_mm, const Correction& margin_mm) {
  const auto kept = file_.write(encodedBounds({correction_mm, margin_mm, utcNow(), start_, no_later_than_, count_}));
  setProblem(kept ? "" : kept.error().what);
  failing_ = !kept;
  if (!kept) return false;
  kept_mm_ = correction_mm;
  margin_mm_ = margin_mm;
  return true;
}

}  // namespace probebox::app
