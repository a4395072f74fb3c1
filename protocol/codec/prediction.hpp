#pragma once
#include <array>
#include <concepts>
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

// Gains of a tracking predictor, in 1/16. Predicted place, sum of speed and acceleration ..., each is corrected by its
// gain times the residual: a fading memory of some eight samples. The first residual has larger gains.
template <std::size_t Sums>
struct TrackGains {
  std::array<std::uint64_t, Sums> first, others;
};
template <std::size_t Sums>
inline constexpr TrackGains<Sums> kTrackGains{};
// Constant acceleration. Noise enters 2.5 times less than with the third difference.
template <>
inline constexpr TrackGains<3> kTrackGains<3>{{32, 24, 8}, {18, 7, 1}};
// Constant jerk, for motion that turns within few samples. Noise enters 2.4 times less than with the third difference.
template <>
inline constexpr TrackGains<4> kTrackGains<4>{{41, 45, 19, 3}, {22, 14, 5, 1}};

// Adds a whole multiple; of vectors by shifts, for they have no product of 64 bits.
template <std::uint64_t Factor, unsigned Shift = 0, class T>
PROBEBOX_INLINE void addTimes(T& sum, const T& value) {
  if constexpr (std::same_as<T, std::uint64_t>) {
    sum += Factor * value;
  } else {
    if constexpr (Factor % 2 == 1) sum += value << Shift;
    if constexpr (Factor > 1) addTimes<(Factor >> 1U), Shift + 1>(sum, value);
  }
}

// Follows one column, or as many as T has lanes. sums[0] is the prediction with half a unit for rounding; each sum goes
// on by the one behind it, so that the next prediction is ready early.
template <class T, std::size_t Sums>
struct Track {
  static constexpr unsigned kFraction = 4;
  std::array<T, Sums> sums{};

  Track() = default;
  // Starts from the three values before x.
  PROBEBOX_INLINE explicit Track(const std::int64_t* x) {
    sums[2] = residual<2>(x - 1) << kFraction;
    sums[1] = (residual<1>(x - 1) << kFraction) + 2 * sums[2];
    sums[0] = (residual<0>(x - 1) << kFraction) + sums[1] - sums[2] + (1U << (kFraction - 1));
  }
  PROBEBOX_INLINE std::uint64_t prediction() const {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(sums[0]) >> kFraction);
  }
  template <bool IsFirst = false>
  PROBEBOX_INLINE void correct(const T& r) {
    correct<IsFirst ? 1U : 0U>(r, std::make_index_sequence<Sums - 1>{});
  }

 private:
  template <unsigned IsFirst, std::size_t... K>
  PROBEBOX_INLINE void correct(const T& r, std::index_sequence<K...>) {
    constexpr auto kGains = IsFirst == 1 ? kTrackGains<Sums>.first : kTrackGains<Sums>.others;
    ((sums[K] += sums[K + 1], addTimes<kGains[K]>(sums[K], r)), ...);
    addTimes<kGains[Sums - 1]>(sums[Sums - 1], r);
  }
};

// Processes columns side by side: a value depends on its predecessor, but not on other columns.
template <std::size_t Sums, std::size_t... C>
PROBEBOX_INLINE void track(const std::int64_t* const* x, std::size_t count, std::int64_t* const* into,
                           std::index_sequence<C...>) {
  if (count == 0) return;
  std::array<Track<std::uint64_t, Sums>, sizeof...(C)> states{Track<std::uint64_t, Sums>{x[C]}...};
  const auto residual = [&](std::size_t c, std::size_t k) {
    const auto r = static_cast<std::uint64_t>(x[c][k]) - states[c].prediction();
    into[c][k] = static_cast<std::int64_t>(r);
    return r;
  };
  (states[C].template correct<true>(residual(C, 0)), ...);
  for (std::size_t k = 1; k < count; ++k) (states[C].correct(residual(C, k)), ...);
}

template <std::size_t Sums>
PROBEBOX_INLINE std::uint64_t untrackOne(const Track<std::uint64_t, Sums>& state, std::int64_t& x) {
  const auto r = static_cast<std::uint64_t>(x);
  x = static_cast<std::int64_t>(state.prediction() + r);
  return r;
}

template <std::size_t Sums>
PROBEBOX_INLINE void untrack(std::int64_t* x, std::size_t count) {
  if (count == 0) return;
  Track<std::uint64_t, Sums> state{x};
  state.template correct<true>(untrackOne(state, x[0]));
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

// Converts residuals to values.
template <std::size_t Sums>
PROBEBOX_INLINE void untrack(Track<Lanes, Sums>& state, Lanes& row) {
  const Lanes r = row;
  row += reinterpret_cast<Lanes>(reinterpret_cast<SignedLanes>(state.sums[0]) >> Track<Lanes, Sums>::kFraction);
  state.correct(r);
}

template <std::size_t Sums, std::size_t... C>
PROBEBOX_INLINE void untrackSome(std::int64_t* const* columns, std::size_t count, std::index_sequence<C...>) {
  if (count == 0) return;
  const std::array<std::int64_t*, sizeof...(C)> x{columns[C]...};
  std::array<Track<std::uint64_t, Sums>, sizeof...(C)> states{Track<std::uint64_t, Sums>{x[C]}...};
  (states[C].template correct<true>(untrackOne(states[C], x[C][0])), ...);
  Track<Lanes, Sums> lanes;
  for (std::size_t k = 0; k < Sums; ++k) ((lanes.sums[k][C] = states[C].sums[k]), ...);
  std::size_t k = 1;
  for (; k + kLanes <= count; k += kLanes) {
    std::array<Lanes, kLanes> rows{};
    ((rows[C] = lanesAt(x[C] + k)), ...);
    transpose(rows);
    untrack(lanes, rows[0]);
    untrack(lanes, rows[1]);
    untrack(lanes, rows[2]);
    untrack(lanes, rows[3]);
    transpose(rows);
    ((lanesAt(x[C] + k) = rows[C]), ...);
  }
  for (std::size_t j = 0; j < Sums; ++j) ((states[C].sums[j] = lanes.sums[j][C]), ...);
  for (; k < count; ++k) (states[C].correct(untrackOne(states[C], x[C][k])), ...);
}

}  // namespace probebox::codec
