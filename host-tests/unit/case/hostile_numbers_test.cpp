// Numbers that no machine has, in every cell and key of one case a method.
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <gmock/gmock.h>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "firmware/metrology/checks/plausible.hpp"
#include "firmware/metrology/methods.hpp"
#include "firmware/metrology/solve.hpp"
#include "tools/case/case_folder.hpp"

namespace probebox::casefolder {
namespace {

namespace fs = std::filesystem;
using metrology::Dataset;
using testing::AllOf;
using testing::AnyOf;
using testing::HasSubstr;

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// A case of this method; no other one is read, because each test runs alone.
fs::path caseOf(std::string_view method) {
  for (const auto& folder : {fs::path{PROBEBOX_REPORT_CASES}, fs::path{PROBEBOX_CASES} / "delay-multi-speed",
                             fs::path{PROBEBOX_CASES} / "sphere-fit"}) {
    for (const auto& entry : fs::recursive_directory_iterator{folder}) {
      if (entry.path().filename() != "config.json") continue;
      std::ifstream config{entry.path()};
      if (nlohmann::json::parse(config)["method"] == method) return entry.path().parent_path();
    }
  }
  return {};
}

// A number of a case, and what a refusal must say of it.
struct Place {
  std::function<double&(Dataset&)> number;
  std::vector<std::string> named;
};

std::vector<Place> placesIn(const Dataset& dataset) {
  std::vector<Place> places;
  for (std::size_t t = 0; t < dataset.tables.size(); ++t) {
    const auto& table = dataset.tables[t];
    for (std::size_t c = 0; c < table.columns.size(); ++c) {
      for (const std::size_t row : std::set<std::size_t>{0, table.rows() / 2, table.rows() - 1}) {
        places.push_back({[=](Dataset& d) -> double& { return d.tables[t].columns[c].values[row]; },
                          {"table '" + table.name + "'", "column '" + table.columns[c].name + "'",
                           "row " + std::to_string(row + 1)}});
      }
    }
  }
  for (const auto& [key, value] : dataset.config) {
    const std::vector<std::string> named{"config key '" + key + "'"};
    if (std::holds_alternative<double>(value))
      places.push_back({[key](Dataset& d) -> double& { return std::get<double>(d.config[key]); }, named});
    if (std::holds_alternative<std::vector<double>>(value))
      places.push_back(
          {[key](Dataset& d) -> double& { return std::get<std::vector<double>>(d.config[key])[0]; }, named});
    if (std::holds_alternative<metrology::Matrix>(value))
      places.push_back(
          {[key](Dataset& d) -> double& { return std::get<metrology::Matrix>(d.config[key])[0][0]; }, named});
  }
  return places;
}

class EveryMethod : public testing::TestWithParam<std::string_view> {
 protected:
  EveryMethod() {
    auto read = readCase(caseOf(GetParam()));
    if (read) dataset = std::move(read).value();
  }
  Dataset dataset;
};

TEST_P(EveryMethod, HasAGoodCase) {
  ASSERT_EQ(dataset.method, GetParam()) << "no case of it lies in the folders";
  EXPECT_TRUE(metrology::solve(dataset));
}

TEST_P(EveryMethod, RefusesNumbersThatNoMachineHasAndSaysWhereTheyAre) {
  for (const auto& place : placesIn(dataset)) {
    const double before = place.number(dataset);
    for (const double hostile : {1e153, 1e308, -1e308, 1e15, kNan, kInf, -kInf}) {
      place.number(dataset) = hostile;
      const auto solved = metrology::solve(dataset);
      ASSERT_FALSE(solved) << place.named.back() << " = " << hostile;
      EXPECT_THAT(solved.error().name, AnyOf("not-finite", "implausible", "bad-config"));
      for (const auto& name : place.named) EXPECT_THAT(solved.error().reason, HasSubstr(name));
      EXPECT_GT(solved.error().reason.size(), 40U) << "a sentence with the remedy";
    }
    place.number(dataset) = before;
  }
}

// A zero, the least number there is, and the largest that `solve` lets in: answered by finite numbers, or
// refused.
TEST_P(EveryMethod, AnswersExtremesInFiniteNumbersOrRefusesThem) {
  for (const auto& place : placesIn(dataset)) {
    const auto& method = *metrology::methodNamed(GetParam());
    const auto quoted = [](const std::string& text) {
      const auto begin = text.find('\'') + 1;
      return text.substr(begin, text.rfind('\'') - begin);
    };
    const auto range = place.named.size() == 3
                           ? metrology::plausibleRange(method, quoted(place.named[0]), quoted(place.named[1]))
                           : metrology::plausibleRange(method, quoted(place.named[0]));
    const double before = place.number(dataset);
    for (const double extreme : {0.0, 1e-308, -1e-308, range.most, range.least}) {
      place.number(dataset) = extreme;
      const auto solved = metrology::solve(dataset);
      const auto where = place.named.front() + ", " + place.named.back() + " = " + std::to_string(extreme);
      if (!solved) {
        EXPECT_GT(solved.error().reason.size(), 30U) << where << solved.error().name;
        continue;
      }
      for (const auto& estimate : solved->estimates) {
        for (const double value : estimate.values) EXPECT_TRUE(std::isfinite(value)) << where << ": " << estimate.key;
        for (const double sd : estimate.sd) EXPECT_TRUE(std::isfinite(sd) && sd >= 0) << where << ": " << estimate.key;
      }
    }
    place.number(dataset) = before;
  }
}

INSTANTIATE_TEST_SUITE_P(HostileNumbers, EveryMethod, testing::ValuesIn(metrology::methods()), [](const auto& tested) {
  std::string name{tested.param};
  std::ranges::replace(name, '-', '_');
  return name;
});

}  // namespace
}  // namespace probebox::casefolder
