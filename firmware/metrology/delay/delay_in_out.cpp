#include "firmware/metrology/delay/delay_in_out.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/delay/delay_method.hpp"
#include "firmware/metrology/delay/drive_contact.hpp"
#include "firmware/metrology/fit/chi_square.hpp"
#include "firmware/metrology/fit/least_squares.hpp"
#include "firmware/metrology/fit/noise_check.hpp"
#include "firmware/metrology/scan/contact_ringing.hpp"
#include "firmware/metrology/scan/non_contact_probe.hpp"
#include "firmware/metrology/scan/quantised_legs.hpp"
#include "firmware/metrology/scan/waveform_match.hpp"
#include "firmware/metrology/touch/despiking.hpp"
#include "firmware/metrology/touch/free_stylus.hpp"
#include "firmware/metrology/touch/one_speed.hpp"
#include "firmware/metrology/touch/previous_delay.hpp"
#include "firmware/metrology/touch/size_line.hpp"
#include "firmware/metrology/touch/stamp_jitter.hpp"
#include "firmware/metrology/touch/stamp_jumps.hpp"
#include "firmware/metrology/touch/touch.hpp"
#include "firmware/metrology/touch/touch_delay.hpp"
#include "protocol/units/angle.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

enum class ProbeZero { known, of_record };

constexpr double kSpeedOfDrive = 0.2;  // share that it may differ from the nominal one

// A drive without a rest takes as long from half the deflection to none as from the apex to half of it.
std::optional<Refusal> notAtZeroBeside(const Touch& touch) {
  const Stream& probe = touch.probe;
  const Eigen::VectorXd size = probe.values.rowwise().norm();
  Eigen::Index deepest = 0;
  const double highest = size.maxCoeff(&deepest);
  Eigen::Index half = deepest;
  while (half + 1 < size.size() && size[half] > 0.5 * highest) ++half;
  const double apex_s = probe.times[static_cast<std::size_t>(deepest)];
  const double fall_s = 2.0 * (probe.times[static_cast<std::size_t>(half)] - apex_s);
  if (!(fall_s > 0.0)) return std::nullopt;
  return notAtZero(
      touch, {.at_s = apex_s + fall_s, .fall_s = fall_s, .units_per_mm = highest / (fall_s * touch.plan.speed_mm_s)});
}

// What is wrong with the record of one drive in and out as a whole: stamps-jump, and where the probe's zero is known
// probe-not-at-zero.
std::optional<Refusal> badDrive(const Touch& touch, const StampJitter& jitter, ProbeZero zero) {
  const Despiked machine = withoutSpikes(touch.machine, jitter.machine_s);
  const Despiked probe = withoutSpikes(touch.probe, jitter.probe_s);
  const Touch clean{touch.plan, machine.stream, probe.stream};
  if (auto bad = stampsJump(clean, jitter.machine_s)) return bad;
  return zero == ProbeZero::known ? notAtZeroBeside(clean) : std::nullopt;
}

// Refuses speed-differs, from the nominal speed by more than 20 %: both streams by a clock of another rate show the
// same motion, and its speed alone tells.
std::optional<Refusal> speedOfDriveDiffers(const TouchPlan& plan, double speed_mm_s) {
  if (std::abs(speed_mm_s - plan.speed_mm_s) <= kSpeedOfDrive * plan.speed_mm_s) return std::nullopt;
  return Refusal{"speed-differs", plan.name + ": the machine drives at " + text(speed_mm_s) + " mm/s where " +
                                      text(plan.speed_mm_s) +
                                      " is stated; set the feed override to 100 %, or correct the time stamps"};
}

constexpr double kSettling_s = 0.02;          // a stylus that bounced at contact is quiet after this
constexpr double kBounceResidualRatio = 1.3;  // residuals that much above the noise: it did bounce
// Where ringing is fitted to what a bounce leaves: of 4000 simulated drives with bounces of 0.2 mm, 14 of the 33 with
// 10 and fewer were off by 20 sd and more, and none of those with more.
constexpr std::size_t kLeastFreedom = 11;

