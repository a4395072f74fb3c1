#include "firmware/corrections/axis_reference.hpp"

#include <cmath>
#include <gtest/gtest.h>

namespace probebox::corrections {
namespace {

constexpr double kMmPerCount = 1e-4;
constexpr std::int64_t kPowerUp = 123'456'789;  // what the counter shows at machine position 0

// An axis with an incremental encoder whose counts come late by tau, and a mark.
class ReferencedAxis {
 public:
  explicit ReferencedAxis(const ReferenceConfig& config, double tau_s = 0) : reference{config}, tau_s_{tau_s} {}

  // Moves at this speed for a while, latched every millisecond; the mark's edge comes when its place is passed.
  void move(double speed_mm_s, double seconds, double mark_mm = 1e9) {
    for (int i = 0; i < std::lround(seconds * 1000); ++i) {
      const double before_mm = at_mm(t_s_);
      t_s_ += 1e-3;
      x_mm_ += speed_mm_s * 1e-3;
      trace_.push_back(x_mm_);
      if ((before_mm < mark_mm) != (x_mm_ < mark_mm)) {
        const double share = (mark_mm - before_mm) / (x_mm_ - before_mm);
        reference.index(stamp(t_s_ - 1e-3 + share * 1e-3));
      }
      reference.push(stamp(t_s_), kPowerUp + lost_ + std::llround(at_mm(t_s_ - tau_s_) / kMmPerCount));
    }
  }
  void loseCounts(std::int64_t counts) { lost_ += counts; }
  bool home(double position_mm) { return reference.homed(position_mm, stamp(t_s_)); }
  double position_mm() const { return x_mm_; }

  AxisReference reference;

 private:
  static MonoTime stamp(double t_s) { return monoTime(std::llround(t_s * 1e9)); }
  double at_mm(double t_s) const {
    const auto place = t_s * 1e3 - 1;
    if (place < 0 || trace_.empty()) return 0;
    const auto i = static_cast<std::size_t>(place);
    if (i + 1 >= trace_.size()) return trace_.back();
    return trace_[i] + (place - std::floor(place)) * (trace_[i + 1] - trace_[i]);
  }

