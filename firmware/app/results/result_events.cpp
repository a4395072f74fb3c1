#include "firmware/app/results/result_events.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "firmware/app/results/result_values.hpp"
#include "firmware/metrology/centreline/axis_alignment.hpp"
#include "firmware/metrology/centreline/centreline_x.hpp"
#include "firmware/metrology/dataset/quantity.hpp"
#include "firmware/metrology/dataset/subject.hpp"
#include "firmware/metrology/methods.hpp"
#include "firmware/metrology/rotary/rotary_axis_errors.hpp"
#include "firmware/metrology/rotary/sensor_head.hpp"
#include "firmware/metrology/screw/screw_calibration.hpp"
#include "firmware/metrology/screw/screw_reference.hpp"
#include "firmware/metrology/tilt/swivel_error.hpp"
#include "firmware/metrology/tool/tool_assembly.hpp"
#include "firmware/metrology/tool/tool_setter.hpp"
#include "firmware/metrology/touch/pre_travel.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::app {
namespace {

// The gain that the touches of a delay gave (servedGain). Without one, that of probe.toml stays.
void addGain(DelayActivated& event, const metrology::Result& result) {
  constexpr double kMost = 1000;  // per channel: more does not fit the event, and is no probe
  const auto* found = servedGain(result);
  if (found == nullptr) return;
  const auto gain = valuesOf(result, found->key, event.gain_ppm.size());
  if (!gain) return;
  const auto fits = [](double entry) { return std::abs(entry) < kMost; };
  if (!std::ranges::all_of(gain->values, fits) || !std::ranges::all_of(gain->sd, fits)) return;
  event.has_gain = true;
  for (std::size_t i = 0; i < event.gain_ppm.size(); ++i) {
    event.gain_ppm[i] = static_cast<std::int32_t>(std::lround(1e6 * gain->values[i]));
    event.sd_gain_ppm[i] = static_cast<std::int32_t>(std::lround(1e6 * gain->sdOf(i)));
  }
}

Outcome<std::vector<Event>> delay(const metrology::Result& result, const Subject& subject, std::uint64_t id,
                                  MonoTime now) {
  const bool per_axis = result.find(quantity::kTauAxis.key) != nullptr;
  TRY(const auto tau,
      per_axis ? valuesOf(result, quantity::kTauAxis.key, kLinearAxes) : valuesOf(result, quantity::kTau.key, 1));
  DelayActivated event{};
  event.result_id = id;
  event.at = now;
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    if (!subject.has(axis)) continue;
    const std::size_t i = per_axis ? axis : 0;
    event.tau_s[axis] = tau.values[i];
    event.sd_s[axis] = tau.sdOf(i);
  }
  addGain(event, result);
  return std::vector<Event>{event};
}

// (B14a). Of Y a lathe of X and Z tells nothing: it stays 0, as the axis that is not there.
Outcome<std::vector<Event>> centrelineX(const metrology::Result& result, std::uint64_t id, MonoTime now) {
  CentrelineActivated event{.result_id = id, .at = now};
  TRY(const auto centre, valuesOf(result, quantity::kCentreX.key, 1));
  TRY(const auto reference, valuesOf(result, quantity::kMeanHeight.key, 1));
  event.centre_mm[0] = centre.values[0];
  event.sd_centre_mm[0] = centre.sdOf(0);
  event.reference_z_mm = reference.values[0];
  if (result.find(quantity::kCTiltX.key) == nullptr) return std::vector<Event>{event};
  TRY(const auto slope, valuesOf(result, quantity::kCTiltX.key, 1));
  event.slope[0] = slope.values[0];
  event.sd_slope[0] = slope.sdOf(0);
  return std::vector<Event>{event};
}