// Shapes of a drive in and out: the rate changes its sign at the apex, the path is the distance from it. What rang is
// a shape of its own: how much it rang is uncertain, too.
WaveformPair seenTwice(const DriveContact& contact, const std::optional<ContactRinging>& ringing) {
  const double apex = contact.machine_apex_s;
  const double start = apex - contact.probe_apex_s;
  const double first = contact.from + start;
  return {.name = contact.name,
          .machine = &contact.machine,
          .probe = &contact.probe,
          .from = contact.from + start + 0.2 * contact.probe.period(),
          .until = contact.until + start - 0.2 * contact.probe.period(),
          .shapes =
              [apex, first, ringing](const Grid& grid) {
                const Eigen::ArrayXd since = grid.times.array() - apex;
                Eigen::MatrixXd shapes{since.size(), ringing ? 7 : 3};
                shapes.leftCols<3>() << since.sign(), since.abs(), Eigen::ArrayXd::Ones(since.size());
                if (ringing) shapes.rightCols<4>() = ringing->shapes(grid.times.array() - first);
                return shapes;
              },
          .skipped = {{apex - contact.kink_s, apex + contact.kink_s}},
          .rounded = contact.rounded};
}

std::vector<WaveformPair> seenTwice(const std::vector<DriveContact>& contacts,
                                    const std::optional<ContactRinging>& ringing) {
  std::vector<WaveformPair> records;
  for (const auto& contact : contacts) records.push_back(seenTwice(contact, ringing));
  return records;
}

struct Matched {
  Match match;
  std::string warning{};
  std::size_t least_dof{};
};

bool isCalm(const Match& match) {
  // Without noise, what is left are the kinks of the motion.
  return match.rms_mm <= kCaseDigits ||
         (match.rms_mm <= kBounceResidualRatio * match.expected_mm && match.dropped.empty());
}

// Over the whole contact; where that does not fit, without the time that the stylus took to settle.
Outcome<Matched, Refusal> matchContacts(std::vector<WaveformPair> records, double start) {
  auto whole = matchWaveforms(records, start, Interpolation::linear);
  if (whole && isCalm(whole.value())) return Matched{std::move(whole).value()};
  // At least the second half of the way in stays.
  for (auto& record : records) record.from += std::min(kSettling_s, 0.35 * (record.until - record.from));
  auto settled = matchWaveforms(records, start, Interpolation::linear);
  if (!settled) return whole ? Outcome<Matched, Refusal>{Matched{std::move(whole).value()}} : settled.error();
  const bool is_better = isCalm(settled.value()) || (whole && widenedSd(settled.value()) <= widenedSd(whole.value()));
  if (whole && !is_better) return Matched{std::move(whole).value()};
  return Matched{
      std::move(settled).value(),
      "the stylus bounced at contact: the samples right after it are omitted, which increases the standard deviation"};
}

// What rings in the stylus since its contact is taken out where the time right after it is not all that it spoils: how
// a stylus rings, to both sides or away from the surface alone, is not known, and samples without it are worth more.
Outcome<Matched, Refusal> matchQuiet(const std::vector<DriveContact>& contacts, double start) {
  std::vector<DrivenContact> driven;
  for (const auto& contact : contacts) {
    driven.push_back(
        {&contact.machine, &contact.probe, contact.from, contact.until, contact.machine_apex_s, contact.kink_s});
  }
  auto plain = matchContacts(seenTwice(contacts, {}), start);
  if (plain && isCalm(plain->match)) return plain;
  const auto ringing = contactRinging(driven, start);
  if (!ringing) return plain;
  double most = 0.0;
  std::vector<DriveContact> quiet = contacts;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    quiet[i].probe = withoutContactRinging(driven[i], *ringing, ringing->amplitudes[i]);
    most = std::max(most, ringing->amplitudes[i].norm());
  }
  auto matched = matchContacts(seenTwice(quiet, ringing), start);
  if (!matched) return plain;
  if (matched->warning.empty()) {
    matched->warning = "the stylus rang at contact by up to " + text(most) + " at " + text(ringing->w / kTurn) +
                       " Hz: the ringing is fitted and removed";
  } else {
    matched->least_dof = kLeastFreedom;
  }
  return matched;
}

