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

constexpr double kMissing = 1.5;              // periods between samples of the contact
constexpr double kApexShare = 0.05;           // of the depth, that counts as the apex
constexpr double kFlatShare = 0.20;           // of the contact, that a rest may take
constexpr double kMostKink = 0.125;           // of the contact, to either side of the apex
constexpr double kSettling_s = 0.02;          // a stylus that bounced at contact is quiet after this
constexpr double kBounceResidualRatio = 1.3;  // residuals that much above the noise: it did bounce
// Where ringing is fitted to what a bounce leaves: of 4000 simulated drives with bounces of 0.2 mm, 14 of the 33 with
// 10 and fewer were off by 20 sd and more, and none of those with more.
constexpr std::size_t kLeastFreedom = 11;

Refusal refusal(const std::string& touch, std::string name, const std::string& what) {
  return {std::move(name), touch + ": " + what};
}

// The contact of one drive, and both streams along it: they fall into the surface and come back.
struct Contact {
  std::string name;
  Signal machine;  // mm, along the retract
  Signal probe;    // raw, against the deflection, so that both have their lowest point at the apex
  double from{};   // stamps of the first and last deflected sample, probe time, s
  double until{};
  double machine_apex_s{};
  double probe_apex_s{};
  std::optional<RoundedMotion> rounded{};
  double kink_s{};  // on either side of the apex, that lines between samples cannot follow
  double speed_mm_s{};
};

std::size_t lowest(const Signal& signal) {
  return static_cast<std::size_t>(std::ranges::min_element(signal.values) - signal.values.begin());
}

struct Flank {
  double at{};  // of the line at time zero of the apex
  double slope{};
};

// Shares of the half contact, from the apex on.
struct Stretch {
  double from{};
  double until{};
};
constexpr Stretch kOfSource{0.40, 0.90};  // 60 to 10 % of the depth
constexpr Stretch kSparse{0.10, 0.95};    // where that holds too few samples; the round apex hardly bends a start

// Line through the samples of a stretch before or after the apex.
std::optional<Flank> flankOf(const Signal& signal, double apex, double half, double side, Stretch stretch) {
  double n = 0.0;
  double st = 0.0;
  double sx = 0.0;
  double stt = 0.0;
  double stx = 0.0;
  for (std::size_t k = 0; k < signal.times.size(); ++k) {
    const double t = signal.times[k] - apex;
    if (t * side < stretch.from * half || t * side > stretch.until * half) continue;
    n += 1.0, st += t, sx += signal.values[k], stt += t * t, stx += t * signal.values[k];
  }
  const double determinant = n * stt - st * st;
  if (n < 3.0 || !(determinant > 0.0)) return std::nullopt;
  const double slope = (n * stx - st * sx) / determinant;
  return Flank{(sx - slope * st) / n, slope};
}

struct Apex {
  double time{};
  double value{};    // beyond the lowest by what the turn of the motion rounds off
  double slope{};    // of the lines
  double at_zero{};  // time at which the line of out crosses zero, s
};

// Where the lines of in and out meet (A18), twice: the first time tells where to look.
std::optional<Apex> apexOf(const Signal& signal, double rough, double half) {
  const auto legs = [&](double side) {
    const auto leg = flankOf(signal, rough, half, side, kOfSource);
    return leg ? leg : flankOf(signal, rough, half, side, kSparse);
  };
  Apex apex{.time = rough};
  for (int round = 0; round < 2; ++round) {
    const auto in = legs(-1.0);
    const auto out = legs(1.0);
    if (!in || !out || !(in->slope < 0.0) || !(out->slope > 0.0)) return std::nullopt;
    const double later = (in->at - out->at) / (out->slope - in->slope);
    rough += later;
    apex = {rough, in->at + in->slope * later, (out->slope - in->slope) / 2.0, rough - later - out->at / out->slope};
  }
  return apex;
}

