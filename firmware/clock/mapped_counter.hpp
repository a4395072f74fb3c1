#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "firmware/clock/counter_clock.hpp"
#include "firmware/clock/tracked_phase.hpp"
#include "protocol/units/time.hpp"

namespace probebox::clock {

struct MappedCounterConfig {
  CounterClockConfig counter;          // nominal rate, of both counters
  Nanoseconds sync_period{1'000'000};  // of the line that both see
  Nanoseconds step{48};                // of both counters; only a start, the spread of edges is learned
  Nanoseconds max_sigma{20'000};       // samples with a less certain place get no stamp
};

// What became of the edges of the common line.
struct MapCounters {
  std::uint64_t matched{};    // seen by both
  std::uint64_t unmatched{};  // by the second alone
  std::uint64_t unseen{};     // by the first alone, while the map was there
  std::uint64_t misfits{};    // matched, and further from the map than the steps explain
  std::uint64_t begun{};      // times that a map was made
};

// A counter beside another one (the first), whose samples get their times from it: both count samples on oscillators of
// their own and stamp the edges of one sync line, so each edge says where a place on the second is on the first. The
// arrivals of its own samples only tell which edge is which.
//
// The second is mapped onto the first, and not the other way round, because the first has the probe: its samples keep
// the stamps that they have without a second one, whatever becomes of that.
//
// Two edges are one when their times by arrival differ by less than 0.3 sync periods, and later when their places
// agree with the map so closely. The map is followed like any other clock (TrackedPhase). Sigma is of times of the
// second relative to those of the first: of the map, and of the step by which an arrival moves the line of the first
// between two stamps. Never allocates.
class MappedCounter {
 public:
  explicit MappedCounter(const MappedCounterConfig& config);

  // An edge of the sync line on the first counter, with its time by arrival; on the second, as it numbers it.
  void sawFirst(const CounterClock& first, const CounterReading& sample, std::uint32_t fraction);
  void sawSecond(const CounterClock& first, const CounterReading& sample, std::uint32_t fraction);

  // Takes one sample in order of arrival. Returns its stamp, with the standard deviation relative to samples of the
  // first; nullopt while it has no place on the first, or that no time.
  std::optional<CounterStamp> push(const CounterClock& first, const CounterReading& sample);
  // As CounterClock::timeAfter.
  std::optional<MonoTime> timeAfter(const CounterClock& first, const CounterReading& sample, std::uint32_t fraction);

  // Where a sample of the second, one of its last, is on the first counter; and how sure that is.
  std::optional<CounterPlace> placeOnFirst(const CounterReading& sample, std::uint32_t fraction) const;
  double mapSigmaNs() const { return mapSigmaNs(newest_); }

  void advance(MonoTime now);
  void restart();  // its source has disappeared

  // locked; holdover: no edge that both have seen for a while; ambiguous: edges do not tell which is which, or sigma is
  // too large; unlocked: no map yet.
  ClockState state() const { return state_; }
  double sigmaNs() const { return sigma_ns_; }               // of the stamp that was given last
  double offsetPpm() const { return tracked_.offsetPpm(); }  // of its period, longer than the first's
  const CounterClock& byArrival() const { return clock_; }
  const MapCounters& counters() const { return counters_; }
  std::uint64_t unstamped() const { return unstamped_; }

 private:
  static constexpr std::size_t kEdges = 256;
  struct SeenEdge {
    CounterPlace place;
    std::optional<MonoTime> arrived;  // its time by the arrivals of its own counter
    MonoTime at{};                    // when its packet came
  };
  // Those that wait for their other half, the oldest first.
  class Waiting {
   public:
    bool empty() const { return count_ == 0; }
    bool full() const { return count_ == kEdges; }
    std::size_t size() const { return count_; }
    const SeenEdge& operator[](std::size_t i) const { return edges_[(begin_ + i) % kEdges]; }
    void push(const SeenEdge& edge) { edges_[(begin_ + count_++) % kEdges] = edge; }
    void drop(std::size_t edges) { begin_ = (begin_ + edges) % kEdges, count_ -= edges; }
    void clear() { count_ = 0; }

   private:
    std::array<SeenEdge, kEdges> edges_{};
    std::size_t begin_{}, count_{};
  };

  bool running() const { return phase_ == Phase::running; }
  void follow(const CounterClock& first);
  void match(const CounterClock& first);
  std::optional<double> apartNs(const SeenEdge& second, const SeenEdge& first) const;
  void take(const CounterClock& first, const SeenEdge& of_second, const SeenEdge& of_first);
  void startOn(const ArrivalLine::Line& line);
  void judge();
  void giveUp(ClockState state);
  MonoTime ownTime(const CounterPlace& place, double period_ns) const;
  double mapSigmaNs(std::int64_t index) const;

  MappedCounterConfig config_;
  CounterClock clock_;
  std::int64_t period_ns_;  // a sample of the first, on its own time: that counts whole nanoseconds
  TrackedPhase tracked_;    // from samples of the second to the own time of the first
  ArrivalLine line_;
  Phase phase_{Phase::searching};
  ClockState state_{ClockState::unlocked};
  Waiting first_, second_;
  std::uint32_t beginning_of_first_{}, beginning_{};
  std::int64_t newest_{};  // sample
  double sigma_ns_{};
  MonoTime observed_{}, given_{MonoTime::min()};
  double apart_ns_{};  // by arrival, of matched edges, smoothed
  std::int64_t misfits_{};
  MapCounters counters_;
  std::uint64_t unstamped_{};
};

}  // namespace probebox::clock
