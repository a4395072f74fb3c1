#include <fstream>
#include <gmock/gmock.h>
#include <regex>

#include "board/describe/start_files.hpp"
#include "host-tests/support/file_content.hpp"
#include "on_the_machine.hpp"

// From a box without an identity to a certificate of what it measured on its certified sphere.
namespace probebox::command {
namespace {

using support::contentOf;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class Certificates : public OnTheMachine {
 protected:
  std::string certificate(const std::string& id, const std::vector<std::string>& options = {}) {
    const auto path = directory_.file("certificate-" + id + ".html");
    std::vector<std::string> words{"certificate", id, "-o", path};
    words.insert(words.end(), options.begin(), options.end());
    const auto done = box(words);
    EXPECT_EQ(done.status, 0) << done.err;
    return contentOf(path);
  }
  void provision() {
    std::string text{board::startFile("unit.toml")};
    const auto exchange = [&](const std::string& from, const std::string& to) {
      const auto at = text.find(from);
      ASSERT_NE(at, std::string::npos) << from;
      text.replace(at, from.size(), to);
    };
    exchange("my board", "sim");
    exchange("25.00018", "25.0001");
    exchange("2028-04-17", "2999-04-17");
    std::ofstream{directory_.file("unit.toml")} << text;
    const auto done = box({"provision", directory_.file("unit.toml")});
    ASSERT_EQ(done.status, 0) << done.err;
    start([](board::Descriptions& changed) { changed.probe.sd_ball_diameter_mm = 0.0005; });
  }
};

TEST_F(Certificates, HaveTheValuesOfTheStoredResultAndTheSpheresUncertainty) {
  const auto bare = box({"calibrate", "delay-known-sphere", "--accept", "--by", "Ada"});
  ASSERT_EQ(bare.status, 0) << bare.err;
  EXPECT_THAT(certificate("1"), AllOf(HasSubstr("<p>NOT TRACEABLE</p>"), Not(HasSubstr("sd_effective_diameter_mm")),
                                      HasSubstr("6 mm"), HasSubstr("exact")));

  provision();
  const auto measured = box({"calibrate", "delay-known-sphere", "--accept", "--although-it-differs", "--by", "Ada"});
  ASSERT_EQ(measured.status, 0) << measured.err;
  const auto page = certificate("2", {"--by", "Grace", "--next-due", "2127-11-26"});
  EXPECT_THAT(page, AllOf(HasSubstr("Traceable"), HasSubstr("2026-0417"), HasSubstr("sd_effective_diameter_mm"),
                          HasSubstr("PB-000123-2"), HasSubstr("by Ada"), HasSubstr("Grace"), HasSubstr("2127-11-26"),
                          HasSubstr("three-axis mill"), HasSubstr("SIM-PROBE-1"),
                          HasSubstr("<td>stylus ball</td><td>diameter 6 mm, sd 0.0005 mm (k = 1), as stated")));

  const auto stored = box({"show", "2", "--json"}).object();
  const std::regex row{
      "<td>delay</td><td class=\"n\">([0-9.]+)</td><td>\u00b5s</td><td class=\"n\">([0-9.]+)</td>"
      "<td class=\"n\">2</td><td class=\"n\">([0-9.]+)</td>"};
  std::smatch found;
  ASSERT_TRUE(std::regex_search(page, found, row)) << page;
  const double value_us = std::stod(found[1]), u_us = std::stod(found[2]), expanded_us = std::stod(found[3]);
  EXPECT_NEAR(value_us, 1e6 * stored["result"]["tau_s"].get<double>(), 0.1 * expanded_us);
  EXPECT_NEAR(expanded_us, 1e6 * stored["expanded_k2"]["tau_s"].get<double>(), 0.06 * expanded_us);
  EXPECT_NEAR(expanded_us, 2 * u_us, 0.1 * expanded_us);
  EXPECT_GT(u_us, 0);
}

// Six kelvin make sphere and stylus ball of 31 mm 2.14 um larger; ways in and out tell the delay without their size.
TEST_F(Certificates, NameTheTemperatureThatWasStatedForTheRun) {
  start([](board::Descriptions& changed) {
    changed.machine.datum_sphere_temperature =
        board::SphereTemperature{.celsius = {}, .sd_k = 0.5, .expansion_per_k = 11.5e-6};
  });
  const auto solvedAt = [&](const std::string& celsius) {
    const auto done = box({"calibrate", "delay-known-sphere", "--temperature", celsius});
    EXPECT_EQ(done.status, 0) << done.err;
    return done.out;
  };
  solvedAt("20");
  solvedAt("26");
  const auto cold = box({"show", "1", "--json"}).object(), warm = box({"show", "2", "--json"}).object();
  EXPECT_NEAR(warm["result"]["tau_s"].get<double>(), cold["result"]["tau_s"].get<double>(), 21e-6)
      << "four sd of the difference of two runs";
  const auto isOfTemperature = [](const auto& line) { return line["name"] == "sd_temperature_k"; };
  EXPECT_TRUE(std::ranges::any_of(warm["budget"], isOfTemperature)) << warm["budget"];
  EXPECT_EQ(warm["conditions"]["temperature_c"], "26") << warm["conditions"];
  EXPECT_THAT(certificate("2"), HasSubstr("<td>temperature</td><td>26 \u00b0C</td>"));
  const auto page = directory_.file("report.html");
  ASSERT_EQ(box({"report", "2", "-o", page}).status, 0);
  EXPECT_THAT(contentOf(page), HasSubstr("<td>temperature</td><td>26 \u00b0C</td>"));
}

TEST_F(Certificates, AreRefusedForWhatIsNoResult) {
  const auto path = directory_.file("none.html");
  EXPECT_EQ(box({"certificate", "7", "-o", path}).status, 4);
  EXPECT_EQ(box({"certificate", "1", "-o", path, "--next-due", "2027-02-30"}).status, 2);
  EXPECT_EQ(box({"certificate", "1", "-o", path, "--next-due", "2020-01-01"}).status, 2) << "a day that is over";
  EXPECT_FALSE(std::filesystem::exists(path));
}

}  // namespace
}  // namespace probebox::command
