#include "protocol/codec/kernels.hpp"

#include <algorithm>
#include <bit>
#include <utility>

#include "protocol/frame/bytes.hpp"

#if defined(__GNUC__)
#define PROBEBOX_INLINE [[gnu::always_inline]] inline
#else
#define PROBEBOX_INLINE inline
#endif

// The bodies are inlined into plain functions and into functions for AVX2, and compiled for each.
namespace probebox::codec {
namespace {

// Differences wrap: two's complement makes that exact.
template <std::size_t Order>
PROBEBOX_INLINE std::uint64_t residual(const std::int64_t* x) {
  const auto at = [x](int back) { return static_cast<std::uint64_t>(*(x - back)); };
  if constexpr (Order == 0) return at(0);
  if constexpr (Order == 1) return at(0) - at(1);
  if constexpr (Order == 2) return at(0) - 2 * at(1) + at(2);
  return at(0) - 3 * (at(1) - at(2)) - at(3);
}

PROBEBOX_INLINE std::uint64_t magnitude(std::uint64_t residual) {
  return residual ^ static_cast<std::uint64_t>(static_cast<std::int64_t>(residual) >> 63);
}

// Where a sum of magnitudes could overflow it says nothing.
PROBEBOX_INLINE std::uint64_t soundSum(std::uint64_t sum, std::uint64_t all) {
  return all >> 47U == 0 ? sum : ~std::uint64_t{0};
}

PROBEBOX_INLINE std::array<std::uint64_t, kMostOrder + 1> survey(const std::int64_t* x, std::size_t count) {
  std::array<std::uint64_t, kMostOrder + 1> sums{};
  std::array<std::uint64_t, kMostOrder + 1> all{};
  for (std::size_t k = kMostOrder; k < count; ++k) {
    const std::array<std::uint64_t, kMostOrder + 1> of_k{magnitude(residual<0>(x + k)), magnitude(residual<1>(x + k)),
                                                         magnitude(residual<2>(x + k)), magnitude(residual<3>(x + k))};
    for (std::size_t order = 0; order < of_k.size(); ++order) {
      sums[order] += of_k[order];
      all[order] |= of_k[order];
    }
  }
  for (std::size_t order = 0; order < sums.size(); ++order) sums[order] = soundSum(sums[order], all[order]);
  return sums;
}

template <std::size_t Order>
PROBEBOX_INLINE void residuals(const std::int64_t* x, std::size_t count, std::uint64_t* into) {
  for (std::size_t k = 0; k < count; ++k) into[k] = residual<Order>(x + k);
}

PROBEBOX_INLINE Size size(const std::uint64_t* residuals, std::size_t count) {
  std::uint64_t sum = 0;
  std::uint64_t all = 0;
  std::uint64_t any = 0;
  for (std::size_t k = 0; k < count; ++k) {
    sum += magnitude(residuals[k]);
    all |= magnitude(residuals[k]);
    any |= residuals[k];
  }
  return {soundSum(sum, all), any == 0 ? 0U : static_cast<unsigned>(std::bit_width(all)) + 1};
}

PROBEBOX_INLINE WiderCounts wider(const std::uint64_t* residuals, std::size_t count, unsigned width) {
  // More than w bits: a magnitude of 2^(w - 1) or more. Of no bits: anything but 0, which doubling tells.
  std::array<std::int64_t, 4> limits{};
  for (unsigned k = 0; k < limits.size(); ++k) {
    const unsigned bits = std::min(width + k, 63U);
    limits[k] = static_cast<std::int64_t>(((std::uint64_t{1} << bits) - 1) >> 1U);
  }
  std::array<std::uint64_t, 4> counts{};
  for (std::size_t k = 0; k < count; ++k) {
    const auto size = static_cast<std::int64_t>(magnitude(residuals[k]));
    for (std::size_t j = 0; j < limits.size(); ++j) counts[j] += size > limits[j] ? 1U : 0U;
  }
  std::uint64_t zeros = 0;
  if (width == 0) {
    for (std::size_t k = 0; k < count; ++k) zeros += residuals[k] == 0 ? 1U : 0U;
    counts[0] = count - zeros;
  }
  return {static_cast<std::uint32_t>(counts[0]), static_cast<std::uint32_t>(counts[1]),
          static_cast<std::uint32_t>(counts[2]), static_cast<std::uint32_t>(counts[3])};
}

PROBEBOX_INLINE std::size_t places(const std::uint64_t* residuals, std::size_t count, unsigned width,
                                   std::uint16_t* into) {
  const auto is_wider = [width](std::uint64_t residual) {
    return static_cast<unsigned>(std::bit_width((residual << 1U) ^ (0 - (residual >> 63U)))) > width;
  };
  std::size_t found = 0;
  for (std::size_t group = 0; group < count; group += kGroup) {
    const std::size_t end = std::min(group + kGroup, count);
    if (end == group + kGroup) {  // most groups have none
      std::uint64_t all = 0;
      std::uint64_t any = 0;
      for (std::size_t k = 0; k < kGroup; ++k) {
        all |= magnitude(residuals[group + k]);
        any |= residuals[group + k];
      }
      if (any == 0 || static_cast<unsigned>(std::bit_width(all)) + 1 <= width) continue;
    }
    for (std::size_t k = group; k < end; ++k) {
      if (is_wider(residuals[k])) into[found++] = static_cast<std::uint16_t>(k);
    }
  }
  return found;
}

PROBEBOX_INLINE std::uint64_t beyond(const std::int64_t* x, std::size_t count, std::uint64_t bias, unsigned bits) {
  std::uint64_t all = 0;
  for (std::size_t k = 0; k < count; ++k) all |= (static_cast<std::uint64_t>(x[k]) + bias) >> bits;
  return all;
}

// Follows place, speed and acceleration, each corrected by a share of every residual (a fading memory of about eight
// samples): beside the third difference, which is the same with shares of one, noise enters 2.5 times less.
struct Track {
  static constexpr unsigned kFraction = 4;  // state in 1/16
  std::uint64_t place{};                    // predicted, with half a unit for rounding
  std::uint64_t speed{};
  std::uint64_t acceleration{};

