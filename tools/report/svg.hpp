#pragma once
#include <string>
#include <vector>

namespace probebox::report {

struct Point {
  double x{};
  double y{};
};

// How a series of points is drawn. Shapes and dashes tell series apart on a printer without colours.
enum class Look {
  dots,       // blue circles
  squares,    // orange
  triangles,  // green
  specks,     // small blue circles, for hundreds
  solid,      // blue line
  dashed,     // orange line
  dotted,     // grey line, thin
};

// One picture with two linear axes, from the data that it is given: the axes span all points, with ticks at round
// numbers, and say what they show with its unit.
class Plot {
 public:
  Plot(std::string title, std::string x_label, std::string y_label);

  // legend: empty, or what the series is. Points that are not finite are left out. Lines of more than 1000 points are
  // thinned to the extremes of equal stretches.
  void add(std::vector<Point> points, Look look, std::string legend = {});
  // Points with a vertical bar of +- this, each.
  void addWithBars(std::vector<Point> points, const std::vector<double>& bars, Look look, std::string legend = {});
  // From each point by a vector, with a head; both in the units of the axes.
  void addArrows(std::vector<Point> from, std::vector<Point> by, std::string legend = {});
  // A line across the whole picture at this height.
  void addLevel(double y, std::string legend = {});
  // One mm is as long up as it is across.
  void keepProportions() { proportional_ = true; }
  // The horizontal axis counts things: its ticks are whole numbers.
  void countAcross() { counts_ = true; }
  // The vertical axis includes this value.
  void include(Point point) { included_.push_back(point); }

  bool empty() const;
  // One <svg> element, without any reference to something outside itself.
  std::string svg() const;

 private:
  struct Series {
    std::vector<Point> points;
    std::vector<double> bars;
    std::vector<Point> arrows;
    Look look{};
    std::string legend;
  };
  struct Range;
  struct Frame;

  Frame frame() const;
  static std::string draw(const Series& series, const Frame& frame);
  std::string title_;
  std::string x_label_;
  std::string y_label_;
  std::vector<Series> series_;
  std::vector<Point> included_;
  bool proportional_{};
  bool counts_{};
};

// Points of a circle, to be drawn as a line.
std::vector<Point> circleAround(Point centre, double radius);

// Round numbers within [low, high], about `wanted` of them, a step of 1, 2 or 5 times a power of ten apart.
std::vector<double> ticks(double low, double high, int wanted);

}  // namespace probebox::report
