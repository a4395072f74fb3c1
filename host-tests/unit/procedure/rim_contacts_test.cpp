#include "firmware/procedure/dataset/rim_contacts.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <numbers>
#include <random>
#include <string>

#include "firmware/procedure/methods/methods.hpp"

// Angles of C at which a ball on the rim meets the stylus, from what was recorded while C turned.
namespace probebox::procedure {
namespace {

constexpr double kLine_rad = std::numbers::pi / 2, kRim_mm = 30, kBeside_mm = 10;
constexpr double kSpeed_rad_s = 0.07, kBeyond_rad = 0.015;

// One turn of C, and the probe that it pushes along X.
struct Turned {
  double side{1};
  double contact_rad{};  // clockwise from the line
  double at_mm{};        // of the stylus along X; by default where it was asked to stand
  double height_mm{};
  double noise_mm{};
  double interval_s{0.01};
  bool by_edges{};
  int free_rows{1000};  // at most, before the contact
};

class Contacts : public testing::Test {
 protected:
  Contacts() {
    facts.rim_ball = RimBall{.c_on_line_rad = kLine_rad,
                             .level_limit_mm = {},
                             .beside_mm = kBeside_mm,
                             .radius_mm = kRim_mm,
                             .c_has_encoder = true};
    facts.sigma_c_rad = 1e-6;
  }

  void record(const Turned& how) {
    const double reach_rad = std::asin(kBeside_mm / kRim_mm), from_rad = kLine_rad + how.side * reach_rad;
    const double way_rad = std::abs(from_rad - (kLine_rad - how.contact_rad)) + kBeyond_rad;
    const double turning_s = way_rad / kSpeed_rad_s, all_s = 2 * turning_s + 1;
    capture::Touch touch;
    touch.request.until_contact = capture::TurnOfC{kLine_rad, kLine_rad - how.side * reach_rad, kSpeed_rad_s};
    touch.request.by_edges = how.by_edges;
    touch.machine_begin = recording.machineRowCount();
    touch.probe_begin = recording.probeRowCount();
    touch.angle_begin = recording.angleRowCount();
    const double at_mm = how.at_mm != 0 ? how.at_mm : how.side * kBeside_mm;
    const auto count = [](double mm) { return std::llround(1e6 * mm); };
    const double contact_s = 0.5 + turning_s - kBeyond_rad / kSpeed_rad_s;
    for (double t_s = std::max(0.0, contact_s - how.free_rows * how.interval_s); t_s < all_s; t_s += how.interval_s) {
      const auto at = monoTime(std::llround(1e9 * t_s));
      const double there_s = std::clamp(t_s - 0.5, 0.0, turning_s),
                   back_s = std::clamp(t_s - 0.5 - turning_s, 0.0, turning_s);
      const double turned_rad = kSpeed_rad_s * (there_s - back_s);
      const double pushed_mm = std::max(0.0, turned_rad - (way_rad - kBeyond_rad)) * kRim_mm;
      const auto noisy_nm = [&](double mm) {
        return static_cast<std::int32_t>(std::lround(1e6 * (mm + how.noise_mm * normal(random))));
      };
      ASSERT_TRUE(recording.append(capture::MachineRow{
          .at = at, .counts = {count(at_mm), count(kRim_mm), count(how.height_mm)}, .screw_nm = {}}));
      ASSERT_TRUE(recording.append(capture::AngleRow{at, from_rad - how.side * turned_rad}));
      ASSERT_TRUE(recording.append(
          capture::ProbeRow{.at = at, .channels_nm = {noisy_nm(-how.side * pushed_mm), noisy_nm(0), noisy_nm(0)}}));
    }
    touch.machine_end = recording.machineRowCount();
    touch.probe_end = recording.probeRowCount();
    touch.angle_end = recording.angleRowCount();
    const auto inside = [&](double s) { return monoTime(std::llround(1e9 * (0.5 + s))); };
    touch.contact = inside(turning_s - kBeyond_rad / kSpeed_rad_s);
    touch.release = inside(turning_s + kBeyond_rad / kSpeed_rad_s);
    ASSERT_TRUE(recording.append(touch));
  }
  Outcome<RimContacts, metrology::Refusal> found() const {
    return rimContacts({kCentrelineBySteps, recording, scales, facts});
  }
  std::string refusal() const {
    const auto contacts = found();
    return contacts ? "none" : contacts.error().name;
  }

