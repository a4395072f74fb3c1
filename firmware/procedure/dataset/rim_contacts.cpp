#include "firmware/procedure/dataset/rim_contacts.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "firmware/capture/turn_until_contact.hpp"
#include "firmware/metrology/touch/pre_travel.hpp"
#include "firmware/procedure/plan/wording.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::procedure {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using metrology::Refusal;

// A difference of heights up to this is taken out with the radius as described, which is known to some per cent.
constexpr double kEqualHeights_mm = 0.1;
// Where the deflection is used: beyond the bounce, and before the drive slows down.
constexpr double kFrom = 0.2, kTo = 0.9;
constexpr std::size_t kFewest = 5;  // samples a way

// One turn: C at contact, clockwise from the line, its variance from the probe alone, and where the stylus stood.
struct Turned {
  double c_rad{};
  double variance{};  // rad^2; 0 of a switch, whose repeatability is a length
  Vector3d at_mm{Vector3d::Zero()};
};

Vector3d stoodAt(const FinishedRun& run, const capture::Touch& touch) {
  Vector3d sum = Vector3d::Zero();
  const auto rows = run.recording.machineRows(touch);
  for (const auto& row : rows) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const auto k = static_cast<std::size_t>(axis);
      sum[axis] += static_cast<double>(row.counts[k]) * run.scales.mm_per_count[k] - 1e-6 * row.screw_nm[k];
    }
  }
  const auto& offset_mm = run.recording.offset_mm();
  return sum / static_cast<double>(rows.size()) + Vector3d{offset_mm[0], offset_mm[1], offset_mm[2]};
}

struct Deflected {
  double c_rad{}, mm{};
};

// Deflection over C in the direction in which the stylus was pushed. One value a row at which C is known.
std::vector<Deflected> deflectionsOf(const FinishedRun& run, const capture::Touch& touch) {
  const auto rows = run.recording.probeRows(touch);
  if (rows.size() < kFewest) return {};
  const auto channels = [&](std::size_t row) {
    const auto& nm = rows[row].channels_nm;
    return Vector3d{1e-6 * nm[0], 1e-6 * nm[1], 1e-6 * nm[2]};
  };
  Vector3d rest = Vector3d::Zero(), pushed = Vector3d::Zero();
  for (std::size_t row = 0; row < kFewest; ++row) rest += channels(row) / static_cast<double>(kFewest);
  for (std::size_t row = 0; row < rows.size(); ++row) {
    const double off_mm = capture::deflectionOf(rows, row);
    if (off_mm > capture::kTouched_mm) pushed += channels(row) - rest;
  }
  pushed.normalize();
  std::vector<Deflected> all;
  for (std::size_t row = 0; row < rows.size(); ++row) {
    const auto c_rad = capture::angleAt(run.recording.angleRows(touch), rows[row].at);
    if (c_rad) all.push_back({*c_rad, (channels(row) - rest).dot(pushed)});
  }
  return all;
}

struct Onset {
  double c_rad{}, variance{};
  double slope_mm{};  // per radian
};

// The free stylus before the contact: the mean deflection, and its variance.
struct Free {
  double mm{}, variance{};
};

std::optional<Free> freeBefore(const std::vector<Deflected>& all) {
  constexpr std::ptrdiff_t kMost = 200, kMargin = 10;  // the last ones may touch already
  const auto touched = std::ranges::find_if(all, [](const Deflected& each) { return each.mm > capture::kTouched_mm; });
  const std::ptrdiff_t end = touched - all.begin() - kMargin, begin = std::max<std::ptrdiff_t>(end - kMost, 0);
  const double count = static_cast<double>(end - begin);
  if (count < static_cast<double>(kFewest)) return std::nullopt;
  double sum = 0, squares = 0;
  for (auto each = all.begin() + begin; each != all.begin() + end; ++each) sum += each->mm;
  for (auto each = all.begin() + begin; each != all.begin() + end; ++each)
    squares += std::pow(each->mm - sum / count, 2);
  return Free{sum / count, squares / (count - 1) / count};
}

