#pragma once
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <string>

#include "firmware/metrology/dataset/dataset.hpp"
#include "host-tests/support/temporary_folder.hpp"

namespace probebox::app {

// Points of a sphere of 15 mm about (10, -20, 30), spread evenly; each off by a micrometre or less.
inline metrology::Dataset sphereCase(std::size_t points) {
  metrology::Dataset dataset{
      .method = "sphere-fit", .config = {{"sigma_mm", 0.001}}, .tables = {{.name = "points", .columns = {}}}};
  auto& columns = dataset.tables.front().columns;
  columns = {{"x_mm", {}}, {"y_mm", {}}, {"z_mm", {}}};
  for (std::size_t k = 0; k < points; ++k) {
    const double n = static_cast<double>(k);
    const double z = -1 + 2 * (n + 0.5) / static_cast<double>(points);
    const double turn = 2.399963229728653 * n;  // the golden angle, rad
    const double radius_mm = 15.0 + 0.001 * std::sin(12.9898 * n);
    const double across_mm = radius_mm * std::sqrt(1 - z * z);
    columns[0].values.push_back(10 + across_mm * std::cos(turn));
    columns[1].values.push_back(-20 + across_mm * std::sin(turn));
    columns[2].values.push_back(30 + radius_mm * z);
  }
  return dataset;
}

// A program in the place of the solver that does what the lines of shell say.
inline std::filesystem::path programThat(const support::TemporaryFolder& folder, const std::string& does) {
  const std::filesystem::path path = folder.file("solver");
  std::ofstream{path} << "#!/bin/sh\n" << does << "\n";
  std::filesystem::permissions(path, std::filesystem::perms::owner_all);
  return path;
}

}  // namespace probebox::app
