#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <random>
#include <vector>

#include "host-tests/metrology/cases.hpp"

// A setting device that probe and tool measure: machine coordinates at contact, worked out from where things are.
namespace probebox::metrology {

// Positions are of the head's reference.
struct Setter {
  Eigen::Vector3d at{-193.0, 23.0, 17.0};
  Eigen::Vector3d probe{0.03, -0.04, 200.0};  // tip of the probe from the head's reference
  Eigen::Vector3d tool{-2.0, 1.1, 125.0};

  Eigen::Vector3d reading(const Eigen::Vector3d& tip) const { return at - tip; }
};

inline Dataset setterDataset(const Setter& setter, int repetitions, double sigma, std::mt19937_64& random) {
  Dataset dataset{
      .method = "tool-setter",
      .config = {{"probe_offset_mm", std::vector<double>{setter.probe.x(), setter.probe.y(), setter.probe.z()}},
                 {"sigma_mm", sigma}},
      .tables = {}};
  stateExactMachine(dataset);
  Table& table = addTable(dataset, "readings", {"is_tool", "x_mm", "y_mm", "z_mm"});
  for (int rep = 0; rep < repetitions; ++rep) {
    for (const double is_tool : {0.0, 1.0}) {
      const Eigen::Vector3d at = setter.reading(is_tool == 1.0 ? setter.tool : setter.probe);
      table.append(
          {is_tool, at.x() + gauss(random, sigma), at.y() + gauss(random, sigma), at.z() + gauss(random, sigma)});
    }
  }
  return dataset;
}

// A hybrid disc: faces across the axes, one along a tool at 45 degrees, each with a half width of its own.
struct Face {
  Eigen::Vector3d normal;
  double half_width;
};
inline const std::vector<Face> kDisc{{{1, 0, 0}, 12.0},
                                     {{-1, 0, 0}, 12.0},
                                     {{0, 1, 0}, 9.5},
                                     {{0, 0, 1}, 5.0},
                                     {Eigen::Vector3d{1, 0, 1}.normalized(), 10.2}};

inline Dataset faceDataset(const Setter& setter, double sigma, std::mt19937_64& random) {
  Dataset dataset = setterDataset(setter, 1, sigma, random);
  dataset.tables.clear();
  Table& table =
      addTable(dataset, "touches", {"is_tool", "nx", "ny", "nz", "half_width_mm", "radius_mm", "x_mm", "y_mm", "z_mm"});
  for (const double is_tool : {0.0, 1.0}) {
    const double radius = is_tool == 1.0 ? 0.4 : 3.0;
    for (const auto& face : kDisc) {
      // Somewhere on the face: what lies along it must not matter.
      const Eigen::Vector3d along = face.normal.unitOrthogonal() * uniform(random, -2, 2);
      const Eigen::Vector3d tip = setter.at + (face.half_width + radius) * face.normal + along;
      const Eigen::Vector3d m = tip - (is_tool == 1.0 ? setter.tool : setter.probe);
      const double e = gauss(random, sigma);
      const auto& n = face.normal;
      table.append({is_tool, n.x(), n.y(), n.z(), face.half_width, radius, m.x() + e * n.x(), m.y() + e * n.y(),
                    m.z() + e * n.z()});
    }
  }
  return dataset;
}

// ---- A tool in its holder against a measuring unit

struct Assembly {
  double holder{85.0};                     // L1 in store
  double tool{142.5};                      // L2 in store
  double assembled{60.2503};               // what sticks out of the holder
  std::array<double, 2> off{-0.03, 0.04};  // W: the holder's axis from the cutting end
  Eigen::Vector3d part{0.0, 62.0, 25.0};
};

inline Dataset assemblyDataset(const Assembly& truth, int repetitions, double sigma, std::mt19937_64& random) {
  Dataset dataset{.method = "tool-assembly",
                  .config = {{"L1_mm", truth.holder},
                             {"L2_mm", truth.tool},
                             {"part_mm", std::vector<double>{truth.part.x(), truth.part.y(), truth.part.z()}}},
                  .tables = {}};
  stateExactMachine(dataset);
  Table& table = addTable(dataset, "readings", {"workpiece_variant", "rep", "W0_x_mm", "W0_y_mm", "L0_z_mm"});
  for (const double variant : {0.0, 1.0}) {
    for (int rep = 0; rep < repetitions; ++rep) {
      const Eigen::Vector3d at =
          Eigen::Vector3d{truth.off[0], truth.off[1], truth.holder + truth.assembled} + variant * truth.part;
      table.append({variant, static_cast<double>(rep), at.x() + gauss(random, sigma), at.y() + gauss(random, sigma),
                    at.z() + gauss(random, sigma)});
    }
  }
  return dataset;
}

}  // namespace probebox::metrology
