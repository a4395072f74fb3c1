#include "firmware/corrections/swivel_source.hpp"

#include <string>
#include <variant>

namespace probebox::corrections {
namespace {

// The terms stand row by row: for X, Y, Z the four factors.
metrology::SwivelTerms termsOf(const SwivelActivated& activated) {
  const auto column = [&](std::size_t k) {
    return Eigen::Vector3d{activated.terms[k], activated.terms[4 + k], activated.terms[8 + k]};
  };
  return {.sine = column(0), .sine_per_mm = column(1), .rest = column(2), .rest_per_mm = column(3)};
}

}  // namespace

SwivelSource::SwivelSource(const SwivelConfig& config) : config_{config}, held_{config.hold} {
  if (config.fitted) held_.invalid();
}

std::optional<Error> SwivelSource::validateActivation(const SwivelConfig& config, const SwivelActivated& activated,
                                                      std::span<const Event> rows) {
  if (!config.fitted) return std::nullopt;
  if (activated.axis != config.axis) {
    const auto letter = [](RotaryAxis axis) { return std::string{"ABC"[static_cast<std::size_t>(axis)]}; };
    return Error{"The result is for a head that swivels by " + letter(activated.axis) +
                 ", but [swivel] of machine.toml says " + letter(config.axis) + ": correct the one that is wrong."};
  }
  if (!config.by_angle) return std::nullopt;
  IncomingTable<3> table;
  table.expect(activated.result_id, activated.rows);
  for (const auto& row : rows) table.add(std::get<ErrorsAtAngle>(row));
  if (const auto made = table.table(metrology::Between::linear); !made)
    return Error{made.error().reason + ", or by_angle = false in [swivel] of machine.toml."};
  return std::nullopt;
}

void SwivelSource::push(const SwivelActivated& activated) {
  if (!config_.fitted || activated.axis != config_.axis) return;
  coming_ = activated;
  table_.expect(activated.result_id, activated.rows);
  if (activated.result_id == 0) {
    result_id_ = 0;
  } else if (!config_.by_angle) {
    bringIntoForce({});
  }
}

void SwivelSource::push(const ErrorsAtAngle& row) {
  if (!config_.fitted || !config_.by_angle || row.of != ErrorsOf::swivel || row.axis != config_.axis) return;
  if (!table_.add(row)) return;
  // validateActivation() has tried the same before.
  if (const auto left = table_.table(metrology::Between::linear)) bringIntoForce(*left);
}

void SwivelSource::bringIntoForce(const std::optional<metrology::AngleTable<3>>& left) {
  correction_ = metrology::SwivelCorrection{termsOf(coming_), left};
  result_id_ = coming_.result_id;
}

void SwivelSource::tick(const MachineTick& tick) {
  if (!config_.fitted) return;
  const auto& angle = tick.angles[static_cast<std::size_t>(config_.axis)];
  if (result_id_ == 0) return held_.invalid();
  const auto error_mm = correction_.at(angle.rad, tick.tool_length_mm);
  if (!error_mm) return held_.invalid();
  if (angle.doubtful) return held_.doubtful(tick.at);
  held_.good({error_mm->x(), error_mm->y(), error_mm->z()});
}

SourceInputs SwivelSource::inputs() const {
  SourceInputs inputs;
  inputs.angles.at(static_cast<std::size_t>(config_.axis)) = fitted();
  return inputs;
}

}  // namespace probebox::corrections
