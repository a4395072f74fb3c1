#include "tools/case/quantities.hpp"

#include <gmock/gmock.h>
#include <numbers>

#include "firmware/metrology/methods.hpp"
#include "tools/case/budget_names.hpp"

namespace probebox::casefolder {
namespace {

using metrology::Estimate;

metrology::Result errorsOfC() {
  metrology::Result result;
  result.method = "rotary-axis-errors";
  const double k60 = std::numbers::pi / 3;
  result.estimates = {Estimate::matrix("six_errors", 6, {0, 0, 0, 0, 0, 0, 0.0012, -0.0034, 0, 1.2e-5, 0, 3e-6},
                                       std::vector<double>(12, 2e-4)),
                      Estimate::vector("location_mm", {0.1, 0.2, 0}, {1e-4, 1e-4, 0}),
                      Estimate::vector("tilt_rad", {1e-5, 2e-5, 0}, {1e-6, 1e-6, 0})};
  for (std::size_t k = 0; k < 12; ++k) result.estimates[0].sd[k] = k % 6 < 3 ? 2e-4 : 1.7e-6;
  result.also = {Estimate::vector("angle_rad", {0, k60}, {})};
  return result;
}

TEST(Quantities, OfARotaryAxisAreNamedAsInIso230) {
  const auto all = quantitiesOf(errorsOfC(), "C");
  ASSERT_EQ(all.size(), 18U);
  EXPECT_EQ(all[0].label.name, "deviation XC at 0 deg");
  EXPECT_EQ(all[6].label.name, "deviation XC at 60 deg");
  EXPECT_EQ(all[6].key, "deviation_XC_at_60_deg_mm") << "as the box names it";
  EXPECT_EQ(withSdAndU(all[6]), "1.20 um, sd 0.20 um");
  EXPECT_EQ(all[9].label.name, "deviation AC at 60 deg");
  EXPECT_EQ(withSdAndU(all[9]), "12.0 urad, sd 1.7 urad");
  EXPECT_EQ(all[12].label.name, "XOC");
  EXPECT_EQ(all[16].label.name, "BOC");
  EXPECT_EQ(all[16].label.unit, "urad");
}

TEST(Quantities, AreNamedAlikeFromTheirKeysAlone) {
  for (const auto& quantity : quantitiesOf(errorsOfC(), "C")) {
    const auto label = quantityLabel(quantity.key, "C");
    EXPECT_EQ(label.name, quantity.label.name);
    EXPECT_EQ(label.unit, quantity.label.unit);
    EXPECT_EQ(label.factor, quantity.label.factor);
  }
  EXPECT_EQ(quantityLabel("pivot_xz_mm[1]").name, "pivot Z");
  EXPECT_EQ(quantityLabel("centre_mm[0]").name, "centre X");
  EXPECT_EQ(quantityLabel("stylus_offset_of_tool_12_mm[1]").name, "stylus offset of tool 12 Y");
  EXPECT_EQ(quantityLabel("comp_um[7]").name, "comp 8") << "no axis of the machine";
  EXPECT_EQ(quantityLabel("gain_matrix[3]").name, "gain Y of a");
  EXPECT_EQ(quantityLabel("gain_matrix[1][0]").name, "gain Y of a");
  EXPECT_EQ(quantityLabel("sector_table_um[7]").name, "sector 7") << "as in table sector_table";
  EXPECT_EQ(quantityLabel("pre_travel_mm[0]").name, "pre-travel across the stylus");
  EXPECT_EQ(quantityLabel("error_at_queries_mm[5]").name, "error Z at query 2");
  EXPECT_EQ(quantityLabel("tau_s").unit, "us");
}

// Pages ask for a value by its key alone, so methods must not disagree about it.
TEST(Quantities, AreTheSameInAllMethods) {
  for (const auto* method : metrology::allMethods()) {
    for (const auto& listed : {method->results, method->further}) {
      for (const auto& quantity : listed) {
        const auto* first = metrology::quantityOf(quantity.key);
        ASSERT_NE(first, nullptr) << method->name << ": " << quantity.key;
        EXPECT_EQ(first->kind, quantity.kind) << method->name << ": " << quantity.key;
        EXPECT_EQ(first->axes, quantity.axes) << method->name << ": " << quantity.key;
        EXPECT_EQ(first->compared, quantity.compared) << method->name << ": " << quantity.key;
        EXPECT_EQ(first->name, quantity.name) << method->name << ": " << quantity.key;
        EXPECT_EQ(first->title, quantity.title) << method->name << ": " << quantity.key;
        EXPECT_EQ(first->of_axis, quantity.of_axis) << method->name << ": " << quantity.key;
        EXPECT_EQ(first->part_name, quantity.part_name) << method->name << ": " << quantity.key;
        EXPECT_EQ(first->columns.size(), quantity.columns.size()) << method->name << ": " << quantity.key;
      }
    }
    for (const auto& quantity : method->results) EXPECT_FALSE(quantity.about.empty()) << quantity.key;
  }
}

TEST(Quantities, OfASwivellingHeadSayWhichAngleAndLength) {
  metrology::Result result;
  result.estimates = {Estimate::matrix("error_at_queries_mm", 3, {0.001, 0.002, 0.003, 0.004, 0.005, 0.006}, {})};
  result.also = {Estimate::vector("query_B_deg", {0, 45}, {}), Estimate::vector("query_L_mm", {100, 150}, {}),
                 Estimate::matrix("left_by_angle_mm", 4, {45, 0.001, 0.002, 0.003}, {}),
                 Estimate::matrix("swivel_terms_mm", 4, std::vector<double>(12, 2e-5), {})};
  EXPECT_EQ(quantitiesOf(result)[5].label.name, "error Z at B 45 deg, L 150 mm");
  const auto left = quantitiesIn(result, result.also[2]);
  EXPECT_EQ(left[0].label.unit, "deg") << "an angle is no length";
  EXPECT_EQ(left[3].label.name, "left Z at B 45 deg");
  EXPECT_EQ(withUncertainty(left[3].label, left[3].value, {}), "3 um");
  const auto terms = quantitiesIn(result, result.also[3]);
  EXPECT_EQ(terms[5].label.name, "Y, factor of L sin B");
  EXPECT_EQ(withUncertainty(terms[5].label, terms[5].value, {}), "20 um/m") << "mm per mm of the tool";
  EXPECT_EQ(withUncertainty(terms[4].label, terms[4].value, {}), "0.02 um");
}

TEST(Quantities, ShowATimeAsATimeAndNoNegativeZero) {
  EXPECT_EQ(withUncertainty(labelOf("measured_at_s"), 1.79e9, {}), "2026-09-21 14:13:20 UTC");
  EXPECT_EQ(withUncertainty(labelOf("x_mm"), -2e-6, 0.001), "0.0000 +/- 0.0010 mm");
}

// Where an axis stands is read in degrees, as on a control, what it leans in microradians.
TEST(Quantities, ShowNoRadians) {
  EXPECT_EQ(withUncertainty(labelOf("psi0_rad"), std::numbers::pi / 6, 1e-5), "30.00000 +/- 0.00057 deg");
  EXPECT_EQ(labelOf("psi0_rad").name, "psi0");
  EXPECT_EQ(withUncertainty(labelOf("C_shift_rad"), -0.012382, 2e-6), "-0.70944 +/- 0.00011 deg");
  for (const auto* small : {"A_minus_C_rad", "square_error_rad", "C_tilt_rad", "lean_xz_rad"})
    EXPECT_EQ(labelOf(small).unit, "urad") << small;
  EXPECT_EQ(designText("C_shift_rad", 0.5, "the middle of one pair of contacts, rad"),
            "C_shift is 0.5 times that of the middle of one pair of contacts");
}

TEST(Quantities, PrintNoZerosForNothing) {
  EXPECT_EQ(withUnit(labelOf("x_mm"), 3e-20), "0 mm");
  EXPECT_EQ(shareText(labelOf("x_mm"), 2e-12, 1e-3), "0 mm") << "what rounding leaves of nothing";
  EXPECT_EQ(shareText(labelOf("x_mm"), 2e-6, 1e-3), "0.0000020 mm");
}

TEST(Quantities, SayWhatTheNamesOfErrorsMean) {
  metrology::Result result;
  result.estimates = {Estimate::vector("location_mm", {0, 0, 0}, {}), Estimate::vector("tilt_rad", {0, 0, 0}, {})};
  EXPECT_EQ(
      axisNamesInWords(result, "C"),
      "Names of ISO 230-7: XOC and YOC are the errors of the position of C in the X and Y directions; AOC and BOC "
      "are the errors of the orientation of C around X and Y.");
  result.estimates.push_back(Estimate::matrix("six_errors", 6, std::vector<double>(6), {}));
  EXPECT_THAT(axisNamesInWords(result, "B"), testing::AllOf(testing::HasSubstr("EYB"), testing::HasSubstr("ECB")));
  EXPECT_EQ(axisNamesInWords(result, ""), "");
  result.estimates.clear();
  EXPECT_EQ(axisNamesInWords(result, "C"), "");
}

TEST(Quantities, SayWhenNoUncertaintyIsKnown) {
  metrology::Result result;
  result.estimates = {Estimate::scalar("radius_mm", 12.5, std::nullopt)};
  EXPECT_EQ(withSdAndU(quantitiesOf(result)[0]), "12.5 mm, sd not known");
  result.estimates = {Estimate::scalar("radius_mm", 12.5, 0.001)};
  result.estimates[0].uncertainty = {0.002};
  EXPECT_EQ(withSdAndU(quantitiesOf(result)[0]), "12.5000 mm, sd 0.0010 mm, U 0.0040 mm");
}

TEST(Quantities, SayWhatIsZeroByDefinition) {
  metrology::Result result;
  result.estimates = {Estimate::vector("location_mm", {-0.0107, 0, 0}, {0.0003, 0.0003, 0})};
  const auto quantities = quantitiesOf(result, "C");
  EXPECT_EQ(withSdAndU(quantities[0]), "-10.70 um, sd 0.30 um") << "errors are read in um";
  EXPECT_EQ(withSdAndU(quantities[1]), "0.00 um, sd 0.30 um") << "measured as zero";
  EXPECT_EQ(withSdAndU(quantities[2]), "0 um by definition");
}

TEST(Quantities, FindTheAxisOfASubject) {
  EXPECT_EQ(rotaryAxisOf("rotary-c"), "C");
  EXPECT_EQ(rotaryAxisOf("rotary-axis-errors"), "");
  EXPECT_EQ(rotaryAxisOf("delay"), "");
}

// Every input of every method, and what stops of axes leave.
TEST(BudgetLines, AreNamedForAPerson) {
  for (const auto& method : metrology::allMethods()) {
    for (const auto& known : method->known)
      EXPECT_NE(budgetName(known.sd_key), known.sd_key) << method->name << ": give it a name in budget_names.cpp";
  }
  EXPECT_EQ(budgetName("sd_effective_diameter_mm"), "certificate of the sphere (sd_effective_diameter_mm)");
  EXPECT_EQ(budgetName("sd_part_mm[2]"), "position of the measuring unit (sd_part_mm[2])");
  EXPECT_EQ(budgetName("stop_of_table"), "stop of the tilting table");
  EXPECT_EQ(budgetName("readings"), "readings");
}

TEST(KeysInWords, HaveAxesInCapitals) {
  EXPECT_EQ(keyInWords("z_offset_error"), "Z offset error");
  EXPECT_EQ(keyInWords("stylus_offset_x"), "stylus offset X");
  EXPECT_EQ(keyInWords("mean_z"), "mean Z");
  EXPECT_EQ(keyInWords("Xcen_B0"), "Xcen B0");
  EXPECT_EQ(keyInWords("extension_xy"), "extension xy");
}

}  // namespace
}  // namespace probebox::casefolder
