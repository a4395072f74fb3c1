#include "tools/report/certificate.hpp"

#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/metrology/dataset/conditions.hpp"
#include "some_facts.hpp"
#include "well_formed.hpp"

namespace probebox::report {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class CalibrationCertificate : public testing::Test {
 protected:
  CalibrationCertificate() {
    result_.method = "delay-known-sphere";
    result_.estimates = {metrology::Estimate::scalar("tau_s", 5.2033e-3, 3e-6)};
    result_.estimates[0].uncertainty = {5e-6};
    result_.dof = 6;
    result_.budget = {{"readings", false, {3e-6}}, {"sd_effective_diameter_mm", true, {4e-6}}};
    result_.conditions = {{"measured_utc", "2026-11-26T08:00:00Z"},
                          {"temperature_c", "20.5"},
                          {"note", "<first>"},
                          {"sphere_certificate", "2026-0417 of Lab: sphere S-1, 25.0001 mm, U = 0.2 um (k = 2)"},
                          {"sphere_next_due", "2028-04-17"}};
  }
  std::string page() const {
    Subject subject{"result 17", result_.method, {}, result_};
    subject.rests_on = rests_on_;
    const auto text = certificatePage(subject, facts_, "1.2.3");
    EXPECT_EQ(WellFormed::objectionTo(text), "");
    return text;
  }
  void forget(std::string_view name) {
    std::erase_if(result_.conditions, [&](const auto& condition) { return condition.name == name; });
  }

  metrology::Result result_;
  std::vector<std::string> rests_on_;
  CertificateFacts facts_ = someFacts();
};

TEST_F(CalibrationCertificate, StatesTheMeasurandWithItsUncertaintyAndCoverage) {
  const auto text = page();
  EXPECT_THAT(
      text, HasSubstr("<td>delay</td><td class=\"n\">5203</td><td>\u00b5s</td><td class=\"n\">5.0</td>"
                      "<td class=\"n\">2</td><td class=\"n\">10</td><td class=\"n\">80</td><td class=\"n\">96.4 %</td>"
                      "<td class=\"n\">64.0 %</td>"))
      << "6 (1 + ((5 / 3)^2 - 1) 6 / 4)^2 = 80.7 degrees of freedom; (4 / 5)^2 of u^2 is the sphere's";
  for (const auto* words : {"PB-1-17", "Acme &amp; Co, PB-1", "mill 3", "P-9, spindle", "2026-11-26T08:00:00Z",
                            "20.5 \u00b0C", "by Ada, 2026-11-26T09:00:00Z", "Grace", "2027-11-26", "&lt;first&gt;",
                            "sd_effective_diameter_mm", "(A12)", "measurand", "coverage probability", "2028-04-17"})
    EXPECT_THAT(text, HasSubstr(words));
}

// ISO/IEC 17025:2017, 7.8.2.1: what a laboratory has to state stands there, in its words, and what it left out says so.
TEST_F(CalibrationCertificate, HasTheTemplateOfTheLaboratory) {
  const auto stated = board::parseParties(R"(
[laboratory]
name = "Shop <metrology>"
email = "lab@shop.example"
city = "Town"
country = "DE"
address = "Mill Lane 1"
accreditation = "D-K-00000-01"
[customer]
name = "Turner Ltd"
email = "office@turner.example"
city = "Village"
country = "AT"
[calibration]
place = "Hall 2"
item = "Mill-turn MT-1, serial number 4711"
environment = "20.3 +/- 0.5 degrees"
)",
                                          "parties.toml");
  ASSERT_TRUE(stated) << stated.error().what;
  Subject subject{"result 17", result_.method, {}, result_};
  subject.before.in_force = Earlier{"result 12", "2026-10-01T08:00:00Z", result_};
  subject.before.in_force->result.estimates[0].values[0] -= 40e-6;
  const auto text = certificatePage(subject, facts_, "1.2.3", &*stated);
  EXPECT_EQ(WellFormed::objectionTo(text), "");
  for (const auto* words : {"Shop &lt;metrology&gt;, Mill Lane 1, Town, DE", "D-K-00000-01", "Turner Ltd", "Hall 2",
                            "serial number 4711", "20.3 \u00b1 0.5 degrees", "result 12"})
    EXPECT_THAT(text, HasSubstr(words));
  EXPECT_THAT(text, HasSubstr("<td>received</td><td>not stated</td>"));
  EXPECT_THAT(text, HasSubstr("<td>delay</td><td class=\"n\">5163</td><td class=\"n\">5203</td>"))
      << "as found, as left";
  // Without a template it claims nothing of the kind.
  EXPECT_THAT(page(), AllOf(Not(HasSubstr("<td>laboratory</td>")), HasSubstr("no certificate of an accredited")));
}

