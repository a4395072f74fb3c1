#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <deque>
#include <functional>
#include <gtest/gtest.h>
#include <memory>
#include <numbers>
#include <random>
#include <vector>

#include "drivers/usb_probe/decode.hpp"
#include "firmware/front_end/core/assembly.hpp"
#include "host-tests/emulation/scenario.hpp"
#include "host-tests/support/no_alloc.hpp"

// Eight axes on two front ends with one sync line: what was put on the pins, and where the box says that it was.
namespace probebox::scenario {
namespace {

constexpr double kStepsASample = FrontEndProbe::kSettings.steps_a_sample;
constexpr std::size_t kChannels = 4;
using Motion = std::function<double(std::size_t channel, double time_s)>;  // counts

// The program of a front end on an oscillator of its own; packets arrive late, and some never.
class FrontEndOnPins {
 public:
  struct Wiring {
    std::uint8_t number{};
    usb_probe::CounterAxes axes{};
    usb_probe::WiredLines lines{};
  };

  FrontEndOnPins(std::uint64_t seed, MonoTime start, double offset_ppm, double lost, const Wiring& wiring,
                 Motion motion)
      : random_{seed},
        start_{start},
        period_s_{(1 + offset_ppm * 1e-6) / FrontEndProbe::kRate_hz},
        lost_{lost},
        motion_{std::move(motion)},
        decoder_{wiring.axes, wiring.lines, wiring.number} {
    assembly_->start(FrontEndProbe::kSettings, run_);
  }

  double nextSample_s() const { return first_s_ + static_cast<double>(samples_) * period_s_; }
  void sample() {
    front_end::Latched latched{.has_deflection = true};
    for (std::size_t i = 0; i < kChannels; ++i) {
      const std::int64_t counts = std::llround(motion_(i, nextSample_s()));
      if (samples_ == 0) zero_[i] = counts;
      latched.counts[i] = static_cast<std::uint32_t>(counts - zero_[i]);
    }
    const double taken_s = nextSample_s();
    ++samples_;
    assembly_->sample(latched);
    for (int parts = 0; parts < 50; ++parts) assembly_->work();
    while (const auto* const packet = assembly_->packets().front()) {
      send(std::span{packet->bytes}.first(packet->size), taken_s);
      assembly_->taken();
    }
  }
  // An active edge at that time, and the other one after it.
  void edge(usb_probe::ReceiverLine line, double time_s) {
    if (samples_ == 0) return;
    const auto step = static_cast<std::uint32_t>(std::ceil((time_s - first_s_) / period_s_ * kStepsASample));
    const unsigned bit = 1U << static_cast<unsigned>(line);
    assembly_->lines((0U - step) << front_end::kStampedPins | bit);
    assembly_->lines((0U - step - 100) << front_end::kStampedPins);
  }
  void restart() {
    first_s_ = nextSample_s() + 0.2;
    samples_ = 0;
    assembly_->start(FrontEndProbe::kSettings, ++run_);
  }
  // In counts of the encoder, from where it began to count.
  double counts(std::size_t channel, double time_s) const {
    return motion_(channel, time_s) - static_cast<double>(zero_.at(channel));
  }
  std::deque<Event>& arrivals() { return arrivals_; }

 private:
  void send(std::span<const std::byte> packet, double taken_s) {
    if (lost_ > 0 && std::bernoulli_distribution{lost_}(random_)) return;
    const double late_ns =
        std::lognormal_distribution{std::log(CountedProbe::kMedianNs), CountedProbe::kShape}(random_);
    arrived_ = std::max(arrived_, start_ + Nanoseconds{std::llround(1e9 * taken_s + late_ns)});
    decoder_.begin(packet, arrived_, true);
    std::array<Event, 64> events;
    while (const std::size_t count = decoder_.read(packet, events))
      arrivals_.insert(arrivals_.end(), events.begin(), events.begin() + static_cast<std::ptrdiff_t>(count));
  }

