#include "firmware/procedure/dataset/rim_contacts.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "firmware/capture/touch_dataset.hpp"
#include "firmware/capture/turn_until_contact.hpp"
#include "firmware/metrology/fit/line.hpp"
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
  for (const auto& row : rows) sum += Vector3d{capture::position_mm(row, run.scales, run.recording.offset_mm()).data()};
  return sum / static_cast<double>(rows.size());
}

// While C turned, from where the stylus stood freely: one deflection a row at which C is known.
struct Deflections {
  std::vector<double> c_rad;
  std::vector<Vector3d> mm;
  Vector3d pushed{Vector3d::Zero()};  // unit vector, in which it gave way

  std::size_t size() const { return c_rad.size(); }
  double along(std::size_t row) const { return mm[row].dot(pushed); }
};

bool touches(const Vector3d& mm) {
  return capture::touches({mm.x(), mm.y(), mm.z()});
}

Deflections deflectionsOf(const FinishedRun& run, const capture::Touch& touch) {
  Deflections all;
  const auto rows = run.recording.probeRows(touch);
  const auto angles = run.recording.angleRows(touch);
  const auto rest_mm = capture::restOf(rows);
  for (const auto& row : rows) {
    const Vector3d mm{capture::deflectionFrom(rest_mm, row).data()};
    if (touches(mm)) all.pushed += mm;
    if (const auto c_rad = capture::angleAt(angles, row.at)) {
      all.c_rad.push_back(*c_rad);
      all.mm.push_back(mm);
    }
  }
  all.pushed.normalize();
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

std::optional<Free> freeBefore(const Deflections& all) {
  constexpr std::size_t kMost = 200, kMargin = 10;  // the last ones may touch already
  const auto touched = static_cast<std::size_t>(std::ranges::find_if(all.mm, touches) - all.mm.begin());
  if (touched < kMargin + kFewest) return std::nullopt;
  const std::size_t end = touched - kMargin, begin = end - std::min(kMost, end);
  const auto count = static_cast<double>(end - begin);
  double sum = 0, squares = 0;
  for (std::size_t row = begin; row < end; ++row) sum += all.along(row);
  for (std::size_t row = begin; row < end; ++row) squares += std::pow(all.along(row) - sum / count, 2);
  return Free{sum / count, squares / (count - 1) / count};
}

// Where the line through these rows has the deflection of the free stylus.
std::optional<Onset> onsetOf(const Deflections& all, const std::vector<std::size_t>& rows, const Free& free) {
  if (rows.size() < kFewest) return std::nullopt;
  std::vector<double> c_rad;
  metrology::Rows3 mm{static_cast<Eigen::Index>(rows.size()), 3};
  for (const std::size_t row : rows) {
    mm.row(static_cast<Eigen::Index>(c_rad.size())) = all.mm[row].transpose();
    c_rad.push_back(all.c_rad[row]);
  }
  const auto line = metrology::fitLine(c_rad, mm);
  const double slope = line.slope.dot(all.pushed);
  if (!(line.sxx > 0) || slope == 0) return std::nullopt;
  const auto count = static_cast<double>(line.n);
  const double back_rad = (line.mean.dot(all.pushed) - free.mm) / slope;
  return Onset{
      line.t_mean - back_rad,
      line.scatterAlong(all.pushed) / (count - 2) / (slope * slope) * (1 / count + back_rad * back_rad / line.sxx),
      slope};
}

// From deflections between two shares of the largest, on the way there and on the way back.
std::optional<Onset> extrapolated(const Deflections& all) {
  const auto free = freeBefore(all);
  if (!free) return std::nullopt;
  std::vector<double> along;
  for (std::size_t row = 0; row < all.size(); ++row) along.push_back(all.along(row));
  const double most_mm = std::ranges::max(along);
  const auto deep = [&](double mm) { return mm > kTo * most_mm; };
  const auto first = static_cast<std::size_t>(std::ranges::find_if(along, deep) - along.begin());
  const auto last = static_cast<std::size_t>(std::find_if(along.rbegin(), along.rend(), deep).base() - along.begin());
  std::vector<std::size_t> on_the_way, on_the_way_back;
  for (std::size_t row = 0; row < all.size(); ++row) {
    if (along[row] > kFrom * most_mm && row < first) on_the_way.push_back(row);
    if (along[row] > kFrom * most_mm && row >= last) on_the_way_back.push_back(row);
  }
  const auto there = onsetOf(all, on_the_way, *free), back = onsetOf(all, on_the_way_back, *free);
  if (!there || !back) return std::nullopt;
  // An error of the mean of the free stylus moves both by the same amount.
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
    return Refusal{"too-few-samples",
                   "step " + std::to_string(touch.request.step + 1) +
                       ": too few samples of the deflection while C turned, so the contact cannot be extrapolated: "
                       "turn C at the speed that the step states, and on by its overtravel after the contact"};
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

// Displacements of the two contacts by the pre-travel in force, and the variance of their middle due to it.
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
                   "the zero of C needs two turns of C until contact, and [rim_ball] beside_mm and radius_mm in "
                   "machine.toml: give "
                   "both keys and measure again"};
  }
  TRY(const auto plus, turnedOf(run, contacts[0]));
  TRY(const auto minus, turnedOf(run, contacts[1]));
  if (const auto why = whyNot(plus, minus, *ball->beside_mm)) return *why;
  const Meeting meeting = meetingOf(plus, minus, *ball->radius_mm);
  // A stylus that stands higher by d along the normal meets the ball d/lever later.
  const double higher_rad = (plus.at_mm.y() - minus.at_mm.y()) * meeting.normal.y() / (2 * meeting.lever_mm);
  const Eigen::RowVector2d slope = meeting.normal.transpose() / meeting.lever_mm;
  RimContacts found{.clockwise_rad = plus.c_rad - higher_rad,
                    .anticlockwise_rad = minus.c_rad - higher_rad,
                    .sd_rad = 0,
                    .tool = contacts[0].request.tool,
                    .stylus_mm = (plus.at_mm + minus.at_mm) / 2,
                    .clockwise_per_mm = slope,
                    .anticlockwise_per_mm = {slope.x(), -slope.y()}};
  const double of_c = run.facts.sigma_c_rad;
  double of_each = of_c * of_c + (plus.variance + minus.variance) / 2, of_middle = 0;
  if (contacts[0].request.by_edges) {
    const auto* pre_travel = run.facts.preTravelOf(contacts[0].request.tool);
    if (pre_travel == nullptr) {
      return Refusal{"no-pre-travel",
                     "no pre-travel of the touch-trigger probe is in force any more: calibrate it (probebox calibrate "
                     "pre-travel), accept it, and measure again"};
    }
    const Displaced displaced = byPreTravel(*pre_travel, contacts, meeting);
    found.clockwise_rad -= displaced.plus_rad;
    found.anticlockwise_rad += displaced.minus_rad;
    of_middle = displaced.variance;
    of_each += std::pow(run.facts.trigger_probe->repeatability_mm / meeting.lever_mm, 2) / 2;  // two edges
  }
  // As if both were independent: then their middle has the right sd.
  found.sd_rad = std::sqrt(of_each + 2 * of_middle);
  return found;
}

}  // namespace probebox::procedure
