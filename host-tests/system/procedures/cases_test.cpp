#include <array>
#include <cmath>
#include <gmock/gmock.h>
#include <numbers>

#include "on_the_machine.hpp"
#include "protocol/units/angle.hpp"
#include "tools/case/case_folder.hpp"

// Cases that were measured without the box: it solves them, somebody accepts, and the CNC is told what to add.
namespace probebox::command {
namespace {

using testing::HasSubstr;

// A head that swivels about Y with its gauge line and its tool off (B20), read at two lengths.
metrology::Dataset swivelling() {
  metrology::Dataset dataset{
      .method = "swivel-error",
      .config = {{"swivel_axis", std::vector<double>{0, 1, 0}}, {"sigma_mm", 0.001}, {"note", std::string{"a head"}}},
      .tables = {}};
  auto readings = metrology::Table::withColumns(
      "readings", std::array<std::string_view, 5>{"B_deg", "L_mm", "x_mm", "y_mm", "z_mm"});
  for (const double length : {100.0, 200.0}) {
    const double z = 0.010 + length * 2e-4, x = 0.025 - length * 1e-4;
    for (const double b : {0.0, 45.0, 90.0}) {
      const double c = std::cos(b * kDegree), s = std::sin(b * kDegree);
      readings.append({b, length, -(s * z + (c - 1) * x), 2, -((c - 1) * z - s * x)});
    }
  }
  auto queries = metrology::Table::withColumns("queries", std::array<std::string_view, 2>{"B_deg", "L_mm"});
  queries.append({30, 150});
  dataset.tables = {std::move(readings), std::move(queries)};
  return dataset;
}

// A plate of eight balls at 60 angles: too much for one request. Whenever it is read on C, at zero too, it is 0.012 mm
// further along Y than when the linear axes alone go round.
metrology::Dataset turning() {
  constexpr std::array<std::string_view, 5> kFirst{"phi_rad", "ball", "x_mm", "y_mm", "z_mm"};
  auto first = metrology::Table::withColumns("first", kFirst);
  auto second = metrology::Table::withColumns("second", std::span{kFirst}.last(4));
  auto third = metrology::Table::withColumns("third", std::span{kFirst}.last(4));
  for (int ball = 0; ball < 8; ++ball) {
    const double at = ball * std::numbers::pi / 4, z = ball % 2 == 0 ? -10.0 : 10.0;
    for (int k = 0; k < 60; ++k) {
      const double phi = 6 * k * kDegree;
      first.append({phi, ball + 1.0, 330 + 120 * std::cos(at + phi), 200 + 120 * std::sin(at + phi) + 0.012, z - 300});
    }
    second.append({ball + 1.0, 330 + 120 * std::cos(at), 200 + 120 * std::sin(at), z - 300});
    third.append({ball + 1.0, 120 * std::cos(at), 120 * std::sin(at), z});
  }
  return {.method = "rotary-axis-errors",
          .config = {{"axis", std::string{"C"}},
                     {"axis_point_mm", std::vector<double>{330, 200, -300}},
                     {"axis_direction", std::vector<double>{0, 0, 1}}},
          .tables = {std::move(first), std::move(second), std::move(third)}};
}

class Cases : public OnTheMachine {
 protected:
  Cases() {
    start([](board::Descriptions& descriptions) {
      auto& machine = descriptions.machine;
      machine.rotary_axes[1] = board::RotaryAxisDescription{.angle_from = board::AngleFrom::controller};
      machine.swivel = board::SwivelDescription{.axis = board::RotaryLetter::b, .by_angle = false, .hold_s = 5};
      machine.tools = {{.number = 4, .length_mm = 150}};
    });
  }
  Finished propose(const metrology::Dataset& dataset) {
    const auto folder = directory_.file("case-" + std::to_string(++cases_));
    EXPECT_TRUE(casefolder::writeCase(dataset, folder));
    return box({"propose", folder, "--as-this-machine", "--by", "Ada", "--json"});
  }
  std::string proposed(const metrology::Dataset& dataset) {
    const auto done = propose(dataset);
    EXPECT_EQ(done.status, 0) << done.err;
    return std::to_string(done.object()["result_id"].get<int>());
  }
  // What the CNC reads once it stands.
  nlohmann::ordered_json settled() {
    nlohmann::ordered_json now;
    for (int attempt = 0; attempt < 200; ++attempt) {
      now = box({"corrections", "--json"}).object();
      if (now["valid"] == true && now["settled"] == true) break;
      std::this_thread::sleep_for(20ms);
    }
    return now;
  }

