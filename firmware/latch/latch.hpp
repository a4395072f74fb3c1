#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "firmware/latch/line_state.hpp"
#include "firmware/latch/record.hpp"
#include "firmware/latch/source.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::latch {

// Longest delay, of either sign, that samples can wait for.
inline constexpr Nanoseconds kLongestDelay{200'000'000};

struct LatchConfig {
  std::int32_t samples_per_tick{1};  // 1 to 100
  SourceConfig probe{};
  std::array<SourceConfig, kLinearAxes> axes{};
  // (A20): an axis that lags the probe by tau (machine data are late, tau > 0) is shifted back by tau, so equal indices
  // belong together. The probe is buffered meanwhile.
  std::array<Nanoseconds, kLinearAxes> tau{};
  // A sample is lost when a source has not delivered this long after the sample's time plus the largest tau.
  Nanoseconds maximum_wait{100'000'000};
};

// Names the first value that is out of range and its valid range; nullopt when the configuration is valid.
std::optional<Error> validate(const LatchConfig& config);

// produced = records + lost holds at every moment.
struct LatchCounters {
  std::int64_t produced{};
  std::int64_t records{};
  std::int64_t lost{};
  std::uint64_t late{};         // events that came after a sample at or after their stamp was decided
  std::uint64_t disordered{};   // events older than the previous one of the same source: not used
  std::uint64_t overwritten{};  // events dropped from a full buffer before a sample used them
};

// Turns events into one decision per sample: a Record, or Lost with a reason. No index is skipped or repeated.
// Allocates in the constructor the buffers for maximum_wait and kLongestDelay: 10 kB a channel at 1 kHz, 1 MB at 100
// kHz. The first sample belongs to the first tick after the clock has locked.
//
//   latch.push(event); latch.setClock(estimator.map()); while (const auto decision = latch.next()) ...
class Latch {
 public:
  // config: must pass validate().
  explicit Latch(const LatchConfig& config);

  void push(const Event& event);  // unknown events are ignored; TimeAdvanced drives the maximum wait
  void push(const Count& count);
  void push(const Deflection& deflection);
  void push(const Edge& edge);  // trigger, skip and index lines; sync edges belong to the clock
  void push(const Marker& marker);
  void advance(MonoTime now);

  // (A20): sets the delay for samples not decided yet. Samples are lost where an axis would need counts that are no
  // longer buffered. Returns false and changes nothing when a delay exceeds kLongestDelay.
  bool setTau(const std::array<Nanoseconds, kLinearAxes>& tau);

  // Sets the clock map; call after each decision of the clock.
  void setClock(const TickMap& map);

  // Returns the next decision, or nullopt until more events arrive. Consecutive losses with the same reason are merged.
  std::optional<Decision> next();

  const LatchCounters& counters() const { return counters_; }
  // The next sample to decide; nullopt before the first lock.
  std::optional<SampleIndex> pending() const { return next_; }
  const TickMap& clock() const { return map_; }

 private:
  // What is said about the next sample at this moment.
  enum class Examined : std::uint8_t { waiting, record, lost };

  // Fills in the record, or the reason of the loss.
  Examined examine(Record& record, LostReason& reason);
  void goTo(SampleIndex next);
  MonoTime timeOfNext();
  bool isReached(MonoTime t) const;
  bool isGivenUp(MonoTime t) const;
  Decision give(Record record);
  Decision give(const Lost& lost);
  void noteLate(MonoTime at);
  template <std::size_t kWidth>
  void note(typename Source<kWidth>::Pushed pushed);

  LatchConfig config_;
  Nanoseconds patience_;
  Source<3> probe_;
  std::array<Source<1>, kLinearAxes> axes_;
  LineState lines_;
  TickMap map_;
  bool clock_is_good_{};
  std::optional<SampleIndex> next_;
  std::optional<MonoTime> time_of_next_;  // by map_, once it was asked for
  SampleIndex resume_{};                  // samples before it were lost with the clock
  MonoTime decided_{MonoTime::min()};     // time of the last decided sample
  MonoTime now_{MonoTime::min()};
  LatchCounters counters_;
};

}  // namespace probebox::latch