// (B14), or the slide's own slope. A method that finds the centre at one height has no slope: 0.
Outcome<std::vector<Event>> centreline(const metrology::Result& result, std::uint64_t id, MonoTime now) {
  if (result.find(quantity::kCentreX.key) != nullptr) return centrelineX(result, id, now);
  CentrelineActivated event{.result_id = id,
                            .centre_mm = {},
                            .slope = {},
                            .reference_z_mm = 0,
                            .sd_centre_mm = {},
                            .sd_slope = {},
                            .at = now};
  TRY(const auto centre, valuesOf(result, quantity::kCentre.key, 2));
  for (std::size_t i = 0; i < 2; ++i) {
    event.centre_mm[i] = centre.values[i];
    event.sd_centre_mm[i] = centre.sdOf(i);
  }
  const bool of_slide = result.find(quantity::kZSlide.key) != nullptr;
  const bool leans = of_slide || result.find(quantity::kCTilt.key) != nullptr;
  if (leans || result.find(quantity::kMeanHeight.key) != nullptr) {
    TRY(const auto reference, valuesOf(result, quantity::kMeanHeight.key, 1));
    event.reference_z_mm = reference.values[0];
  }
  if (!leans) return std::vector<Event>{event};
  TRY(const auto tilt, valuesOf(result, of_slide ? quantity::kZSlide.key : quantity::kCTilt.key, 2));
  for (std::size_t i = 0; i < 2; ++i) {
    event.slope[i] = tilt.values[i];  // small: the tangent is the angle
    event.sd_slope[i] = tilt.sdOf(i);
  }
  return std::vector<Event>{event};
}

Outcome<std::vector<Event>> screw(const metrology::Result& result, Axis axis, std::uint64_t id, MonoTime now) {
  ScrewActivated event{
      .result_id = id, .axis = axis, .gain = 0, .sd_gain = 0, .sectors = 0, .sector_nm = {}, .at = now};
  const bool has_table = result.find(quantity::kSectorTable.key) != nullptr;
  // A run on the machine sees the face alone: K stays.
  if (result.find(quantity::kScrewGain.key) != nullptr || !has_table) {
    TRY(const auto gain, valuesOf(result, quantity::kScrewGain.key, 1));
    event.gain = gain.values[0];
    event.sd_gain = gain.sdOf(0);
  }
  if (!has_table) return std::vector<Event>{event};
  TRY(const auto table, valuesOf(result, quantity::kSectorTable.key, 0));
  if (table.values.size() > kMostScrewSectors) {
    return Error{"The box holds a table of " + std::to_string(kMostScrewSectors) + " sectors, but this result has " +
                 std::to_string(table.values.size()) + ": calibrate again with fewer."};
  }
  event.sectors = static_cast<std::uint8_t>(table.values.size());
  constexpr double kMost_um = 1e6;  // a metre of extension is no reading
  for (std::size_t i = 0; i < table.values.size(); ++i) {
    const double value_um = table.values[i];
    if (std::abs(value_um) > kMost_um) return Error{"A sector of the screw's table is longer than a metre."};
    event.sector_nm[i] = static_cast<std::int32_t>(std::lround(value_um * 1e3));
  }
  return std::vector<Event>{event};
}

// (D1a)
Outcome<std::vector<Event>> screwReference(const metrology::Result& result, Axis axis, std::uint64_t id, MonoTime now) {
  TRY(const auto reading, valuesOf(result, quantity::kColdReading.key, 1));
  return std::vector<Event>{
      ScrewReferenceActivated{.result_id = id, .axis = axis, .reading_um = reading.values[0], .at = now}};
}

// The length of the assembled tool from the gauge line, L3 + L1 (C2): it replaces the one of [[tool]]. A result with
// L3 alone has no such length.
Outcome<std::vector<Event>> assembly(const metrology::Result& result, std::uint32_t tool, std::uint64_t id,
                                     MonoTime now) {
  if (result.find(quantity::kGaugeLength.key) == nullptr)
    return std::vector<Event>{ToolLengthActivated{.result_id = 0, .tool = tool, .length_mm = 0, .at = now}};
  TRY(const auto length, valuesOf(result, quantity::kGaugeLength.key, 1));
  if (!(length.values[0] > 0))
    return Error{"The " + std::string{quantity::kGaugeLength.key} + " of tool " + std::to_string(tool) +
                 " is not above 0: measure it again (probebox calibrate tool-assembly)."};
  return std::vector<Event>{
      ToolLengthActivated{.result_id = id, .tool = tool, .length_mm = length.values[0], .at = now}};
}

std::optional<Error> tooManyRows(std::size_t rows) {
  if (rows <= kMostErrorRows) return std::nullopt;
  return Error{"The box holds a table of " + std::to_string(kMostErrorRows) + " angles, but this result has " +
               std::to_string(rows) + ": leave some out."};
}