TEST_F(CalibrationCertificate, RefusesATemplateWithWhatItDoesNotKnow) {
  const auto stated = board::parseParties(
      "[laboratory]\nname=\"L\"\nemail=\"e\"\ncity=\"c\"\ncountry=\"DE\"\nlogo=\"x\"\n"
      "[customer]\nname=\"L\"\nemail=\"e\"\ncity=\"c\"\ncountry=\"de\"\n",
      "parties.toml");
  ASSERT_FALSE(stated);
  EXPECT_THAT(stated.error().what, AllOf(HasSubstr("parties.toml:6"), HasSubstr("logo"), HasSubstr("parties.toml:11")));
}

TEST_F(CalibrationCertificate, NamesBothDegreesOfFreedom) {
  EXPECT_THAT(page(), AllOf(HasSubstr("<th class=\"n\">effective degrees of freedom \u03bd_eff</th>"),
                            HasSubstr("here 6"), HasSubstr("\u03bd = 6")));
  result_.chi2_reduced = 1;  // held against stated noise
  EXPECT_THAT(page(), AllOf(HasSubstr("here \u221e,"), HasSubstr("\u03bd = 6")));
}

// A budget line of its own: the certificate says nothing of the stylus ball.
TEST_F(CalibrationCertificate, DoesNotCreditTheStylusBallToTheSphere) {
  result_.budget = {{"readings", false, {3e-6}},
                    {"sd_effective_diameter_mm", true, {1e-6}},
                    {"sd_stylus_ball_diameter_mm", true, {std::sqrt(15e-12)}}};
  EXPECT_THAT(page(), HasSubstr("<td class=\"n\">4.0 %</td>"));
}

TEST_F(CalibrationCertificate, SaysWhatItTakesTheSphereToBeWhereNoTemperatureIsStated) {
  EXPECT_THAT(page(), Not(HasSubstr("20 \u00b0C")));
  forget("temperature_c");
  EXPECT_THAT(page(), HasSubstr("20 \u00b0C"));
}

TEST_F(CalibrationCertificate, NamesTheCertificateThatItIsTraceableTo) {
  EXPECT_FALSE(whyNotTraceable(result_, facts_));
  EXPECT_THAT(page(), HasSubstr("<p>Traceable to the certificate of the reference sphere, as far as u rests on it</p>"
                                "<ul><li>2026-0417 of Lab"));
  EXPECT_THAT(page(), HasSubstr("scales of"));
  EXPECT_THAT(page(), Not(HasSubstr("NOT TRACEABLE")));
}

// The clock of a box that was never set says 1970.
TEST_F(CalibrationCertificate, IsNotTraceableToACertificateThatCameAfterTheMeasurement) {
  forget("sphere_certificate");
  result_.conditions.push_back(
      {"sphere_certificate", "2026-0417 of Lab, Hall 2, 2026-04-17: sphere S-1, 25.0001 mm, U = 0.2 um (k = 2)"});
  EXPECT_FALSE(whyNotTraceable(result_, facts_));
  forget("measured_utc");
  result_.conditions.push_back({"measured_utc", "1970-01-01T00:05:12Z"});
  EXPECT_THAT(page(), AllOf(HasSubstr("<p>NOT TRACEABLE</p>"), HasSubstr("1970-01-01"), HasSubstr("2026-04-17")));
}

TEST_F(CalibrationCertificate, SaysWhatTheValuesAreOfAndWhereTheyHold) {
  EXPECT_THAT(page(), HasSubstr("later than"));
  result_.method = "c-axis-alignment";
  result_.also = {metrology::Estimate::scalar("mean_z_mm", 155.0, std::nullopt)};
  facts_.subject = "centreline-stylus";
  EXPECT_THAT(page(), AllOf(HasSubstr("tip of the stylus with"), HasSubstr("A = 0"), HasSubstr("155")));
  facts_.subject = "centreline";
  EXPECT_THAT(page(), Not(HasSubstr("tip of the stylus with")));
  for (const auto* known : {"screw-reference-x", "screw-x", "tool-4", "rotary-c"}) {
    facts_.subject = known;
    EXPECT_THAT(page(), HasSubstr("<td>measurand</td>")) << known;
  }
}

