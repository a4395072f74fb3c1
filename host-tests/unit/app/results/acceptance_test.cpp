#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "accepting.hpp"
#include "firmware/app/results/result_values.hpp"
#include "firmware/app/results/results_in_force.hpp"
#include "firmware/app/results/values_in_use.hpp"
#include "firmware/procedure/facts/places.hpp"
#include "host-tests/support/temporary_folder.hpp"

// What a person accepts, beside what is in force; and what a result rests on.
namespace probebox::app {
namespace {

using namespace std::chrono_literals;
using metrology::Estimate;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

TEST_F(Accepting, OfTheFirstOfItsSubjectSaysSo) {
  const auto first = acceptedAs("centreline", centreAt(0.154, -0.110, "centreline-by-steps"));
  EXPECT_TRUE(first.comparison.first());
  EXPECT_FALSE(first.comparison.differs());
}

// 14 um of a stylus offset, 180 sd: on a machine it was the offset of the stylus, taken for a move of the axis.
TEST_F(Accepting, OfACentrelineFarFromTheOneInForceNeedsAWord) {
  const auto first = acceptedAs("centreline", centreAt(0.154, -0.110, "centreline-by-steps")).id;
  const auto next = propose("centreline", centreAt(0.168, -0.110, "centreline-by-steps"));
  const auto refused = results_.accept(next, "Ada");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().reason, store::Reason::differs);
  EXPECT_THAT(refused.error().what,
              AllOf(HasSubstr("centre_mm[0]"), HasSubstr("0.168"), HasSubstr("0.154"), HasSubstr("+0.014"),
                    HasSubstr("180"), HasSubstr("result " + std::to_string(first)), HasSubstr("--although-it-differs"),
                    testing::Not(HasSubstr("centre_mm[1]"))));
  EXPECT_EQ(inForce("centreline")->id, first);
  const auto accepted = results_.accept(next, "Ada", true);
  ASSERT_TRUE(accepted);
  EXPECT_EQ(accepted->comparison.with, first);
  ASSERT_EQ(accepted->comparison.values.size(), 2U);
  EXPECT_NEAR(accepted->comparison.values[0].inSd().value(), 180, 0.1);
  EXPECT_EQ(accepted->comparison.values[1].inSd(), 0.0);
  EXPECT_EQ(inForce("centreline")->id, next);
  const auto history = store_.history(next).value();
  EXPECT_EQ(history.at(1).remark, "although it differs");
}

TEST_F(Accepting, WithinFourSdNeedsNone) {
  acceptedAs("centreline", centreAt(0.154, -0.110, "centreline-by-steps"));
  const auto accepted = acceptedAs("centreline", centreAt(0.1543, -0.110, "centreline-by-steps"));
  EXPECT_FALSE(accepted.comparison.differs()) << accepted.comparison.values.front().inSd().value();
  EXPECT_GT(accepted.comparison.values.front().inSd().value(), 3);
}

TEST_F(Accepting, ComparesWithoutChangingAnything) {
  const auto first = acceptedAs("delay", resultOf("delay-plates", {Estimate::scalar("tau_s", 0.00385, 4e-6)})).id;
  auto by_axis =
      resultOf("delay-per-axis", {Estimate::vector("tau_axis_s", {0.00386, 0.0040, 0.00385}, {4e-6, 4e-6, 4e-6})});
  const auto next = propose("delay", by_axis);
  const auto compared = results_.compareOnly(next);
  ASSERT_TRUE(compared);
  ASSERT_EQ(compared->comparison.values.size(), 3U) << "one delay of all axes is one of each";
  EXPECT_FALSE(compared->comparison.values[0].differs());
  EXPECT_TRUE(compared->comparison.values[1].differs());
  EXPECT_EQ(inForce("delay")->id, first);
  EXPECT_EQ(store_.find(next)->state, store::State::proposed);
}

TEST_F(Accepting, OfWhatHasNoSdOrNoValueInCommonNeedsAWord) {
  auto bare = centreAt(0.154, -0.110);
  bare.estimates[0].sd.clear();
  acceptedAs("centreline-stylus", bare);
  acceptedAs("centreline-stylus", bare);  // the same again
  bare.estimates[0].values[0] = 0.1541;
  EXPECT_THAT(results_.accept(propose("centreline-stylus", bare), "Ada").error().what, HasSubstr("standard deviation"));
  acceptedAs("screw-x", resultOf("screw-calibration", {Estimate::scalar("K", 1, 0.01)}));
  const auto table = resultOf("screw-calibration", {Estimate::vector("sector_table_um", {1, -1}, {0.1, 0.1})});
  EXPECT_THAT(results_.accept(propose("screw-x", table), "Ada").error().what, HasSubstr("in common"));
}

// Centres of axes that lean are compared at one height.
TEST_F(Accepting, ComparesCentrelinesAtTheSameHeight) {
  const auto leaning = [](double x_mm, double z_mm) {
    auto result = resultOf("c-axis-alignment", {Estimate::vector("C_tilt_rad", {2e-4, 0}, {1e-7, 1e-7})});
    result.also = {Estimate::vector("centre_mm", {x_mm, 0.1}, {5e-5, 5e-5}),
                   Estimate::scalar("mean_z_mm", z_mm, std::nullopt)};
    return result;
  };
  acceptedAs("centreline", leaning(0.100, 100));
  const auto higher = acceptedAs("centreline", leaning(0.120, 200));
  EXPECT_LT(higher.comparison.values.back().inSd().value_or(99), 0.1);
}

// Offsets of a tool at several B of a swivelling head.
TEST_F(Accepting, ComparesWhatWasMeasuredAtTheSameB) {
  const auto at = [](const std::vector<double>& b_deg, const std::vector<double>& x_mm) {
    std::vector<double> rows;
    for (const double x : x_mm) rows.insert(rows.end(), {x, 0.1, -120});
    auto result = resultOf("tool-setter", {Estimate::vector("tool_offset_mm", rows, std::vector(rows.size(), 1e-4))});
    if (b_deg != std::vector<double>{0}) result.also = {Estimate::vector("B_deg", b_deg, {})};
    return result;
  };
  acceptedAs("tool-4", at({0, 45}, {1, 2}));
  const auto other_angles = acceptedAs("tool-4", at({0, 90}, {1, 3}));
  ASSERT_EQ(other_angles.comparison.values.size(), 3U) << "B = 0 alone";
  EXPECT_EQ(other_angles.comparison.values.front().key, "tool_offset_mm_at_B_0_deg[0]");
  EXPECT_EQ(acceptedAs("tool-4", at({-30, 0, 90}, {7, 1, 3})).comparison.values.size(), 6U);
  EXPECT_EQ(acceptedAs("tool-4", at({0}, {1})).comparison.values.size(), 3U) << "with a level head";
  const auto moved = results_.accept(propose("tool-4", at({0, 45}, {1.1, 2})), "Ada");
  ASSERT_FALSE(moved);
  EXPECT_THAT(moved.error().what,
              AllOf(HasSubstr("tool_offset_mm_at_B_0_deg[0]"), HasSubstr("1.1"), HasSubstr("of 1")));
}

// One height does not tell how the axis leans; the result of two heights does.
TEST_F(Accepting, TakesTheSlopeFromWhicheverOfTwoCentrelinesHasOne) {
  const auto at_one_height = [](double x_mm, double z_mm) {
    auto result = centreAt(x_mm, 0.1);
    result.also = {Estimate::scalar("mean_z_mm", z_mm, std::nullopt)};
    return result;
  };
  auto leaning = resultOf("c-axis-alignment", {Estimate::vector("C_tilt_rad", {2e-4, 0}, {1e-7, 1e-7})});
  leaning.also = {Estimate::vector("centre_mm", {0.120, 0.1}, {5e-5, 5e-5}),
                  Estimate::scalar("mean_z_mm", 200, std::nullopt)};
  acceptedAs("centreline", at_one_height(0.100, 100));
  EXPECT_LT(acceptedAs("centreline", leaning).comparison.values.back().inSd().value_or(99), 0.1);
  EXPECT_FALSE(results_.accept(propose("centreline", at_one_height(0.120, 100)), "Ada"));
  EXPECT_TRUE(results_.accept(propose("centreline", at_one_height(0.100, 100)), "Ada"));
}

TEST_F(Accepting, OfATipsCentrelineServesNoSpindles) {
  const auto accepted = acceptedAs("centreline-stylus", centreAt(0.174, -0.1233));
  EXPECT_THAT(accepted.notes, ElementsAre(HasSubstr("tool 1")));
  EXPECT_FALSE(servedCentre());
  EXPECT_TRUE(inForce("centreline-stylus"));
}

// 0.174 from the tip and 0.020 of the stylus: 0.194, with both sd.
TEST_F(Accepting, OfTheStylusOffsetMakesACentrelineOfWhatTheTipSaw) {
  const auto tip = acceptedAs("centreline-stylus", centreAt(0.174, -0.1233)).id;
  const auto offset = acceptedAs("stylus-offset-1", offsetOf(0.020, -0.013));
  ASSERT_EQ(offset.notes.size(), 1U);
  EXPECT_THAT(offset.notes.front(), HasSubstr("in force"));
  const auto centre = inForce("centreline");
  ASSERT_TRUE(centre);
  EXPECT_EQ(centre->accepted_by, "Ada");
  const auto* value = centre->result()->find("centre_mm");
  EXPECT_NEAR(value->values[0], 0.194, 1e-12);
  EXPECT_NEAR(value->values[1], -0.1363, 1e-12);
  EXPECT_NEAR(value->sd[0], std::hypot(5.5e-5, 4e-5), 1e-12);
  EXPECT_EQ(centre->result()->find("tip_centre_mm")->values[0], 0.174);
  ASSERT_TRUE(servedCentre());
  EXPECT_NEAR((*servedCentre())[0], 0.194, 1e-12);
  const auto rests_on = store_.restsOn(centre->id).value();
  ASSERT_EQ(rests_on.size(), 2U);
  EXPECT_EQ(rests_on[0].id, tip);
  EXPECT_EQ(rests_on[1].id, offset.id);
}

TEST_F(Accepting, OfASumRestsOnWhatItsPartsRestOn) {
  const auto delay = acceptedAs("delay", resultOf("delay-plates", {Estimate::scalar("tau_s", 0.00385, 4e-6)})).id;
  const auto tip = propose("centreline-stylus", centreAt(0.174, -0.1233), {.rests_on = {delay}});
  ASSERT_TRUE(results_.accept(tip, "Ada"));
  const auto offset = acceptedAs("stylus-offset-1", offsetOf(0.020, -0.013)).id;
  std::vector<store::Id> basis;
  const auto rests_on = store_.restsOn(inForce("centreline")->id).value();
  for (const auto& other : rests_on) basis.push_back(other.id);
  EXPECT_THAT(basis, testing::UnorderedElementsAre(delay, tip, offset));
  acceptedAs("delay", resultOf("delay-plates", {Estimate::scalar("tau_s", 0.00386, 4e-6)}));
  EXPECT_THAT(results_.toRepeat(), testing::Contains(HasSubstr("about centreline rests on a retired result, " +
                                                               std::to_string(delay) + " about delay")));
}

TEST_F(Accepting, OfAnotherProbesOffsetMakesNone) {
  acceptedAs("centreline-stylus", centreAt(0.174, -0.1233));
  EXPECT_THAT(acceptedAs("stylus-offset-2", offsetOf(0.020, -0.013)).notes, IsEmpty());
  EXPECT_FALSE(inForce("centreline"));
  auto by_second = centreAt(0.1741, -0.1233);
  by_second.conditions = {{"probe_tool", "2"}};
  acceptedAs("centreline-stylus", by_second);
  EXPECT_TRUE(inForce("centreline"));
}

TEST_F(Accepting, NeverReplacesACentrelineByASumUnasked) {
  const auto direct = acceptedAs("centreline", centreAt(0.154, -0.110, "centreline-by-steps")).id;
  acceptedAs("centreline-stylus", centreAt(0.174, -0.1233));
  const auto offset = acceptedAs("stylus-offset-1", offsetOf(0.020, -0.013));
  EXPECT_THAT(offset.notes, ElementsAre(HasSubstr("is proposed")));
  EXPECT_EQ(inForce("centreline")->id, direct);
}

TEST_F(Accepting, NamesWhatRestsOnTheResultThatItReplaces) {
  acceptedAs("centreline-stylus", centreAt(0.174, -0.1233));
  const auto offset = acceptedAs("stylus-offset-1", offsetOf(0.020, -0.013)).id;
  EXPECT_THAT(results_.toRepeat(), IsEmpty());
  const auto again = acceptedAs("stylus-offset-1", offsetOf(0.0201, -0.013));
  EXPECT_THAT(results_.toRepeat(),
              ElementsAre(AllOf(HasSubstr("about centreline rests on a retired result, " + std::to_string(offset)))));
  EXPECT_THAT(again.notes.front(), HasSubstr("retired"));
  EXPECT_NEAR((*servedCentre())[0], 0.194, 1e-12) << "what is in force stays until a person accepts the new sum";
}

TEST_F(Accepting, OfASlideAndOfASpindleExcludeEachOther) {
  auto slide = resultOf("c-axis-alignment", {Estimate::vector("Z_slide_rad", {3e-4, -2e-4}, {1e-6, 1e-6})});
  slide.also = {Estimate::vector("centre_mm", {0.16, -0.12}, {5e-5, 5e-5}),
                Estimate::scalar("mean_z_mm", 200, std::nullopt)};
  const auto direct = acceptedAs("centreline", centreAt(0.154, -0.110, "centreline-by-steps")).id;
  const auto of_slide = propose("centreline-slide", slide);
  EXPECT_THAT(results_.accept(of_slide, "Ada").error().what,
              HasSubstr("cannot be in force beside result " + std::to_string(direct)));
  ASSERT_TRUE(results_.rollBack(direct, "Ada"));
  const auto accepted = results_.accept(of_slide, "Ada");
  ASSERT_TRUE(accepted) << accepted.error().what;
  EXPECT_THAT(accepted->notes, ElementsAre(HasSubstr("slide")));
  EXPECT_THAT(results_.rollBack(std::string{"centreline"}, "Ada").error().what, HasSubstr("beside"));
  ASSERT_TRUE(servedCentre());
  EXPECT_EQ(std::get<CentrelineActivated>(told_.back()).slope[0], 3e-4);
}

TEST_F(Accepting, OfADelayByJointSaysThatItIsNotAppliedByAxis) {
  const auto by_axis = acceptedAs("delay", resultOf("delay-plates", {Estimate::scalar("tau_s", 0.00385, 4e-6)})).id;
  const auto accepted = acceptedAs(
      "delay-joints", resultOf("delay-joints", {Estimate::vector("tau_joint_s", {0.003, 0.004}, {4e-6, 4e-6})}));
  EXPECT_THAT(accepted.notes, ElementsAre(HasSubstr("by axis")));
  EXPECT_EQ(inForce("delay")->id, by_axis);
}

// docs/metrology.md B.10: the next check starts from the ball of the last one that was accepted.
TEST_F(Accepting, OfACheckMovesTheBallThatTheNextOneStartsFrom) {
  EXPECT_FALSE(results_.measuredFacts().ball_x);
  auto check = resultOf("periodic-check",
                        {Estimate::scalar("Xcen_B0_mm", 0.154, 5e-5), Estimate::scalar("Ycen_B0_mm", -0.11, 5e-5)});
  check.also = {Estimate::vector("ball_centre_mm", {20.154, -0.11, 80.5}, {1e-4, 1e-4, 1e-4})};
  acceptedAs("check", check);
  const auto facts = results_.measuredFacts();
  ASSERT_TRUE(facts.ball_x && facts.ball_y && facts.ball_z);
  EXPECT_EQ(facts.ball_x->mm, 0.154);
  EXPECT_EQ(facts.ball_y->mm, -0.11);
  EXPECT_EQ(facts.ball_y->sd_mm, 5e-5);
  EXPECT_EQ(facts.ball_z->mm, 80.5);
  EXPECT_EQ(facts.ball_z->sd_mm, 1e-4);
  ASSERT_TRUE(results_.rollBack(std::string{"check"}, "Ada"));
  EXPECT_FALSE(results_.measuredFacts().ball_x);
}

// A lathe of X and Z tells nothing of Y, which stays as it was.
TEST_F(Accepting, OfACheckWithoutYMovesXAndTheHeightOfTheBall) {
  auto check = resultOf("periodic-check", {Estimate::scalar("Xcen_B0_mm", 0.157, 5e-5)});
  check.also = {Estimate::scalar("ball_centre_z_mm", 120.01, 1e-4)};
  acceptedAs("check", check);
  procedure::Facts described;
  described.has_y = false;
  described.checked_ball =
      procedure::CheckedBall{.centre_z = {.mm = 120}, .accepted_x = procedure::AcceptedValue{.mm = 0.1}};
  procedure::takeMeasured(described, results_.measuredFacts(), {});
  EXPECT_EQ(described.checked_ball->accepted_x->mm, 0.157);
  EXPECT_FALSE(described.checked_ball->accepted_y);
  EXPECT_EQ(described.checked_ball->centre_z.mm, 120.01);
}

// X at 90 degrees counted from the axis that was accepted before; the next check counts from the one of this check.
TEST_F(Accepting, OfACheckWithASwivelledHeadIsWhatTheNextOneIsHeldAgainst) {
  auto check = resultOf("periodic-check",
                        {Estimate::scalar("Xcen_B0_mm", 0.052, 1e-4), Estimate::scalar("Ycen_B0_mm", -0.01, 1e-4),
                         Estimate::scalar("x_offset_error_mm", 0.1, 2e-4)});
  check.also = {Estimate::scalar("Zcen_B90_mm", -310.2, 3e-4), Estimate::scalar("deviation_Xcen_B0_mm", 0.002, 1e-4)};
  acceptedAs("check", check);
  const auto facts = results_.measuredFacts();
  ASSERT_TRUE(facts.ball_x90 && facts.ball_z90);
  EXPECT_NEAR(facts.ball_x90->mm, 0.098, 1e-12);
  EXPECT_EQ(facts.ball_x90->sd_mm, 2e-4);
  EXPECT_EQ(facts.ball_z90->mm, -310.2);
}

TEST_F(Accepting, OfAStylusOffsetIsWhereItsTipIs) {
  const auto id = acceptedAs("stylus-offset-2",
                             [&] {
                               auto result =
                                   resultOf("spindle-offset-2x2",
                                            {Estimate::vector("stylus_offset_mm", {0.087, -0.013}, {1e-3, 2e-3})});
                               result.conditions.push_back({"probe_tool", "2"});
                               return result;
                             }())
                      .id;
  const auto facts = results_.measuredFacts();
  ASSERT_EQ(facts.styli.size(), 1U);
  EXPECT_EQ(facts.styli[0].result_id, id);
  EXPECT_EQ(facts.styli[0].tool, 2U);
  EXPECT_EQ(facts.styli[0].at_mm, (std::array{0.087, -0.013}));
  EXPECT_EQ(facts.styli[0].sd_mm, 2e-3);
}

TEST_F(Accepting, OfASetterMovesItsPlaceAndNamesTheSourceOfEveryValue) {
  procedure::Facts described;
  described.checked_ball = procedure::CheckedBall{};
  described.tool_setter = procedure::ToolSetter{};
  described.tool_setter->accepted_mm = {1, 2, 3};
  const auto sourceOf = [&](const std::string& name) {
    for (const auto& value : valuesInUse(described, results_.about())) {
      if (value.name == name) return std::pair{value.source, value.result_id};
    }
    return std::pair{messages::ValueSource::unknown, std::uint64_t{999}};
  };
  EXPECT_EQ(sourceOf("setter"), (std::pair{messages::ValueSource::description, std::uint64_t{0}}));
  const auto setter =
      resultOf("tool-setter",
               {Estimate::matrix("setter_mm", 3, {10, 20, 30, 11, 21, 31}, {1e-3, 2e-3, 1e-3, 1e-3, 1e-3, 9e-3})});
  const auto id = acceptedAs("setter", setter).id;
  EXPECT_EQ(results_.measuredFacts().setter_mm, (std::array{10.0, 20.0, 30.0}));
  EXPECT_EQ(results_.measuredFacts().sd_setter_mm, 2e-3);
  auto whole = setter;
  whole.estimates.front().uncertainty = {3e-3, 2e-3, 4e-3, 1e-3, 1e-3, 9e-3};
  acceptedAs("setter", whole);
  EXPECT_EQ(results_.measuredFacts().sd_setter_mm, 4e-3) << "with the part of type B";
  acceptedAs("setter", setter);
  EXPECT_EQ(sourceOf("setter").first, messages::ValueSource::result);
  EXPECT_GT(sourceOf("setter").second, id);
  EXPECT_EQ(sourceOf("check").first, messages::ValueSource::description);
}

TEST_F(Accepting, OfASetterOfALatheWithoutYMovesItInXAndZ) {
  const auto lying = [](double x_mm, double z_mm) {
    return resultOf("tool-setter",
                    {Estimate::scalar("setter_x_mm", x_mm, 1e-3), Estimate::scalar("setter_z_mm", z_mm, 2e-3)});
  };
  procedure::Facts described;
  described.has_y = false;
  described.tool_setter = procedure::ToolSetter{};
  described.tool_setter->accepted_mm = {160, 0.5, -60};
  const auto usedAfter = [&](double x_mm, double z_mm) {
    EXPECT_TRUE(results_.accept(propose("setter", lying(x_mm, z_mm)), "Ada", /*although_it_differs=*/true));
    auto facts = described;
    procedure::takeMeasured(facts, results_.measuredFacts());
    return *facts.tool_setter;
  };
  EXPECT_EQ(usedAfter(160.2, -60.1).accepted_mm, (std::array{160.2, 0.5, -60.1})) << "Y of machine.toml";
  const auto moved = usedAfter(161.4, -58.9);
  EXPECT_EQ(moved.accepted_mm, (std::array{161.4, 0.5, -58.9})) << "the device was moved and accepted again";
  EXPECT_EQ(moved.sd_accepted_mm, 2e-3);
}

TEST_F(Accepting, OfAnAssemblyGivesMethodsTheLengthOfTheirTool) {
  auto assembly = resultOf("tool-assembly", {Estimate::scalar("assembled_length_mm", 88, 1e-3)});
  acceptedAs("assembly-1", assembly);
  EXPECT_THAT(results_.measuredFacts().tool_lengths, testing::IsEmpty()) << "L3 alone is not the length";
  assembly.also = {Estimate::scalar("gauge_length_mm", 150.02, 1e-3)};
  const auto id = acceptedAs("assembly-1", assembly).id;
  const auto lengths = results_.measuredFacts().tool_lengths;
  ASSERT_EQ(lengths.size(), 1U);
  EXPECT_EQ(lengths.front().result_id, id);
  EXPECT_EQ(lengths.front().tool, 1U);
  EXPECT_EQ(lengths.front().length_mm, 150.02);
  EXPECT_EQ(lengths.front().sd_mm, 1e-3);

  procedure::Facts facts;
  facts.probe_tools = {.count = 2, .numbers = {1, 2}, .lengths_mm = {150, 200}};
  facts.probe_shank = procedure::ProbeShank{.tool = 1, .tip_length_mm = 150, .height_mm = 50};
  facts.takeLength(1, 150.02, id, 1e-3);
  EXPECT_EQ(facts.lengthOf(1), 150.02);
  EXPECT_EQ(facts.sdOfLength(1), 1e-3);
  EXPECT_EQ(facts.sdOfLength(2), 0) << "not stated";
  EXPECT_EQ(facts.lengthResultOf(1), id);
  EXPECT_EQ(facts.probe_tools.lengthOf(1), 150.02);
  EXPECT_NEAR(facts.probe_shank->length_mm(), 100.02, 1e-12) << "the shank moves with its tip";
  EXPECT_EQ(facts.lengthResultOf(2), 0U) << "machine.toml has its length";
}

TEST_F(Accepting, OfAScrewGivesFaceAndReferenceEachItsSource) {
  procedure::Facts described;
  described.screws[0] = procedure::ScrewFacts{};
  const auto sourceOf = [&](const std::string& name) {
    for (const auto& value : valuesInUse(described, results_.about()))
      if (value.name == name) return value.source;
    return messages::ValueSource::unknown;
  };
  EXPECT_EQ(sourceOf("screw-reference-x"), messages::ValueSource::description);
  const auto face = acceptedAs(
      "screw-x", resultOf("screw-calibration", {Estimate::vector("sector_table_um", {1, -1, 0}, {0.1, 0.3, 0.1})}));
  EXPECT_EQ(sourceOf("screw-x"), messages::ValueSource::result);
  EXPECT_EQ(sourceOf("screw-reference-x"), messages::ValueSource::description) << "the reference is another quantity";
  const auto in_force = results_.measuredFacts().screw_faces[0];
  ASSERT_TRUE(in_force);
  EXPECT_EQ(in_force->result_id, face.id);
  EXPECT_EQ(in_force->sector_um, (std::vector<double>{1, -1, 0}));
  EXPECT_EQ(in_force->sd_um, 0.3);
  acceptedAs("screw-reference-x", resultOf("screw-reference", {Estimate::scalar("reference_um", 4, 0.1)}));
  EXPECT_EQ(sourceOf("screw-reference-x"), messages::ValueSource::result);
  EXPECT_TRUE(inForce("screw-x")) << "the face stays";
}

TEST_F(Accepting, IsNoReasonToRepeatWhatRestsOnAResultThatAgreesWithItsSuccessor) {
  const auto delayOf = [](double tau_s) { return resultOf("delay-plates", {Estimate::scalar("tau_s", tau_s, 4e-6)}); };
  const auto first = acceptedAs("delay", delayOf(0.00385)).id;
  const auto centreline = propose("centreline", centreAt(0.154, -0.11, "centreline-by-steps"), {.rests_on = {first}});
  ASSERT_TRUE(results_.accept(centreline, "Ada"));
  EXPECT_THAT(acceptedAs("delay", delayOf(0.003853)).notes, IsEmpty()) << "3 us, and u is 4 us";
  EXPECT_THAT(results_.toRepeat(), IsEmpty());
  EXPECT_THAT(acceptedAs("delay", delayOf(0.003856)).notes, testing::SizeIs(1)) << "6 us from the first";
  EXPECT_THAT(results_.toRepeat(), testing::SizeIs(1));
}

TEST_F(Accepting, SaysThatTheUncertaintyGrows) {
  const auto delayOf = [](double u_s) {
    auto tau = Estimate::scalar("tau_s", 0.00385, 4e-6);
    tau.uncertainty = {u_s};
    return resultOf("delay-plates", {tau});
  };
  acceptedAs("delay", delayOf(4e-6));
  EXPECT_THAT(acceptedAs("delay", delayOf(5e-6)).notes, IsEmpty());
  EXPECT_THAT(acceptedAs("delay", delayOf(2e-5)).notes, ElementsAre(HasSubstr("from 5e-06 to 2e-05")));
  EXPECT_THAT(acceptedAs("delay", delayOf(4e-6)).notes, IsEmpty());
}

TEST_F(Accepting, AndGoingBackNameWhatRestsOnTheRetired) {
  const auto delayOf = [](double tau_s) { return resultOf("delay-plates", {Estimate::scalar("tau_s", tau_s, 4e-6)}); };
  const auto first = acceptedAs("delay", delayOf(0.00385)).id;
  const auto centreline = propose("centreline", centreAt(0.154, -0.11, "centreline-by-steps"), {.rests_on = {first}});
  ASSERT_TRUE(results_.accept(centreline, "Ada"));
  const auto sentence =
      HasSubstr("Result " + std::to_string(centreline) + " about centreline rests on a retired result");
  EXPECT_THAT(acceptedAs("delay", delayOf(0.00386)).notes, ElementsAre(sentence));
  const auto back = results_.rollBack(std::string{"delay"}, "Ada");
  ASSERT_TRUE(back);
  EXPECT_THAT(back->notes, IsEmpty()) << "it rests on the one that is in force again";
  const auto none = results_.rollBack(first, "Ada");
  ASSERT_TRUE(none);
  EXPECT_THAT(none->notes, ElementsAre(sentence));
  EXPECT_THAT(results_.toRepeat(), ElementsAre(sentence));
}

TEST_F(Accepting, SaysWhatStandsAgainstAResultOfAnotherProbe) {
  auto elsewhere = results_.bindingFor("centreline");
  elsewhere.probe_serial_number = "P-2002";
  elsewhere.mounting = "turret";
  const auto id = store_.propose(elsewhere, centreAt(0.154, -0.11), "", "2026-01-01T00:00:00Z").value();
  const auto why = results_.whyNotInForce(store_.find(id).value());
  ASSERT_TRUE(why);
  EXPECT_THAT(*why, AllOf(HasSubstr("P-2002"), HasSubstr("P-1001")));
  EXPECT_EQ(results_.accept(id, "Ada").error().what, *why);
  const auto here = acceptedAs("centreline", centreAt(0.154, -0.11, "centreline-by-steps"));
  EXPECT_FALSE(results_.whyNotInForce(here));
}

TEST_F(Accepting, IsRememberedWhateverBecomesOfTheResult) {
  const auto first = acceptedAs("centreline", centreAt(0.154, -0.11)).id;
  const auto second = propose("centreline", centreAt(0.154, -0.11));
  EXPECT_TRUE(results_.wasAccepted(first));
  EXPECT_FALSE(results_.wasAccepted(second));
  ASSERT_TRUE(results_.rollBack(first, "Ada"));
  EXPECT_TRUE(results_.wasAccepted(first));
}

TEST_F(Accepting, NamesTheSourceOfTheDelayAndOfTheLengthsOfTheProbesTools) {
  procedure::Facts described;
  described.probe_tools = {.count = 2, .numbers = {1, 2}, .lengths_mm = {150, 200}};
  const auto sourceOf = [&](const std::string& name) {
    for (const auto& value : valuesInUse(described, results_.about()))
      if (value.name == name) return static_cast<int>(value.source);
    return -1;
  };
  EXPECT_EQ(sourceOf("delay"), static_cast<int>(messages::ValueSource::unknown));
  acceptedAs("delay", resultOf("delay-plates", {Estimate::scalar("tau_s", 0.004, 4e-6)}));
  EXPECT_EQ(sourceOf("delay"), static_cast<int>(messages::ValueSource::result));
  auto assembly = resultOf("tool-assembly", {Estimate::scalar("assembled_length_mm", 88, 1e-3)});
  assembly.also = {Estimate::scalar("gauge_length_mm", 150.02, 1e-3)};
  acceptedAs("assembly-1", assembly);
  EXPECT_EQ(sourceOf("assembly-1"), static_cast<int>(messages::ValueSource::result));
  EXPECT_EQ(sourceOf("assembly-2"), static_cast<int>(messages::ValueSource::description));
}

TEST_F(Accepting, DuringACutChangesNothingAndTheSumWaitsToo) {
  acceptedAs("centreline-stylus", centreAt(0.174, -0.1233));
  letCut(true);
  EXPECT_EQ(acceptedAs("stylus-offset-1", offsetOf(0.020, -0.013)).state, store::State::accepted);
  EXPECT_FALSE(inForce("centreline"));
  letCut(false);
  EXPECT_TRUE(inForce("stylus-offset-1"));
  EXPECT_TRUE(inForce("centreline"));
}

}  // namespace
}  // namespace probebox::app
