#include "firmware/app/results/unit_record.hpp"

#include <utility>

#include "board/describe/parse.hpp"

namespace probebox::app {
namespace {

constexpr const char* kFileName = "unit.toml";
// What the file has in the place of a lost identity, until the box is provisioned again.
constexpr const char* kIfLost = "# The identity of this box was lost.\n";
constexpr const char* kLost = "The identity of the box is lost: provision it again";

Outcome<std::optional<board::Unit>> unitIn(const std::string& text, const std::string& path) {
  if (text.empty() || text == kIfLost) return std::optional<board::Unit>{};
  auto unit = board::parseUnit(text, kFileName);
  if (!unit)
    return Error{"The identity of the box in " + path +
                 " is not understood by this firmware and is not used: " + unit.error().what};
  return std::optional{std::move(unit).value()};
}

}  // namespace

UnitRecord::UnitRecord(const std::string& path) : path_{path}, file_{store::TwinFile::open(path, kMostBytes, kIfLost)} {
  problem_ = file_.notice();
  if (file_.content() == kIfLost) problem_ += (problem_.empty() ? "" : ". ") + std::string{kLost};
  auto read = unitIn(file_.content(), path_);
  if (!read)
    problem_ += (problem_.empty() ? "" : ". ") + read.error().what;
  else
    unit_ = in_use_ = std::move(read).value();
}

Outcome<std::optional<board::Unit>> UnitRecord::peek(const std::string& path) {
  const auto text = store::TwinFile::peek(path, kMostBytes);
  if (!text) return Error{text.error().what};
  if (*text == kIfLost) return Error{kLost};
  return unitIn(*text, path);
}

bool UnitRecord::locked() const {
  return !file_.content().empty() && file_.content() != kIfLost;
}

Outcome<board::Unit> UnitRecord::write(std::string_view text, std::string_view board_name) {
  if (locked()) {
    const std::string whose = unit_ ? " as " + unit_->serial_number : "";
    return Error{"This box is provisioned" + whose + ", which is done once. To do it again, remove " + path_ +
                 " as root on the box and restart probeboxd (docs/vendor.md)."};
  }
  if (text.size() > kMostBytes)
    return Error{"unit.toml has " + std::to_string(text.size()) + " bytes: shorten it to " +
                 std::to_string(kMostBytes) + "."};
  TRY(auto unit, board::parseUnit(text, kFileName));
  if (unit.board != board_name)
    return Error{"unit.toml is for the board \"" + unit.board + "\", and this box has \"" + std::string{board_name} +
                 "\" (board_name of box.toml): correct 'unit.board', or take the file of this box."};
  if (const auto written = file_.write(text); !written) return Error{written.error().what};
  unit_ = unit;
  return unit;
}

}  // namespace probebox::app
