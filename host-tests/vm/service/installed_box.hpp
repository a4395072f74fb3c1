#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "gpio_sim.hpp"

namespace probebox::vm {

// A box as its vendor installs it, in a guest that systemd runs: what `cmake --install` gives, its user, its rules, its
// descriptions, simulated lines. Throws when the guest cannot be made one.
class InstalledBox {
 public:
  InstalledBox();

  // One for the whole program: a guest is installed once.
  static InstalledBox& instance();

  GpioSim lines;

  // Of the box's user.
  unsigned uid() const { return uid_; }
  // The daemon's process; 0 when there is none.
  static int pid();
  // How often systemd has started it again.
  static int restarts();
  // What systemd says of one property, such as ActiveState.
  static std::string property(const std::string& name);
  // Of the daemon's log, all.
  static std::string log();
  // A result for this box, proposed, as a calibration leaves it. The daemon must not run.
  std::uint64_t propose() const;

 private:
  unsigned uid_;
};

// A shell command: its output without the last newline. Throws when it fails.
std::string shell(const std::string& command);

// One field of a file such as /proc/PID/status: the text behind "NAME:".
std::string field(const std::filesystem::path& file, const std::string& name);

}  // namespace probebox::vm
