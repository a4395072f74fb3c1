#include <gtest/gtest.h>
#include <string>
#include <type_traits>

#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"
#include "protocol/units/quantity.hpp"
#include "protocol/units/time.hpp"

namespace probebox {
namespace {

template <class A, class B>
concept Addable = requires(A a, B b) {
  a + b;
};
template <class A, class B>
concept Subtractable = requires(A a, B b) {
  a - b;
};

TEST(Quantity, MixesWithItsOwnUnitOnly) {
  EXPECT_EQ((Millimetres{1.5} + Millimetres{0.25}).value(), 1.75);
  EXPECT_EQ(Millimetres{3} / Millimetres{2}, 1.5);
  static_assert(Addable<Millimetres, Millimetres>);
  static_assert(!Addable<Millimetres, Micrometres>);
  static_assert(!Addable<Millimetres, double>);
  static_assert(!std::is_convertible_v<double, Millimetres>);
}

TEST(Quantity, ConvertsByName) {
  EXPECT_EQ(toMicrometres(Millimetres{0.0125}).value(), 12.5);
  EXPECT_EQ(toMillimetres(toMicrometres(Millimetres{0.75})).value(), 0.75);
}

TEST(Time, MonotonicAndMasterTimeDoNotMix) {
  static_assert(!Subtractable<MonoTime, MasterTime>);
  static_assert(Subtractable<MonoTime, MonoTime>);
  EXPECT_EQ(toSeconds(monoTime(2'500'000'000) - monoTime(1'000'000'000)), 1.5);
}

TEST(Time, MasterTimeIsTickTimesPeriodExactlyAfterYears) {
  const Tick tick{10'000LL * 86'400 * 365 * 10};  // ten years at 10 kHz
  EXPECT_EQ(toNs(masterTime(tick, Nanoseconds{100'000})), tick.index * 100'000);
  EXPECT_EQ((tick + 7) - tick, 7);
}

TEST(Outcome, HoldsAValueOrAReason) {
  const Outcome<int> good{7};
  const Outcome<int> bad{Error{"file a.csv, line 3: not a number"}};
  ASSERT_TRUE(good);
  EXPECT_EQ(*good, 7);
  ASSERT_FALSE(bad.ok());
  EXPECT_EQ(bad.error().what, "file a.csv, line 3: not a number");
}

TEST(Event, EveryKindHasAStampAndKeepsItsNumberInTheJournal) {
  EXPECT_EQ(stampOf(Event{Edge{.at = monoTime(42)}}), monoTime(42));
  // The numbers are in journals that people have kept.
  EXPECT_EQ(Event{TimeAdvanced{}}.index(), 0U);
  EXPECT_EQ(Event{Edge{}}.index(), 1U);
  EXPECT_EQ(Event{Count{}}.index(), 2U);
  EXPECT_EQ(Event{Deflection{}}.index(), 3U);
  EXPECT_EQ(Event{Drift{}}.index(), 4U);
  EXPECT_EQ(Event{Marker{}}.index(), 5U);
  EXPECT_EQ(Event{SourceLost{}}.index(), 6U);
  EXPECT_EQ(Event{ProcedureStarted{}}.index(), 7U);
  EXPECT_EQ(Event{ProcedureAborted{}}.index(), 8U);
  EXPECT_EQ(Event{Solved{}}.index(), 9U);
  EXPECT_EQ(Event{DelayActivated{}}.index(), 10U);
}

}  // namespace
}  // namespace probebox
