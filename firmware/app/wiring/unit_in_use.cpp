#include "firmware/app/wiring/unit_in_use.hpp"

#include <utility>

#include "firmware/app/log/log.hpp"

namespace probebox::app {
namespace {

constexpr const char* kUnitFile = "unit";

}  // namespace

UnitRequestHandler takeUnit(const std::filesystem::path& state, board::Descriptions& descriptions) {
  UnitRecord record{(state / kUnitFile).string()};
  std::vector<std::string> notes;
  if (record.inUse()) {
    if (auto note = board::applyUnit(*record.inUse(), descriptions)) notes.push_back(std::move(*note));
  }
  return {std::move(record), descriptions.box.board_name, std::move(notes), KeyFolder{state}};
}

std::optional<board::Unit> unitOf(const Options& options) {
  const auto path = stateDirectory(options.state) / kUnitFile;
  auto unit = UnitRecord::peek(path.string());
  if (unit) return std::move(unit).value();
  logWarning(unit.error().what);
  return std::nullopt;
}

}  // namespace probebox::app
