#include "accepting.hpp"

// A screw's result with a gain, and one of its face alone.
namespace probebox::app {
namespace {

using metrology::Estimate;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

metrology::Result faceFrom(double first_um) {
  return resultOf("screw-calibration", {Estimate::vector("sector_table_um", {first_um, -first_um}, {0.1, 0.1})});
}

metrology::Result gainAndFace(double gain) {
  auto result = faceFrom(1);
  result.estimates.push_back(Estimate::scalar("K", gain, 0.01));
  return result;
}

TEST_F(Accepting, OfAFaceAloneSaysThatAMeasuredGainIsReplaced) {
  const auto says_so = AllOf(HasSubstr("0.8 of"), HasSubstr("result 1"), HasSubstr("machine.toml"));
  EXPECT_THAT(acceptedAs("screw-x", gainAndFace(0.8)).notes, Not(Contains(HasSubstr("machine.toml"))));
  const auto next = propose("screw-x", faceFrom(1.1));
  EXPECT_THAT(results_.compareOnly(next)->notes, Contains(says_so)) << "before it is accepted";
  EXPECT_THAT(results_.accept(next, "Ada")->notes, Contains(says_so));
  EXPECT_THAT(acceptedAs("screw-x", faceFrom(1.2)).notes, Not(Contains(HasSubstr("machine.toml"))))
      << "there is none any more";
  EXPECT_THAT(acceptedAs("screw-x", gainAndFace(0.9)).notes, Not(Contains(HasSubstr("machine.toml"))));
}

// Later runs are as uncertain as the check of the machine has found it to err.
TEST_F(Accepting, OfAMachineCheckTakesItsErrorsIntoTheBudgetsOfLaterRuns) {
  EXPECT_THAT(results_.measuredFacts().machine_errors, testing::IsEmpty());
  auto check = resultOf("machine-check", {Estimate::vector("lost_motion_mm", {0.003, -0.004, 0.001}, {0, 0.003, 0})});
  check.estimates.push_back(Estimate::vector("machine_drift_um_per_min", {0.1, 0.2, -0.3}, {0, 0, 0}));
  acceptedAs("machine", check);
  std::map<std::string, double> found;
  for (const auto& [error, value] : results_.measuredFacts().machine_errors) found[error->key] = value;
  EXPECT_THAT(found, testing::ElementsAre(testing::Pair("drift_um_per_min", testing::DoubleNear(0.3, 1e-12)),
                                          testing::Pair("lost_motion_um", testing::DoubleNear(5, 1e-12))));
}

}  // namespace
}  // namespace probebox::app
