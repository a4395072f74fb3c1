#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "protocol/codec/inlined.hpp"

// Converts values to residuals and back: kernel bodies.
namespace probebox::codec {

// Differences wrap around, which two's complement makes exact.
template <std::size_t Order>
PROBEBOX_INLINE std::uint64_t residual(const std::int64_t* x) {
  const auto at = [x](int back) { return static_cast<std::uint64_t>(*(x - back)); };
  if constexpr (Order == 0) return at(0);
  if constexpr (Order == 1) return at(0) - at(1);
  if constexpr (Order == 2) return at(0) - 2 * at(1) + at(2);
  return at(0) - 3 * (at(1) - at(2)) - at(3);
}

template <std::size_t Order>
PROBEBOX_INLINE void residuals(const std::int64_t* x, std::size_t count, std::int64_t* into) {
  for (std::size_t k = 0; k < count; ++k) into[k] = static_cast<std::int64_t>(residual<Order>(x + k));
}

template <std::size_t Order>
PROBEBOX_INLINE void integrate(std::int64_t* x, std::size_t count) {
  if constexpr (Order > 0) {
    // Holds the differences at the last value, from order 0.
    std::array<std::uint64_t, Order> state{};
    state[0] = residual<0>(x - 1);
    if constexpr (Order > 1) state[1] = residual<1>(x - 1);
    if constexpr (Order > 2) state[2] = residual<2>(x - 1);
    for (std::size_t k = 0; k < count; ++k) {
      auto sum = static_cast<std::uint64_t>(x[k]);
      for (std::size_t d = Order; d-- > 0;) sum = state[d] += sum;
      x[k] = static_cast<std::int64_t>(sum);
    }
  }
}

// Tracks position, velocity and acceleration and corrects each by a fixed gain times the residual (fading memory of
// about eight samples). Noise enters 2.5 times less than with the third difference, which is the case of unit gains.
//   acceleration += r; speed += acceleration + 5 r; place += speed + 12 r
// in units of 1/16, stored as sums so that the next prediction is ready early. The first residual has a larger gain.
struct Track {
  static constexpr unsigned kFraction = 4;
  std::uint64_t place{};  // predicted, with half a unit for rounding
  std::uint64_t step{};   // speed + acceleration
  std::uint64_t acceleration{};

  PROBEBOX_INLINE Track(std::uint64_t at, std::uint64_t by, std::uint64_t faster)
      : place{at}, step{by}, acceleration{faster} {}
  // Starts from the three values before x.
  PROBEBOX_INLINE explicit Track(const std::int64_t* x) {
    acceleration = residual<2>(x - 1) << kFraction;
    step = (residual<1>(x - 1) << kFraction) + 2 * acceleration;
    place = (residual<0>(x - 1) << kFraction) + step - acceleration + (1U << (kFraction - 1));
  }
  PROBEBOX_INLINE std::uint64_t prediction() const {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(place) >> kFraction);
  }
  PROBEBOX_INLINE void correctFirst(std::uint64_t r) {
    place += step + 32 * r;
    step += acceleration + 24 * r;
    acceleration += 8 * r;
  }
  PROBEBOX_INLINE void correct(std::uint64_t r) {
    place = (place + step) + 18 * r;
    step = (step + acceleration) + 7 * r;
    acceleration += r;
  }
};

// Processes columns side by side: a value depends on its predecessor, but not on other columns.
template <std::size_t... C>
PROBEBOX_INLINE void track(const std::int64_t* const* x, std::size_t count, std::int64_t* const* into,
                           std::index_sequence<C...>) {
  if (count == 0) return;
  std::array<Track, sizeof...(C)> states{Track{x[C]}...};
  const auto residual = [&](std::size_t c, std::size_t k) {
    const auto r = static_cast<std::uint64_t>(x[c][k]) - states[c].prediction();
    into[c][k] = static_cast<std::int64_t>(r);
    return r;
  };
  (states[C].correctFirst(residual(C, 0)), ...);
  for (std::size_t k = 1; k < count; ++k) (states[C].correct(residual(C, k)), ...);
}