// Where the line through these samples has no deflection.
std::optional<Onset> onsetOf(const std::vector<Deflected>& samples) {
  if (samples.size() < kFewest) return std::nullopt;
  const auto count = static_cast<double>(samples.size());
  Deflected mean;
  for (const auto& [c_rad, mm] : samples) {
    mean.c_rad += c_rad / count;
    mean.mm += mm / count;
  }
  double squares = 0, products = 0, rest = 0;
  for (const auto& [c_rad, mm] : samples) {
    squares += (c_rad - mean.c_rad) * (c_rad - mean.c_rad);
    products += (c_rad - mean.c_rad) * (mm - mean.mm);
  }
  const double slope = products / squares;
  if (!(squares > 0) || slope == 0) return std::nullopt;
  for (const auto& [c_rad, mm] : samples) rest += std::pow(mm - mean.mm - slope * (c_rad - mean.c_rad), 2);
  const double back_rad = mean.mm / slope;
  return Onset{mean.c_rad - back_rad,
               rest / (count - 2) / (slope * slope) * (1 / count + back_rad * back_rad / squares), slope};
}

// Deflections between two shares of the largest, on the way there and on the way back.
std::optional<Onset> extrapolated(const std::vector<Deflected>& all) {
  const auto free = freeBefore(all);
  if (!free) return std::nullopt;
  const double most_mm = std::ranges::max(all, {}, &Deflected::mm).mm;
  const auto deep = [&](const Deflected& each) { return each.mm > kTo * most_mm; };
  const auto first = std::ranges::find_if(all, deep);
  const auto last = std::find_if(all.rbegin(), all.rend(), deep).base();
  const auto sloping = [&](auto from, auto to) {
    std::vector<Deflected> way;
    std::copy_if(from, to, std::back_inserter(way), [&](const Deflected& each) { return each.mm > kFrom * most_mm; });
    for (auto& each : way) each.mm -= free->mm;
    return onsetOf(way);
  };
  const auto there = sloping(all.begin(), first), back = sloping(last, all.end());
  if (!there || !back) return std::nullopt;
  // What the mean of the free stylus is off by moves both alike.
  return Onset{(there->c_rad + back->c_rad) / 2,
               (there->variance + back->variance) / 4 + free->variance / (there->slope_mm * there->slope_mm),
               there->slope_mm};
}

Outcome<Turned, Refusal> turnedOf(const FinishedRun& run, const capture::Touch& touch) {
  Turned turned{.at_mm = stoodAt(run, touch)};
  const auto clockwise = [&](double c_rad) {
    return std::remainder(touch.request.until_contact->line_rad - c_rad, kTurn);
  };
  if (touch.request.by_edges) {
    const auto angles = run.recording.angleRows(touch);
    turned.c_rad =
        clockwise((*capture::angleAt(angles, *touch.contact) + *capture::angleAt(angles, *touch.release)) / 2);
    return turned;
  }
  const auto onset = extrapolated(deflectionsOf(run, touch));
  if (!onset) {
    return Refusal{
        "too-few-samples",
        "step " + std::to_string(touch.request.step + 1) +
            ": the deflection while C turned has too few samples on a way to be extrapolated to the contact: "
            "turn C at the speed that the step states, and stop after its overtravel"};
  }
  turned.c_rad = clockwise(onset->c_rad);
  turned.variance = onset->variance;
  return turned;
}

// How a contact depends on what displaces it.
struct Meeting {
  Vector2d normal{Vector2d::Zero()};  // from the ball to the stylus at +X; at -X it is mirrored
  double lever_mm{};                  // the ball's way along it per radian of C
};

// Both normals are mirror images where the stylus stands on either side of the line at equal heights.
Meeting meetingOf(const Turned& plus, const Turned& minus, double radius_mm) {
  const double beside_mm = (plus.at_mm.x() - minus.at_mm.x()) / 2, half_rad = (plus.c_rad - minus.c_rad) / 2;
  const Vector2d to_stylus{beside_mm - radius_mm * std::sin(half_rad), radius_mm * (1 - std::cos(half_rad))};
  const Vector2d n = to_stylus.normalized();
  return {n, radius_mm * (std::cos(half_rad) * n.x() - std::sin(half_rad) * n.y())};
}