// A turn of constant acceleration takes twice as long, to either side, as the lines take for what they meet too deep.
// Lines between samples that are far apart cut it off: where that stands out of the noise it is left out.
double kinkOf(const Contact& contact, const Apex& apex) {
  const double period = std::max(contact.machine.period(), contact.probe.period());
  const double rounded = *std::ranges::min_element(contact.machine.values) - apex.value;
  const double turn = 2.0 * std::max(rounded, 0.0) / apex.slope;
  const double cut_off = turn > 0.0 ? apex.slope / turn * period * period / 8.0 : 0.0;
  const double noise = std::sqrt(sampleVariance(contact.machine, Interpolation::linear));
  if (cut_off <= std::max(noise, kCaseDigits)) return period;
  return std::max(period, std::min(period + turn, kMostKink * (contact.until - contact.from)));
}

// Share of the contact that the signal spends near its lowest point, from the first sample there to the last.
double apexShare(const Signal& signal, double apex, double half) {
  const double bottom = signal.values[lowest(signal)];
  const auto within = [&](std::size_t k) { return std::abs(signal.times[k] - apex) < half; };
  double rim = bottom;
  for (std::size_t k = 0; k < signal.times.size(); ++k) {
    if (within(k)) rim = std::max(rim, signal.values[k]);
  }
  double first = std::numeric_limits<double>::infinity();
  double last = first;
  for (std::size_t k = 0; k < signal.times.size(); ++k) {
    if (!within(k) || signal.values[k] - bottom >= kApexShare * (rim - bottom)) continue;
    first = std::min(first, signal.times[k]);
    last = signal.times[k];
  }
  return std::isinf(first) ? 1.0 : (last - first) / (2.0 * half);
}

// How far apart neighbours may be that none is missing between: stamps may jitter.
double farthestNeighbours(const Signal& signal) {
  const double period = signal.period();
  std::vector<double> off;
  for (std::size_t k = 1; k < signal.times.size(); ++k) {
    off.push_back(std::abs(signal.times[k] - signal.times[k - 1] - period));
  }
  const double jitter = off.empty() ? 0.0 : 1.4826 * median(off);
  return std::clamp(period + 4.0 * jitter, kMissing * period, kGapPeriods * period);
}

bool complete(const Signal& signal, double from, double until) {
  const double allowed = farthestNeighbours(signal);
  if (signal.times.front() > from || signal.times.back() < until) return false;
  for (std::size_t k = 1; k < signal.times.size(); ++k) {
    const bool within = signal.times[k] > from && signal.times[k - 1] < until;
    if (within && signal.times[k] - signal.times[k - 1] > allowed) return false;
  }
  return true;
}

Signal project(const Stream& stream, const Eigen::Vector3d& direction) {
  return {stream.times, stream.along(direction, {0, stream.times.size()})};
}

Outcome<Contact, Refusal> findContact(const Touch& touch) {
  Contact contact;
  contact.name = touch.plan.name;
  Eigen::Index deepest = 0;
  const double highest = touch.probe.values.rowwise().norm().maxCoeff(&deepest);
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  for (const auto row : touch.probe.values.rowwise()) {
    if (row.norm() > 0.5 * highest) direction += row.transpose();
  }
  contact.machine = project(touch.machine, touch.plan.retract);
  contact.probe = project(touch.probe, -direction.normalized());
  const double sigma = std::sqrt(sampleVariance(contact.probe, Interpolation::linear));
  if (highest < std::max(20.0 * sigma, 100.0 * kCaseDigits)) {
    return refusal(contact.name, "no-contact", "no clear deflection of the probe was found; check that it touched");
  }
  const double limit = -std::max(5.0 * sigma, 10.0 * kCaseDigits);
  const auto& depth = contact.probe.values;
  auto first = static_cast<std::size_t>(deepest);
  auto last = first;
  while (first > 0 && depth[first - 1] < limit) --first;
  while (last + 1 < depth.size() && depth[last + 1] < limit) ++last;
  if (first == 0 || last + 1 == depth.size()) {
    return refusal(contact.name, "truncated", "the record does not hold the whole contact; measure it again");
  }
  contact.from = contact.probe.times[first];
  contact.until = contact.probe.times[last];
  return contact;
}