  std::mt19937_64 random_;
  MonoTime start_;
  double period_s_, lost_;
  Motion motion_;
  usb_probe::ReceiverDecoder decoder_;
  std::unique_ptr<front_end::Assembly> assembly_ = std::make_unique<front_end::Assembly>();
  std::uint8_t run_{1};
  double first_s_{};
  std::uint64_t samples_{};
  std::array<std::int64_t, kChannels> zero_{};
  std::deque<Event> arrivals_;
  MonoTime arrived_{};
};

constexpr double kCounts_per_mm = 40'000, kCounts_per_deg = 40'000;

// Each of them 100 mm/s at most, at a frequency of its own.
double motionOf(std::size_t channel, double time_s) {
  const double hertz = 0.7 + 0.1 * static_cast<double>(channel);
  const double radian_hz = 2 * std::numbers::pi * hertz;
  return kCounts_per_mm * 100 / radian_hz * std::sin(radian_hz * time_s + static_cast<double>(channel));
}

box::BoxConfig boxOfEightAxes() {
  auto world = usualWorld();
  world.probe.rate_hz = FrontEndProbe::kRate_hz;
  auto box = usualBox(world);
  box.has_second_receiver = box.counts_have_own_stamps = true;
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    box.latch.axes[axis].interval = box.latch.probe.interval;
    box.mm_per_count[axis] = 1 / kCounts_per_mm;
    box.corrections.references[axis] = {.by = corrections::ReferenceBy::absolute, .mm_per_count = 1 / kCounts_per_mm};
    box.corrections.angles[axis] = {
        .described = true,
        .reference = {.by = corrections::ReferenceBy::absolute, .mm_per_count = 1 / kCounts_per_deg}};
  }
  return box;
}

class EightAxes {
 public:
  // Random phase of the sync line, and ratio of the oscillators.
  EightAxes(std::uint64_t seed, double lost) : EightAxes{std::mt19937_64{seed}, seed, lost} {}

  // X + U, Z + W on the first; Y, A, B, C on the second.
  void run(double seconds) {
    for (const double end_s = now_s_ + seconds; now_s_ < end_s; now_s_ += 1e-3) {
      advance(now_s_);
      const MonoTime now = start_ + Nanoseconds{std::llround(1e9 * now_s_)};
      for (auto* const queue : {&first_.arrivals(), &second_.arrivals()})
        for (; !queue->empty() && stampOf(queue->front()) <= now; queue->pop_front()) push(queue->front());
      push(TimeAdvanced{now});
    }
  }
  FrontEndOnPins& second() { return second_; }
  const published::SecondReceiverStatus& status() const { return box_.state().snapshot.second_receiver; }

  // Largest difference of X, Y, Z, A, B, C at the triggers since the last call, in counts.
  double worstCounts() {
    double worst = 0;
    judged_ = 0;
    for (const auto& [stamp, sigma_ns, state, tick, phase] : recorder_.triggers) {
      const double time_s =
          kTrigger_s * std::round(1e-9 * static_cast<double>((stamp.at - start_).count()) / kTrigger_s);
      const bool known = stamp.has_position[0] && stamp.has_position[1] && stamp.has_position[2] &&
                         stamp.has_angle[0] && stamp.has_angle[1] && stamp.has_angle[2];
      if (!known) continue;
      ++judged_;
      const std::array truth{first_.counts(0, time_s) + first_.counts(1, time_s), second_.counts(0, time_s),
                             first_.counts(2, time_s) + first_.counts(3, time_s)};
      for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
        worst = std::max(worst, std::abs(stamp.position_mm[axis] * kCounts_per_mm - truth[axis]));
        const double angle_deg = stamp.angle_rad[axis] * 180 / std::numbers::pi;
        worst = std::max(
            worst, std::abs(std::remainder(angle_deg - second_.counts(axis + 1, time_s) / kCounts_per_deg, 360.0)) *
                       kCounts_per_deg);
      }
    }
    recorder_.triggers.clear();
    return worst;
  }
  std::size_t judged() const { return judged_; }
  std::uint64_t allocations() const { return allocations_; }

 private:
  static constexpr double kTick_s = 1e-3, kTrigger_s = 0.0517;

  EightAxes(std::mt19937_64 random, std::uint64_t seed, double lost)
      : tick_s_{std::uniform_real_distribution{0.0, kTick_s}(random)},
        first_{seed, start_, std::uniform_real_distribution{-50.0, 50.0}(random), lost, wiringOfFirst(), motionOf},
        second_{seed + 1000,
                start_,
                std::uniform_real_distribution{-50.0, 50.0}(random),
                lost,
                wiringOfSecond(),
                [](std::size_t channel, double time_s) { return motionOf(channel + kChannels, time_s); }} {
    recorder_.triggers.reserve(4096);
    recorder_.keeps_bytes = false;
  }

