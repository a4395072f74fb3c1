#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "board/describe/unit.hpp"
#include "firmware/store/twin_file.hpp"
#include "protocol/messages/unit.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::app {

// Keeps the identity that a vendor writes into a box, once: afterwards only a person who removes the file changes it
// (docs/vendor.md). One thread; inUse() and problem() any.
class UnitRecord {
 public:
  static constexpr std::size_t kMostBytes = messages::Provision::kMostBytes;

  explicit UnitRecord(const std::string& path);

  // Reads the unit of this file beside a daemon that has it open; nothing where none was written. Error where it cannot
  // be read, or is lost.
  static Outcome<std::optional<board::Unit>> peek(const std::string& path);

  // Was read at the start.
  const std::optional<board::Unit>& inUse() const { return in_use_; }
  // Was read at the start or written since.
  const std::optional<board::Unit>& unit() const { return unit_; }
  bool locked() const;
  // Problem with the file at the start, for a person; empty without one.
  const std::string& problem() const { return problem_; }

  // The unit is on the disk when this returns. Error: it is not well described or for another board, the record is
  // locked, the disk fails; with the remedy.
  Outcome<board::Unit> write(std::string_view text, std::string_view board_name);

 private:
  std::string path_;
  store::TwinFile file_;
  std::optional<board::Unit> unit_;
  std::optional<board::Unit> in_use_;
  std::string problem_;
};

}  // namespace probebox::app