  // The three values before x.
  PROBEBOX_INLINE explicit Track(const std::int64_t* x) {
    acceleration = residual<2>(x - 1) << kFraction;
    speed = (residual<1>(x - 1) << kFraction) + acceleration;
    place = (residual<0>(x - 1) << kFraction) + speed + (1U << (kFraction - 1));
  }
  PROBEBOX_INLINE std::uint64_t prediction() const {
    return static_cast<std::uint64_t>(static_cast<std::int64_t>(place) >> kFraction);
  }
  PROBEBOX_INLINE void correct(std::uint64_t r, std::uint64_t of_place, std::uint64_t of_speed,
                               std::uint64_t of_acceleration) {
    // acceleration += of_acceleration r; speed += acceleration + of_speed r; place += speed + of_place r, in an order
    // that has the next prediction soonest.
    place = (place + speed + acceleration) + (of_place + of_speed + of_acceleration) * r;
    speed += acceleration + (of_speed + of_acceleration) * r;
    acceleration += of_acceleration * r;
  }
  PROBEBOX_INLINE void correctFirst(std::uint64_t r) { correct(r, 16, 8, 8); }
  PROBEBOX_INLINE void correct(std::uint64_t r) { correct(r, 12, 5, 1); }
};

PROBEBOX_INLINE void track(const std::int64_t* x, std::size_t count, std::uint64_t* into) {
  Track state{x};
  for (std::size_t k = 0; k < count; ++k) {
    into[k] = static_cast<std::uint64_t>(x[k]) - state.prediction();
    if (k == 0) {
      state.correctFirst(into[k]);
    } else {
      state.correct(into[k]);
    }
  }
}

PROBEBOX_INLINE void untrack(std::int64_t* x, std::size_t count) {
  Track state{x};
  for (std::size_t k = 0; k < count; ++k) {
    const auto r = static_cast<std::uint64_t>(x[k]);
    x[k] = static_cast<std::int64_t>(state.prediction() + r);
    if (k == 0) {
      state.correctFirst(r);
    } else {
      state.correct(r);
    }
  }
}

template <std::size_t Width>
constexpr std::uint64_t kMask = Width == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << (Width % 64)) - 1;

template <std::size_t Width>
PROBEBOX_INLINE void pack(const std::uint64_t* values, std::size_t groups, std::byte* into) {
  if constexpr (Width > 0) {
    for (std::size_t group = 0; group < groups; ++group) {
      std::array<std::uint64_t, (Width + 7) / 8> words{};
      [&]<std::size_t... K>(std::index_sequence<K...>) {
        (
            [&] {
              constexpr std::size_t kBit = K * Width;
              const std::uint64_t value = values[K] & kMask<Width>;
              words[kBit / 64] |= value << (kBit % 64);
              if constexpr (kBit % 64 + Width > 64) words[kBit / 64 + 1] |= value >> (64 - kBit % 64);
            }(),
            ...);
      }
      (std::make_index_sequence<kGroup>{});
      for (std::size_t word = 0; word < words.size(); ++word) frame::storeLittle(words[word], into + 8 * word);
      values += kGroup;
      into += Width;
    }
  }
}

template <std::size_t Width>
PROBEBOX_INLINE void unpack(const std::byte* from, std::size_t groups, std::int64_t* values) {
  for (std::size_t group = 0; group < groups; ++group) {
    [&]<std::size_t... K>(std::index_sequence<K...>) {
      (
          [&] {
            if constexpr (Width == 0) {
              values[K] = 0;
            } else {
              constexpr std::size_t kByte = K * Width / 8;
              constexpr std::size_t kShift = K * Width % 8;
              std::uint64_t bits = frame::loadLittle<std::uint64_t>(from + kByte) >> kShift;
              if constexpr (kShift + Width > 64)
                bits |= std::to_integer<std::uint64_t>(from[kByte + 8]) << (64 - kShift);
              values[K] = static_cast<std::int64_t>(bits << (64 - Width)) >> (64 - Width);
            }
          }(),
          ...);
    }
    (std::make_index_sequence<kGroup>{});
    from += Width;
    values += kGroup;
  }
}

template <std::size_t Order>
PROBEBOX_INLINE void integrate(std::int64_t* x, std::size_t count) {
  if constexpr (Order > 0) {
    // The differences up to the last value, from order 0 on.
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

// The kernels once more, as functions for the processors that `attribute` names.
#define PROBEBOX_KERNELS(name, attribute)                                                                         \
  namespace name {                                                                                                \
  attribute std::array<std::uint64_t, kMostOrder + 1> surveyOf(const std::int64_t* x, std::size_t count) {        \
    return survey(x, count);                                                                                      \
  }                                                                                                               \
  template <std::size_t Order>                                                                                    \
  attribute void residualsOf(const std::int64_t* x, std::size_t count, std::uint64_t* into) {                     \
    residuals<Order>(x, count, into);                                                                             \
  }                                                                                                               \
  attribute void trackOf(const std::int64_t* x, std::size_t count, std::uint64_t* into) {                         \
    track(x, count, into);                                                                                        \
  }                                                                                                               \
  attribute Size sizeOf(const std::uint64_t* residuals, std::size_t count) {                                      \
    return size(residuals, count);                                                                                \
  }                                                                                                               \
  attribute WiderCounts widerOf(const std::uint64_t* residuals, std::size_t count, unsigned width) {              \
    return wider(residuals, count, width);                                                                        \
  }                                                                                                               \
  attribute std::size_t placesOf(const std::uint64_t* residuals, std::size_t count, unsigned width,               \
                                 std::uint16_t* into) {                                                           \
    return places(residuals, count, width, into);                                                                 \
  }                                                                                                               \
  attribute std::uint64_t beyondOf(const std::int64_t* x, std::size_t count, std::uint64_t bias, unsigned bits) { \
    return beyond(x, count, bias, bits);                                                                          \
  }                                                                                                               \
  template <std::size_t Width>                                                                                    \
  attribute void packOf(const std::uint64_t* values, std::size_t groups, std::byte* into) {                       \
    pack<Width>(values, groups, into);                                                                            \
  }                                                                                                               \
  template <std::size_t Width>                                                                                    \
  attribute void unpackOf(const std::byte* from, std::size_t groups, std::int64_t* values) {                      \
    unpack<Width>(from, groups, values);                                                                          \
  }                                                                                                               \
  template <std::size_t Order>                                                                                    \
  attribute void integrateOf(std::int64_t* x, std::size_t count) {                                                \
    integrate<Order>(x, count);                                                                                   \
  }                                                                                                               \
  attribute void untrackOf(std::int64_t* x, std::size_t count) {                                                  \
    untrack(x, count);                                                                                            \
  }                                                                                                               \
  template <std::size_t... W, std::size_t... O>                                                                   \
  constexpr Kernels table(std::index_sequence<W...>, std::index_sequence<O...>) {                                 \
    return {surveyOf,         {residualsOf<O>..., trackOf},  sizeOf, widerOf, placesOf, beyondOf, {packOf<W>...}, \
            {unpackOf<W>...}, {integrateOf<O>..., untrackOf}};                                                    \
  }                                                                                                               \
  constexpr Kernels kTable = table(std::make_index_sequence<65>{}, std::make_index_sequence<kMostOrder + 1>{});   \
  }

PROBEBOX_KERNELS(plain, )
#if defined(__x86_64__) && defined(__GNUC__)
PROBEBOX_KERNELS(avx2, __attribute__((target("avx2,bmi,bmi2,lzcnt"))))
#endif

}  // namespace

const Kernels& plainKernels() {
  return plain::kTable;
}

const Kernels* vectorKernels() {
#if defined(__x86_64__) && defined(__GNUC__)
  static const bool has_them = __builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("bmi2") != 0;
  return has_them ? &avx2::kTable : nullptr;
#else
  return nullptr;
#endif
}

const Kernels& kernels() {
  static const Kernels& fastest = vectorKernels() != nullptr ? *vectorKernels() : plainKernels();
  return fastest;
}

}  // namespace probebox::codec
