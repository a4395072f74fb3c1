#include "host-tests/emulation/emulated_encoders.hpp"

#include <cmath>
#include <numbers>
#include <utility>

namespace probebox::scenario {
namespace {

constexpr Nanoseconds kInterval = std::chrono::milliseconds{1};
constexpr Nanoseconds kLineStep = std::chrono::microseconds{50};

struct Width {
  std::uint64_t ceiling{}, power_up{};
  std::uint8_t bits{};
};
// They wrap with the first motion.
constexpr std::array<Width, kLinearAxes> kWidths{Width{0xFFFF, 0xFFF0, 16}, Width{0xFFFF'FFFF, 0xFFFF'FF00, 32},
                                                 Width{999'999, 999'990, 0}};

}  // namespace

EmulatedEncoders::EmulatedEncoders(EncodersAre kind, const world::World& world, const world::Config& config)
    : kind_{kind}, world_{world}, config_{config} {
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    const auto& [ceiling, power_up, bits] = kWidths[axis];
    auto device = std::make_unique<counter::EmulatedCounter>(
        counter::EmulatedCounter::Config{
            .ceiling = ceiling, .power_up = power_up, .interval = isLatched(axis) ? Nanoseconds{} : kInterval},
        [this, axis](MonoTime at) { return countsAt(axis, at); });
    devices_.at(axis) = device.get();
    counters_.at(axis) = std::make_unique<counter::CounterSource>(
        std::move(device), counter::CounterConfig{.axis = axis,
                                                  .device = "counter" + std::to_string(axis),
                                                  .bits = bits,
                                                  .is_latched = isLatched(axis),
                                                  .interval = kInterval});
  }
  if (kind != EncodersAre::on_lines) return;
  auto lines = std::make_unique<gpio::EmulatedQuadrature>();
  lines_ = lines.get();
  quadrature_ = std::make_unique<gpio::QuadratureSource>(
      std::move(lines),
      gpio::QuadratureConfig{.axis = kLinearAxes + 2, .interval = 10 * kInterval, .maximum_edge_rate_hz = 5000});
}

void EmulatedEncoders::describe(EncodersAre kind, box::BoxConfig& box) {
  if (kind == EncodersAre::stamped) return;
  box.counts_have_own_stamps = true;
  for (auto& axis : box.latch.axes) axis.interval = kInterval;
  if (kind != EncodersAre::on_lines) return;
  auto& c = box.corrections.angles[2];
  c.described = true;
  c.from = corrections::AngleFrom::encoder;
  c.reference = {
      .by = corrections::ReferenceBy::homing, .mm_per_count = 1 / kCountsPerDegree, .maximum_speed_mm_s = 500};
}

bool EmulatedEncoders::isLatched(std::size_t axis) const {
  return kind_ == EncodersAre::latched || (kind_ == EncodersAre::on_lines && axis == 2);
}

// Where the axis that is wired to this input is seen to be: a machine's delay before, with the noise of the scale.
std::int64_t EmulatedEncoders::countsAt(std::size_t input, MonoTime at) {
  const auto axis = wired_to_.at(input);
  const auto& encoders = config_.encoders;
  const double true_mm = std::as_const(world_).machine().positionAt(at, config_.delays.tau_machine_s[axis])[axis];
  const double seen_mm = world_.screws().motorPosition_mm(axis, true_mm, at) +
                         1e-3 * encoders.noise_um * std::normal_distribution{}(random_);
  return turns_.at(input) * config_.machine.axes[axis].sense * std::llround(seen_mm * encoders.counts_per_mm);
}

bool EmulatedEncoders::replaces(const Event& event) const {
  return std::holds_alternative<Count>(event) || (quadrature_ && std::holds_alternative<AngleCount>(event));
}

void EmulatedEncoders::latch(MonoTime at) {
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis)
    if (isLatched(axis)) devices_.at(axis)->latch(at, at + kStampLateness);
}

std::size_t EmulatedEncoders::read(std::span<Event> into, MonoTime now) {
  if (lines_ != nullptr) {
    for (turned_until_ = std::max(turned_until_, now - kInterval); turned_until_ < now; turned_until_ += kLineStep) {
      const double degrees = std::as_const(world_).machine().partAngleAt(turned_until_) * 180 / std::numbers::pi;
      lines_->turnTo(std::llround(degrees * kCountsPerDegree), turned_until_);
    }
  }
  std::size_t count = 0;
  // At instants of its own, as a timer of the kernel ends.
  for (const auto& counter : counters_)
    count += counter->read(into.subspan(count), now - std::chrono::microseconds{30});
  if (quadrature_) count += quadrature_->read(into.subspan(count), now);
  return count;
}

}  // namespace probebox::scenario