// (B19)-(B21), and what the readings have left at each angle.
Outcome<std::vector<Event>> swivel(const metrology::Result& result, RotaryAxis axis, std::uint64_t id, MonoTime now) {
  SwivelActivated event{.result_id = id, .axis = axis, .terms = {}, .rows = 0, .at = now};
  TRY(const auto terms, valuesOf(result, quantity::kSwivelTerms.key, event.terms.size()));
  TRY(const auto left, valuesOf(result, quantity::kLeftByAngle.key, 0));
  const std::size_t rows = left.values.size() / 4;  // B_deg, x, y, z
  if (auto error = tooManyRows(rows)) return *error;
  std::ranges::copy(terms.values, event.terms.begin());
  event.rows = static_cast<std::uint8_t>(rows);
  std::vector<Event> events{event};
  for (std::size_t k = 0; k < rows; ++k) {
    const auto row = left.values.subspan(4 * k, 4);
    events.emplace_back(ErrorsAtAngle{.of = ErrorsOf::swivel,
                                      .axis = axis,
                                      .result_id = id,
                                      .angle_rad = radians(row[0]),
                                      .errors = {row[1], row[2], row[3]},
                                      .at = now});
  }
  return events;
}

// (E5), with the nominal axis that the errors are about.
Outcome<std::vector<Event>> rotary(const metrology::Result& result, RotaryAxis axis, std::uint64_t id, MonoTime now) {
  RotaryActivated event{.result_id = id, .axis = axis, .point_mm = {}, .direction = {}, .sd = {}, .rows = 0, .at = now};
  TRY(const auto point, valuesOf(result, quantity::kAxisPoint.key, event.point_mm.size()));
  TRY(const auto direction, valuesOf(result, quantity::kAxisDirection.key, event.direction.size()));
  TRY(const auto angles, valuesOf(result, quantity::kErrorAngles.key, 0));
  const std::size_t rows = angles.values.size();
  if (auto error = tooManyRows(rows)) return *error;
  TRY(const auto errors, valuesOf(result, quantity::kSixErrors.key, 6 * rows));
  std::ranges::copy(point.values, event.point_mm.begin());
  std::ranges::copy(direction.values, event.direction.begin());
  event.rows = static_cast<std::uint8_t>(rows);
  for (std::size_t i = 0; i < 6 * rows; ++i) event.sd[i % 6] = std::max(event.sd[i % 6], errors.sdOf(i));
  std::vector<Event> events{event};
  for (std::size_t k = 0; k < rows; ++k) {
    ErrorsAtAngle row{
        .of = ErrorsOf::rotary, .axis = axis, .result_id = id, .angle_rad = angles.values[k], .errors = {}, .at = now};
    std::ranges::copy(errors.values.subspan(6 * k, 6), row.errors.begin());
    events.emplace_back(row);
  }
  return events;
}

// Why a result about the offset of a stylus cannot be in force; nothing where it can.
std::optional<Error> whyNoOffset(const metrology::Result& result) {
  const auto offset = stylusOffsetOf(result);
  if (!offset)
    return Error{"The result of " + result.method +
                 " has no offset of the stylus: measure it with spindle-offset-2x2."};
  if (!std::ranges::all_of(offset->values, [](double mm) { return std::isfinite(mm); }))
    return Error{"The result of " + result.method + " has a stylus offset that is not a number: calibrate again."};
  return std::nullopt;
}

std::string named(const store::Record& record) {
  return "Result " + std::to_string(record.id);
}

// Why a result whose case does not name its subject cannot be in force; nothing where it can.
std::optional<Error> whyNameless(const store::Record& record, const metrology::Result& result) {
  const auto& subject = record.binding.subject;
  if (subject == "c-axis-alignment")
    return Error{
        "The spindle stood still while the slide carried the chuck, so the result of " + result.method +
        " relates neither to the spindle axis nor to one tip: measure again with the spindle at 0 and 180 degrees."};
  if (subject == "sensor-head-calibration")
    return Error{named(record) + " does not name its sensor head: give its case the config key 'tool'."};
  return std::nullopt;
}

// Covariance of two parts of one key; nothing if the result states none.
std::optional<double> covarianceOf(const metrology::Result& result, std::string_view key, std::size_t i,
                                   std::size_t k) {
  if (!result.covariance) return std::nullopt;
  const auto& [components, values] = *result.covariance;
  const auto placeOf = [&](std::size_t part) {
    const auto name = std::string{key} + "[" + std::to_string(part) + "]";
    return static_cast<std::size_t>(std::ranges::find(components, name) - components.begin());
  };
  const std::size_t row = placeOf(i), column = placeOf(k), size = components.size();
  if (row == size || column == size || values.size() != size * size) return std::nullopt;
  return values[row * size + column];
}