  double tau_s_;
  double t_s_{};
  double x_mm_{};
  std::int64_t lost_{};
  std::vector<double> trace_;
};

ReferenceConfig marked() {
  return {.by = ReferenceBy::index,
          .mm_per_count = kMmPerCount,
          .has_mark = true,
          .index_mm = 12.5,
          .index_tolerance_mm = 0.02};
}

TEST(AxisReference, IsThereAfterTheMarkAndNotBefore) {
  ReferencedAxis axis{marked()};
  axis.move(1, 2, 3.0);  // the mark is 3 mm from where the machine was switched on
  EXPECT_FALSE(axis.reference.referenced());
  EXPECT_FALSE(axis.reference.position_mm());
  axis.move(1, 2, 3.0);
  ASSERT_TRUE(axis.reference.referenced());
  EXPECT_NEAR(*axis.reference.position_mm(), 12.5 + axis.position_mm() - 3.0, 2e-3);
}

TEST(AxisReference, WaitsForASlowerPassWhileTheDelayIsNotKnown) {
  ReferencedAxis axis{marked(), 0.005};
  axis.move(50, 0.2, 3.0);  // 0.25 mm of lag that nobody knows of
  EXPECT_FALSE(axis.reference.referenced());
  EXPECT_EQ(axis.reference.unusedIndexes(), 1U);
  axis.move(-1, 8, 3.0);
  EXPECT_TRUE(axis.reference.referenced());
}

TEST(AxisReference, CountsEveryMarkThatItCannotUse) {
  ReferencedAxis axis{marked()};
  axis.move(50, 0.061, 3.0);
  axis.move(-50, 0.01, 3.0);  // back over it before the first pass was judged
  axis.move(0, 0.5);
  EXPECT_FALSE(axis.reference.referenced());
  EXPECT_EQ(axis.reference.unusedIndexes(), 2U);
}

// Counts that come late stand still yet when the mark is passed.
TEST(AxisReference, DoesNotJudgeAQuickStepOverTheMarkWhileTheDelayIsNotKnown) {
  ReferencedAxis axis{marked(), 0.005};
  axis.move(1, 2.9, 3.0);
  axis.move(0, 0.5);
  axis.move(40, 0.005, 3.0);
  axis.move(0, 0.5);
  EXPECT_FALSE(axis.reference.referenced()) << "it may have been anywhere on 0.2 mm";
  EXPECT_EQ(axis.reference.unusedIndexes(), 1U);
  axis.move(-1, 2, 3.0);
  ASSERT_TRUE(axis.reference.referenced());
  axis.move(1, 1.8);
  axis.move(0, 0.5);
  for (const double speed_mm_s : {40.0, -40.0}) {
    axis.move(speed_mm_s, 0.005, 3.0);
    axis.move(0, 0.5);
    EXPECT_TRUE(axis.reference.referenced()) << "the mark may have been where it belongs";
  }
  axis.loseCounts(4000);  // 0.4 mm
  axis.move(40, 0.005, 3.0);
  axis.move(0, 0.5);
  EXPECT_FALSE(axis.reference.referenced()) << "farther than the step went";
}

// Positions of 2 to 150 ms ago at the speeds of touches: nothing is wrong, and nobody has measured the delay yet.
TEST(AxisReference, IsKeptOverMarksWhateverDelayIsNotKnown) {
  for (const double tau_s : {0.002, 0.012, 0.04, 0.15}) {
    auto config = marked();
    config.by = ReferenceBy::homing;
    ReferencedAxis axis{config, tau_s};
    axis.move(0, 0.5);
    ASSERT_TRUE(axis.home(9.5));  // the mark is passed at 3 mm
    for (const double speed_mm_s : {25.0, -25.0, 80.0, -80.0}) {
      axis.move(speed_mm_s, 5 / std::abs(speed_mm_s), 3.0);
      axis.move(0, 0.5);
      EXPECT_TRUE(axis.reference.referenced()) << tau_s << " s at " << speed_mm_s << " mm/s";
    }
    axis.reference.setDelay(tau_s, 2e-6);
    axis.move(25, 0.2, 3.0);
    EXPECT_TRUE(axis.reference.referenced()) << "the mark is where the delay says";
    axis.loseCounts(500);
    axis.move(-25, 0.2, 3.0);
    axis.move(0, 0.5);
    EXPECT_FALSE(axis.reference.referenced()) << "and counts that were lost are found";
  }
}

TEST(AxisReference, LooksTheMarkUpInCountsThatCameTheDelayLater) {
  ReferencedAxis axis{marked(), 0.005};
  axis.reference.setDelay(0.005, 2e-6);
  axis.move(50, 0.2, 3.0);
  ASSERT_TRUE(axis.reference.referenced());
  axis.move(0, 0.1);
  EXPECT_NEAR(*axis.reference.position_mm(), 12.5 + axis.position_mm() - 3.0, 2e-3);
}

// The probe is later than the counts. How late those are it does not tell, but not more than that.
TEST(AxisReference, IsThereAfterTheMarkWhereTheProbeIsLaterThanTheCounts) {
  ReferencedAxis axis{marked()};
  axis.reference.setDelay(-0.0005, 2e-6);
  axis.move(50, 0.2, 3.0);
  EXPECT_FALSE(axis.reference.referenced()) << "0.025 mm are not known";
  axis.move(-5, 2, 3.0);
  ASSERT_TRUE(axis.reference.referenced());
  EXPECT_NEAR(*axis.reference.position_mm(), 12.5 + axis.position_mm() - 3.0, 6e-3);
}

TEST(AxisReference, OfACountLatchedAtTheMarkNeedsNoDelay) {
  for (const bool is_delay_known : {false, true}) {
    AxisReference reference{marked()};
    if (is_delay_known) reference.setDelay(0.004, 2e-6);
    reference.push(monoTime(1'000'000), kPowerUp);
    reference.index(monoTime(1'000'001), kPowerUp + 1250);  // 250 mm/s, and nobody measured when
    reference.push(monoTime(2'000'000), kPowerUp + 2500);
    ASSERT_TRUE(reference.referenced());
    EXPECT_NEAR(*reference.position_mm(), 12.5 + 0.125, 1e-9);
    reference.index(monoTime(2'000'001), kPowerUp + 1250 + 300);  // 0.03 mm off
    reference.push(monoTime(3'000'000), kPowerUp);
    EXPECT_FALSE(reference.referenced());
    EXPECT_EQ(reference.lastFault(), ReferenceFault::wrong_index);
  }
}

TEST(AxisReference, KnowsThatAMarkHasTwoSides) {
  auto config = marked();
  config.index_width_mm = 0.4;
  ReferencedAxis up{config}, down{config};
  up.move(1, 4, 3.0);
  down.move(1, 4);
  down.move(-1, 2, 3.4);  // its other side comes first on the way down
  ASSERT_TRUE(up.reference.referenced());
  ASSERT_TRUE(down.reference.referenced());
  EXPECT_NEAR(*up.reference.position_mm() - up.position_mm(), *down.reference.position_mm() - down.position_mm(), 4e-3);
}

TEST(AxisReference, IsLostWhenTheMarkComesAtTheWrongCount) {
  ReferencedAxis axis{marked()};
  axis.move(1, 4, 3.0);
  axis.move(-1, 2, 3.0);
  EXPECT_TRUE(axis.reference.referenced()) << "a mark at the right count changes nothing";
  axis.loseCounts(5000);  // 0.5 mm, farther than it goes in the longest delay
  axis.move(1, 2, 3.0);
  EXPECT_FALSE(axis.reference.referenced());
  EXPECT_EQ(axis.reference.lastFault(), ReferenceFault::wrong_index);
  EXPECT_EQ(axis.reference.losses(), 1U);
  axis.move(-1, 2, 3.0);
  ASSERT_TRUE(axis.reference.referenced()) << "the next pass makes a new reference";
  EXPECT_NEAR(*axis.reference.position_mm(), 12.5 + axis.position_mm() - 3.0, 2e-3);
}

TEST(AxisReference, IsLostWhenTheCountsMoveFasterThanTheAxisCan) {
  auto config = marked();
  config.by = ReferenceBy::homing;
  config.maximum_speed_mm_s = 200;
  ReferencedAxis axis{config};
  axis.move(0, 0.2);
  ASSERT_TRUE(axis.home(-40));
  axis.move(150, 0.5);
  EXPECT_TRUE(axis.reference.referenced());
  EXPECT_NEAR(*axis.reference.position_mm(), 35, 2e-3);
  axis.loseCounts(10'000);
  axis.move(0, 0.01);
  EXPECT_FALSE(axis.reference.referenced());
  EXPECT_EQ(axis.reference.lastFault(), ReferenceFault::impossible_speed);
}

TEST(AxisReference, IsTakenFromTheControllerOnlyAtRest) {
  auto config = marked();
  config.by = ReferenceBy::homing;
  ReferencedAxis axis{config};
  EXPECT_FALSE(axis.home(7)) << "no count has come";
  axis.move(5, 0.5);
  EXPECT_FALSE(axis.home(7)) << "it moves";
  axis.move(0, 0.2);
  EXPECT_TRUE(axis.home(7));
  EXPECT_NEAR(*axis.reference.position_mm(), 7, 1e-9);
}

TEST(AxisReference, IsTakenFromTheControllerOnlyWithinTheTravel) {
  auto config = marked();
  config.by = ReferenceBy::homing;
  config.travel = {-50, 450};
  ReferencedAxis axis{config};
  axis.move(0, 0.2);
  for (const double nowhere_mm : {1e6, 450.01, -50.01, -1e308, HUGE_VAL, std::nan("")}) {
    EXPECT_FALSE(axis.home(nowhere_mm)) << nowhere_mm;
    EXPECT_FALSE(axis.reference.referenced());
  }
  EXPECT_TRUE(axis.home(static_cast<float>(-50.0F)));
  EXPECT_TRUE(axis.home(450));
}

TEST(AxisReference, OfRepeatingMarksNeedsHomingAndIsCheckedByEach) {
  auto config = marked();
  config.by = ReferenceBy::homing;
  config.index_pitch_mm = 10;
  ReferencedAxis axis{config};
  axis.move(1, 2, 1.0);
  EXPECT_FALSE(axis.reference.referenced());
  axis.move(0, 0.2);
  ASSERT_TRUE(axis.home(20));  // it stands 2 mm from where it was switched on
  axis.move(1, 10, 4.5);       // the mark at 22.5
  EXPECT_TRUE(axis.reference.referenced());
  axis.loseCounts(-4000);
  axis.move(1, 10, 14.5);  // the one at 32.5
  EXPECT_FALSE(axis.reference.referenced());
}

// A mark is wired, and nobody has said where it is.
TEST(AxisReference, IsNotComparedWithAMarkOfUnknownPlace) {
  ReferencedAxis axis{{.by = ReferenceBy::homing, .mm_per_count = kMmPerCount}};
  axis.move(0, 0.2);
  ASSERT_TRUE(axis.home(20));
  axis.move(1, 4, 3.0);
  EXPECT_TRUE(axis.reference.referenced());
  EXPECT_NEAR(*axis.reference.position_mm(), 20 + axis.position_mm(), 2e-3);
  EXPECT_EQ(axis.reference.unusedIndexes(), 1U);
}

TEST(AxisReference, GoesWithTheEncoder) {
  ReferencedAxis axis{marked()};
  axis.move(1, 4, 3.0);
  axis.reference.encoderLost();
  EXPECT_FALSE(axis.reference.referenced());
  EXPECT_EQ(axis.reference.lastFault(), ReferenceFault::encoder_lost);
  EXPECT_EQ(axis.reference.breaks(), 1U);
  axis.reference.encoderLost();
  EXPECT_EQ(axis.reference.breaks(), 2U) << "without a reference too";
  EXPECT_EQ(axis.reference.losses(), 1U);
}

TEST(AxisReference, OfAnAbsoluteEncoderIsThereWithItsFirstCount) {
  AxisReference reference{{.by = ReferenceBy::absolute, .mm_per_count = kMmPerCount}};
  EXPECT_FALSE(reference.referenced()) << "nothing has been heard of it";
  EXPECT_EQ(reference.zero_mm(), 0.0);
  reference.push(monoTime(1), 25'000);
  EXPECT_TRUE(reference.referenced());
  EXPECT_DOUBLE_EQ(*reference.position_mm(), 2.5);
}

TEST(AxisReference, OfAnAbsoluteEncoderIsThereAgainWithItsFirstCount) {
  AxisReference reference{{.by = ReferenceBy::absolute, .mm_per_count = kMmPerCount}};
  reference.push(monoTime(1), 25'000);
  reference.encoderLost();
  EXPECT_FALSE(reference.referenced());
  EXPECT_EQ(reference.zero_mm(), 0.0);
  reference.push(monoTime(2), 95'000);  // it went on while it was unplugged
  EXPECT_TRUE(reference.referenced());
  EXPECT_DOUBLE_EQ(*reference.position_mm(), 9.5);
  EXPECT_EQ(reference.breaks(), 0U) << "it counts from where it did";
  EXPECT_EQ(reference.lastFault(), ReferenceFault::encoder_lost);
}

TEST(AxisReference, OfAnAbsoluteEncoderOutlivesACountThatCannotBe) {
  ReferencedAxis axis{{.by = ReferenceBy::absolute, .mm_per_count = kMmPerCount}};
  axis.move(5, 0.5);
  axis.loseCounts(10'000'000);  // a metre
  axis.move(5, 0.001);
  EXPECT_FALSE(axis.reference.referenced());
  EXPECT_EQ(axis.reference.lastFault(), ReferenceFault::impossible_speed);
  axis.loseCounts(-10'000'000);
  axis.move(5, 0.001);
  ASSERT_TRUE(axis.reference.referenced());
  EXPECT_NEAR(*axis.reference.position_mm(), kPowerUp * kMmPerCount + axis.position_mm(), 2e-3);
  EXPECT_EQ(axis.reference.breaks(), 0U) << "it counts from where it did";
  EXPECT_EQ(axis.reference.losses(), 1U);
}

TEST(AxisReference, OfAnAbsoluteEncoderThatAMarkContradictsComesBackWithARightOne) {
  auto config = marked();
  config.by = ReferenceBy::absolute;
  config.index_mm = kPowerUp * kMmPerCount + 3.5;
  ReferencedAxis axis{config};
  axis.move(1, 4, 3.5);
  ASSERT_TRUE(axis.reference.referenced());
  axis.move(-1, 2, 3.0);
  EXPECT_FALSE(axis.reference.referenced());
  EXPECT_EQ(axis.reference.lastFault(), ReferenceFault::wrong_index);
  axis.move(0, 1);
  EXPECT_FALSE(axis.reference.referenced());
  EXPECT_FALSE(axis.home(5));
  axis.move(1, 4, 3.5);
  ASSERT_TRUE(axis.reference.referenced());
  EXPECT_NEAR(*axis.reference.position_mm(), kPowerUp * kMmPerCount + axis.position_mm(), 2e-3);
}

TEST(AxisReference, OfAnAbsoluteEncoderIsNeverTakenFromTheController) {
  ReferencedAxis axis{{.by = ReferenceBy::absolute, .mm_per_count = kMmPerCount}};
  axis.move(0, 0.5);
  EXPECT_FALSE(axis.home(5));
  axis.loseCounts(10'000'000);
  axis.move(0, 0.001);
  axis.move(0, 0.5);
  EXPECT_FALSE(axis.home(5)) << "nor after a count that cannot be";
}

}  // namespace
}  // namespace probebox::corrections
