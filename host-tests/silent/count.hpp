#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <string>

#include "host-tests/silent/worlds.hpp"

namespace probebox::metrology::silent {

// Cases of one method with one error. off: by more than four combined uncertainties (2 U) in a promised value. silent:
// off without a warning. told: with a warning, or refused; named: of these, where the error is named; blamed: where one
// is named that was not put in.
struct Cell {
  std::uint64_t cases{}, off{}, silent{}, told{}, refused{}, named{}, blamed{};
  std::map<std::string, std::uint64_t> words;  // beginnings of the warnings, and names of the refusals

  void add(const SimulatedCase& simulated, const Errors& errors);
  void add(const Cell& other);
};

// What is put into the next case.
using Draw = std::function<Errors(Random& random)>;

// One error of its ordinary size; its first kind may be Err::none.
Draw each(Err err, bool states_noise = true);
// Two errors of machine and probe of half to twice their size.
Draw mixed(bool states_noise = true);

// Nothing counted where the readings do not have those errors.
Cell count(const World& world, const Draw& draw, std::uint64_t cases, std::uint64_t seed = 1);

}  // namespace probebox::metrology::silent