TEST_F(CalibrationCertificate, OfAMeasurementWithoutADateIsNotTraceable) {
  EXPECT_FALSE(whyNotTraceable(result_, facts_));
  forget("measured_utc");
  result_.conditions.push_back({"measured_utc", "unknown, 12 s after start 7"});
  EXPECT_TRUE(whyNotTraceable(result_, facts_));
  forget("sphere_next_due");
  EXPECT_TRUE(whyNotTraceable(result_, facts_));
}

TEST_F(CalibrationCertificate, SaysAtTheTopThatItIsNotTraceable) {
  forget("sphere_certificate");
  const auto text = page();
  const auto at = text.find("<p>NOT TRACEABLE</p>");
  ASSERT_NE(at, std::string::npos);
  EXPECT_LT(at, text.find("<h2>"));
  EXPECT_THAT(text, HasSubstr(whyNotTraceable(result_, facts_).value()));
}

// Its sd is in the budget where it is stated; a value of 0 that nobody stated has to be seen.
TEST_F(CalibrationCertificate, SaysWhetherTheSdOfTheStylusBallIsStatedOrAssumed) {
  const auto withBall = [&](const std::string& words) {
    forget(metrology::kStylusBall);
    result_.conditions.push_back({std::string{metrology::kStylusBall}, words});
    return page();
  };
  const std::string stated = "diameter 6 mm, sd 0.0005 mm (k = 1), as stated in probe.toml";
  auto text = withBall(stated);
  EXPECT_THAT(text, HasSubstr("<td>stylus ball</td><td>" + stated + "</td>"));
  EXPECT_THAT(text, Not(HasSubstr("Stylus ball")));
  const std::string assumed = "diameter 6 mm, sd not stated, " + std::string{metrology::kAssumedExact};
  text = withBall(assumed);
  EXPECT_THAT(text, HasSubstr("<td>stylus ball</td><td>" + assumed + "</td>"));
  const auto at_the_top = text.find("<li>Stylus ball: " + assumed);
  ASSERT_NE(at_the_top, std::string::npos);
  EXPECT_LT(at_the_top, text.find("<h2>"));
  forget(metrology::kStylusBall);
  EXPECT_THAT(page(), HasSubstr("<td>stylus ball</td><td>not on record"));
  result_.method = "centreline";
  EXPECT_THAT(page(), HasSubstr("<td>stylus ball</td><td>the values do not rely on its diameter</td>"));
}

TEST_F(CalibrationCertificate, OfASphereThatWasOverdueIsNotTraceable) {
  result_.conditions[0].value = "2028-04-16T23:59:59Z";
  EXPECT_FALSE(whyNotTraceable(result_, facts_));
  result_.conditions[0].value = "2028-04-17T00:00:00Z";
  ASSERT_TRUE(whyNotTraceable(result_, facts_));
  EXPECT_THAT(*whyNotTraceable(result_, facts_), HasSubstr("2028-04-17"));
  forget("measured_utc");
  EXPECT_FALSE(whyNotTraceable(result_, facts_)) << "stored before";
  facts_.stored_utc = "2029-01-01T00:00:00Z";
  EXPECT_TRUE(whyNotTraceable(result_, facts_));
}

TEST_F(CalibrationCertificate, OfStatedNoiseWithoutSpareReadingsHasACoverage) {
  result_.dof = 0;
  EXPECT_THAT(page(), HasSubstr("<td class=\"n\">\u221e</td><td class=\"n\">95.4 %</td>"));
}

// A result does not keep the firmware that measured it, which may have been another one.
TEST_F(CalibrationCertificate, NamesTheFirmwareAsThatOfItsIssue) {
  const auto text = page();
  EXPECT_THAT(text, HasSubstr("<td>issued from a box with firmware</td><td>9.8.7</td>"));
  EXPECT_THAT(text, HasSubstr("<td>measured with</td><td>Acme &amp; Co, PB-1</td>"));
}

