// What people and programs do to good readings before they are solved: a row copied, degrees for radians, one reading
// that is off. The answer is refused, or says what is wrong, or is as near to the good one as the two standard
// deviations say.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <gmock/gmock.h>
#include <map>
#include <numbers>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "firmware/metrology/methods.hpp"
#include "firmware/metrology/solve.hpp"
#include "host-tests/support/sanitized.hpp"
#include "reported_case.hpp"
#include "tools/case/case_folder.hpp"

namespace probebox::casefolder {
namespace {

namespace fs = std::filesystem;
using metrology::Dataset;
using metrology::Result;
using metrology::Solved;
using metrology::Table;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;

class SlippedReadings : public testing::TestWithParam<std::string> {
 protected:
  SlippedReadings() {
    dataset = readCase(fs::path{PROBEBOX_REPORT_CASES} / GetParam()).value();
    good = metrology::solve(dataset).value();
  }
  // Tables whose rows are readings of their own.
  std::vector<Table*> readings() {
    std::vector<Table*> found;
    for (const auto& described : metrology::methodNamed(dataset.method)->tables) {
      for (auto& table : dataset.tables) {
        if (described.readings && table.name == described.name) found.push_back(&table);
      }
    }
    return found;
  }
  bool objects(const Solved& solved) const {
    return !solved || solved->warnings != good.warnings || solved->dropped.size() > good.dropped.size();
  }
  // The largest change of a promised value, in combined standard uncertainties of both answers.
  double changeOf(const Result& answer) const {
    double largest = 0;
    for (const auto& before : good.estimates) {
      const auto* after = answer.find(before.key);
      if (after == nullptr || after->values.size() != before.values.size()) continue;
      for (std::size_t k = 0; k < before.values.size() && k < before.uncertainty.size(); ++k) {
        const double sd =
            std::hypot(before.uncertainty[k], k < after->uncertainty.size() ? after->uncertainty[k] : 0.0);
        if (sd > 0) largest = std::max(largest, std::abs(after->values[k] - before.values[k]) / sd);
      }
    }
    return largest;
  }
  // Whether a promised value without an uncertainty is another than before, by more than a hundredth.
  bool changesWhatHasNoSd(const Result& answer) const {
    return std::ranges::any_of(good.estimates, [&](const auto& before) {
      const auto* after = answer.find(before.key);
      return before.uncertainty.empty() && after != nullptr &&
             !std::ranges::equal(before.values, after->values,
                                 [](double was, double is) { return std::abs(is - was) <= 0.01 * std::abs(was); });
    });
  }