std::optional<Refusal> findApexes(Contact& contact) {
  const double half = (contact.until - contact.from) / 2.0;
  // The middle of the lowest tenth: a rest has no lowest sample.
  const auto middle = [](const Signal& signal) { return signal.times[lowest(signal)]; };
  const auto in_machine = apexOf(contact.machine, middle(contact.machine), half);
  const auto in_probe = apexOf(contact.probe, (contact.from + contact.until) / 2.0, half);
  const double flat = apexShare(contact.machine, middle(contact.machine), half);
  if (flat > kFlatShare + kApexShare) {
    return refusal(contact.name, "flat-apex",
                   "the machine rests on the surface for " + text(100.0 * flat) +
                       " % of the contact, 20 % are allowed; retract without a dwell");
  }
  if (apexShare(contact.probe, (contact.from + contact.until) / 2.0, half) > flat + 0.15) {
    return refusal(contact.name, "clipped",
                   "the deflection stays at its limit while the machine moves; reduce the overtravel");
  }
  if (!in_machine || !in_probe) {
    return refusal(contact.name, "too-few-samples",
                   "fewer than three samples on the way in or out; move more slowly or further, or sample faster");
  }
  contact.machine_apex_s = in_machine->time;
  contact.probe_apex_s = in_probe->time;
  contact.kink_s = kinkOf(contact, *in_machine);
  contact.speed_mm_s = in_machine->slope;
  // A stylus that swings on after it has parted shows deflections, but no contact.
  contact.until = std::min(contact.until, in_probe->at_zero);
  const double start = contact.machine_apex_s - contact.probe_apex_s;
  if (!complete(contact.probe, contact.from, contact.until) ||
      !complete(contact.machine, contact.from + start, contact.until + start)) {
    return refusal(contact.name, "gap",
                   "samples of the contact are missing; find the cause of the loss and measure again");
  }
  return std::nullopt;
}