 private:
  int cases_{};
};

TEST_F(Cases, OfAHeadAndATableAreAcceptedAndServedWithTheirSum) {
  const auto head = proposed(swivelling()), table = proposed(turning());
  EXPECT_EQ(box({"corrections", "--json"}).object()["swivel"]["result_id"], 0) << "a proposal changes nothing";
  ASSERT_EQ(box({"accept", head, "--by", "Ada"}).status, 0);
  ASSERT_EQ(box({"accept", table, "--by", "Ada"}).status, 0);
  ASSERT_EQ(box({"corrections", "--sum", "swivel,rotary", "--tell", "B=30,tool=4"}).status, 0);
  const auto now = settled();
  ASSERT_TRUE(now["valid"]) << now;
  // Worked in the specification of the rigid head: E(30, 150) = (x, z) = (-.018660254, .010358984). The readings say
  // the same of the table at every angle, the zero included.
  EXPECT_NEAR(now["correction_mm"][0].get<double>(), -0.018660254, 2e-6);
  EXPECT_NEAR(now["correction_mm"][1].get<double>(), 0.012, 2e-6);
  EXPECT_NEAR(now["correction_mm"][2].get<double>(), 0.010358984, 2e-6);
  EXPECT_EQ(now["swivel"]["tool_length_mm"], 150);

  start([](board::Descriptions&) {});  // anew, as the board describes itself: without a head
  EXPECT_EQ(box({"corrections", "--sum", "swivel"}).status, 4) << "no head is described";
  ASSERT_EQ(box({"corrections", "--sum", "rotary"}).status, 0);
  EXPECT_NEAR(settled()["correction_mm"][1].get<double>(), 0.012, 2e-6) << "still in force";
  ASSERT_EQ(box({"rollback", "rotary-c", "--by", "Ada"}).status, 0);
  nlohmann::ordered_json after;
  for (int attempt = 0; attempt < 200 && after["valid"] != false; ++attempt)
    after = box({"corrections", "--json"}).object();
  EXPECT_EQ(after["valid"], false);
}

TEST_F(Cases, AreRefusedByNameAndKept) {
  auto dataset = swivelling();
  for (auto& length : dataset.tables[0].columns[1].values) length = 100;
  const auto refused = propose(dataset);
  EXPECT_EQ(refused.status, 1);
  EXPECT_THAT(refused.object()["refusal"].get<std::string>(), HasSubstr("length-span-too-small"));
  EXPECT_GT(refused.object()["result_id"], 0);
}

TEST_F(Cases, OfAnotherMachineAreNotForThisBox) {
  auto dataset = swivelling();
  dataset.config["machine"] = std::string{"another mill"};
  const auto refused = propose(dataset);
  EXPECT_EQ(refused.status, 4);
  EXPECT_THAT(refused.err, HasSubstr("another mill"));
}

TEST_F(Cases, AboutAnAxisThatTheMachineDoesNotHaveCannotComeIntoForce) {
  auto dataset = turning();
  dataset.config["axis"] = std::string{"A"};
  const auto done = box({"accept", proposed(dataset), "--by", "Ada"});
  EXPECT_EQ(done.status, 4);
  EXPECT_THAT(done.err, HasSubstr("not name"));
}

}  // namespace
}  // namespace probebox::command