// Much ringing leads the start astray: then what came of it is the next start.
Outcome<Matched, Refusal> matchFrom(std::vector<DriveContact> contacts, double start) {
  constexpr int kStarts = 4;
  constexpr double kClose = 0.25;   // of a period of the probe
  constexpr double kAstray = 0.25;  // of a contact
  auto matched = matchQuiet(contacts, start);
  for (int round = 1; matched && round < kStarts; ++round) {
    const double tau = matched->match.tau_s;
    if (std::abs(tau - start) < kClose * contacts.front().probe.period()) break;
    if (std::abs(tau - start) > kAstray * (contacts.front().until - contacts.front().from)) {
      return Refusal{"no-convergence",
                     "machine and probe do not show the same motion in and out: are they the same touch?"};
    }
    start = tau;
    for (auto& contact : contacts) contact.probe_apex_s = contact.machine_apex_s - tau;
    matched = matchQuiet(contacts, start);
  }
  return matched;
}

// Drives that contradict one delay, and of which each agrees with one of its own: those of the axes differ.
std::optional<Refusal> delaysDiffer(std::span<const Touch> touches, const std::vector<DriveContact>& contacts) {
  constexpr double kMostSd = 6;
  std::string told;
  const auto tell = [&](std::size_t i, double tau_s) {
    told += (told.empty() ? "" : ", ") + touches[i].plan.name + " " + text(std::round(tau_s * 1e6) / 1e3) + " ms";
  };
  std::vector<Match> alone;
  for (const auto& contact : contacts) {
    const auto matched = matchFrom({contact}, contact.machine_apex_s - contact.probe_apex_s);
    if (!matched || poorMatch(matched->match, kMostDroppedShare)) return std::nullopt;
    tell(alone.size(), matched->match.tau_s);
    alone.push_back(matched->match);
  }
  const auto [least, most] = std::ranges::minmax(alone, {}, &Match::tau_s);
  if (most.tau_s - least.tau_s <= kMostSd * std::hypot(widenedSd(most), widenedSd(least))) return std::nullopt;
  return Refusal{"axes-delays-differ", "the drives contradict one delay, and each agrees with one of its own: " + told +
                                           "; solve those of each axis alone, and look why their stamps are not "
                                           "equally late"};
}

std::optional<Refusal> tooFewAfterBounce(const Touch& touch, const Matched& matched) {
  if (matched.match.dof >= matched.least_dof) return std::nullopt;
  return Refusal{
      "too-few-samples",
      touch.plan.name +
          ": the stylus rang and bounced, and the samples after that do not show both the ringing and the delay; "
          "move further into the surface or more slowly, or sample faster"};
}

double startOf(const std::vector<DriveContact>& contacts) {
  double sum = 0.0;
  for (const auto& contact : contacts) sum += contact.machine_apex_s - contact.probe_apex_s;
  return sum / static_cast<double>(contacts.size());
}

// Drives along one line, at speeds that differ enough.
bool partsLostMotion(std::span<const Touch> touches) {
  constexpr double kSameLine = 0.999;  // cosine of 2.6 degrees
  double slowest = touches.front().plan.speed_mm_s, fastest = slowest;
  for (const auto& touch : touches) {
    if (std::abs(touch.plan.retract.dot(touches.front().plan.retract)) < kSameLine) return false;
    slowest = std::min(slowest, touch.plan.speed_mm_s);
    fastest = std::max(fastest, touch.plan.speed_mm_s);
  }
  return !refuseSpeeds(slowest, fastest);
}

// Warnings of single drives. Of those that begin alike, up to the first number, that of the worst drive stays.
class WarningsOfDrives {
 public:
  void add(std::string warning, double widening) {
    const auto beginningOf = [](const std::string& of) { return of.substr(0, of.find_first_of("(0123456789")); };
    const auto alike =
        std::ranges::find(all_, beginningOf(warning), [&](const auto& of) { return beginningOf(of.second); });
    if (alike == all_.end())
      all_.emplace_back(widening, std::move(warning));
    else if (widening > alike->first)
      *alike = {widening, std::move(warning)};
  }
  std::vector<std::string> all() const {
    std::vector<std::string> warnings;
    for (const auto& [widening, warning] : all_) warnings.push_back(warning);
    return warnings;
  }

