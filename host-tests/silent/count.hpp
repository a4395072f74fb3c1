#pragma once
#include <cstdint>
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

  void add(const Cell& other);
};

// Nothing counted where the readings do not have that error.
Cell count(const World& world, const ErrorKind& error, std::uint64_t cases, std::uint64_t seed = 1);

}  // namespace probebox::metrology::silent