std::optional<Refusal> whyNot(const Turned& plus, const Turned& minus, double beside_mm) {
  const Vector3d apart_mm = plus.at_mm - minus.at_mm;
  if (!(apart_mm.x() > beside_mm)) {
    return Refusal{"wrong-side", "the stylus stood " + number(apart_mm.x()) +
                                     " mm further to +X in the first turn of C than in the second, not " +
                                     number(2 * beside_mm) +
                                     " mm: stand it to +X of the nominal line first, and then to -X"};
  }
  const double higher_mm = apart_mm.tail<2>().norm();
  if (higher_mm > kEqualHeights_mm) {
    return Refusal{"unequal-heights", "the places of the stylus in the two turns of C differ by " + number(higher_mm) +
                                          " mm across X, more than " + number(kEqualHeights_mm) +
                                          " mm: stand it at equal heights on either side of the nominal line"};
  }
  return std::nullopt;
}

// What the pre-travel in force displaces the two contacts by, and the variance that it gives their middle.
struct Displaced {
  double plus_rad{}, minus_rad{};
  double variance{};
};

Displaced byPreTravel(const PreTravel& pre_travel, std::span<const capture::Touch> contacts, const Meeting& meeting) {
  const auto parts = [&](double side, const capture::Touch& touch) -> Eigen::RowVector4d {
    const Eigen::AngleAxisd into_probe{-touch.request.rotary_angles_rad[0], Vector3d::UnitZ()};
    return metrology::preTravelParts(into_probe * Vector3d{side * meeting.normal.x(), meeting.normal.y(), 0}) /
           meeting.lever_mm;
  };
  const Eigen::RowVector4d plus = parts(1, contacts[0]), minus = parts(-1, contacts[1]), half = (minus - plus) / 2;
  const Eigen::Vector4d way_mm{pre_travel.parts_mm.data()};
  Displaced displaced{.plus_rad = plus.dot(way_mm), .minus_rad = minus.dot(way_mm)};
  for (std::size_t i = 0; i < PreTravel::kParts; ++i) {
    for (std::size_t k = 0; k < PreTravel::kParts; ++k)
      displaced.variance +=
          half[static_cast<Eigen::Index>(i)] * half[static_cast<Eigen::Index>(k)] * pre_travel.covariance[i][k];
  }
  return displaced;
}

}  // namespace

Outcome<RimContacts, Refusal> rimContacts(const FinishedRun& run) {
  const auto contacts = run.recording.contacts();
  const auto& ball = run.facts.rim_ball;
  if (contacts.size() != 2 || !ball || !ball->radius_mm || !ball->beside_mm) {
    return Refusal{"missing-contact",
                   "two turns of C until contact are needed, and [rim_ball] beside_mm and radius_mm in machine.toml: "
                   "measure again"};
  }
  TRY(const auto plus, turnedOf(run, contacts[0]));
  TRY(const auto minus, turnedOf(run, contacts[1]));
  if (const auto why = whyNot(plus, minus, *ball->beside_mm)) return *why;
  const Meeting meeting = meetingOf(plus, minus, *ball->radius_mm);
  // A stylus that stands higher by d along the normal meets the ball d/lever later.
  const double higher_rad = (plus.at_mm.y() - minus.at_mm.y()) * meeting.normal.y() / (2 * meeting.lever_mm);
  RimContacts found{.clockwise_rad = plus.c_rad - higher_rad, .anticlockwise_rad = minus.c_rad - higher_rad};
  const double of_c = run.facts.sigma_c_rad;
  double of_each = of_c * of_c + (plus.variance + minus.variance) / 2, of_middle = 0;
  if (contacts[0].request.by_edges) {
    const auto& probe = run.facts.trigger_probe;
    if (!probe || !probe->pre_travel) {
      return Refusal{"no-pre-travel",
                     "no pre-travel of the touch-trigger probe is in force any more: calibrate it (probebox calibrate "
                     "pre-travel), accept it, and measure again"};
    }
    const Displaced displaced = byPreTravel(*probe->pre_travel, contacts, meeting);
    found.clockwise_rad -= displaced.plus_rad;
    found.anticlockwise_rad += displaced.minus_rad;
    of_middle = displaced.variance;
    of_each += std::pow(probe->repeatability_mm / meeting.lever_mm, 2) / 2;  // two edges
  }
  // As if both were independent: then their middle has the right sd.
  found.sd_rad = std::sqrt(of_each + 2 * of_middle);
  return found;
}

}  // namespace probebox::procedure