 private:
  std::vector<std::pair<double, std::string>> all_;  // by how much the sd of that drive is widened
};

// Each drive by itself: lost motion l makes its delay smaller by l / (2 S) (A7b), and the speeds part the two. A drive
// that does not match is left out as long as the others part them. Drives that contradict each other are told: a
// vibration as slow as a drive is in no residual of it.
class DrivesOfSpeeds {
 public:
  DrivesOfSpeeds(const Dataset& dataset, const Eigen::VectorXd& previous) : dataset_{dataset}, previous_{previous} {}

  // Refuses what no drive can be matched with.
  std::optional<Refusal> add(const Touch& touch, const DriveContact& contact) {
    const std::vector drive{contact};
    const auto matched = matchFrom(drive, startOf(drive));
    if (!matched) return matched.error();
    auto bad = poorMatch(matched->match, kMostDroppedShare);
    if (bad) bad->reason = touch.plan.name + ": " + bad->reason;
    if (!bad) bad = tooFewAfterBounce(touch, *matched);
    if (!bad) {
      take(touch, contact, *matched);
      return std::nullopt;
    }
    all_.dropped.push_back({touch.plan.name, bad->name});
    warnings_.add("dropped: " + bad->reason, 0);
    if (!first_bad_) first_bad_ = std::move(bad);
    return std::nullopt;
  }

  Outcome<Result, Refusal> result() {
    if (first_bad_ && (kept_.empty() || !partsLostMotion(kept_))) return *first_bad_;
    const auto rows = std::ssize(kept_);
    Eigen::MatrixX2d design{rows, 2};  // of delay and lost motion
    for (Eigen::Index row = 0; row < rows; ++row) design.row(row) = rows_[static_cast<std::size_t>(row)];
    TRY(const auto fit, linearLeastSquares(design, Eigen::VectorXd::Map(delays_.data(), rows)));
    const double chi2_reduced = fit.dof > 0 ? fit.sumOfSquares() / static_cast<double>(fit.dof) : 0.0;
    const double widened = std::max(1.0, chi2_reduced);
    Match match;
    match.tau_s = fit.parameters[0];
    match.sd_s = std::sqrt(widened * fit.cofactor(0, 0));
    match.rms_mm = std::sqrt(squares_ / static_cast<double>(all_.dof));
    match.expected_mm = std::max(match.rms_mm, std::sqrt(expected_ / static_cast<double>(all_.dof)));
    match.dof = all_.dof;
    match.condition = all_.condition;
    match.residuals = std::move(all_.residuals);
    Result result = reportMatch(dataset_, match, previous_);
    result.warnings = warnings_.all();
    result.dropped = std::move(all_.dropped);
    const ChiSquareLaw law{.dof = fit.dof, .noise_dof = match.dof};
    if (fit.dof > 0 && law.probabilityAbove(chi2_reduced) < kFalseAlarm) {
      result.warnings.push_back(std::string{kResidualsExceedNoise} + ": the drives contradict each other by " +
                                text(std::sqrt(chi2_reduced)) + " times their sd, which is widened by that: look for " +
                                "vibration, also one near the rate of the samples, which looks slow; drive more often");
    }
    result.also.push_back(
        Estimate::scalar(quantity::kLostMotion, fit.parameters[1], std::sqrt(widened * fit.cofactor(1, 1))));
    return result;
  }

