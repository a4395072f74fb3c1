#include "firmware/metrology/dataset/pre_travel_shifts.hpp"

#include <gtest/gtest.h>
#include <string>

#include "firmware/procedure/dataset/switched_readings.hpp"

// What a cause of the pre-travel's uncertainty changes the tables of a method by.
namespace probebox::procedure {
namespace {

metrology::Dataset readingsOf(double x_mm, double y_mm) {
  metrology::Table table{.name = "readings", .columns = {{"x_mm", {1.0, x_mm, 3.0}}, {"y_mm", {4.0, y_mm, 6.0}}}};
  return {.method = "centreline", .config = {}, .tables = {table}};
}

TEST(PreTravelShifts, AreToldWhereOneRowChanges) {
  metrology::Dataset dataset = readingsOf(2.0, 5.0);
  addShifts(dataset, readingsOf(2.25, 5.0), "_by_pre_travel_1");
  const auto* shifts = dataset.table("readings" + std::string{metrology::kByPreTravel} + "1");
  ASSERT_NE(shifts, nullptr);
  ASSERT_NE(shifts->column("x_mm"), nullptr);
  EXPECT_EQ(*shifts->column("x_mm"), (std::vector<double>{0.0, 0.25, 0.0}));
  EXPECT_EQ(shifts->column("y_mm"), nullptr) << "does not change";
}

TEST(PreTravelShifts, OfNothingAreNoTable) {
  metrology::Dataset dataset = readingsOf(2.0, 5.0);
  addShifts(dataset, readingsOf(2.0, 5.0), "_by_pre_travel_1");
  EXPECT_EQ(dataset.tables.size(), 1U);
}

}  // namespace
}  // namespace probebox::procedure
