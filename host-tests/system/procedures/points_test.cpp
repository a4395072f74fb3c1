#include <cmath>
#include <fstream>
#include <gmock/gmock.h>
#include <map>
#include <sstream>
#include <thread>

#include "on_the_machine.hpp"

// A recording of touches as points of the touched sphere, by the emulated machine's own delay, gain and references.
namespace probebox::command {
namespace {

using testing::HasSubstr;

class ExportedPoints : public OnTheMachine {
 protected:
  using Row = std::map<std::string, double>;
  // Rows of a CSV; an empty cell is not there.
  static std::vector<Row> rowsOf(const std::string& path) {
    std::ifstream file{path};
    std::string line, cell;
    std::getline(file, line);
    std::vector<std::string> names;
    for (std::stringstream head{line}; std::getline(head, cell, ',');) names.push_back(cell);
    std::vector<Row> rows;
    while (std::getline(file, line)) {
      Row& row = rows.emplace_back();
      std::size_t k = 0;
      for (std::stringstream cells{line}; std::getline(cells, cell, ','); ++k)
        if (!cell.empty()) row[names.at(k)] = std::stod(cell);
    }
    return rows;
  }
  Finished points(const std::string& table) {
    return probebox({"export", recording_, "-o", table, "--points", "--force", "--json"});
  }

  std::string recording_ = directory_.file("scan.pbx"), table_ = directory_.file("scan.csv");
};

TEST_F(ExportedPoints, LieOnTheSphereThatWasTouched) {
  ASSERT_EQ(box({"record", "-o", recording_, "--for", "0.3"}).status, 0);
  const auto without = points(table_);
  EXPECT_EQ(without.status, 1);
  EXPECT_THAT(without.err, HasSubstr("no sample"));

  const auto calibrated = box({"calibrate", "delay-known-sphere", "--accept", "--by", "Ada", "--json"});
  ASSERT_EQ(calibrated.status, 0) << calibrated.err;
  std::thread again{[this] { EXPECT_EQ(box({"calibrate", "delay-known-sphere"}).status, 0); }};
  const auto recorded = box({"record", "-o", recording_, "--for", "2", "--force"});
  again.join();
  ASSERT_EQ(recorded.status, 0) << recorded.err;
  const auto exported = points(table_);
  ASSERT_EQ(exported.status, 0) << exported.err;
  EXPECT_GT(exported.object()["points"]["surface_points"].get<int>(), 500) << exported.out;

  const auto shown = box({"info", "--json"}).object();
  EXPECT_GT(shown["tip"]["gain_result_id"].get<int>(), 0);
  const auto centre = box({"show", "1", "--json"}).object()["result"];
  const std::array<double, 3> c{centre["centre_mm[0]"], centre["centre_mm[1]"], centre["centre_mm[2]"]};
  std::size_t touching = 0;
  for (const auto& row : rowsOf(table_)) {
    if (!row.contains("surface_x_mm")) continue;
    ++touching;
    double surface = 0;
    for (std::size_t k = 0; k < 3; ++k)
      surface += std::pow(row.at("surface_" + std::string{"xyz"[k]} + "_mm") - c[k], 2);
    const double off_mm = std::sqrt(surface) - 12.5, sd_mm = row.at("sd_along_normal_mm");
    EXPECT_LT(std::abs(off_mm), 6 * sd_mm) << "sample " << row.at("sample");
  }
  EXPECT_GT(touching, 500U);
}

}  // namespace
}  // namespace probebox::command