// Shapes of a drive in and out: the rate changes its sign at the apex, the path is the distance from it. What rang is
// a shape of its own: how much it rang is uncertain, too.
WaveformPair seenTwice(const Contact& contact, const std::optional<ContactRinging>& ringing) {
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

std::vector<WaveformPair> seenTwice(const std::vector<Contact>& contacts,
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

// Between a share of the half contact and the apex, where the machine keeps its speed.
std::optional<RoundedMotion> roundedIn(const Touch& touch, const Contact& contact) {
  const double half = (contact.until - contact.from) / 2.0;
  const double apex = contact.machine_apex_s;
  return roundedLegs(touch.machine, touch.plan.retract,
                     {{{apex - half, apex - kSparse.from * half}, {apex + kSparse.from * half, apex + half}}});
}

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
Outcome<Matched, Refusal> matchQuiet(const std::vector<Contact>& contacts, double start) {
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
  std::vector<Contact> quiet = contacts;
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
Outcome<Matched, Refusal> matchFrom(std::vector<Contact> contacts, double start) {
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
std::optional<Refusal> delaysDiffer(std::span<const Touch> touches, const std::vector<Contact>& contacts) {
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
  return refusal(touch.plan.name, "too-few-samples",
                 "the stylus rang and bounced, and the samples after that do not show both the ringing and the delay; "
                 "move further into the surface or more slowly, or sample faster");
}

double startOf(const std::vector<Contact>& contacts) {
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
Outcome<Result, Refusal> solveSpeeds(const Dataset& dataset, std::span<const Touch> touches,
                                     const std::vector<Contact>& contacts, const Eigen::VectorXd& previous) {
  Result all;
  WarningsOfDrives warnings;
  std::vector<Touch> kept;
  std::optional<Refusal> first_bad;
  Eigen::MatrixX2d design{std::ssize(contacts), 2};  // of delay and lost motion
  Eigen::VectorXd delays{design.rows()};
  double rms = 0.0, expected = 0.0;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const std::vector drive{contacts[i]};
    TRY(const auto matched, matchFrom(drive, startOf(drive)));
    const Match& match = matched.match;
    auto bad = poorMatch(match, kMostDroppedShare);
    if (bad) bad = refusal(touches[i].plan.name, bad->name, bad->reason);
    if (!bad) bad = tooFewAfterBounce(touches[i], matched);
    if (bad) {
      all.dropped.push_back({touches[i].plan.name, bad->name});
      warnings.add("dropped: " + bad->reason, 0);
      if (!first_bad) first_bad = std::move(bad);
      continue;
    }
    const double sd_s = widenedSd(match);
    const auto row = std::ssize(kept);
    kept.push_back(touches[i]);
    design.row(row) << 1.0 / sd_s, -0.5 / contacts[i].speed_mm_s / sd_s;
    delays[row] = match.tau_s / sd_s;
    const auto dof = static_cast<double>(match.dof);
    rms += dof * match.rms_mm * match.rms_mm;
    expected += dof * match.expected_mm * match.expected_mm;
    Result one = reportMatch(dataset, match, previous);
    if (!matched.warning.empty()) one.warnings.push_back(matched.warning);
    for (auto& warning : one.warnings) warnings.add(std::move(warning), sd_s / match.sd_s);
    all.dropped.insert(all.dropped.end(), one.dropped.begin(), one.dropped.end());
    all.dof += match.dof;
    all.condition = std::max(all.condition, match.condition);
    auto& [unit, against, names, at, values] = all.residuals;
    unit = one.residuals.unit;
    against = one.residuals.against;
    names.insert(names.end(), one.residuals.names.begin(), one.residuals.names.end());
    at.insert(at.end(), one.residuals.at.begin(), one.residuals.at.end());
    values.insert(values.end(), one.residuals.values.begin(), one.residuals.values.end());
  }
  if (first_bad && (kept.empty() || !partsLostMotion(kept))) return *first_bad;
  design.conservativeResize(std::ssize(kept), Eigen::NoChange);
  delays.conservativeResize(std::ssize(kept));
  TRY(const auto fit, linearLeastSquares(design, delays));
  const double chi2_reduced = fit.dof > 0 ? fit.sumOfSquares() / static_cast<double>(fit.dof) : 0.0;
  const double widened = std::max(1.0, chi2_reduced);
  Match match;
  match.tau_s = fit.parameters[0];
  match.sd_s = std::sqrt(widened * fit.cofactor(0, 0));
  match.rms_mm = std::sqrt(rms / static_cast<double>(all.dof));
  match.expected_mm = std::max(match.rms_mm, std::sqrt(expected / static_cast<double>(all.dof)));
  match.dof = all.dof;
  match.condition = all.condition;
  match.residuals = std::move(all.residuals);
  Result result = reportMatch(dataset, match, previous);
  result.warnings = warnings.all();
  result.dropped = std::move(all.dropped);
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

// From deflections.
Outcome<Result, Refusal> solveDrives(const Dataset& dataset, ProbeZero zero) {
  TRY(const auto previous, previousDelay(dataset, 1));
  TRY(const auto touches, readTouches(dataset));
  std::vector<Contact> contacts;
  const StampJitter jitter = stampJitter(touches);
  for (const auto& touch : touches) {
    if (auto bad = badDrive(touch, jitter, zero)) return *bad;
    TRY(auto contact, findContact(touch));
    if (auto bad = findApexes(contact)) return *bad;
    if (auto bad = speedOfDriveDiffers(touch.plan, contact.speed_mm_s)) return *bad;
    contact.rounded = roundedIn(touch, contact);
    contacts.push_back(std::move(contact));
  }
  if (partsLostMotion(touches)) return solveSpeeds(dataset, touches, contacts, previous);
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
