#pragma once
#include <cstdint>
#include <optional>

#include "protocol/units/time.hpp"

namespace probebox::iio {

// Numbers the frames of a device that stamps but does not count them. The kernel drops frames silently when its buffer
// is full, so gaps show only in the stamps. A frame is numbered when the next one has come: until then a single late
// stamp looks like a gap. Pure; never allocates.
class FrameCounter {
 public:
  struct Number {
    std::uint8_t run{};  // changes when the number of missing frames is unknown
    std::uint32_t counter{};
  };

  // period: nominal; the true one may differ by 200 ppm.
  explicit FrameCounter(Nanoseconds period) : period_ns_{static_cast<double>(period.count())} {}

  // at: stamp of the newest frame, later than that of the one before. Returns the number of the frame before it;
  // nullopt for the first one.
  std::optional<Number> push(MonoTime at);

  // Makes the next frame the first of this run.
  void startRun(std::uint8_t run);
  std::uint8_t run() const { return last_.run; }

  std::uint64_t missing() const { return missing_; }
  // Rate of the last kJudged frames if most of them did not come at the nominal rate; else nullopt.
  std::optional<double> wrongRateHz() const { return wrong_rate_hz_; }

  static constexpr int kJudged = 256;

 private:
  Number decide(MonoTime held, MonoTime next);
  void judge(bool regular, MonoTime at);

  double period_ns_;
  std::optional<MonoTime> held_;  // newest frame, not numbered yet
  std::optional<MonoTime> due_;   // smoothed time of the frame that was numbered last
  Number last_;
  std::uint64_t missing_{};
  int judged_{};
  int regular_{};
  MonoTime judged_from_{};
  std::optional<double> wrong_rate_hz_;
};

}  // namespace probebox::iio
