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

// The longest delay that samples can wait for, either way.
inline constexpr Nanoseconds kLongestDelay{200'000'000};

struct LatchConfig {
  std::int32_t samples_per_tick{1};  // 1 to 100
  SourceConfig probe{};
  std::array<SourceConfig, kLinearAxes> axes{};
  // (A20): an axis that lags the probe by tau (machine data are stale, tau > 0) is moved back by it, so that equal
  // indices belong together; the probe is buffered meanwhile.
  std::array<Nanoseconds, kLinearAxes> tau{};
  // A sample is given up this long after its time (and the largest tau), when a source has not come by then.
  Nanoseconds maximum_wait{100'000'000};
};

// Says which value cannot be used and what could be; nothing when the configuration is good.
std::optional<Error> whyRefused(const LatchConfig& config);

// produced = records + lost, at every moment.
struct LatchCounters {
  std::int64_t produced{};
  std::int64_t records{};
  std::int64_t lost{};
  std::uint64_t late{};         // events that came after a sample at or after their stamp was decided
  std::uint64_t disordered{};   // events older than the previous one of the same source: not used
  std::uint64_t overwritten{};  // events pushed out of a full buffer before any sample used them
};

// Events in, one decision a sample out: a Record, or samples declared Lost. No index is skipped or repeated.
// Buffers for all stamps of maximum_wait and kLongestDelay are allocated when it is made: 10 kB a channel at 1 kHz, 1
// MB at 100 kHz. The first sample is the first one of the first tick after the clock has locked.
//
//   latch.push(event); latch.setClock(estimator.map()); while (const auto decision = latch.next()) ...
class Latch {
 public:
  // config: one that whyRefused() has nothing against.
  explicit Latch(const LatchConfig& config);

  void push(const Event& event);  // what a latch does not know it ignores; TimeAdvanced drives the maximum wait
  void push(const Count& count);
  void push(const Deflection& deflection);
  void push(const Edge& edge);  // trigger, skip and index lines; sync is the clock's
  void push(const Marker& marker);
  void advance(MonoTime now);

  // (A20): another delay for the samples that are not decided yet. Where an axis then needs counts that have gone by,
  // samples are lost. False, and nothing changes, for a delay beyond kLongestDelay.
  bool setTau(const std::array<Nanoseconds, kLinearAxes>& tau);

  // The clock's map after each of its decisions.
  void setClock(const TickMap& map);

  // The next decision, or nothing until more has come. Losses in a row with one reason come as one.
  std::optional<Decision> next();

  const LatchCounters& counters() const { return counters_; }
  // The sample that will be decided next; nothing before the first lock.
  std::optional<SampleIndex> pending() const { return next_; }

 private:
  // What the next sample would become now.
  struct Examined {
    enum class As : std::uint8_t { waiting, record, lost } as{};
    LostReason reason{};
    Record record{};
  };

  Examined examine();
  bool isGivenUp(MonoTime t) const;
  Decision give(const Record& record);
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
  SampleIndex resume_{};               // samples before it were lost with the clock
  MonoTime decided_{MonoTime::min()};  // time of the last sample decided
  MonoTime now_{MonoTime::min()};
  LatchCounters counters_;
};

}  // namespace probebox::latch
