#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>
#include <utility>

#include "tools/interference/scene.hpp"

namespace probebox::interference {
namespace {

// A solid of a cell is rarely smaller or larger: rather was it drawn in metres, inches or micrometres.
constexpr double kSmallest_mm = 15, kLargest_mm = 10'000;
constexpr std::size_t kMostRows = 128;

using Triangle = std::array<std::size_t, 3>;

struct Edge {
  std::size_t low{}, high{};  // corners
  std::size_t triangle{};
  bool sameAs(const Edge& other) const { return low == other.low && high == other.high; }
};

// The triangles, each corner of the same place with the same number.
std::vector<Triangle> welded(const Mesh& mesh) {
  std::vector<std::size_t> order(mesh.points.size()), numbers(order.size());
  std::iota(order.begin(), order.end(), 0u);
  std::ranges::sort(order, [&](std::size_t a, std::size_t b) { return mesh.points[a] < mesh.points[b]; });
  for (std::size_t k = 0; k < order.size(); ++k) {
    const bool same = k > 0 && mesh.points[order[k]] == mesh.points[order[k - 1]];
    numbers[order[k]] = same ? numbers[order[k - 1]] : k;
  }
  auto triangles = mesh.triangles;
  for (auto& triangle : triangles) {
    for (auto& corner : triangle) corner = numbers[corner];
  }
  return triangles;
}

bool isFlat(const Triangle& triangle) {
  const auto& [a, b, c] = triangle;
  return a == b || b == c || c == a;
}

// Those of one place stand together.
std::vector<Edge> edgesOf(const std::vector<Triangle>& triangles) {
  std::vector<Edge> edges;
  edges.reserve(3 * triangles.size());
  for (std::size_t n = 0; n < triangles.size(); ++n) {
    if (isFlat(triangles[n])) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(triangles[n][k], triangles[n][(k + 1) % 3]);
      edges.push_back({low, high, n});
    }
  }
  std::ranges::sort(edges,
                    [](const Edge& a, const Edge& b) { return std::tie(a.low, a.high) < std::tie(b.low, b.high); });
  return edges;
}

// How many edges have an odd number of triangles.
std::size_t openEdges(const std::vector<Edge>& edges) {
  std::size_t open = 0;
  for (std::size_t k = 0, next = 0; k < edges.size(); k = next) {
    while (next < edges.size() && edges[next].sameAs(edges[k])) ++next;
    open += (next - k) % 2;
  }
  return open;
}

// Whether a line along Z through (x, y) passes the side between two corners, left of the point. Both triangles at a
// side give the same answer, so a line never slips between them.
bool passes(Point a, Point b, double x, double y) {
  if (b < a) std::swap(a, b);
  if ((a[1] > y) == (b[1] > y)) return false;
  return a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]) < x;
}

bool isUnder(const std::array<Point, 3>& triangle, const Point& at) {
  const auto& [a, b, c] = triangle;
  const bool hit = passes(a, b, at[0], at[1]) != (passes(b, c, at[0], at[1]) != passes(c, a, at[0], at[1]));
  if (!hit) return false;
  const double ux = b[0] - a[0], uy = b[1] - a[1], vx = c[0] - a[0], vy = c[1] - a[1];
  const double area = ux * vy - uy * vx, px = at[0] - a[0], py = at[1] - a[1];
  const double s = (px * vy - py * vx) / area, t = (ux * py - uy * px) / area;
  return a[2] + s * (b[2] - a[2]) + t * (c[2] - a[2]) > at[2];
}

// Of the tetrahedron between a triangle and a place; positive where the triangle is counterclockwise seen from outside.
double volumeOf(const std::array<Point, 3>& triangle, const Point& place) {
  std::array<Point, 3> v{};
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t i = 0; i < 3; ++i) v[k][i] = triangle[k][i] - place[i];
  }
  return (v[0][0] * (v[1][1] * v[2][2] - v[1][2] * v[2][1]) + v[0][1] * (v[1][2] * v[2][0] - v[1][0] * v[2][2]) +
          v[0][2] * (v[1][0] * v[2][1] - v[1][1] * v[2][0])) /
         6;
}

}  // namespace

