#pragma once
#include <string>
#include <vector>

namespace probebox::report {

struct Point {
  double x{};
  double y{};
};

// How a series is drawn. Shapes and dashes keep series distinguishable in black-and-white print.
enum class Look {
  dots,       // blue circles
  squares,    // orange
  triangles,  // green
  specks,     // small blue circles, for hundreds
  solid,      // blue line
  dashed,     // orange line
  dotted,     // grey line, thin
};

// A plot with two linear axes, which span all points and have ticks at round numbers and labels with units.
class Plot {
 public:
  Plot(std::string title, std::string x_label, std::string y_label);

  // legend: name of the series, or empty. Points that are not finite are omitted. Lines of more than 1000 points are
  // thinned to the extremes of equal intervals.
  void add(std::vector<Point> points, Look look, std::string legend = {});
  // Points with a vertical error bar of +- bars[k] each.
  void addWithBars(std::vector<Point> points, const std::vector<double>& bars, Look look, std::string legend = {});
  // An arrow from each point by a vector, in the units of the axes.
  void addArrows(std::vector<Point> from, std::vector<Point> by, std::string legend = {});
  // A horizontal line across the whole plot at y.
  void addLevel(double y, std::string legend = {});
  // Gives both axes the same scale.
  void keepProportions() { proportional_ = true; }
  // The horizontal axis is a count: its ticks are whole numbers.
  void countAcross() { counts_ = true; }
  // Extends the axes to include this point.
  void include(Point point) { included_.push_back(point); }

  bool empty() const;
  // Returns one self-contained <svg> element.
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

// Returns about `wanted` round numbers within [low, high], spaced by 1, 2 or 5 times a power of ten.
std::vector<double> ticks(double low, double high, int wanted);

}  // namespace probebox::report
