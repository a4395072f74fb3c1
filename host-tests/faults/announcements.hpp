#pragma once
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/store/record.hpp"

namespace probebox::faults {

using Correction = std::array<double, 3>;

// What a store room has to hold, as far as it has acknowledged.
//
//     doing WHAT      a change that is about to be made: propose ID, refuse ID, accept ID, await ID, activate ID, back,
//                     hold CONNECTION, end CONNECTION, order CONNECTION NUMBER, unit SERIAL
//     done            it is acknowledged
//     failed WHY      it was refused
//     sees ID STATE ...   all results as the box has them after a refusal: what its disk did not acknowledge may be
//     done ready           the boot is over, and changes begin serving X Y Z   a correction that a CNC is about to
//     read; served X Y Z: it has found ...       what a boot finds: state ID STATE, held CONNECTION, order CONNECTION NUMBER,
//     before X Y Z (the correction that
//                     was served last), applied X Y Z DX DY DZ (where the axes are, and the doubt), unit SERIAL,
//                     notice WHY
class Acknowledged {
 public:
  void hear(std::string_view line);

  // Compares with what a boot says. Nothing when all acknowledged changes are there, and nothing else but the one that
  // was announced last.
  struct After {
    bool power_was_cut{};
    bool disk_died{};      // it took nothing any more: a refused change of a small file may be half on it
    bool folder_failed{};  // it could not be opened, which SQLite takes for a file system without such a thing
  };
  std::optional<std::string> whyBroken(const std::vector<std::string>& found, const After& after) const;

  std::uint64_t changes() const { return changes_; }
  std::uint64_t refused() const { return refused_; }

 private:
  struct Kept {
    std::map<store::Id, std::string> states;
    std::vector<store::Id> retired;  // in this order
    std::set<std::string> held;
    std::map<std::string, std::string> orders;
    std::string unit;  // serial number
  };
  struct Found;
  static Found read(const std::vector<std::string>& lines);
  static void apply(std::string_view change, Kept& kept);
  void storeUncertain();
  void see(std::string_view states);
  static void retire(std::string_view state, Kept& kept);
  std::optional<std::string> whyConnectionsBroken(const Kept& expected, const Found& found, const After& after) const;
  std::optional<std::string> whyUnitBroken(const Found& found, const After& after) const;
  std::optional<std::string> whyCorrectionBroken(const Found& found, const After& after) const;

  Kept kept_;
  Kept before_;           // the last change of a result
  bool may_be_undone_{};  // the last change of a result was refused, and there
  std::string doing_;
  std::string failed_;
  bool ready_{};
  std::optional<std::string> broken_;
  std::string refused_change_;       // of a result, when nothing could be seen after it
  std::set<std::string> uncertain_;  // changes of connections that were refused
  std::optional<Correction> served_;
  std::optional<Correction> serving_;
  std::uint64_t changes_{};
  std::uint64_t refused_{};
};

}  // namespace probebox::faults