 private:
  void take(const Touch& touch, const DriveContact& contact, const Matched& matched) {
    const Match& match = matched.match;
    const double sd_s = widenedSd(match);
    kept_.push_back(touch);
    rows_.emplace_back(1.0 / sd_s, -0.5 / contact.speed_mm_s / sd_s);
    delays_.push_back(match.tau_s / sd_s);
    const auto dof = static_cast<double>(match.dof);
    squares_ += dof * match.rms_mm * match.rms_mm;
    expected_ += dof * match.expected_mm * match.expected_mm;
    Result one = reportMatch(dataset_, match, previous_);
    if (!matched.warning.empty()) one.warnings.push_back(matched.warning);
    for (auto& warning : one.warnings) warnings_.add(std::move(warning), sd_s / match.sd_s);
    all_.dropped.insert(all_.dropped.end(), one.dropped.begin(), one.dropped.end());
    all_.dof += match.dof;
    all_.condition = std::max(all_.condition, match.condition);
    auto& [unit, against, names, at, values] = all_.residuals;
    unit = one.residuals.unit;
    against = one.residuals.against;
    names.insert(names.end(), one.residuals.names.begin(), one.residuals.names.end());
    at.insert(at.end(), one.residuals.at.begin(), one.residuals.at.end());
    values.insert(values.end(), one.residuals.values.begin(), one.residuals.values.end());
  }

  const Dataset& dataset_;
  const Eigen::VectorXd& previous_;
  Result all_;
  WarningsOfDrives warnings_;
  std::vector<Touch> kept_;
  std::optional<Refusal> first_bad_;
  std::vector<Eigen::RowVector2d> rows_;  // of the drives that are kept, weighted by their sd
  std::vector<double> delays_;
  double squares_{}, expected_{};  // mm^2
};

// From deflections.
Outcome<Result, Refusal> solveDrives(const Dataset& dataset, ProbeZero zero) {
  TRY(const auto previous, previousDelay(dataset, 1));
  TRY(const auto touches, readTouches(dataset));
  std::vector<DriveContact> contacts;
  const StampJitter jitter = stampJitter(touches);
  for (const auto& touch : touches) {
    if (auto bad = badDrive(touch, jitter, zero)) return *bad;
    TRY(auto contact, contactOf(touch));
    if (auto bad = speedOfDriveDiffers(touch.plan, contact.speed_mm_s)) return *bad;
    contacts.push_back(std::move(contact));
  }
  if (partsLostMotion(touches)) {
    DrivesOfSpeeds drives{dataset, previous};
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      if (auto refusal = drives.add(touches[i], contacts[i])) return *refusal;
    }
    return drives.result();
  }
  TRY(const auto matched, matchFrom(contacts, startOf(contacts)));
  const Match& match = matched.match;
  if (auto bad = poorMatch(match, kMostDroppedShare)) return delaysDiffer(touches, contacts).value_or(*bad);
  if (auto bad = tooFewAfterBounce(touches.front(), matched)) return *bad;
  Result result = reportMatch(dataset, match, previous);
  if (!matched.warning.empty()) result.warnings.push_back(matched.warning);
  return result;
}

}  // namespace

Outcome<Result, Refusal> solveDelayInOut(const Dataset& dataset) {
  TRY(const auto distances, readsDistances(dataset));
  if (!distances) return solveDrives(dataset, ProbeZero::known);
  TRY(const auto converted, withDeflections(dataset, column::kTouch, Undeflected::ends));
  return solveDrives(converted, ProbeZero::of_record);
}

namespace {

constexpr MethodTable kInOutTables[]{
    of_delay::kMachine,
    of_delay::kProbe,
    {"probe", of_delay::kTouchDistanceColumns, "instead, with probe_kind distance: distance from the surface"},
    of_delay::kTouches};
constexpr MethodKey kInOutKeys[]{of_delay::kPreviousTau, of_delay::kFeature, of_delay::kProbeKind, kProbeAForTheRecord,
                                 kProbeBForTheRecord};
constexpr Quantity kInOutResults[]{quantity::kTau};
constexpr std::string_view kInOutUnobservable[]{
    of_delay::kApart, of_delay::kAfterStamps,
    "the delay of an axis across the direction of motion, and the position of the surface"};

}  // namespace

const Method kDelayInOut{.name = "delay-in-out",
                         .title = "System delay from one drive in and out",
                         .equations = "(A1), (A17)-(A19)",
                         .source = source::kDelay,
                         .solver = solveDelayInOut,
                         .tables = kInOutTables,
                         .keys = kInOutKeys,
                         .results = kInOutResults,
                         .further = of_delay::kFurther,
                         .unobservable = kInOutUnobservable,
                         .undetermined = lostMotionAtOneSpeed,
                         .subject = of_delay::kSubject};

}  // namespace probebox::metrology
