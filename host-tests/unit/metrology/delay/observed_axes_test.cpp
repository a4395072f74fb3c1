#include "firmware/metrology/delay/observed_axes.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <vector>

#include "firmware/metrology/methods.hpp"

namespace probebox::metrology {
namespace {

struct Direction {
  double x, y, z;
};

// Touches that retract along their normals.
Dataset touchesAlong(const std::vector<Direction>& normals, const char* method = "delay-multi-speed") {
  auto dataset = touchDataset(method);
  auto touches = Table::withColumns("touches", kTouchesColumns);
  double number = 0;
  for (const auto& [x, y, z] : normals) touches.append({number++, x, y, z, x, y, z, 25});
  for (auto& table : dataset.tables)
    if (table.name == "touches") table = touches;
  return dataset;
}

std::string subjectOfNormals(const std::vector<Direction>& normals) {
  return subjectOf(touchesAlong(normals));
}

TEST(ObservedAxes, AreThoseThatTouchesTellApart) {
  const double d = 1 / std::sqrt(3.0), h = std::sqrt(0.5);
  EXPECT_EQ(subjectOfNormals({{1, 0, 0}, {-1, 0, 0}}), "delay-x");
  EXPECT_EQ(subjectOfNormals({{0, 0, 1}}), "delay-z");
  EXPECT_EQ(subjectOfNormals({{1, 0, 0}, {0, -1, 0}}), "delay-xy");
  EXPECT_EQ(subjectOfNormals({{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}), "delay");
  EXPECT_EQ(subjectOfNormals({{d, d, d}}), "delay-oblique") << "a mean of all three";
  EXPECT_EQ(subjectOfNormals({{h, h, 0}, {0, 0, 1}}), "delay-z") << "X and Y are together in one touch";
  EXPECT_EQ(subjectOfNormals({{h, h, 0}, {1, 0, 0}, {0, 0, 1}}), "delay");
  EXPECT_EQ(subjectOfNormals({{std::cos(0.1), std::sin(0.1), 0}}), "delay-x") << "a normal that is a little askew";
}

TEST(ObservedAxes, OfAScanAreThoseAlongWhichItGoes) {
  Dataset scan{.method = "delay-contour", .config = {}, .tables = {}};
  constexpr std::string_view kColumns[]{"scan", "t_s", "x_mm", "y_mm", "z_mm"};
  auto machine = Table::withColumns("machine", kColumns);
  for (int i = 0; i < 100; ++i) machine.append({0, i * 1e-3, 10 * std::cos(i * 0.06), 10 * std::sin(i * 0.06), 5});
  scan.tables = {machine};
  EXPECT_EQ(subjectOf(scan), "delay-xy");
}

}  // namespace
}  // namespace probebox::metrology