Point sizeOf(const Mesh& mesh) {
  Point low = mesh.points.front(), high = low;
  for (const auto& point : mesh.points) {
    for (std::size_t k = 0; k < point.size(); ++k) {
      low[k] = std::min(low[k], point[k]);
      high[k] = std::max(high[k], point[k]);
    }
  }
  return {high[0] - low[0], high[1] - low[1], high[2] - low[2]};
}

Outcome<Mesh> meshOf(const board::CellSolid& solid, const std::filesystem::path& folder) {
  const auto path = folder / solid.file;
  TRY(auto mesh, readStl(path));
  for (auto& point : mesh.points) {
    for (auto& value : point) value *= solid.unit_mm.value_or(1);
  }
  const auto open = openEdges(edgesOf(welded(mesh)));
  if (open != 0)
    return Error{
        path.string() + ": is not closed, " + std::to_string(open) +
        " edges have a triangle on one side alone, so what is inside is not known: repair the solid and export "
        "it again"};
  const auto size = sizeOf(mesh);
  const double largest = std::ranges::max(size);
  if (!solid.unit_mm && (largest < kSmallest_mm || largest > kLargest_mm))
    return Error{
        path.string() + ": is " + std::to_string(largest) +
        " mm large if its numbers are mm, and an STL states no unit: write unit = \"mm\", \"inch\" or \"m\" at the "
        "solid " +
        solid.name};
  return mesh;
}

Inside::Inside(const Mesh& mesh) {
  const auto numbered = welded(mesh);
  // Triangles that share an edge are of one surface.
  std::vector<std::size_t> root(numbered.size());
  std::iota(root.begin(), root.end(), 0u);
  const auto rootOf = [&](std::size_t n) {
    while (root[n] != n) n = root[n] = root[root[n]];
    return n;
  };
  const auto edges = edgesOf(numbered);
  for (std::size_t k = 1; k < edges.size(); ++k) {
    if (edges[k].sameAs(edges[k - 1])) root[rootOf(edges[k].triangle)] = rootOf(edges[k - 1].triangle);
  }
  std::map<std::size_t, std::size_t> surfaces;
  for (std::size_t n = 0; n < numbered.size(); ++n) {
    if (isFlat(numbered[n])) continue;
    const auto& [a, b, c] = mesh.triangles[n];
    triangles_.push_back({mesh.points[a], mesh.points[b], mesh.points[c]});
    const auto surface = surfaces.emplace(rootOf(n), surfaces.size()).first->second;
    surface_.push_back(surface);
    volumes_.resize(surfaces.size());
    volumes_[surface] += volumeOf(triangles_.back(), mesh.points.front());
  }
  const double size = sizeOf(mesh)[1];
  rows_.resize(std::clamp<std::size_t>(triangles_.size(), 1, kMostRows));
  front_ = std::ranges::min(mesh.points, {}, [](const Point& point) { return point[1]; })[1];
  row_ = std::max(size, 1e-9) / static_cast<double>(rows_.size());
  for (std::size_t n = 0; n < triangles_.size(); ++n) {
    const auto& [a, b, c] = triangles_[n];
    const auto last = rowOf(std::max({a[1], b[1], c[1]}));
    for (auto row = rowOf(std::min({a[1], b[1], c[1]})); row <= last; ++row)
      rows_[row].push_back(static_cast<std::uint32_t>(n));
  }
}

std::size_t Inside::rowOf(double y) const {
  return static_cast<std::size_t>(std::clamp((y - front_) / row_, 0.0, static_cast<double>(rows_.size() - 1)));
}

bool Inside::contains(const Point& at) const {
  std::map<std::size_t, bool> odd;  // surfaces that a line upwards leaves more often than it enters them
  for (const auto n : rows_[rowOf(at[1])]) {
    if (isUnder(triangles_[n], at)) odd[surface_[n]] = !odd[surface_[n]];
  }
  int around = 0;
  for (const auto& [surface, leaves] : odd) {
    if (leaves) around += volumes_[surface] < 0 ? -1 : 1;
  }
  return around != 0;
}

}  // namespace probebox::interference
