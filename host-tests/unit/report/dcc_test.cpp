#include "tools/report/dcc.hpp"

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/metrology/methods.hpp"
#include "some_facts.hpp"
#include "tools/case/readable.hpp"
#include "well_formed.hpp"

namespace probebox::report {
namespace {

using testing::HasSubstr;
using testing::Not;

class DigitalCertificate : public testing::Test {
 protected:
  DigitalCertificate() {
    result_.method = "delay-known-sphere";
    result_.estimates = {metrology::Estimate::scalar("tau_s", 5.2033e-3, 3e-6)};
    result_.estimates[0].uncertainty = {5e-6};
    result_.dof = 6;
    result_.conditions = {{"measured_utc", "2026-11-26T08:00:00Z"},
                          {"temperature_c", "20.5"},
                          {"sphere_certificate", "2026-0417 of Lab, 2026-04-17: sphere <S-1>, 25.0001 mm"},
                          {"sphere_next_due", "2028-04-17"}};
  }
  Outcome<std::string> document() const {
    return dccDocument({"result 17", result_.method, {}, result_}, facts_, parties_, "1.2.3");
  }
  std::string text() const {
    const auto written = document();
    EXPECT_TRUE(written);
    const auto all = written ? *written : std::string{};
    EXPECT_EQ(WellFormed::objectionTo(all.substr(all.find('\n') + 1)), "");
    return all;
  }

  metrology::Result result_;
  CertificateFacts facts_ = someFacts();
  board::Parties parties_{.laboratory = {"Shop metrology", "lab@shop.example", "Town", "DE"},
                          .customer = {"Shop", "shop@shop.example", "Town", "DE"}};
};

TEST_F(DigitalCertificate, StatesValuesWithExpandedUncertaintyInUnitsOfTheSi) {
  const auto all = text();
  EXPECT_THAT(all, HasSubstr("<si:value>5203</si:value>\n<si:unit>\\micro\\second</si:unit>"));
  EXPECT_THAT(all, HasSubstr("<si:uncertainty>10</si:uncertainty>\n<si:coverageFactor>2</si:coverageFactor>"));
  EXPECT_THAT(all, HasSubstr("<dcc:beginPerformanceDate>2026-11-26</dcc:beginPerformanceDate>"));
  EXPECT_THAT(all, HasSubstr("<dcc:traceable>true</dcc:traceable>"));
}

TEST_F(DigitalCertificate, SaysWhatIsNotTraceable) {
  std::erase_if(result_.conditions, [](const auto& each) { return each.name == "sphere_certificate"; });
  EXPECT_THAT(text(), HasSubstr("<dcc:traceable>false</dcc:traceable>"));
}

// What a reader of the page is warned of, a reader of the XML is too.
TEST_F(DigitalCertificate, HasTheReservationsOfThePage) {
  facts_.accepted.clear();
  std::erase_if(result_.conditions, [](const auto& each) { return each.name == "temperature_c"; });
  result_.warnings = {"a < b"};
  const Subject subject{"result 17", result_.method, {}, result_};
  const auto all = text();
  EXPECT_EQ(reservationsAbout(subject, facts_).size(), 3U);
  for (const auto& sentence : reservationsAbout(subject, facts_)) EXPECT_THAT(all, HasSubstr(sentence));
  EXPECT_THAT(all, HasSubstr("a &lt; b"));
}

TEST_F(DigitalCertificate, SaysWhereTheValuesHold) {
  result_.also = {metrology::Estimate::scalar("mean_z_mm", 12.5, 0.001)};
  EXPECT_THAT(text(), HasSubstr("<si:value>12.5"));
}

TEST_F(DigitalCertificate, IsNotWrittenWithoutADayOrAPerson) {
  result_.conditions[0].value = "unknown, 12 s after start 7";
  EXPECT_FALSE(document());
  result_.conditions[0].value = "2026-11-26T08:00:00Z";
  facts_.issued_by.clear();
  EXPECT_FALSE(document());
}

// Every key that a method answers with has a unit of D-SI.
TEST_F(DigitalCertificate, KnowsTheUnitsOfAllMethods) {
  for (const auto name : metrology::methods()) {
    for (const auto& key : metrology::methodNamed(name)->keys) {
      if (casefolder::labelOf(key.name).unit == "UTC") continue;
      result_.method = name;
      result_.estimates = {metrology::Estimate::scalar(std::string{key.name}, 0.001, 1e-5)};
      EXPECT_THAT(text(), Not(HasSubstr("noQuantity"))) << name << " " << key.name;
    }
  }
}

// The schema is PTB's and not in this tree: PROBEBOX_DCC_SCHEMA names a dcc.xsd of version 3.1.2.
TEST_F(DigitalCertificate, FollowsTheSchema) {
  const char* schema = std::getenv("PROBEBOX_DCC_SCHEMA");
  if (schema == nullptr) GTEST_SKIP() << "PROBEBOX_DCC_SCHEMA names no schema";
  result_.warnings = {"a < b"};
  const auto file = std::filesystem::path{testing::TempDir()} / "certificate.xml";
  std::ofstream{file} << text();
  EXPECT_EQ(std::system(("xmllint --noout --schema " + std::string{schema} + " " + file.string()).c_str()), 0);
}

}  // namespace
}  // namespace probebox::report