PROBEBOX_INLINE std::uint64_t untrackOne(Track& state, std::int64_t& x) {
  const auto r = static_cast<std::uint64_t>(x);
  x = static_cast<std::int64_t>(state.prediction() + r);
  return r;
}

PROBEBOX_INLINE void untrack(std::int64_t* x, std::size_t count) {
  if (count == 0) return;
  Track state{x};
  state.correctFirst(untrackOne(state, x[0]));
  for (std::size_t k = 1; k < count; ++k) state.correct(untrackOne(state, x[k]));
}

// Processes four columns in the lanes of a vector.
constexpr std::size_t kLanes = 4;
using Lanes [[gnu::vector_size(8 * kLanes)]] = std::uint64_t;
using SignedLanes [[gnu::vector_size(8 * kLanes)]] = std::int64_t;
using LanesInMemory [[gnu::vector_size(8 * kLanes), gnu::aligned(8), gnu::may_alias]] = std::uint64_t;

PROBEBOX_INLINE LanesInMemory& lanesAt(std::int64_t* at) {
  return *reinterpret_cast<LanesInMemory*>(at);
}

PROBEBOX_INLINE void transpose(std::array<Lanes, kLanes>& rows) {
  const Lanes a = __builtin_shufflevector(rows[0], rows[1], 0, 4, 2, 6);
  const Lanes b = __builtin_shufflevector(rows[0], rows[1], 1, 5, 3, 7);
  const Lanes c = __builtin_shufflevector(rows[2], rows[3], 0, 4, 2, 6);
  const Lanes d = __builtin_shufflevector(rows[2], rows[3], 1, 5, 3, 7);
  rows[0] = __builtin_shufflevector(a, c, 0, 1, 4, 5);
  rows[1] = __builtin_shufflevector(b, d, 0, 1, 4, 5);
  rows[2] = __builtin_shufflevector(a, c, 2, 3, 6, 7);
  rows[3] = __builtin_shufflevector(b, d, 2, 3, 6, 7);
}

struct TrackLanes {
  Lanes place{};
  Lanes step{};
  Lanes acceleration{};

  // Converts residuals to values.
  PROBEBOX_INLINE void untrack(Lanes& row) {
    const Lanes r = row;
    row += reinterpret_cast<Lanes>(reinterpret_cast<SignedLanes>(place) >> Track::kFraction);
    place += step + (r << 4U) + (r << 1U);
    step += acceleration + (r << 3U) - r;
    acceleration += r;
  }
};

template <std::size_t... C>
PROBEBOX_INLINE void untrackSome(std::int64_t* const* columns, std::size_t count, std::index_sequence<C...>) {
  if (count == 0) return;
  const std::array<std::int64_t*, sizeof...(C)> x{columns[C]...};
  std::array<Track, sizeof...(C)> states{Track{x[C]}...};
  (states[C].correctFirst(untrackOne(states[C], x[C][0])), ...);
  TrackLanes lanes;
  ((lanes.place[C] = states[C].place, lanes.step[C] = states[C].step, lanes.acceleration[C] = states[C].acceleration),
   ...);
  std::size_t k = 1;
  for (; k + kLanes <= count; k += kLanes) {
    std::array<Lanes, kLanes> rows{};
    ((rows[C] = lanesAt(x[C] + k)), ...);
    transpose(rows);
    lanes.untrack(rows[0]);
    lanes.untrack(rows[1]);
    lanes.untrack(rows[2]);
    lanes.untrack(rows[3]);
    transpose(rows);
    ((lanesAt(x[C] + k) = rows[C]), ...);
  }
  ((states[C] = {lanes.place[C], lanes.step[C], lanes.acceleration[C]}), ...);
  for (; k < count; ++k) (states[C].correct(untrackOne(states[C], x[C][k])), ...);
}

}  // namespace probebox::codec
