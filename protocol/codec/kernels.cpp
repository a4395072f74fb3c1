#include "protocol/codec/kernels.hpp"

#include <utility>
#include <vector>
#if defined(__x86_64__) && defined(__GNUC__)
#include <cpuid.h>
#endif

#include "protocol/codec/judging.hpp"
#include "protocol/codec/packing.hpp"
#include "protocol/codec/prediction.hpp"

namespace probebox::codec {
namespace {

// The kernels once more, as functions for the processors that `attribute` names.
#define PROBEBOX_KERNELS(name, attribute, with_lanes)                                                             \
  namespace name {                                                                                                \
  attribute std::array<std::uint64_t, kMostOrder + 1> surveyOf(const std::int64_t* x, std::size_t count) {        \
    return survey(x, count);                                                                                      \
  }                                                                                                               \
  template <std::size_t Order>                                                                                    \
  attribute void residualsOf(const std::int64_t* x, std::size_t count, std::int64_t* into) {                      \
    residuals<Order>(x, count, into);                                                                             \
  }                                                                                                               \
  template <std::size_t Sums, std::size_t Columns>                                                                \
  attribute void trackOf(const std::int64_t* const* x, std::size_t count, std::int64_t* const* into) {            \
    track<Sums>(x, count, into, std::make_index_sequence<Columns>{});                                             \
  }                                                                                                               \
  attribute Size sizeOf(const std::int64_t* residuals, std::size_t count, std::int16_t* narrow) {                 \
    return size(residuals, count, narrow);                                                                        \
  }                                                                                                               \
  template <std::signed_integral T>                                                                               \
  attribute WiderCounts widerOf(const T* residuals, std::size_t count, unsigned width) {                          \
    return wider(residuals, count, width);                                                                        \
  }                                                                                                               \
  template <std::signed_integral T>                                                                               \
  attribute std::size_t placesOf(const T* residuals, std::size_t count, unsigned width, std::uint16_t* into) {    \
    return places(residuals, count, width, into);                                                                 \
  }                                                                                                               \
  attribute std::uint64_t beyondOf(const std::int64_t* x, std::size_t count, std::uint64_t bias, unsigned bits) { \
    return beyond(x, count, bias, bits);                                                                          \
  }                                                                                                               \
  template <std::size_t Width>                                                                                    \
  attribute void packOf(const std::int64_t* values, std::size_t groups, std::byte* into) {                        \
    pack<Width>(values, groups, into);                                                                            \
  }                                                                                                               \
  template <std::size_t Width>                                                                                    \
  attribute void packNarrowOf(const std::int16_t* values, std::size_t groups, std::byte* into) {                  \
    packNarrow<Width>(values, groups, into);                                                                      \
  }                                                                                                               \
  template <std::size_t Width>                                                                                    \
  attribute void unpackOf(const std::byte* from, std::size_t groups, std::int64_t* values) {                      \
    unpack<Width>(from, groups, values);                                                                          \
  }                                                                                                               \
  template <std::size_t Order>                                                                                    \
  attribute void integrateOf(std::int64_t* x, std::size_t count) {                                                \
    integrate<Order>(x, count);                                                                                   \
  }                                                                                                               \
  template <std::size_t Sums, std::size_t Columns>                                                                \
  attribute void untrackOf(std::int64_t* const* x, std::size_t count) {                                           \
    if constexpr (with_lanes && Columns > 1)                                                                      \
      return untrackSome<Sums>(x, count, std::make_index_sequence<Columns>{});                                    \
    for (std::size_t c = 0; c < Columns; ++c) untrack<Sums>(x[c], count);                                         \
  }                                                                                                               \
  template <std::size_t... W, std::size_t... N, std::size_t... O>                                                 \
  constexpr Kernels table(std::index_sequence<W...>, std::index_sequence<N...>, std::index_sequence<O...>) {      \
    return {surveyOf,                                                                                             \
            {residualsOf<O>...},                                                                                  \
            {{trackOf<3, 1>, trackOf<3, 2>, trackOf<3, 3>}, {trackOf<4, 1>, trackOf<4, 2>, trackOf<4, 3>}},       \
            sizeOf,                                                                                               \
            widerOf<std::int64_t>,                                                                                \
            widerOf<std::int16_t>,                                                                                \
            placesOf<std::int64_t>,                                                                               \
            placesOf<std::int16_t>,                                                                               \
            beyondOf,                                                                                             \
            {packOf<W>...},                                                                                       \
            {packNarrowOf<N>...},                                                                                 \
            {unpackOf<W>...},                                                                                     \
            {integrateOf<O>...},                                                                                  \
            {{untrackOf<3, 1>, untrackOf<3, 2>, untrackOf<3, 3>, untrackOf<3, 4>},                                \
             {untrackOf<4, 1>, untrackOf<4, 2>, untrackOf<4, 3>, untrackOf<4, 4>}}};                              \
  }                                                                                                               \
  constexpr Kernels kTable = table(std::make_index_sequence<65>{}, std::make_index_sequence<kNarrowPacked + 1>{}, \
                                   std::make_index_sequence<kMostOrder + 1>{});                                   \
  }

PROBEBOX_KERNELS(plain, , false)
#if defined(__x86_64__) && defined(__GNUC__)
PROBEBOX_KERNELS(sse4, __attribute__((target("sse4.2"))), false)
PROBEBOX_KERNELS(avx2, __attribute__((target("avx2,bmi,bmi2,lzcnt"))), true)
PROBEBOX_KERNELS(avx512, __attribute__((target("avx2,bmi,bmi2,lzcnt,avx512f,avx512vl,avx512bw,avx512dq"))), true)
#define PROBEBOX_HAS(feature) (__builtin_cpu_supports(feature) != 0)

// clang asks the processor for no lzcnt by name.
bool hasLzcnt() {
  unsigned a = 0, b = 0, c = 0, d = 0;
  return __get_cpuid(0x80000001, &a, &b, &c, &d) != 0 && (c & bit_LZCNT) != 0;
}
#endif

std::vector<NamedKernels> find() {
  std::vector<NamedKernels> all{{"plain", &plain::kTable}};
#if defined(PROBEBOX_HAS)
  if (!PROBEBOX_HAS("sse4.2")) return all;
  all.push_back({"SSE4.2", &sse4::kTable});
  // Where lzcnt is masked its bytes are bsr, which counts the other way.
  if (!PROBEBOX_HAS("avx2") || !PROBEBOX_HAS("bmi") || !PROBEBOX_HAS("bmi2") || !hasLzcnt()) return all;
  all.push_back({"AVX2", &avx2::kTable});
  if (!PROBEBOX_HAS("avx512f") || !PROBEBOX_HAS("avx512vl") || !PROBEBOX_HAS("avx512bw") || !PROBEBOX_HAS("avx512dq"))
    return all;
  all.push_back({"AVX-512", &avx512::kTable});
#endif
  return all;
}

}  // namespace

std::span<const NamedKernels> allKernels() {
  static const std::vector<NamedKernels> all = find();
  return all;
}

const Kernels& kernels() {
  static const Kernels& fastest = *allKernels().back().kernels;
  return fastest;
}

}  // namespace probebox::codec
