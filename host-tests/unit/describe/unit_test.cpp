#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>

#include "board/describe/parse.hpp"
#include "board/describe/start_files.hpp"
#include "problems.hpp"

// The identity of a box, which arrives from a file and over links.
namespace probebox::board {
namespace {

using testing::HasSubstr;

const std::string kGood{startFile("unit.toml")};

std::string unitProblem(std::string_view from, std::string_view to) {
  return problemOf(parseUnit(exchanged(kGood, from, to), "unit.toml"));
}

TEST(UnitToml, ThatABoardStartsWithIsGood) {
  const auto unit = parseUnit(kGood, "unit.toml");
  ASSERT_TRUE(unit.ok()) << unit.error().what;
  EXPECT_EQ(unit->serial_number, "PB-000123");
  EXPECT_EQ(unit->usb_vendor_id, 0x1209);
  EXPECT_EQ(unit->usb_product_id, 1);
  ASSERT_TRUE(unit->sphere);
  EXPECT_EQ(unit->sphere->diameter_mm, 25.00018);
  EXPECT_EQ(unit->sphere->sd_mm(), 1e-4);
  EXPECT_EQ(unit->sphere->inWords(),
            "2026-0417 of Laboratory, 2026-04-17: sphere S-4711, 25.00018 mm, U = 0.2 um (k = 2)");
  EXPECT_TRUE(unit->update_keys.empty());
}

TEST(UnitToml, NamesWhatIsWrongWithTheRemedy) {
  EXPECT_THAT(unitProblem("vendor_id", "vendr_id"), HasSubstr("'vendor_id'?"));
  EXPECT_THAT(unitProblem("model = \"Probe box 1\"", ""),
              testing::AllOf(HasSubstr("missing"), HasSubstr("'unit.model'")));
  EXPECT_THAT(unitProblem("0x1209", "0"), HasSubstr("'usb.vendor_id' = 0"));
  EXPECT_THAT(unitProblem("0x0001", "65536"), HasSubstr("'usb.product_id' = 65536"));
  EXPECT_THAT(unitProblem("25.00018", "nan"), HasSubstr("'sphere.diameter_mm' = nan"));
  EXPECT_THAT(unitProblem("25.00018", "-25"), HasSubstr("range"));
  EXPECT_THAT(unitProblem("0.20 ", "0.0 "), HasSubstr("'sphere.expanded_uncertainty_um' = 0"));
  EXPECT_THAT(unitProblem("coverage_factor = 2", "coverage_factor = 0.5"), HasSubstr("range"));
  EXPECT_THAT(unitProblem("\"2028-04-17\"", "\"2026-04-17\""), HasSubstr("'sphere.date'"));
  EXPECT_THAT(unitProblem("\"2028-04-17\"", "2028-04-17"), HasSubstr("a text"));
  for (const auto* day : {"2027-02-29", "2028-13-01", "28-04-17", "2028-04-17T00:00", "2028/04/17", "0000-01-01"})
    EXPECT_THAT(unitProblem("2028-04-17", day), HasSubstr("no day")) << day;
}

// Serial number, vendor and model go through a script of root and into the kernel.
TEST(UnitToml, TakesPlainTextAlone) {
  for (const auto* text : {"PB\\n1", "PB\\u0000", "PB\\u202e1", "PB\\u00e9", "", "   ", "PB\\u001b[31m"})
    EXPECT_THAT(unitProblem("PB-000123", text), HasSubstr("'unit.serial_number'")) << text;
  EXPECT_THAT(unitProblem("PB-000123", std::string(101, 'x')), HasSubstr("100"));
  EXPECT_THAT(unitProblem("\"Laboratory\"", "\"a\\tb\""), HasSubstr("'sphere.laboratory'"));
}

TEST(UnitToml, TakesFingerprintsAsOpensslPrintsThem) {
  const auto with = [](const std::string& key) { return kGood + "[trust]\nupdate_keys = [\"" + key + "\"]\n"; };
  std::string colons = "AB", digits = "ab";
  for (int i = 1; i < 32; ++i) colons += ":CD", digits += "cd";
  const auto unit = parseUnit(with(colons), "unit.toml");
  ASSERT_TRUE(unit.ok()) << unit.error().what;
  EXPECT_THAT(unit->update_keys, testing::ElementsAre(digits));
  for (const auto& key : {std::string(63, 'a'), std::string(65, 'a'), std::string(64, 'g')})
    EXPECT_THAT(problemOf(parseUnit(with(key), "unit.toml")), HasSubstr("SHA-256"));
}

TEST(UnitToml, MayLeaveTheSphereOut) {
  const auto unit = parseUnit(kGood.substr(0, kGood.find("# The calibrated sphere")), "unit.toml");
  ASSERT_TRUE(unit.ok()) << unit.error().what;
  EXPECT_FALSE(unit->sphere);
}

class Applied : public testing::Test {
 protected:
  Unit unit_ = parseUnit(kGood, "unit.toml").value();
  Descriptions descriptions_ = simDescriptions().value();
};

TEST_F(Applied, ReplacesTheIdentity) {
  applyUnit(unit_, descriptions_);
  EXPECT_EQ(descriptions_.box.serial_number, "PB-000123");
  EXPECT_EQ(descriptions_.box.usb.manufacturer, "My company");
  EXPECT_EQ(descriptions_.box.usb.product, "Probe box 1");
}

TEST_F(Applied, GivesTheSphereToAMachineThatDescribesNoneOrTheSame) {
  for (const auto described_mm : {std::optional<double>{}, std::optional{25.00018}, std::optional{25.00038}}) {
    descriptions_.machine.datum_sphere_diameter_mm = described_mm;
    descriptions_.machine.datum_sphere_certificate.reset();
    EXPECT_FALSE(applyUnit(unit_, descriptions_));
    EXPECT_EQ(descriptions_.machine.datum_sphere_diameter_mm, 25.00018);
    ASSERT_TRUE(descriptions_.machine.datum_sphere_certificate);
  }
}

TEST_F(Applied, LeavesAnotherSphereOfTheMachineAloneAndSaysSo) {
  for (const double described_mm : {25.00039, 24.99997, 20.0}) {
    descriptions_.machine.datum_sphere_diameter_mm = described_mm;
    const auto note = applyUnit(unit_, descriptions_);
    ASSERT_TRUE(note) << described_mm;
    EXPECT_THAT(*note, testing::AllOf(HasSubstr("not traceable"), HasSubstr("the section")));
    EXPECT_EQ(descriptions_.machine.datum_sphere_diameter_mm, described_mm);
    EXPECT_FALSE(descriptions_.machine.datum_sphere_certificate);
  }
}

}  // namespace
}  // namespace probebox::board