// Type A covariance of two parts of one key: as stated, else from the sd.
double statisticalCovarianceOf(const metrology::Result& result, std::string_view key, std::size_t i, std::size_t k) {
  if (const auto stated = covarianceOf(result, key, i, k)) return *stated;
  const auto& sd = result.find(key)->sd;
  return i == k && i < sd.size() ? sd[i] * sd[i] : 0;
}

// Place of the first value of a promised key among all promised values, as the lines of the budget list them.
std::optional<std::size_t> placeInBudget(const metrology::Result& result, std::string_view key) {
  std::size_t place = 0;
  for (const auto& estimate : result.estimates) {
    if (estimate.key == key) return place;
    place += estimate.values.size();
  }
  return std::nullopt;
}

// One cause changes all values together, so each type B line adds the products of its sd.
double typeBCovarianceOf(const metrology::Result& result, std::string_view key, std::size_t i, std::size_t k) {
  const auto first = placeInBudget(result, key);
  if (!first) return 0;
  double sum = 0;
  for (const auto& line : result.budget) {
    if (line.type_b && *first + std::max(i, k) < line.sd.size()) sum += line.sd[*first + i] * line.sd[*first + k];
  }
  return sum;
}

// The core follows the main chuck alone; registers have the second one from the results in force.
Outcome<std::vector<Event>> ofChuck(const Subject& subject, Outcome<std::vector<Event>> events) {
  if (events && subject.of == kSecondSpindle) events->clear();
  return events;
}

}  // namespace

Outcome<procedure::CalibratedHead> calibratedHeadOf(const store::Record& record) {
  const metrology::Result* result = record.result();
  if (result == nullptr) return Error{named(record) + " is a refusal."};
  TRY(const auto matrix, valuesOf(*result, quantity::kSensorMatrix.key, 9));
  procedure::CalibratedHead head{.result_id = record.id,
                                 .tool = parseSubject(record.binding.subject, SubjectKind::sensor_head)->of};
  for (std::size_t i = 0; i < 9; ++i) {
    head.matrix[i / 3][i % 3] = matrix.values[i];
    head.sd[i / 3][i % 3] = matrix.sdOf(i);
  }
  return head;
}

Outcome<procedure::PreTravel> preTravelOf(const store::Record& record) {
  const metrology::Result* result = record.result();
  if (result == nullptr) return Error{named(record) + " is a refusal."};
  constexpr std::string_view kKey = quantity::kPreTravel.key;
  constexpr auto kParts = procedure::PreTravel::kParts;
  if (const auto* found = result->find(kKey); found != nullptr && found->values.size() == kParts - 1)
    return Error{named(record) +
                 " has no pre-travel along the stylus: touch the sphere from below its equator as well."};
  TRY(const auto parts, valuesOf(*result, kKey, kParts));
  const auto subject = parseSubject(record.binding.subject, SubjectKind::pre_travel).value_or(Subject{});
  procedure::PreTravel found{.result_id = record.id, .tool = subject.of, .parts_mm = {}, .covariance = {}};
  std::ranges::copy(parts.values, found.parts_mm.begin());
  for (std::size_t i = 0; i < kParts; ++i)
    for (std::size_t k = 0; k < kParts; ++k)
      found.covariance[i][k] = statisticalCovarianceOf(*result, kKey, i, k) + typeBCovarianceOf(*result, kKey, i, k);
  return found;
}

std::optional<procedure::MeasuredLength> measuredLengthOf(const store::Record& record) {
  const auto assembly = parseSubject(record.binding.subject, SubjectKind::assembly);
  const auto* length = record.result() != nullptr ? record.result()->find(quantity::kGaugeLength.key) : nullptr;
  if (!assembly || length == nullptr) return std::nullopt;
  const auto sds_mm = uncertaintiesOf(*length);
  procedure::MeasuredLength measured{.result_id = record.id,
                                     .tool = assembly->of,
                                     .length_mm = length->value(),
                                     .sd_mm = sds_mm.empty() ? 0.0 : sds_mm.front()};
  // W2 brings the tip onto the axis.
  const auto* to_axis = record.result()->find(quantity::kCompensation.key);
  if (to_axis == nullptr || to_axis->values.size() < 2) return measured;
  measured.tip_mm = {-to_axis->values[0], -to_axis->values[1]};
  const auto sds_of_tip = uncertaintiesOf(*to_axis);
  if (sds_of_tip.size() >= 2) measured.sd_tip_mm = std::max(sds_of_tip[0], sds_of_tip[1]);
  return measured;
}

