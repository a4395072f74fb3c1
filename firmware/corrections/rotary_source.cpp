#include "firmware/corrections/rotary_source.hpp"

#include <algorithm>
#include <string>
#include <variant>

namespace probebox::corrections {
namespace {

Eigen::Vector3d vectorOf(const std::array<double, 3>& values) {
  return {values[0], values[1], values[2]};
}

}  // namespace

bool RotaryConfig::turnsBy(RotaryAxis axis) const {
  const std::span named{chain.data(), count};
  return std::ranges::find(named, axis) != named.end();
}

RotarySource::RotarySource(const RotaryConfig& config) : config_{config}, held_{config.hold} {
  if (config.fitted()) held_.invalid();
}

std::optional<Error> RotarySource::validateActivation(const RotaryConfig& config, const RotaryActivated& activated,
                                                      std::span<const Event> rows) {
  if (!config.fitted()) return std::nullopt;
  if (!config.turnsBy(activated.axis)) {
    return Error{std::string{"The result is for the axis "} + "ABC"[static_cast<std::size_t>(activated.axis)] +
                 ", which the chain of [rotary_table] in machine.toml does not name."};
  }
  IncomingTable<6> table;
  table.expect(activated.result_id, activated.rows);
  for (const auto& row : rows) table.add(std::get<ErrorsAtAngle>(row));
  if (const auto made = table.table(config.between[static_cast<std::size_t>(activated.axis)]); !made)
    return Error{made.error().reason + "."};
  return std::nullopt;
}

void RotarySource::push(const RotaryActivated& activated) {
  if (!config_.turnsBy(activated.axis)) return;
  auto& axis = axes_[static_cast<std::size_t>(activated.axis)];
  axis.coming = activated;
  axis.table.expect(activated.result_id, activated.rows);
  if (activated.result_id != 0) return;
  axis.in_force = {};
  correction_.reset();
}

void RotarySource::push(const ErrorsAtAngle& row) {
  if (row.of != ErrorsOf::rotary || !config_.turnsBy(row.axis)) return;
  auto& axis = axes_[static_cast<std::size_t>(row.axis)];
  if (!axis.table.add(row)) return;
  // validateActivation() has tried the same before.
  const auto errors = axis.table.table(config_.between[static_cast<std::size_t>(row.axis)]);
  if (!errors) return;
  axis.in_force = axis.coming;
  axis.calibrated = {vectorOf(axis.coming.point_mm), vectorOf(axis.coming.direction), *errors};
  chainUp();
}

void RotarySource::chainUp() {
  correction_.reset();
  std::array<metrology::CalibratedAxis, kRotaryAxes> links;
  for (std::size_t k = 0; k < config_.count; ++k) {
    const auto& axis = axes_[static_cast<std::size_t>(config_.chain[k])];
    if (axis.in_force.result_id == 0) return;
    links[k] = axis.calibrated;
  }
  if (const auto correction = metrology::RotaryCorrection::of(std::span{links}.first(config_.count)))
    correction_ = *correction;
}

Eigen::Vector3d RotarySource::toolPoint(const MachineTick& tick) const {
  const Eigen::Vector3d position{*tick.position_mm[0], *tick.position_mm[1], *tick.position_mm[2]};
  if (!config_.at_tip) return position;
  return position + vectorOf(config_.tool_direction) * (*tick.tool_length_mm - config_.measured_length_mm);
}

void RotarySource::tick(const MachineTick& tick) {
  if (!config_.fitted()) return;
  const bool placed = std::ranges::all_of(tick.position_mm, [](const auto& mm) { return mm.has_value(); }) &&
                      (!config_.at_tip || tick.tool_length_mm.has_value());
  if (!correction_ || !placed) return held_.invalid();
  std::array<std::optional<double>, kRotaryAxes> angles;
  bool doubtful = std::ranges::find(tick.position_doubtful, true) != tick.position_doubtful.end();
  for (std::size_t k = 0; k < config_.count; ++k) {
    const auto& angle = tick.angles[static_cast<std::size_t>(config_.chain[k])];
    angles[k] = angle.rad;
    doubtful = doubtful || angle.doubtful;
  }
  const auto known = std::span{angles}.first(config_.count);
  const auto point = correction_->tablePoint(known, toolPoint(tick));
  const auto error_mm = point ? correction_->at(known, *point) : std::nullopt;
  if (!error_mm) return held_.invalid();
  if (doubtful) return held_.doubtful(tick.at);
  held_.good({error_mm->x(), error_mm->y(), error_mm->z()});
}

std::optional<metrology::SixErrors> RotarySource::errorsAt(RotaryAxis axis, std::optional<double> angle_rad) const {
  const auto& errors = axes_[static_cast<std::size_t>(axis)];
  if (errors.in_force.result_id == 0 || !angle_rad) return std::nullopt;
  return errors.calibrated.errors.at(*angle_rad);
}

SourceInputs RotarySource::inputs() const {
  if (!fitted()) return {};
  SourceInputs inputs{.positions = {true, true, true}, .angles = {}};
  for (std::size_t axis = 0; axis < kRotaryAxes; ++axis)
    inputs.angles[axis] = config_.turnsBy(static_cast<RotaryAxis>(axis));
  return inputs;
}

}  // namespace probebox::corrections
