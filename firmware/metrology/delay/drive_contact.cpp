#include "firmware/metrology/delay/drive_contact.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "firmware/metrology/fit/robust_statistics.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

constexpr double kMissing = 1.5;     // periods between samples of the contact
constexpr double kApexShare = 0.05;  // of the depth, that counts as the apex
constexpr double kFlatShare = 0.20;  // of the contact, that a rest may take
constexpr double kMostKink = 0.125;  // of the contact, to either side of the apex

Refusal ofDrive(const std::string& touch, std::string name, const std::string& what) {
  return {std::move(name), touch + ": " + what};
}

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
double kinkOf(const DriveContact& contact, const Apex& apex) {
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

Outcome<DriveContact, Refusal> findContact(const Touch& touch) {
  DriveContact contact;
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
    return ofDrive(contact.name, "no-contact", "no clear deflection of the probe was found; check that it touched");
  }
  const double limit = -std::max(5.0 * sigma, 10.0 * kCaseDigits);
  const auto& depth = contact.probe.values;
  auto first = static_cast<std::size_t>(deepest);
  auto last = first;
  while (first > 0 && depth[first - 1] < limit) --first;
  while (last + 1 < depth.size() && depth[last + 1] < limit) ++last;
  if (first == 0 || last + 1 == depth.size()) {
    return ofDrive(contact.name, "truncated", "the record does not hold the whole contact; measure it again");
  }
  contact.from = contact.probe.times[first];
  contact.until = contact.probe.times[last];
  return contact;
}

std::optional<Refusal> findApexes(DriveContact& contact) {
  const double half = (contact.until - contact.from) / 2.0;
  // The middle of the lowest tenth: a rest has no lowest sample.
  const auto middle = [](const Signal& signal) { return signal.times[lowest(signal)]; };
  const auto in_machine = apexOf(contact.machine, middle(contact.machine), half);
  const auto in_probe = apexOf(contact.probe, (contact.from + contact.until) / 2.0, half);
  const double flat = apexShare(contact.machine, middle(contact.machine), half);
  if (flat > kFlatShare + kApexShare) {
    return ofDrive(contact.name, "flat-apex",
                   "the machine rests on the surface for " + text(100.0 * flat) +
                       " % of the contact, 20 % are allowed; retract without a dwell");
  }
  if (apexShare(contact.probe, (contact.from + contact.until) / 2.0, half) > flat + 0.15) {
    return ofDrive(contact.name, "clipped",
                   "the deflection stays at its limit while the machine moves; reduce the overtravel");
  }
  if (!in_machine || !in_probe) {
    return ofDrive(contact.name, "too-few-samples",
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
    return ofDrive(contact.name, "gap",
                   "samples of the contact are missing; find the cause of the loss and measure again");
  }
  return std::nullopt;
}

// Between a share of the half contact and the apex, where the machine keeps its speed.
std::optional<RoundedMotion> roundedIn(const Touch& touch, const DriveContact& contact) {
  const double half = (contact.until - contact.from) / 2.0;
  const double apex = contact.machine_apex_s;
  return roundedLegs(touch.machine, touch.plan.retract,
                     {{{apex - half, apex - kSparse.from * half}, {apex + kSparse.from * half, apex + half}}});
}

}  // namespace

Outcome<DriveContact, Refusal> contactOf(const Touch& touch) {
  TRY(auto contact, findContact(touch));
  if (auto bad = findApexes(contact)) return *bad;
  contact.rounded = roundedIn(touch, contact);
  return contact;
}

}  // namespace probebox::metrology
