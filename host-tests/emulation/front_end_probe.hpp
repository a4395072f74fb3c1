#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <random>
#include <span>
#include <utility>

#include "drivers/usb_probe/decode.hpp"
#include "firmware/front_end/core/assembly.hpp"
#include "host-tests/emulation/counted_probe.hpp"
#include "protocol/events/event.hpp"

namespace probebox::scenario {

// The world's probe, encoders, index marks, sync line and trigger behind the front end: its own program makes the
// packets from what its hardware would have latched, and the box's decoder reads them, late by the way over USB. Edges
// have to come with their true times.
class FrontEndProbe {
 public:
  static constexpr front_end::Settings kSettings{.full_scale_nm = {2'000'000, -2'000'000, 2'000'000}};
  static constexpr double kRate_hz = double{front_end::kSystemHz} / front_end::kCyclesAStep / kSettings.steps_a_sample;

  // What is on its pins: the encoders of these axes, as bits, and of the first of two the trigger. Its oscillator is
  // off by so much where it takes its samples itself.
  struct Wiring {
    std::uint8_t axes{0b111};
    std::uint8_t receiver{};
    double offset_ppm{};
  };

  // counts: of X, Y and Z at a time. The front end counts from where they are at its first sample. marks_late_s: by
  // which the encoders show their marks after the world's edges of them.
  FrontEndProbe(std::uint64_t seed, CountedProbe::Counts counts, const std::array<double, kLinearAxes>& marks_late_s,
                const Wiring& wiring)
      : random_{seed},
        counts_{std::move(counts)},
        marks_late_s_{marks_late_s},
        receiver_{wiring.receiver},
        rate_hz_{kRate_hz * (1 + wiring.offset_ppm * 1e-6)},
        axes_{wiring.axes},
        decoder_{counterAxes(wiring.axes), wiredLines(wiring.receiver), wiring.receiver} {
    assembly_->start(kSettings, 1);
  }

  // Takes the samples until then on its own oscillator, without a probe.
  void advance(MonoTime until) {
    if (begun_ == MonoTime{}) begun_ = until;
    while (true) {
      const auto at = begun_ + Nanoseconds{std::llround(1e9 * static_cast<double>(taken_) / rate_hz_)};
      if (at > until) return;
      ++taken_;
      take(Deflection{.at = at});
    }
  }
  // Its supply fails for a moment: it counts anew, and the host finds another run.
  void restart() {
    assembly_->start(kSettings, ++run_);
    samples_ = 0;
    levels_ = 0;
  }
  // It is not on the bus, and what it had sent is gone.
  void setUnplugged(bool unplugged) {
    unplugged_ = unplugged;
    waiting_.clear();
    decoder_.restart();
  }