  static FrontEndOnPins::Wiring wiringOfFirst() {
    FrontEndOnPins::Wiring wiring{
        .lines = {usb_probe::WiredLine{LineRole::sync}, usb_probe::WiredLine{LineRole::trigger}}};
    wiring.axes[0] = {.axis = 0};
    wiring.axes[1] = {.axis = 0, .counts_per_count = 1};
    wiring.axes[2] = {.axis = 2};
    wiring.axes[3] = {.axis = 2, .counts_per_count = 1};
    return wiring;
  }
  static FrontEndOnPins::Wiring wiringOfSecond() {
    FrontEndOnPins::Wiring wiring{.number = 1, .lines = {usb_probe::WiredLine{LineRole::sync, 1}}};
    for (std::uint8_t i = 0; i < kChannels; ++i)
      wiring.axes[i] = {.axis = static_cast<std::uint8_t>(i == 0 ? 1 : i + 2)};
    return wiring;
  }

  // What comes on the pins, in the order of its time.
  void advance(double until_s) {
    while (true) {
      const double trigger_s = kTrigger_s * static_cast<double>(triggers_ + 1);
      const double next_s = std::min({first_.nextSample_s(), second_.nextSample_s(), tick_s_, trigger_s});
      if (next_s > until_s) return;
      if (next_s == first_.nextSample_s()) {
        first_.sample();
      } else if (next_s == second_.nextSample_s()) {
        second_.sample();
      } else if (next_s == tick_s_) {
        first_.edge(usb_probe::ReceiverLine::sync, tick_s_);
        second_.edge(usb_probe::ReceiverLine::sync, tick_s_);
        tick_s_ += kTick_s;
      } else {
        ++triggers_;
        first_.edge(usb_probe::ReceiverLine::trigger_1, trigger_s);
      }
    }
  }
  void push(const Event& event) {
    const support::NoAlloc guard;
    box_.push(event);
    allocations_ += guard.allocations();
  }

  MonoTime start_{monoTime(5'000'000'000)};
  double tick_s_, now_s_{};
  FrontEndOnPins first_, second_;
  Recorder recorder_;
  box::Box box_{boxOfEightAxes(), recorder_};
  std::uint64_t triggers_{};
  std::size_t judged_{};
  std::uint64_t allocations_{};
};

// Half a count of each part of a sum, the chord on which the position at a trigger lies between two ticks (Z and W:
// 1194 mm/s^2 over 1 ms), and 8 counts a us of the two.
double mostCounts(const EightAxes& box) {
  return 1 + 6 + 8 * 4 * 1e-3 * box.status().sigma_ns;
}

TEST(TwoFrontEnds, TellWhereEightAxesWereWhateverTheirClocksAre) {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const bool loses = seed % 2 == 0;
    EightAxes box{seed, loses ? 0.01 : 0};
    box.run(15);
    box.worstCounts();
    box.run(4);
    constexpr double kChordOverALostPacket = 1194 * 7e-3 * 7e-3 / 8 / 25e-6;  // 7 ms from tick to tick, in counts
    EXPECT_LT(box.worstCounts(), mostCounts(box) + (loses ? kChordOverALostPacket : 0)) << "seed " << seed;
    EXPECT_LT(box.status().sigma_ns, 200U);
    EXPECT_GT(box.judged(), 60U);
    EXPECT_EQ(box.status().state, ClockState::locked);
    EXPECT_EQ(box.status().restarts, 0U);
    EXPECT_EQ(box.allocations(), 0U) << "on the tick path";
  }
}

TEST(TwoFrontEnds, TellItAgainAfterARestartOfTheSecond) {
  EightAxes box{21, 0};
  box.run(6);
  box.second().restart();
  box.run(10);
  box.worstCounts();
  box.run(2);
  EXPECT_LT(box.worstCounts(), mostCounts(box));
  EXPECT_GT(box.judged(), 30U);
  EXPECT_EQ(box.status().restarts, 1U);
  EXPECT_EQ(box.allocations(), 0U);
}

}  // namespace
}  // namespace probebox::scenario
