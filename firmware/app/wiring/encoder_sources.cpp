#include "firmware/app/wiring/encoder_sources.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include "board/describe/encoder_checks.hpp"
#include "drivers/counter/counter_source.hpp"
#include "drivers/counter/linux_counter.hpp"
#include "drivers/gpio/lines.hpp"
#include "drivers/gpio/quadrature.hpp"
#include "drivers/io/summed_source.hpp"
#include "firmware/app/wiring/gpio_line.hpp"

namespace probebox::app {
namespace {

// Kinds with a driver, in the order in which they are named to a person.
constexpr std::array<std::string_view, 4> kDriven{"counter", "quadrature", "receiver", "control"};

Nanoseconds intervalOf(const board::EncoderDescription& encoder) {
  return Nanoseconds{std::llround(1e9 / encoder.rate_hz)};
}

std::unique_ptr<io::EventSource> openCounter(const board::CounterEncoder& described,
                                             const board::EncoderDescription& encoder, std::size_t axis,
                                             double fastest_counts_hz) {
  const auto interval = intervalOf(encoder);
  return std::make_unique<counter::CounterSource>(
      std::make_unique<counter::LinuxCounter>(described, board::kAllEncoderAxes.at(axis), interval),
      counter::CounterConfig{.axis = axis,
                             .device = described.device,
                             .bits = described.bits,
                             .is_latched = described.latched_by != board::LatchedBy::polling,
                             .interval = interval,
                             .fastest_counts_hz = fastest_counts_hz});
}

// Lines that are absent or held are asked for while the box runs, as its other lines.
std::unique_ptr<io::EventSource> openQuadrature(const board::QuadratureEncoder& described,
                                                const board::EncoderDescription& encoder, std::size_t axis) {
  return std::make_unique<gpio::QuadratureSource>(
      std::make_unique<GpioLine>(gpio::quadratureLines(described.a, described.b)),
      gpio::QuadratureConfig{
          .axis = axis, .interval = intervalOf(encoder), .maximum_edge_rate_hz = described.maximum_edge_rate_hz});
}

// Null where the axis has none, or it is part of another source.
std::unique_ptr<io::EventSource> openEncoder(const board::Descriptions& descriptions, std::size_t axis) {
  const auto& encoder = board::encoderOf(descriptions.box.devices, axis);
  if (!encoder) return nullptr;
  if (const auto* const counter = std::get_if<board::CounterEncoder>(&encoder->by))
    return openCounter(*counter, *encoder, axis, board::fastestCounts_hz(descriptions.machine, axis));
  if (const auto* const lines = std::get_if<board::QuadratureEncoder>(&encoder->by))
    return openQuadrature(*lines, *encoder, axis);
  return nullptr;
}

}  // namespace

double countsPerSecondaryCount(const board::Machine& machine, std::size_t axis) {
  const auto& primary = machine.axes.at(axis);
  const auto& secondary = machine.secondary_axes.at(axis);
  if (!secondary) return 0;
  return primary.sense * secondary->sense * primary.counts_per_mm / secondary->counts_per_mm;
}

std::optional<Error> whyUnsupportedEncoders(const board::Devices& devices) {
  for (std::size_t axis = 0; axis < board::kAllEncoderAxes.size(); ++axis) {
    const auto& encoder = board::encoderOf(devices, axis);
    if (!encoder || std::ranges::find(kDriven, board::kindOf(*encoder)) != kDriven.end()) continue;
    std::string driven;
    for (const auto kind : kDriven) driven += (driven.empty() ? "\"" : ", \"") + std::string{kind} + "\"";
    return Error{"box.toml:" + std::to_string(encoder->line) + ": [encoder." +
                 std::string{board::kAllEncoderAxes[axis]} + "] has kind = \"" + std::string{board::kindOf(*encoder)} +
                 "\", which is not in this build; it has " + driven + "."};
  }
  return std::nullopt;
}

std::vector<std::unique_ptr<io::EventSource>> openEncoders(const board::Descriptions& descriptions) {
  std::vector<std::unique_ptr<io::EventSource>> sources;
  for (std::size_t axis = 0; axis < board::kEncoderLetters; ++axis) {
    auto source = openEncoder(descriptions, axis);
    if (!source) continue;
    auto secondary = axis < board::kLinearEncoders ? openEncoder(descriptions, board::kEncoderLetters + axis) : nullptr;
    if (secondary) {
      source = std::make_unique<io::SummedSource>(std::move(source), std::move(secondary),
                                                  countsPerSecondaryCount(descriptions.machine, axis));
    }
    sources.push_back(std::move(source));
  }
  return sources;
}

usb_probe::CounterAxes counterAxes(const board::Descriptions& descriptions, std::uint8_t number) {
  usb_probe::CounterAxes axes{};
  for (std::size_t place = 0; place < board::kAllEncoderAxes.size(); ++place) {
    const auto& encoder = board::encoderOf(descriptions.box.devices, place);
    const auto* const receiver = encoder ? std::get_if<board::ReceiverEncoder>(&encoder->by) : nullptr;
    if (receiver == nullptr || receiver->receiver_number != number) continue;
    const bool is_secondary = place >= board::kEncoderLetters;
    const std::size_t axis = is_secondary ? place - board::kEncoderLetters : place;
    const double counts_per_secondary =
        axis < board::kLinearEncoders ? countsPerSecondaryCount(descriptions.machine, axis) : 0;
    // At a mark the receiver latches the primary axis alone, which is no count of the sum.
    axes.at(receiver->channel) = {.axis = static_cast<std::uint8_t>(axis),
                                  .has_index = receiver->has_index && counts_per_secondary == 0,
                                  .counts_per_count = is_secondary ? counts_per_secondary : 0};
  }
  return axes;
}

// The names are in the order of the lines.
static_assert(board::kReceiverLineNames[static_cast<std::size_t>(usb_probe::ReceiverLine::sync)] == "sync" &&
              board::kReceiverLineNames[static_cast<std::size_t>(usb_probe::ReceiverLine::trigger_1)] == "trigger-1" &&
              board::kReceiverLineNames[static_cast<std::size_t>(usb_probe::ReceiverLine::trigger_2)] == "trigger-2" &&
              board::kReceiverLineNames[static_cast<std::size_t>(usb_probe::ReceiverLine::inhibit)] == "inhibit");

usb_probe::WiredLines wiredLines(const board::Box& box, std::uint8_t number) {
  usb_probe::WiredLines lines{};
  const auto sync = static_cast<std::size_t>(usb_probe::ReceiverLine::sync);
  if (number != 0) lines.at(sync) = {LineRole::sync, number, box.sync.active == board::ActiveLevel::low};
  for (const auto& [described, role, line] : gpio::allLines(box))
    if (described->receiver && described->receiver_number == number)
      lines.at(*described->receiver) = {role, line, described->active == board::ActiveLevel::low};
  return lines;
}

std::uint8_t controlAxes(const board::Devices& devices) {
  unsigned axes = 0;
  for (std::size_t axis = 0; axis < board::kEncoderLetters; ++axis) {
    const auto& encoder = devices.encoders_by_axis.at(axis);
    if (encoder && std::holds_alternative<board::ControlEncoder>(encoder->by)) axes |= 1U << axis;
  }
  return static_cast<std::uint8_t>(axes);
}

std::optional<double> controlCounterRate(const board::Devices& devices) {
  for (const auto& encoder : devices.encoders_by_axis) {
    const auto* const control = encoder ? std::get_if<board::ControlEncoder>(&encoder->by) : nullptr;
    if (control != nullptr) return control->counter_rate_hz;
  }
  return std::nullopt;
}

}  // namespace probebox::app