  capture::Recording recording{capture::Capacity{}};
  const capture::Scales scales{.mm_per_count = {1e-6, 1e-6, 1e-6}, .nominal_period = Nanoseconds{1'000'000}};
  Facts facts;
  std::mt19937_64 random{11};
  std::normal_distribution<double> normal;
};

TEST_F(Contacts, AreWhereTheDeflectionBegins) {
  record({.side = 1, .contact_rad = 0.03});
  record({.side = -1, .contact_rad = -0.05});
  const auto contacts = found();
  ASSERT_TRUE(contacts) << contacts.error().reason;
  EXPECT_NEAR(contacts->clockwise_rad, 0.03, 1e-6);
  EXPECT_NEAR(contacts->anticlockwise_rad, -0.05, 1e-6);
  EXPECT_NEAR(contacts->sd_rad, 1e-6, 1e-7) << "the stop of C";
}

TEST_F(Contacts, HaveTheUncertaintyOfTheirLines) {
  double squares = 0;
  constexpr int kRuns = 200;
  facts.sigma_c_rad = 0;
  for (int run = 0; run < kRuns; ++run) {
    recording.clear();
    record({.side = 1, .contact_rad = 0.03, .noise_mm = 0.002});
    record({.side = -1, .contact_rad = -0.05, .noise_mm = 0.002});
    const auto contacts = found();
    ASSERT_TRUE(contacts) << contacts.error().reason;
    const double off_rad = (contacts->clockwise_rad + contacts->anticlockwise_rad) / 2 + 0.01;
    squares += off_rad * off_rad / (contacts->sd_rad * contacts->sd_rad / 2);
  }
  // Chi-square of 200: 0.1 % below and above.
  EXPECT_GT(squares / kRuns, 0.70);
  EXPECT_LT(squares / kRuns, 1.35);
}

TEST_F(Contacts, OfOneSideAreNone) {
  record({.side = 1, .contact_rad = 0.03});
  EXPECT_EQ(refusal(), "missing-contact");
}

// Five rows and more, and ten that may touch already. The first deflection that counts as a contact, beyond 0.03 mm, is
// two rows after it.
TEST_F(Contacts, NeedRowsOfTheFreeStylus) {
  for (const auto& [rows, refused] : {std::pair{12, true}, {13, false}}) {
    recording.clear();
    record({.side = 1, .contact_rad = 0.03, .free_rows = rows});
    record({.side = -1, .contact_rad = -0.05});
    EXPECT_EQ(refusal(), refused ? "too-few-samples" : "none") << rows;
  }
}

TEST_F(Contacts, NeedToKnowTheRim) {
  record({.side = 1, .contact_rad = 0.03});
  record({.side = -1, .contact_rad = -0.05});
  facts.rim_ball->radius_mm.reset();
  EXPECT_EQ(refusal(), "missing-contact");
}

TEST_F(Contacts, OfAStylusThatStoodOnTheSameSideTwiceAreRefused) {
  record({.side = 1, .contact_rad = 0.03});
  record({.side = -1, .contact_rad = -0.05, .at_mm = 9});
  EXPECT_EQ(refusal(), "wrong-side");
}

TEST_F(Contacts, AtHeightsThatDifferAreRefused) {
  record({.side = 1, .contact_rad = 0.03, .height_mm = 0.15});
  record({.side = -1, .contact_rad = -0.05});
  EXPECT_EQ(refusal(), "unequal-heights");
}

TEST_F(Contacts, OfFewSamplesAreRefused) {
  record({.side = 1, .contact_rad = 0.03, .interval_s = 0.2});
  record({.side = -1, .contact_rad = -0.05, .interval_s = 0.2});
  EXPECT_EQ(refusal(), "too-few-samples");
}

TEST_F(Contacts, OfASwitchNeedItsPreTravel) {
  for (const double side : {1.0, -1.0}) record({.side = side, .contact_rad = 0.03 * side, .by_edges = true});
  EXPECT_EQ(refusal(), "no-pre-travel");
  facts.trigger_probe = TriggerProbe{.repeatability_mm = 0.0005};
  EXPECT_EQ(refusal(), "no-pre-travel");
  facts.trigger_probe->pre_travels = {PreTravel{}};
  const auto contacts = found();
  ASSERT_TRUE(contacts) << contacts.error().reason;
  EXPECT_NEAR(contacts->clockwise_rad, 0.03, 1e-6);
  EXPECT_NEAR(contacts->anticlockwise_rad, -0.03, 1e-6);
}

}  // namespace
}  // namespace probebox::procedure
