#pragma once
#include <cstdint>
#include <string_view>
#include <vector>

#include "host-tests/support/temporary_folder.hpp"
#include "own_touches.hpp"

namespace probebox::scenario {

// What is left of an error after it was calibrated and corrected, measured again by the control, with the sd of both.
struct Residual {
  std::string_view of;
  double value{};
  double sd{};
};

// A machine with errors that nobody knows: delays by axis, a turning axis off its place and tilted, screws that warm up
// and turn askew faces before their sensors, a head that swivels about another line, a tool of other lengths.
world::Config hiddenWorld(std::uint64_t seed);

// One machine, its control and its box. The control knows registers alone.
class Circle {
 public:
  explicit Circle(std::uint64_t seed);

  // Calibrates all errors, accepts the results and waits until the correction is valid.
  void calibrateAll();
  // Calibrates the delay once more.
  std::vector<Residual> delayAgain();
  // What the control's own touches find, first with the correction added to its commands, then without it and with the
  // tool as its drawing has it.
  std::vector<Residual> corrected();
  std::vector<Residual> uncorrected();
  std::uint64_t crashes() { return office_.scenario().machine().crashes(); }

 private:
  void errorsOfMachine();
  void calibrate(std::uint16_t method, const std::vector<double>& requests = {});
  unsigned ask(std::uint16_t what, std::uint32_t of);
  unsigned number(std::uint16_t at) { return static_cast<unsigned>(line_.value(at)); }
  world::Vector3 triple(std::uint16_t at);
  // For standard deviations that no register shows.
  const metrology::Result& lastResult();
  world::Vector3 centrelineAdds(double z_mm);
  double sdOfCentreline(std::size_t axis, double z_mm);
  double sdOfScrew(std::size_t axis, double position_mm) const;
  double sdOfLevel(std::size_t axis, double length_mm) const;
  world::Vector3 turnedOut(const OwnTouches::Ball& ball, const world::Pose& pose);
  void add(std::string_view of, double value, double sd) { residuals_.push_back({of, value, sd}); }

  std::vector<Residual> withOwnTouches();
  void partAgain();
  void sphereAgain();
  void headAgain();
  void toolAgain();

  world::Config config_;
  const support::TemporaryFolder folder_;
  Office office_;
  Boot boot_;
  LineOfTheBox box_side_{office_, boot_};
  RegisterLink line_{box_side_.registers()};
  AddedCorrection correction_{office_.scenario(), line_};
  OwnTouches touches_;
  std::vector<Residual> residuals_;
  world::Vector3 sd_of_extension_mm_{};
  world::Vector3 sd_of_swivel_mm_{};
  metrology::Result last_;
};

}  // namespace probebox::scenario
