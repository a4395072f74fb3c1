#pragma once
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "firmware/app/results/last_served_file.hpp"
#include "host-tests/campaign/act.hpp"
#include "host-tests/campaign/believed.hpp"
#include "host-tests/campaign/follower.hpp"
#include "host-tests/campaign/tally.hpp"
#include "host-tests/emulation/boot.hpp"

namespace probebox::campaign {

// Changes the rules by which a stage judges, so that a test can show that each of them can be broken.
struct Rules {
  double rate{1};  // of the joints, relative to the box's limit
  double value_um{3};
};

// Performs a play on virtual time and checks the rules of docs/reliability.md at every step: a box with its store and
// two hosts at an emulated machine, and a Modbus master that follows. One play per process, because the emulated full
// disk acts on the whole process.
class Stage {
 public:
  // folder: empty, for the files of the box.
  Stage(const Play& play, const std::filesystem::path& folder, const Rules& rules = {});

  Verdict run();

 private:
  static constexpr Nanoseconds kNever{-1};
  static constexpr Nanoseconds kRound = std::chrono::milliseconds{10};
  // What is told to the core is served by then.
  static constexpr Nanoseconds kGrace = std::chrono::milliseconds{500};

  void apply(const Act& act);
  void applyToMachine(const Act& act);
  void applyToBox(const Act& act);
  void applyToHosts(const Act& act);
  void command(const Act& act);
  void replugEncoder(std::size_t axis);
  void restart(const Act& act);
  void begin();
  void carryOn();  // continues lasting acts and their consequences
  void tendHosts();
  void homeAgain();
  void propose(std::uint64_t number);
  void accept();
  void rollBack(std::uint64_t number);
  void inhibit(const Act& act);
  void fail(const std::string& what);

  void follow();
  void check();
  void checkSources();
  void checkLedger();
  void checkHosts();
  void checkValues();
  void checkRun();
  double assumedReading_um(std::size_t axis) const;
  bool wasRecent(Nanoseconds end, Nanoseconds within) const { return end != kNever && now_ - end < within; }

  scenario::Scenario& box() { return office_.scenario(); }
  const published::Snapshot& served() { return box().state().snapshot; }

  struct Host {
    scenario::VirtualHost* host{};
    Nanoseconds reads_again{kNever};
    Nanoseconds left{kNever};
  };
  // The end of the latest fault of a kind; `since` is its begin.
  struct Trouble {
    Nanoseconds since{kNever};
    Nanoseconds until{kNever};
    bool on(Nanoseconds now) const { return until != kNever && now < until; }
  };

  Play play_;
  std::filesystem::path folder_;
  Rules rules_;
  scenario::Office office_;
  std::optional<scenario::Boot> boot_;
  std::optional<app::LastServedFile> last_served_file_;
  std::vector<Host> hosts_;
  Follower follower_;
  Believed believed_;
  std::map<store::Id, double> readings_um_;  // of cold screws, by the results that were accepted about them
  Verdict verdict_;

  Nanoseconds now_{};
  Nanoseconds began_{};    // the present boot
  Nanoseconds changed_{};  // the last command that changes what is in force
  bool applied_lost_{};    // the disk does not know where the axes stand
  Nanoseconds worker_back_{kNever};
  Nanoseconds disk_back_{kNever};
  Nanoseconds line_back_{kNever};
  std::array<Trouble, kMachineKinds> troubles_{};
  Trouble any_trouble_;
  bool is_unhomed_{};                      // an axis, by an encoder that began anew
  Nanoseconds moved_{};                    // when the machine was seen moving last
  std::optional<std::uint32_t> torn_run_;  // an encoder began anew in it, after its first touch
  bool counts_stuck_{};      // since the start of the box: its references may be wrong without a way to know
  bool queue_overflowed_{};  // since the start of the box
  bool sums_known_{true};    // the losses before this boot are known exactly
  world::Ledger at_boot_{};
};

}  // namespace probebox::campaign
