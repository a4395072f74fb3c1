#include "firmware/app/wiring/start_folder.hpp"

#include <array>
#include <fstream>
#include <string>
#include <system_error>

#include "board/describe/start_files.hpp"

namespace probebox::app {
namespace {

constexpr std::array kNames{"box.toml", "machine.toml", "probe.toml", "service.toml"};

}  // namespace

std::optional<Error> writeStartingDescriptions(const std::filesystem::path& folder) {
  std::error_code error;
  for (const auto* name : kNames) {
    const auto type = std::filesystem::symlink_status(folder / name, error).type();
    if (type == std::filesystem::file_type::none)
      return Error{(folder / name).string() + " cannot be written: " + error.message()};
    if (type != std::filesystem::file_type::not_found)
      return Error{(folder / name).string() + " is there already: remove it, or name another folder with --init"};
  }
  std::filesystem::create_directories(folder, error);
  if (error) return Error{"The folder " + folder.string() + " cannot be made: " + error.message()};
  for (const auto* name : kNames) {
    std::ofstream file{folder / name, std::ios::binary};
    file << board::startFile(name) << std::flush;
    if (!file) return Error{(folder / name).string() + " cannot be written: name a folder that you may write to"};
  }
  return std::nullopt;
}

}  // namespace probebox::app
