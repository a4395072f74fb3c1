#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "protocol/messages/types.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::app {

// State that the updater reports in its file.
struct UpdaterReport {
  messages::UpdateState state{};
  std::uint64_t installation{};  // number of the installation that it reports on
  std::string version;
  std::string running_version;
  std::uint8_t percent{};
  std::string text;
};

// Reads lines of a name and a value; lines that it does not know are skipped.
UpdaterReport parseReport(std::string_view text);

// Speaks with the program that installs bundles as root (board/image/tree/usr/lib/probebox/update) through files: it
// reports in the file `state` of its folder; requests are put beside the bundle, where a systemd path unit waits for
// them. For the worker's thread.
class Updater {
 public:
  Updater(std::filesystem::path reports, std::filesystem::path requests);

  // Nothing when it has reported nothing yet.
  std::optional<UpdaterReport> report() const;

  // Asks to install the bundle. Its version must be above the one that runs, unless although_not_newer.
  std::optional<Error> askInstall(std::uint64_t installation, bool although_not_newer);
  // True when the updater had not taken it.
  bool takeBack();
  // Asks to restart the box into what was installed.
  std::optional<Error> askRestart();

 private:
  std::optional<Error> put(const char* name, const std::string& text);

  std::filesystem::path reports_;
  std::filesystem::path requests_;
};

}  // namespace probebox::app