  Dataset dataset;
  Result good;
};

TEST_P(SlippedReadings, ACopiedRowIsNoReadingOfItsOwn) {
  for (auto* table : readings()) {
    const Table before = *table;
    for (auto& column : table->columns) column.values.push_back(column.values.front());
    const auto one = metrology::solve(dataset);
    if (one) {
      EXPECT_THAT(one->warnings, Contains(HasSubstr("rows 1 and " + std::to_string(before.rows() + 1))));
    }
    *table = before;
    for (auto& column : table->columns) {
      const auto values = column.values;
      column.values.insert(column.values.end(), values.begin(), values.end());
    }
    const auto all = metrology::solve(dataset);
    if (all) {
      EXPECT_THAT(all->warnings, Contains(HasSubstr("every digit")));
    }
    *table = before;
  }
}

TEST_P(SlippedReadings, ARowCopiedToTheSamePoseATurnLaterIsNone) {
  for (auto* table : readings()) {
    if (table->column("t_s") != nullptr || table->name == "contacts") continue;
    const Table before = *table;
    bool turned = false;
    for (auto& column : table->columns) {
      double value = column.values.front();
      if (column.name == "C_rad" || column.name == "C_deg") {
        value += column.name == "C_rad" ? 2 * std::numbers::pi : 360;
        turned = true;
      }
      column.values.push_back(value);
    }
    const auto solved = metrology::solve(dataset);
    if (turned && solved) {
      EXPECT_THAT(solved->warnings, Contains(HasSubstr("rows 1 and " + std::to_string(before.rows() + 1))));
    }
    *table = before;
  }
}

// The cable is off, or the program wrote the first reading into every row: there is no noise, so no sd to be believed.
TEST_P(SlippedReadings, AFrozenChannelGivesNoAnswer) {
  constexpr double kMost = 5;  // standard deviations
  for (auto* table : readings()) {
    for (auto& column : table->columns) {
      if (!column.name.ends_with("_mm") && !column.name.ends_with("_um")) continue;
      const auto before = column.values;
      std::ranges::fill(column.values, before.front() + 1.234567e-4);
      const auto solved = metrology::solve(dataset);
      column.values = before;
      if (objects(solved)) continue;
      EXPECT_LE(changeOf(*solved), kMost) << table->name << " " << column.name;
    }
  }
}

TEST_P(SlippedReadings, DegreesAreNotTakenForRadiansWithoutAWord) {
  constexpr double kDegrees = 180 / std::numbers::pi;
  for (auto* table : readings()) {
    for (auto& column : table->columns) {
      if (column.name.find("_rad") == std::string::npos) continue;
      const auto before = column.values;
      for (auto& value : column.values) value *= kDegrees;
      const double farthest = std::abs(std::ranges::max(column.values, {}, [](double v) { return std::abs(v); }));
      if (farthest > 4 * std::numbers::pi) {
        EXPECT_TRUE(objects(metrology::solve(dataset))) << table->name << " " << column.name << ": " << farthest;
      }
      column.values = before;
    }
  }
}

// What a number becomes where somebody writes it in another unit than the column's.
struct Unit {
  std::string_view suffix;
  std::string_view written;
  double factor;
};
constexpr Unit kWrongUnits[]{{"_mm", "um", 1e3},
                             {"_um", "mm", 1e-3},
                             {"_um", "nm", 1e3},
                             {"_s", "ms", 1e3},
                             {"_rad", "deg", 180 / std::numbers::pi},
                             {"_deg", "rad", std::numbers::pi / 180},
                             {"_rad", "mrad", 1e3}};

bool isIn(std::string_view column, std::string_view unit) {
  if (unit == "_s" && column.ends_with("_mm_s")) return false;
  return column.ends_with(unit) || (unit == "_rad" && column.find("_rad_") != std::string_view::npos);
}

// Columns whose unit nothing can tell, and why: what they say in another unit is another machine's honest reading.
const std::map<std::string, std::set<std::string>> kAnyUnit{
    {"c-zero-shift", {"C1_rad", "C2_rad", "C1_rad C2_rad"}},  // two angles, and their mean is the answer
    {"screw-compensation", {"phi_rad"}},                      // a screw turns as often as it likes
    {"screw-reference", {"phi_rad"}},                         // likewise, and stands
    {"sensor-head-calibration", {"y_mm", "z_mm"}},            // places on a machine of 60 m
    {"swivel-error", {"B_deg"}},                              // of the queries: answered as asked
    {"tool-setter", {"y_mm"}},                                // a place on a machine of 23 m
};

TEST_P(SlippedReadings, AWholeColumnInAnotherUnitIsToldOrChangesNothing) {
  constexpr double kMost = 5;  // standard deviations
  const auto any_unit = kAnyUnit.find(GetParam());
  std::set<std::string> unreported;
  for (auto& table : dataset.tables) {
    const Table before = table;
    for (const auto& wrong : kWrongUnits) {
      for (std::size_t alone = 0; alone <= table.columns.size(); ++alone) {  // or, last, all columns of the unit
        std::string columns;
        for (std::size_t k = 0; k < table.columns.size(); ++k) {
          auto& column = table.columns[k];
          if (!isIn(column.name, wrong.suffix) || (alone != k && alone < table.columns.size())) continue;
          columns += (columns.empty() ? "" : " ") + column.name;
          for (auto& value : column.values) value *= wrong.factor;
        }
        if (columns.empty()) continue;
        const auto solved = metrology::solve(dataset);
        table = before;
        if (objects(solved) || (changeOf(*solved) <= kMost && !changesWhatHasNoSd(*solved))) continue;
        unreported.insert(columns);
        EXPECT_TRUE(any_unit != kAnyUnit.end() && any_unit->second.contains(columns))
            << "table " << table.name << ", " << columns << " in " << wrong.written << ": " << changeOf(*solved);
      }
    }
  }
  if (any_unit == kAnyUnit.end()) return;
  for (const auto& column : any_unit->second)
    EXPECT_TRUE(unreported.contains(column)) << column << " is told by now: take it off the list";
}

// What `solve` says of a case in which a column, or a key, has another unit.
std::string saidOf(const std::string& name, const std::string& table, const std::string& what, double factor) {
  auto dataset = changed(name, table, what, [=](double& value) { value *= factor; });
  if (table.empty()) std::get<double>(dataset.config.at(what)) *= factor;
  const auto solved = metrology::solve(dataset);
  if (!solved) return solved.error().name + ": " + solved.error().reason;
  std::string all;
  for (const auto& warning : solved->warnings) all += warning + "\n";
  return all;
}

TEST(WrongUnit, IsToldWithItsPlaceAndTheRightOne) {
  EXPECT_EQ(saidOf("screw-calibration", "gain_cal", "ext_um", 1), "");
  EXPECT_THAT(saidOf("screw-calibration", "gain_cal", "ext_um", 1e3),
              AllOf(HasSubstr("implausible: "), HasSubstr("'gain_cal'"), HasSubstr("'ext_um'"), HasSubstr("row 1"),
                    HasSubstr("in um")));
  EXPECT_THAT(saidOf("screw-calibration", "gain_cal", "error_um", 1e-3),
              AllOf(HasSubstr("'error_um'"), HasSubstr("'gain_cal'"), HasSubstr("millimetres?")));
  EXPECT_THAT(saidOf("screw-calibration", "sector_cal", "t_s", 1e3),
              AllOf(HasSubstr("'t_s'"), HasSubstr("'sector_cal'"), HasSubstr("milliseconds?")))
      << "the limit of the drift would let through a thousand times as much";
  EXPECT_THAT(saidOf("rotary-axis-errors", "first", "phi_rad", 1e3),
              AllOf(HasSubstr("errors-too-large: "), HasSubstr("phi_rad")));
  EXPECT_THAT(saidOf("screw-calibration", "", "screw_length_mm", 1e-3),
              AllOf(HasSubstr("implausible: "), HasSubstr("'screw_length_mm'"), HasSubstr("in mm")));
  EXPECT_THAT(saidOf("bore-fit", "", "stylus_ball_radius_mm", 1e3),
              AllOf(HasSubstr("implausible: "), HasSubstr("'stylus_ball_radius_mm'"), HasSubstr("in mm")));
  EXPECT_THAT(saidOf("periodic-check", "z_touch", "z_mm", 1e3),
              AllOf(HasSubstr("implausible: "), HasSubstr("'z_offset_error_mm'")));
}

// Position over pitch: 16 turns where the axis is 160 mm from the fixed bearing.
TEST(WrongUnit, IsNotSaidOfAScrewThatTurnsFarFromItsZero) {
  auto dataset = readCase(fs::path{PROBEBOX_REPORT_CASES} / "screw-calibration").value();
  auto& table = *std::ranges::find(dataset.tables, "sector_cal", &Table::name);
  for (double& phi : std::ranges::find(table.columns, "phi_rad", &metrology::Column::name)->values)
    phi += 1000 * 2 * std::numbers::pi;
  const auto solved = metrology::solve(dataset);
  ASSERT_TRUE(solved) << solved.error().reason;
  EXPECT_THAT(solved->warnings, testing::IsEmpty());
  EXPECT_THAT(saidOf("screw-calibration", "sector_cal", "phi_rad", 180 / std::numbers::pi), HasSubstr("radians"));
}

TEST(Limits, OfWhatAMachineHasAreKept) {
  EXPECT_THAT(saidOf("head-pivot", "readings", "B_deg", 180 / std::numbers::pi),
              AllOf(HasSubstr("implausible: "), HasSubstr("'readings'"), HasSubstr("'B_deg'"), HasSubstr("degrees")));
  EXPECT_THAT(saidOf("table-pivot", "readings", "tilt_deg", 180 / std::numbers::pi), HasSubstr("implausible"));
  EXPECT_THAT(saidOf("table-pivot", "readings", "C_deg", 180 / std::numbers::pi), HasSubstr("turns"));
  EXPECT_THAT(saidOf("screw-calibration", "gain_cal", "x_mm", 25.4),
              AllOf(HasSubstr("outside-screw: "), HasSubstr("'gain_cal'")));
  EXPECT_THAT(saidOf("screw-calibration", "", "orgoff_mm", 25.4), HasSubstr("outside-screw"));
  EXPECT_THAT(saidOf("rotary-axis-errors", "first", "phi_rad", -1),
              AllOf(HasSubstr("errors-too-large"), HasSubstr("axis_direction")));
}

// Readings without which there is no answer and with which there is no other to compare: nothing can object to them.
const std::map<std::string, std::set<std::string>> kWithoutRedundancy{
    {"centreline-by-steps", {"stylus"}},        // its offset from two of them
    {"delay-joints", {"chain"}},                // the machine as it is described
    {"periodic-check", {"z_touch"}},            // the error is what is asked for
    {"sensor-head-calibration", {"readings"}},  // each is an answer of its own
    {"table-pivot", {"readings"}},              // as many as unknowns
    {"tool-setter", {"readings"}},              // likewise
};

TEST_P(SlippedReadings, OneThatIsOffIsToldOrWithinTheUncertainty) {
  constexpr double kMost = 5;  // standard deviations
  constexpr int kRounds = support::kSanitized ? 20 : 400;
  const auto exempt = kWithoutRedundancy.find(GetParam());
  std::mt19937_64 random{20261124};
  std::size_t tried = 0;
  double alone = 0;  // the largest change by a reading that nothing can contradict
  for (int round = 0; round < kRounds; ++round) {
    auto& table = dataset.tables[random() % dataset.tables.size()];
    auto& column = table.columns[random() % table.columns.size()];
    if (!column.name.ends_with("_mm") || column.values.empty()) continue;
    const auto row = random() % column.values.size();
    const double before = column.values[row];
    const double off_mm = std::array{0.03, 0.1, 0.3, 1.0, 10.0}[random() % 5] * (random() % 2 == 0 ? 1 : -1);
    column.values[row] += off_mm;
    const auto solved = metrology::solve(dataset);
    column.values[row] = before;
    ++tried;
    if (objects(solved)) continue;
    const double change = changeOf(*solved);
    if (exempt != kWithoutRedundancy.end() && exempt->second.contains(table.name)) {
      alone = std::max(alone, change);
      continue;
    }
    EXPECT_LE(change, kMost) << "table " << table.name << ", column " << column.name << ", row " << row + 1
                             << " off by " << off_mm << " mm";
  }
  if (exempt != kWithoutRedundancy.end() && kRounds >= 400) {
    EXPECT_GT(alone, kMost) << "they can be told by now: take them off the list";
  }
  RecordProperty("tried", static_cast<int>(tried));
}

INSTANTIATE_TEST_SUITE_P(Case, SlippedReadings, testing::ValuesIn(caseNames()), [](const auto& test) {
  std::string name = test.param;
  std::ranges::replace(name, '-', '_');
  return name;
});

}  // namespace
}  // namespace probebox::casefolder
