#include "firmware/app/host/machine_description.hpp"

#include <gtest/gtest.h>

// What a host is told of the machine, of descriptions and of results in force that replace them.
namespace probebox::app {
namespace {

procedure::Facts fullFacts() {
  procedure::Facts facts{.sphere_diameter_mm = 25,
                         .gaps = {procedure::KnownSize{26}},
                         .stylus_ball_diameter_mm = 6,
                         .sigma_c_rad = 4e-6,
                         .screws = {}};
  facts.sd_sphere_diameter_mm = 5e-5;
  facts.sphere_certificate = procedure::SphereCertificate{.in_words = "number 7", .next_due = "2028-04-17"};
  facts.sphere_temperature = procedure::SphereTemperature{.celsius = 23.5, .sd_k = 0.5, .expansion_per_k = 11.5e-6};
  facts.sd_stylus_ball_diameter_mm = 3e-4;
  facts.tilting_table = procedure::BFacts{.axis = {1, 0, 0}, .count = 2, .angles_rad = {-1.5, 0}, .sigma_rad = 5e-6};
  facts.swivel_head = procedure::HeadFacts{.b = {.axis = {0, 1, 0}, .count = 1, .angles_rad = {0.7}, .sigma_rad = 1e-6},
                                           .pivot_mm = {0, 0, 60},
                                           .ball_mm = {},
                                           .sd_ball_mm = 0.001};
  facts.probe_tools = {.count = 2, .numbers = {3, 8}, .lengths_mm = {150, 200}};
  facts.tools = {{.number = 4, .length_mm = 120, .sd_mm = 0.001, .holder = procedure::HolderFacts{1, 62, 0.002}}};
  facts.screws[1] = procedure::ScrewFacts{{.length_mm = 800, .offset_mm = 100, .pitch_mm = 12}};
  facts.screws[1]->face = procedure::ScrewFace{.result_id = 9, .sector_um = {}, .sd_um = 0.02};
  facts.sensor_head =
      procedure::SensorHead{.tool = 5, .range_mm = 0.5, .centre_offset_mm = {}, .sd_centre_offset_mm = 0.001};
  return facts;
}

TEST(MachineDescription, HasWhatIsDescribedAndTheNames) {
  const auto says = machineDescription({"mill", "spindle", "P1", 0.4, 1.5}, fullFacts(), {});
  EXPECT_EQ(says.machine, "mill");
  EXPECT_EQ(says.mounting, "spindle");
  EXPECT_EQ(says.probe.name, "P1");
  EXPECT_FALSE(says.probe.switches);
  EXPECT_EQ(says.probe.noise_um, 0.4);
  EXPECT_EQ(says.probe.deflection_limit_mm, 1.5);
  EXPECT_EQ(says.probe.sd_ball_diameter_mm, 3e-4);
  EXPECT_EQ(says.sphere.sd_diameter_mm, 5e-5);
  EXPECT_EQ(says.sphere.certificate, "number 7");
  EXPECT_TRUE(says.sphere.has_temperature);
  EXPECT_EQ(says.sphere.sd_temperature_k, 0.5);
  EXPECT_EQ(says.gaps_mm, (std::array<double, 3>{26, 0, 0}));
  EXPECT_EQ(says.sigma_c_rad, 4e-6);
  ASSERT_EQ(says.table.size(), 1U);
  EXPECT_EQ(says.table[0].angles_rad, (std::vector{-1.5, 0.0}));
  ASSERT_EQ(says.head.size(), 1U);
  EXPECT_FALSE(says.head[0].has_ball);
  EXPECT_EQ(says.head[0].sd_ball_mm, 0.001);
  ASSERT_EQ(says.tools.size(), 1U);
  EXPECT_EQ(says.tools[0].sd_holder_mm, 0.002);
  ASSERT_EQ(says.screws.size(), 1U);
  EXPECT_EQ(says.screws[0].axis, 1);
  EXPECT_EQ(says.screws[0].face_result_id, 9U);
  EXPECT_TRUE(says.plate.empty());
  EXPECT_TRUE(says.checked_ball.empty());
  EXPECT_FALSE(says.has_rim_ball);
  EXPECT_EQ(says.positions_hz[0], 0) << "nothing has arrived yet";
}

TEST(MachineDescription, HasTheResultsInForceInThePlaceOfWhatTheyReplace) {
  auto facts = fullFacts();
  facts.takeLength(8, 199.5, 31);
  facts.sensor_head->calibrated = procedure::CalibratedHead{.result_id = 12, .tool = 5, .matrix = {}, .sd = {}};
  facts.sensor_head->calibrated->sd[2][1] = 1e-4;
  facts.trigger_probe =
      procedure::TriggerProbe{.repeatability_mm = 0.0005, .pre_travels = {{.result_id = 6, .tool = 8}}};
  facts.checked_ball = procedure::CheckedBall{.diameter_mm = 12,
                                              .centre_z = {.mm = -160, .sd_mm = 0.0004},
                                              .accepted_x = procedure::AcceptedValue{.mm = 330, .sd_mm = 0.0003},
                                              .accepted_y = procedure::AcceptedValue{.mm = 200, .sd_mm = 0.0002}};
  const auto says = machineDescription({"mill", "spindle", "P1", 0.4}, facts, {});
  ASSERT_EQ(says.checked_ball.size(), 1U);
  EXPECT_TRUE(says.checked_ball[0].accepted);
  EXPECT_EQ(says.checked_ball[0].sd_accepted_mm, (std::array{0.0003, 0.0002}));
  EXPECT_EQ(says.checked_ball[0].sd_centre_z_mm, 0.0004);
  ASSERT_EQ(says.carriers.size(), 2U);
  EXPECT_EQ(says.carriers[0].result_id, 0U);
  EXPECT_EQ(says.carriers[1].number, 8U);
  EXPECT_EQ(says.carriers[1].length_mm, 199.5);
  EXPECT_EQ(says.carriers[1].result_id, 31U);
  EXPECT_EQ(says.sensor_head.at(0).result_id, 12U);
  EXPECT_EQ(says.sensor_head.at(0).sd_matrix[2][1], 1e-4);
  EXPECT_TRUE(says.probe.switches);
  EXPECT_DOUBLE_EQ(says.probe.repeatability_um, 0.5);
  EXPECT_EQ(says.probe.noise_um, 0) << "it delivers no samples";
  ASSERT_EQ(says.pre_travels.size(), 1U);
  EXPECT_EQ(says.pre_travels[0].tool, 8U);
}

}  // namespace
}  // namespace probebox::app