  void take(const Deflection& deflection) {
    if (samples_ == 0) begin_ = counts_(deflection.at);
    passMarks(deflection.at);
    front_end::Latched latched{.counts = countersAt(deflection.at), .has_deflection = true};
    for (std::size_t c = 0; c < latched.deflection.size(); ++c) {
      const double of_full = deflection.channels_nm[c] / static_cast<double>(kSettings.full_scale_nm[c]);
      latched.deflection[c] = static_cast<std::int16_t>(std::clamp(std::round(32'768 * of_full), -32'768.0, 32'767.0));
    }
    last_ = deflection.at;
    ++samples_;
    assembly_->sample(latched);
    for (int parts = 0; parts < 50; ++parts) assembly_->work();
    while (const auto* const packet = assembly_->packets().front()) {
      send(std::span{packet->bytes}.first(packet->size));
      assembly_->taken();
    }
  }

  // Whether a pin of the front end has this line.
  bool take(const Edge& edge) {
    const bool high = edge.level == Level::active;
    if (edge.role == LineRole::index) {
      if ((axes_ & (1U << edge.line)) == 0) return false;
      marks_.push_back({edge.line, edge.at + Nanoseconds{std::llround(1e9 * marks_late_s_[edge.line])}});
      return true;
    }
    const bool is_sync = edge.role == LineRole::sync;
    if (!is_sync && !(receiver_ == 0 && edge.role == LineRole::trigger && edge.line == 0)) return false;
    const auto line = is_sync ? usb_probe::ReceiverLine::sync : usb_probe::ReceiverLine::trigger_1;
    pass(edge.at, [&](std::uint32_t step) {
      set(step, line, high);
      if (is_sync) set(step + kPulseSteps, line, false);  // the world tells the active edges alone
    });
    return true;
  }

  // What has arrived by `now`.
  bool next(MonoTime now, Event& event) {
    if (waiting_.empty() || stampOf(waiting_.front()) > now) return false;
    event = waiting_.front();
    waiting_.pop_front();
    return true;
  }

  const front_end::FrontEndCounters& counters() { return assembly_->counters(); }

 private:
  static constexpr std::uint32_t kPulseSteps = 100;

  static usb_probe::CounterAxes counterAxes(std::uint8_t wired) {
    usb_probe::CounterAxes axes{};
    for (std::uint8_t i = 0; i < kLinearAxes; ++i)
      if ((wired & (1U << i)) != 0) axes[i] = {.axis = i, .has_index = true};
    return axes;
  }
  static usb_probe::WiredLines wiredLines(std::uint8_t receiver) {
    if (receiver != 0) return {usb_probe::WiredLine{LineRole::sync, receiver}};
    return {usb_probe::WiredLine{LineRole::sync}, usb_probe::WiredLine{LineRole::trigger}};
  }
  static std::uint32_t hardwareStamp(std::uint32_t step, unsigned levels) {
    return (0U - step) << front_end::kStampedPins | levels;
  }

  std::array<std::uint32_t, front_end::kCounters> countersAt(MonoTime at) {
    std::array<std::uint32_t, front_end::kCounters> latched{};
    const auto counts = counts_(at);
    for (std::size_t axis = 0; axis < counts.size(); ++axis)
      latched[axis] = static_cast<std::uint32_t>(counts[axis] - begin_[axis]);
    return latched;
  }

  // The step in which the hardware sees what happens at `at`; nothing is seen before the first sample.
  void pass(MonoTime at, auto&& see) {
    if (samples_ == 0) return;
    const double since = 1e-9 * static_cast<double>((at - last_).count()) * rate_hz_;
    see(static_cast<std::uint32_t>(
        std::llround(std::ceil((static_cast<double>(samples_ - 1) + since) * kSettings.steps_a_sample))));
  }
  void set(std::uint32_t step, usb_probe::ReceiverLine line, bool high) {
    const unsigned bit = 1U << static_cast<unsigned>(line);
    levels_ = high ? levels_ | bit : levels_ & ~bit;
    assembly_->lines(hardwareStamp(step, levels_));
  }

  void passMarks(MonoTime until) {
    for (; !marks_.empty() && marks_.front().at <= until; marks_.pop_front()) {
      const auto [axis, at] = marks_.front();
      pass(at, [&, counts = countersAt(at)](std::uint32_t step) {
        assembly_->index(hardwareStamp(step, 1U << axis), counts);
        assembly_->index(hardwareStamp(step + kPulseSteps, 0), counts);
      });
    }
  }

  void send(std::span<const std::byte> packet) {
    if (unplugged_) return;
    const auto late_ns = std::lognormal_distribution{std::log(CountedProbe::kMedianNs), CountedProbe::kShape}(random_);
    arrived_ = std::max(arrived_, last_ + Nanoseconds{std::llround(late_ns)});
    decoder_.begin(packet, arrived_, true);
    std::array<Event, 64> events;
    while (const std::size_t count = decoder_.read(packet, events))
      waiting_.insert(waiting_.end(), events.begin(), events.begin() + static_cast<std::ptrdiff_t>(count));
  }

  std::mt19937_64 random_;
  CountedProbe::Counts counts_;
  std::array<double, kLinearAxes> marks_late_s_;
  std::uint8_t receiver_;
  double rate_hz_;
  std::uint8_t axes_;
  usb_probe::ReceiverDecoder decoder_;
  MonoTime begun_{};       // its first sample, of its own
  std::uint64_t taken_{};  // of them
  std::uint8_t run_{1};
  bool unplugged_{};
  std::unique_ptr<front_end::Assembly> assembly_ = std::make_unique<front_end::Assembly>();
  std::array<std::int64_t, kLinearAxes> begin_{};
  std::uint64_t samples_{};
  MonoTime last_{};  // sample
  unsigned levels_{};
  struct Mark {
    std::uint8_t axis{};
    MonoTime at{};
  };
  std::deque<Mark> marks_;  // that the encoders have yet to show
  std::deque<Event> waiting_;
  MonoTime arrived_{};
};

}  // namespace probebox::scenario
