#pragma once
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "host-tests/metrology/cases.hpp"

// Features of a piece, touched by a stylus ball.
namespace probebox::metrology {

struct Ball {
  Eigen::Vector3d centre;
  double radius{};
  std::vector<Eigen::Vector3d> normals;
};

inline Ball randomBall(std::mt19937_64& random) {
  Ball ball{{uniform(random, -200, 200), uniform(random, -200, 200), uniform(random, -200, 200)},
            uniform(random, 3, 30),
            {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}}};
  for (int k = 0; k < 5; ++k) {
    ball.normals.push_back(
        Eigen::Vector3d{uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, 0.1, 1)}.normalized());
  }
  return ball;
}

inline Dataset touched(const Ball& ball, double sigma, std::mt19937_64& random) {
  std::normal_distribution<double> noise{0.0, 1.0};
  constexpr std::array<std::string_view, 3> kNames{"x_mm", "y_mm", "z_mm"};
  Dataset dataset{
      .method = "sphere-fit", .config = {{"sigma_mm", sigma}}, .tables = {Table::withColumns("points", kNames)}};
  for (const auto& normal : ball.normals) {
    Eigen::Vector3d point = ball.centre + ball.radius * normal;
    for (double& component : point) component += sigma * noise(random);
    dataset.tables[0].append({point.x(), point.y(), point.z()});
  }
  return dataset;
}

struct Round {
  Eigen::Vector2d centre{12.0, -7.0};
  double radius{20.0};
  double stylus{1.5};
  bool bore{};

  double effective() const { return bore ? radius - stylus : radius + stylus; }
  Eigen::Vector2d touched(double angle) const {
    return centre + effective() * Eigen::Vector2d{std::cos(angle), std::sin(angle)};
  }
};

inline Dataset roundDataset(const Round& round, const std::vector<double>& angles, double sigma,
                            std::mt19937_64& random) {
  Dataset dataset{.method = round.bore ? "bore-fit" : "boss-fit",
                  .config = {{"sigma_mm", sigma}, {"stylus_ball_radius_mm", round.stylus}},
                  .tables = {}};
  Table& points = addTable(dataset, "points", {"x_mm", "y_mm", "z_mm"});
  for (const double angle : angles) {
    const Eigen::Vector2d at = round.touched(angle);
    points.append({at.x() + gauss(random, sigma), at.y() + gauss(random, sigma), -5.0});
  }
  return dataset;
}

inline Dataset widthDataset(bool web, double middle, double width, const Eigen::Vector3d& direction, int touches,
                            double sigma, std::mt19937_64& random) {
  constexpr double kStylus = 1.0;
  Dataset dataset{.method = web ? "web-fit" : "pocket-fit",
                  .config = {{"sigma_mm", sigma},
                             {"stylus_ball_radius_mm", kStylus},
                             {"width_direction", std::vector<double>{direction.x(), direction.y(), direction.z()}}},
                  .tables = {}};
  Table& points = addTable(dataset, "points", {"face", "x_mm", "y_mm", "z_mm"});
  for (const double face : {1.0, 2.0}) {
    for (int k = 0; k < touches; ++k) {
      const double out = width / 2.0 + (web ? kStylus : -kStylus);
      const Eigen::Vector3d along = direction.unitOrthogonal() * uniform(random, -20, 20);
      const Eigen::Vector3d at = along + direction * (middle + (face == 1.0 ? -out : out) + gauss(random, sigma));
      points.append({face, at.x(), at.y(), at.z()});
    }
  }
  return dataset;
}

struct Block {
  Eigen::Vector3d corner{40.0, 25.0, -10.0};
  std::vector<Eigen::Vector3d> normals{Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(),
                                       Eigen::Vector3d::UnitZ()};  // outward
  double stylus{1.5};
};

inline Block randomBlock(std::mt19937_64& random, bool edge) {
  Block block;
  block.corner = {uniform(random, -50, 50), uniform(random, -50, 50), edge ? 0.0 : uniform(random, -50, 50)};
  block.stylus = uniform(random, 0.5, 3.0);
  if (edge) block.normals.pop_back();
  for (auto& normal : block.normals) {
    normal +=
        0.1 * Eigen::Vector3d{uniform(random, -1, 1), uniform(random, -1, 1), edge ? 0.0 : uniform(random, -1, 1)};
    normal.normalize();
  }
  return block;
}

// Faces as lines across Z (two) or planes (three). Points lie 5 to 40 mm inside the block from the corner.
inline Dataset cornerDataset(const Block& block, int touches, double sigma, std::mt19937_64& random) {
  Dataset dataset{
      .method = "corner-fit", .config = {{"sigma_mm", sigma}, {"stylus_ball_radius_mm", block.stylus}}, .tables = {}};
  Table points = Table::withColumns("points", std::array<std::string_view, 4>{"face", "x_mm", "y_mm", "z_mm"});
  Table faces = Table::withColumns("faces", std::array<std::string_view, 4>{"face", "nx", "ny", "nz"});
  const auto count = block.normals.size();
  for (std::size_t f = 0; f < count; ++f) {
    const Eigen::Vector3d& normal = block.normals[f];
    const Eigen::Vector3d nominal = Eigen::Vector3d::Unit(static_cast<Eigen::Index>(f));
    faces.append({static_cast<double>(f + 1), nominal.x(), nominal.y(), nominal.z()});
    for (int k = 0; k < touches; ++k) {
      Eigen::Vector3d inward = Eigen::Vector3d::Zero();
      int far = k % 3;  // in turns near the corner, far from it one way, and the other way
      for (std::size_t other = 0; other < count; ++other) {
        if (other == f) continue;
        inward -= (far == 1 ? uniform(random, 30, 40) : uniform(random, 5, 12)) * block.normals[other];
        --far;
      }
      inward -= normal * normal.dot(inward);  // along the face
      const Eigen::Vector3d at = block.corner + inward + (block.stylus + gauss(random, sigma)) * normal;
      points.append({static_cast<double>(f + 1), at.x(), at.y(), at.z()});
    }
  }
  dataset.tables = {std::move(points), std::move(faces)};
  return dataset;
}

}  // namespace probebox::metrology
