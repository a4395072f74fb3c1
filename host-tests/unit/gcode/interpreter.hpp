#pragma once
#include <array>
#include <cstddef>
#include <string>
#include <vector>

// Reads a program back as a control would, knowing nothing of how it was written.
namespace probebox {

struct Reached {
  std::array<double, 3> at_mm{};
  std::array<double, 3> angles_deg{};
  double feed_mm_min{};
  bool rapid{};
  bool z_only{};                      // X and Y were not given yet
  int arc{};                          // 2 clockwise, 3 the other way, 0: straight
  std::array<double, 2> centre_mm{};  // of an arc
};

// A line that goes to the box: begin or end of a step.
struct SentMark {
  bool begin{};
  std::size_t step{};
  std::array<double, 3> angles_deg{};
  double speed_mm_s{};
  std::size_t after{};  // how many moves came before it
};

// What lies between two stops for the operator, the first before any motion.
struct Part {
  std::vector<Reached> moves;
  std::vector<SentMark> marks;
  std::vector<std::size_t> dwells;  // after how many moves
};

struct Interpreted {
  std::vector<Part> parts{1};
  std::vector<std::string> unknown;  // lines that no control of that kind would take
  bool ended{};
};

Interpreted interpret(const std::string& program);

}  // namespace probebox
