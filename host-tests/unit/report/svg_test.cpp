#include "tools/report/svg.hpp"

#include <cmath>
#include <gmock/gmock.h>
#include <limits>
#include <rapidcheck/gtest.h>
#include <sstream>
#include <string_view>

#include "tools/report/html.hpp"
#include "well_formed.hpp"

namespace probebox::report {
namespace {

using testing::HasSubstr;
using testing::Not;

// All coordinates x,y of the polylines of a picture.
std::vector<Point> drawnPoints(const std::string& svg) {
  std::vector<Point> points;
  constexpr std::string_view kBegin = "points=\"";
  for (auto at = svg.find(kBegin); at != std::string::npos; at = svg.find(kBegin, at)) {
    at += kBegin.size();
    std::istringstream list{svg.substr(at, svg.find('"', at) - at)};
    char comma{};
    for (Point point; list >> point.x >> comma >> point.y;) points.push_back(point);
  }
  return points;
}

RC_GTEST_PROP(Ticks, AreRoundAndWithinTheRange, ()) {
  const double low = *rc::gen::inRange(-1000000, 1000000) * 1e-3;
  const double width = std::pow(10.0, *rc::gen::inRange(-6, 6)) * *rc::gen::inRange(1, 100);
  const int wanted = *rc::gen::inRange(2, 10);
  const auto values = ticks(low, low + width, wanted);
  RC_ASSERT(!values.empty());
  RC_ASSERT(values.size() <= static_cast<std::size_t>(wanted) + 1);
  for (const double value : values) {
    RC_ASSERT(value >= low - 1e-6 * width && value <= low + width + 1e-6 * width);
  }
  if (values.size() < 2) return;
  const double step = values[1] - values[0];
  const double leading = step / std::pow(10.0, std::floor(std::log10(step * (1.0 + 1e-4))));
  RC_ASSERT(std::abs(leading - 1.0) < 1e-3 || std::abs(leading - 2.0) < 1e-3 || std::abs(leading - 5.0) < 1e-3);
}

// Whatever the data, the picture is XML and everything drawn is inside it.
RC_GTEST_PROP(Picture, HoldsAnyData, ()) {
  const double scale = std::pow(10.0, *rc::gen::inRange(-12, 12));
  const auto numbers = *rc::gen::container<std::vector<int>>(rc::gen::inRange(-1000, 1000));
  Plot plot{"a <title> & \"more\"", "x (mm)", "y (um)"};
  if (*rc::gen::arbitrary<bool>()) plot.keepProportions();
  std::vector<Point> points;
  for (std::size_t k = 0; k < numbers.size(); ++k) points.push_back({static_cast<double>(k), scale * numbers[k]});
  plot.add(points, Look::solid, "a line");
  plot.addWithBars(points, std::vector<double>(points.size(), scale), Look::squares, "marks");
  plot.addArrows(points, points);
  plot.addLevel(0.0);
  const auto svg = plot.svg();
  RC_ASSERT(WellFormed::objectionTo(svg) == "");
  for (const auto& at : drawnPoints(svg)) {
    RC_ASSERT(at.x >= 0.0 && at.x <= 460.0);
    RC_ASSERT(at.y >= 0.0 && at.y <= 500.0);
  }
}

TEST(Picture, DrawsWhatIsHigherFurtherUp) {
  Plot plot{"title", "x", "y"};
  plot.add({{0.0, 1.0}, {1.0, 3.0}, {2.0, 2.0}}, Look::solid);
  const auto points = drawnPoints(plot.svg());
  ASSERT_EQ(points.size(), 3U);
  EXPECT_LT(points[0].x, points[1].x);
  EXPECT_NEAR(points[1].x - points[0].x, points[2].x - points[1].x, 0.11);
  EXPECT_LT(points[1].y, points[2].y) << "downwards in the picture";
  EXPECT_NEAR(points[0].y - points[2].y, points[2].y - points[1].y, 0.11) << "in proportion";
}

TEST(Picture, CountsInWholeNumbers) {
  Plot plot{"", "result", ""};
  plot.add({{-1, 0}, {0, 1}}, Look::dots);
  EXPECT_THAT(plot.svg(), HasSubstr(">-0.8<"));
  plot.countAcross();
  const auto counted = plot.svg();
  EXPECT_THAT(counted, Not(HasSubstr(">-0.8<")));
  EXPECT_THAT(counted, HasSubstr(">-1<"));
}

TEST(Picture, LeavesOutWhatIsNotFinite) {
  const double nan = std::nan("");
  Plot plot{"title", "x", "y"};
  plot.add({{nan, 1.0}, {1.0, std::numeric_limits<double>::infinity()}}, Look::dots);
  EXPECT_TRUE(plot.empty());
  EXPECT_EQ(WellFormed::objectionTo(plot.svg()), "");
  EXPECT_THAT(plot.svg(), Not(HasSubstr("nan")));
}

TEST(Picture, OfManyPointsKeepsItsExtremes) {
  std::vector<Point> points;
  for (int k = 0; k < 100000; ++k) points.push_back({k * 1.0, k == 50001 ? 7.0 : 0.0});
  Plot many{"title", "x", "y"};
  many.add(points, Look::solid);
  const auto drawn = drawnPoints(many.svg());
  EXPECT_LT(drawn.size(), 1500U);
  double top = 1e9;
  double bottom = 0.0;
  for (const auto& at : drawn) top = std::min(top, at.y), bottom = std::max(bottom, at.y);
  EXPECT_GT(bottom - top, 100.0) << "the one that stands out is there";
}

TEST(Escaped, IsTextWhateverTheBytes) {
  EXPECT_EQ(escaped("<b> & \"c\" 'd'"), "&lt;b&gt; &amp; &quot;c&quot; &#39;d&#39;");
  EXPECT_EQ(escaped("20 \xC2\xB5m"), "20 \xC2\xB5m");
  EXPECT_EQ(escaped(std::string{"a\0b\x1b", 4}),
            "a\xEF\xBF\xBD"
            "b\xEF\xBF\xBD");
  EXPECT_EQ(escaped("\xC3("), "\xEF\xBF\xBD(") << "broken UTF-8";
}

}  // namespace
}  // namespace probebox::report
