#include "firmware/procedure/facts/places.hpp"

#include <algorithm>
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

// The table of lengths and places that computations use.
namespace probebox::procedure {
namespace {

Facts described() {
  Facts facts;
  facts.probe_tools.count = 1;
  facts.probe_tools.numbers[0] = 1;
  facts.probe_tools.lengths_mm[0] = 150;
  facts.probe_tools.sds_mm[0] = 0.002;
  facts.tool_setter = ToolSetter{};
  facts.tool_setter->probe_offset_mm = {0.021, -0.013, -150};
  facts.tool_setter->sd_probe_offset_mm = 0.0005;
  return facts;
}

const PlaceRow* rowOf(const std::vector<PlaceRow>& table, const std::string& name) {
  const auto found = std::ranges::find(table, name, &PlaceRow::name);
  return found == table.end() ? nullptr : &*found;
}

// 66 um wrong at U = 1.1 um: the typed offset outlived the measured one.
TEST(Places, TakeTheMeasuredOffsetOfTheStylus) {
  Facts facts = described();
  MeasuredPlaces measured;
  measured.styli = {{.result_id = 7, .tool = 1, .at_mm = {0.087, -0.013}, .sd_mm = 0.0004}};
  const auto table = takeMeasured(facts, measured);
  EXPECT_EQ(facts.tool_setter->probe_offset_mm, (std::array{0.087, -0.013, -150.0}));
  EXPECT_EQ(facts.tool_setter->probe_offset_result, 7U);
  const auto* x = rowOf(table, "stylus-offset-1 X");
  ASSERT_NE(x, nullptr);
  EXPECT_EQ(x->used()->by, "result 7");
  EXPECT_EQ(x->typed->mm, 0.021);
  EXPECT_THAT(disagreement(*x).value_or(""), testing::StartsWith("places-disagree: stylus-offset-1 X"));
  EXPECT_FALSE(disagreement(*rowOf(table, "stylus-offset-1 Y"))) << "both say the same";
}

TEST(Places, KeepYOfASetterThatALatheWithoutYMeasured) {
  Facts facts = described();
  facts.tool_setter->accepted_mm = {160, 0.5, -60};
  const MeasuredPlaces measured{.setter_result = 9, .setter_mm = {{161, 0, -61}}, .setter_tells_y = false};
  const auto table = takeMeasured(facts, measured);
  EXPECT_EQ(facts.tool_setter->accepted_mm, (std::array{161.0, 0.5, -61.0}));
  EXPECT_NE(rowOf(table, "setter Z"), nullptr);
  EXPECT_EQ(rowOf(table, "setter Y"), nullptr) << "nothing measured it";
  facts = described();
  takeMeasured(facts, measured);
  EXPECT_EQ(facts.tool_setter->accepted_mm, (std::array{161.0, 0.0, -61.0})) << "no place is typed";
}

// The head's reference is 150 mm above the tip.
TEST(Places, CountAStylusFromTheReferenceOfTheHeadWhereTheTiltOfTheSpindleIsKnown) {
  Facts facts = described();
  MeasuredPlaces measured;
  measured.styli = {{.result_id = 7, .tool = 1, .at_mm = {0.006, 0.017}, .sd_mm = 0.0003}};
  takeMeasured(facts, measured);
  EXPECT_TRUE(facts.tool_setter->tilt_unknown);
  facts = described();
  measured.spindle_tilt_rad = {{-0.0001, 0.0002}};
  measured.sd_spindle_tilt_rad = 4e-6;
  const auto table = takeMeasured(facts, measured);
  EXPECT_FALSE(facts.tool_setter->tilt_unknown);
  EXPECT_NEAR(facts.tool_setter->probe_offset_mm[0], 0.021, 1e-12);
  EXPECT_NEAR(facts.tool_setter->probe_offset_mm[1], -0.013, 1e-12);
  EXPECT_NEAR(*facts.tool_setter->sd_probe_offset_mm, std::hypot(0.0003, 0.0006), 1e-12);
  EXPECT_FALSE(disagreement(table[0]));
}

TEST(Places, AreThoseOfTheProbeThatIsUsed) {
  Facts facts = described();
  MeasuredPlaces measured;
  measured.styli = {{.result_id = 7, .tool = 2, .at_mm = {0.087, -0.013}, .sd_mm = 0.0004}};
  EXPECT_EQ(rowOf(takeMeasured(facts, measured), "stylus-offset-2 X"), nullptr);
  EXPECT_EQ(facts.tool_setter->probe_offset_mm[0], 0.021);
}

TEST(Places, KeepTheTypedValueOfTheRowThatIsNamed) {
  Facts facts = described();
  MeasuredPlaces measured;
  measured.tool_lengths = {{.result_id = 9, .tool = 1, .length_mm = 150.05, .sd_mm = 0.001}};
  const auto table = takeMeasured(facts, measured, "assembly-1 length");
  EXPECT_EQ(facts.lengthOf(1), 150);
  ASSERT_EQ(table.size(), 1U);
  EXPECT_TRUE(disagreement(table[0]));
  takeMeasured(facts, measured);
  EXPECT_EQ(facts.lengthOf(1), 150.05);
  EXPECT_EQ(facts.lengthResultOf(1), 9U);
}

TEST(Places, DoNotDisagreeWhereNoSdIsStated) {
  Facts facts = described();
  facts.probe_tools.sds_mm[0] = 0;
  MeasuredPlaces measured;
  measured.tool_lengths = {{.result_id = 9, .tool = 1, .length_mm = 151, .sd_mm = 0.001}};
  EXPECT_FALSE(disagreement(takeMeasured(facts, measured)[0])) << "a nominal length";
}

// Ways are judged about the axis that was found, and not about the one that was typed.
TEST(Places, TakeTheMeasuredPivotOfATiltingTable) {
  Facts facts = described();
  facts.tilting_table = BFacts{.axis = {1, 0, 0}, .count = 2, .point_mm = {{330, 200, -260}}};
  MeasuredPlaces measured;
  takeMeasured(facts, measured);
  EXPECT_EQ(facts.tilting_table->point_mm, (std::array{330.0, 200.0, -260.0}));
  measured.table_pivot_result = 12;
  measured.table_pivot = {std::nullopt, AcceptedValue{200.5, 0.001}, AcceptedValue{-261.25, 0.001}};
  const auto table = takeMeasured(facts, measured);
  EXPECT_EQ(facts.tilting_table->point_mm, (std::array{330.0, 200.5, -261.25}));
  ASSERT_NE(rowOf(table, "table-pivot Z"), nullptr);
  EXPECT_EQ(rowOf(table, "table-pivot Z")->used()->by, "result 12");
  EXPECT_EQ(rowOf(table, "table-pivot X"), nullptr) << "along the axis nothing was measured";
  facts.tilting_table->point_mm.reset();
  takeMeasured(facts, measured);
  EXPECT_EQ(facts.tilting_table->point_mm, (std::array{0.0, 200.5, -261.25})) << "never typed";
}

// tool-4 and assembly-4 in force say different things of one tool.
TEST(Places, OfOneToolByTwoMethodsAreCompared) {
  Facts facts = described();
  MeasuredPlaces measured;
  measured.tool_tips = {{.result_id = 20, .tool = 4, .at_mm = {0.010, 0.020, -120.03}, .sd_mm = {0.001, 0.001, 0.001}}};
  measured.tool_lengths = {{.result_id = 18,
                            .tool = 4,
                            .length_mm = 120.03,
                            .sd_mm = 0.001,
                            .tip_mm = {{0.030, 0.0205}},
                            .sd_tip_mm = 0.001}};
  const auto table = takeMeasured(facts, measured);
  ASSERT_EQ(table.size(), 3U);
  const auto* x = rowOf(table, "tool-4 X");
  ASSERT_NE(x, nullptr);
  EXPECT_EQ(x->used()->by, "result 20") << "the newest";
  EXPECT_TRUE(disagreement(*x));
  EXPECT_FALSE(disagreement(*rowOf(table, "tool-4 Y")));
  EXPECT_FALSE(disagreement(*rowOf(table, "tool-4 length")));
  measured.tool_lengths[0].length_mm = 120.05;
  const auto again = takeMeasured(facts, measured);
  EXPECT_TRUE(disagreement(*rowOf(again, "tool-4 length")));
}

}  // namespace
}  // namespace probebox::procedure