// A check is held against limits: what it answers stands before all else, and by which rule.
class CertificateOfACheck : public CalibrationCertificate {
 protected:
  CertificateOfACheck() {
    auto x = metrology::Estimate::scalar("deviation_Xcen_B0_mm", 0.0081, 0.0004),
         z = metrology::Estimate::scalar("deviation_z_offset_error_mm", -0.0061, 0.0005);
    x.uncertainty = {0.0007};
    z.uncertainty = {0.0005};
    result_.method = "periodic-check";
    result_.estimates = {metrology::Estimate::scalar("Xcen_B0_mm", 12.0081, 0.0004),
                         metrology::Estimate::scalar("z_offset_error_mm", -0.0061, 0.0005)};
    result_.also = {x, z, metrology::Estimate::scalar("verdict", 1, std::nullopt)};
    result_.warnings = {"not proven: Xcen_B0_mm is 0.0081 mm off the accepted value"};
    dataset_.method = "periodic-check";
    dataset_.config["limit_mm"] = 0.0125;
    dataset_.config["limit_Xcen_B0_mm"] = 0.0075;
    facts_.subject = "check";
  }
  std::string pageAbout(const std::string& subject, bool kept = true) const {
    Subject of{"result 17", result_.method, {}, result_};
    if (kept) of.dataset = dataset_;
    of.about = subject;
    const auto text = certificatePage(of, facts_, "1.2.3");
    EXPECT_EQ(WellFormed::objectionTo(text), "");
    return text;
  }
  metrology::Dataset dataset_;
};

TEST_F(CertificateOfACheck, GivesDeviationLimitAndVerdictOfEveryValueAndTheRule) {
  const auto text = pageAbout("check");
  const auto verdict =
      text.find("<div class=\"verdict warned\"><p>NOT PROVEN: the limit lies within U, or U is unknown</p>");
  ASSERT_NE(verdict, std::string::npos) << text;
  EXPECT_LT(verdict, text.find("Traceable to"));
  EXPECT_THAT(text, AllOf(HasSubstr("limit 7.5 \u00b5m"), HasSubstr("ISO 14253-1")));
  EXPECT_THAT(text, HasSubstr("<td>Xcen B0, mean X of the ball at B = 0</td><td class=\"n\">8.1</td>"
                              "<td class=\"n\">1.4</td><td class=\"n\">7.5</td><td>\u00b5m</td><td>NOT PROVEN</td>"));
  EXPECT_THAT(text,
              HasSubstr("<td class=\"n\">-6.1</td><td class=\"n\">1.0</td><td class=\"n\">12.5</td><td>\u00b5m</td>"
                        "<td>PASS</td>"))
      << "a limit is not rounded";
  EXPECT_THAT(pageAbout("check", false), AllOf(HasSubstr("<td class=\"n\">not kept</td>"), HasSubstr("NOT PROVEN")));
}

TEST_F(CertificateOfACheck, ProvesNothingOfAValueWhoseUIsUnknown) {
  result_.also[1].sd.clear();
  result_.also[1].uncertainty.clear();
  EXPECT_THAT(pageAbout("check"), HasSubstr("<td class=\"n\">unknown</td><td class=\"n\">12.5</td><td>\u00b5m</td>"
                                            "<td>NOT PROVEN</td>"));
}

// Its readings give the offset of the stylus too, which was held against nothing.
TEST_F(CertificateOfACheck, IsNoVerdictOnAnotherResultOfItsReadings) {
  EXPECT_THAT(pageAbout("stylus-offset-1"), AllOf(Not(HasSubstr("NOT PROVEN:")), Not(HasSubstr("Decision rule"))));
}

TEST_F(CalibrationCertificate, SaysWhatNobodyHasStated) {
  facts_.accepted = facts_.issued_by = facts_.next_due = "";
  rests_on_ = {"It rests on result 3 about delay."};
  forget("temperature_c");
  result_.warnings = {"a touch is late"};
  result_.estimates[0].sd = result_.estimates[0].uncertainty = {};
  const auto text = page();
  EXPECT_THAT(text, HasSubstr("proposal"));
  EXPECT_THAT(text, AllOf(HasSubstr("result 3"), HasSubstr("about delay")));
  EXPECT_THAT(text, HasSubstr("<td>temperature</td><td>not stated</td>"));
  EXPECT_THAT(text, HasSubstr("<td>next calibration due</td><td>not stated</td>"));
  EXPECT_THAT(text, HasSubstr("is late"));
  EXPECT_THAT(text, HasSubstr("<td class=\"n\">unknown</td>"));
}

}  // namespace
}  // namespace probebox::report
