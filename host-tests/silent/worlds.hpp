#pragma once
#include <optional>
#include <ostream>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "host-tests/silent/errors.hpp"

// A simulated case for each method, with an error of the machine or the probe in it.
namespace probebox::metrology::silent {

struct Truth {
  std::string key;
  std::vector<double> values;  // those that are not finite are not known
};

struct SimulatedCase {
  Dataset dataset;  // states nothing of the machine
  std::vector<Truth> truth;
};

struct World {
  std::string_view name;  // the method, and what is particular
  // Nothing where the readings do not have that error.
  std::optional<SimulatedCase> (*make)(const Errors& errors, Random& random);
  bool is_long{};  // to solve, beside the others
};
inline void PrintTo(const World& world, std::ostream* out) {
  *out << world.name;
}

std::span<const World> worldsOfTouches();
std::span<const World> worldsOfPlaces();

}  // namespace probebox::metrology::silent
