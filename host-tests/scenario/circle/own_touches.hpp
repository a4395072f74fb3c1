#pragma once
#include <cstdint>
#include <span>

#include "drivers/world/random.hpp"
#include "host-tests/emulation/line_of_the_box.hpp"

namespace probebox::scenario {

// What the control adds to its commands, from what it reads of the box by registers alone: the correction, once the
// axes are homed and while the box is valid. After that the last one stays.
class AddedCorrection {
 public:
  AddedCorrection(Scenario& scenario, RegisterLink& line);

  // From the next move on the control's commands are what it is told.
  void addNothing() { adds_ = false; }
  bool adds() const { return adds_; }

  // Position of the drives less that of the commands, mm, since the last move: the correction, and what the nuts are
  // off by.
  const world::Vector3& added() const { return added_mm_; }

 private:
  world::Vector3 reached(const world::Vector3& commanded_mm, MonoTime now);

  Scenario& scenario_;
  RegisterLink& line_;
  bool adds_{true};
  world::Vector3 correction_mm_{};
  world::Vector3 added_mm_{};
};

// The control's own measuring cycle with its skip input, in its own coordinates: the box has no part in it.
class OwnTouches {
 public:
  struct Config {
    double repeatability_mm{0.0005};  // k = 1, of one touch
    double speed_mm_s{2};
    double free_height_mm{};  // nothing is above
  };
  struct Ball {
    world::Vector3 centre_mm{};  // where the control expects it, as a position of the machine
    double reach_mm{};           // radius of the ball and of the stylus' ball
  };
  struct Block {
    world::Vector3 centre_mm{};
    world::Vector3 half_mm{};  // to where its faces are met
  };

  OwnTouches(Boot& boot, Scenario& scenario, RegisterLink& line, const AddedCorrection& correction,
             const Config& config, std::uint64_t seed);

  // Tells the box which tool and pose it has now.
  void standHere();
  // Takes tool and pose, and tells the box.
  void stand(const world::Pose& pose, std::uint32_t tool = 1);
  // The centre by five touches, in the control's coordinates. Z is known to the repeatability, X and Y to that over
  // sqrt(2).
  world::Vector3 centreOf(const Ball& ball);
  world::Vector3 centreOf(const Block& block);
  void goHome();
  // Waits until the axes stand still and the correction has reached its target.
  void settle();

  double sdAcross() const { return config_.repeatability_mm / std::sqrt(2.0); }
  double sdAlong() const { return config_.repeatability_mm; }

 private:
  double touch(const world::Vector3& surface_mm, std::size_t axis, double sense);
  void go(const world::Vector3& to_mm, double speed_mm_s);
  void traverse(const world::Vector3& to_mm);

  Boot& boot_;
  Scenario& scenario_;
  RegisterLink& line_;
  const AddedCorrection& correction_;
  Config config_;
  world::Random random_;
};

}  // namespace probebox::scenario
