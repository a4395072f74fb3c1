#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/units/outcome.hpp"
#include "protocol/units/time.hpp"

// A play: faults around a box and commands to it at given instants. Equal plays run equally.
namespace probebox::campaign {

enum class Kind : std::uint8_t {
  // of the machine, its sensors and the master clock: as world::FaultKind, in the same order
  drop_probe,
  drop_encoders,
  stop_sync,
  lose_edges,
  double_edges,
  drop_drift,
  stick_encoders,
  freeze_probe,
  shake_probe,
  jump_clock,
  drop_angles,
  // of the box
  replug_encoder,  // of axis `number`: away and back at once, and it counts from 0 unless it is absolute
  overflow_queue,  // the capture queue has no room for `number` events
  stall_worker,    // the worker does nothing for `lasts`
  fill_disk,       // the disk is full for `lasts`
  unplug_line,     // the controller's, for `lasts`
  kill,            // the process dies at once
  cut_power,       // data that were not synced are lost; bit `number` of one copy of each small file is damaged
  lose_applied,    // the same, and both copies of where the axes stand are damaged
  stop,            // the daemon ends regularly
  // of hosts
  connect,
  cut_link,      // after `number` more bytes
  stop_reading,  // for `lasts`
  // commands
  propose,  // result `number` (proposal.hpp)
  start_run,
  abort_run,
  accept,        // the newest proposed result
  roll_back,     // one of the subjects in force
  inhibit,       // by connection `number`
  end_inhibit,   // of that connection
  home_outside,  // axis `number` at 10 m
  choose_sources,
};
inline constexpr std::size_t kKinds = static_cast<std::size_t>(Kind::choose_sources) + 1;
inline constexpr std::size_t kMachineKinds = static_cast<std::size_t>(Kind::drop_angles) + 1;

std::string_view name(Kind kind);

struct Act {
  Kind kind{};
  Nanoseconds at{};  // since the start of the play
  Nanoseconds lasts{};
  std::uint64_t number{};
};

struct Play {
  std::string world{};   // folder of descriptions in place of those of board/sim; empty: none
  std::uint64_t seed{};  // of the emulated world
  Nanoseconds length{};
  Nanoseconds tick{};           // nominal period of the master clock
  Nanoseconds poll_interval{};  // of the Modbus master
  bool absolute{};              // the encoders: references need no homing
  double cold_um{};             // how much longer than the reference the screws are at the start
  std::vector<Act> acts;        // in the order of time
};

// How often acts happen. A kind without a weight happens only as one of the usual commands, which every third act is.
struct Mixture {
  std::array<double, kKinds> weights{};
  std::optional<double> mean_interval_s;  // between acts
};
// Reads "kill=3,cut_power=1". The error names what is no kind or no weight, and all kinds.
Outcome<Mixture> mixtureFrom(std::string_view text);

// Draws the play of this seed: rates, and acts from a mixture that is drawn too unless it is given, so that there are
// plays with few faults, with long ones and with many.
Play drawPlay(std::uint64_t seed, Nanoseconds length, const std::optional<Mixture>& given = std::nullopt);

std::string toJson(const Play& play);
// Reads a play. The error explains what is wrong with the text.
Outcome<Play> playFrom(std::string_view json);

}  // namespace probebox::campaign