std::optional<procedure::MeasuredTip> measuredTipOf(const store::Record& record) {
  const auto tool = parseSubject(record.binding.subject, SubjectKind::tool);
  const auto* tip = record.result() != nullptr ? record.result()->find(quantity::kToolOffset.key) : nullptr;
  if (!tool || tip == nullptr || tip->values.size() < 3) return std::nullopt;
  procedure::MeasuredTip measured{.result_id = record.id, .tool = tool->of};
  const auto sds_mm = uncertaintiesOf(*tip);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    measured.at_mm[axis] = tip->values[axis];
    if (axis < sds_mm.size()) measured.sd_mm[axis] = sds_mm[axis];
  }
  return measured;
}

std::string subjectNamed(std::string_view subject_or_method) {
  if (parseSubject(subject_or_method)) return std::string{subject_or_method};  // a method may be called so, too
  const metrology::Method* method = metrology::methodNamed(subject_or_method);
  const bool shared = method != nullptr && method->subject.about;
  return shared ? text(*method->subject.about) : std::string{subject_or_method};
}

Outcome<std::vector<Event>> activationOf(const store::Record& record, MonoTime now) {
  const metrology::Result* result = record.result();
  if (result == nullptr) return Error{named(record) + " is a refusal."};
  const std::vector<Event> none;
  const auto subject = parseSubject(record.binding.subject);
  if (!subject) {
    if (auto why = whyNameless(record, *result)) return *std::move(why);
    return none;
  }
  switch (subject->kind) {
    case SubjectKind::delay:
      return delay(*result, *subject, record.id, now);
    case SubjectKind::centreline:
    case SubjectKind::centreline_slide:
      return ofChuck(*subject, centreline(*result, record.id, now));
    case SubjectKind::screw:
      return screw(*result, static_cast<Axis>(subject->axis()), record.id, now);
    case SubjectKind::screw_reference:
      return screwReference(*result, static_cast<Axis>(subject->axis()), record.id, now);
    case SubjectKind::rotary:
      return rotary(*result, static_cast<RotaryAxis>(subject->axis()), record.id, now);
    case SubjectKind::swivel:
      return swivel(*result, static_cast<RotaryAxis>(subject->axis()), record.id, now);
    case SubjectKind::assembly:
      return assembly(*result, subject->of, record.id, now);
    // The worker follows these, and the core hears nothing of them.
    case SubjectKind::centreline_tip:
      TRY(valuesOf(*result, quantity::kCentre.key, 2));
      return none;
    case SubjectKind::stylus_offset:
      if (auto why = whyNoOffset(*result)) return *std::move(why);
      return none;
    case SubjectKind::sensor_head:
      TRY(calibratedHeadOf(record));
      return none;
    case SubjectKind::pre_travel:
      TRY(preTravelOf(record));
      return none;
    default:
      return none;
  }
}

std::optional<Event> noneInForce(std::string_view name, MonoTime now) {
  const auto subject = parseSubject(name);
  if (!subject) return std::nullopt;
  const auto as = [now](auto none) {
    none.at = now;
    return std::optional<Event>{none};
  };
  const auto of = [&](auto none, auto axis) {
    none.axis = axis;
    return as(none);
  };
  const auto axis = static_cast<Axis>(subject->axis());
  const auto rotary_axis = static_cast<RotaryAxis>(subject->axis());
  switch (subject->kind) {
    case SubjectKind::delay:
      return as(DelayActivated{});
    case SubjectKind::centreline:
    case SubjectKind::centreline_slide:
      if (subject->of != 0) return std::nullopt;
      return as(CentrelineActivated{});
    case SubjectKind::screw:
      return of(ScrewActivated{}, axis);
    case SubjectKind::screw_reference:
      return of(ScrewReferenceActivated{}, axis);
    case SubjectKind::rotary:
      return of(RotaryActivated{}, rotary_axis);
    case SubjectKind::swivel:
      return of(SwivelActivated{}, rotary_axis);
    case SubjectKind::assembly:
      return ToolLengthActivated{.result_id = 0, .tool = subject->of, .length_mm = 0, .at = now};
    default:
      return std::nullopt;
  }
}

}  // namespace probebox::app
