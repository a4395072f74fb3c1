#include "firmware/app/update/updater.hpp"

#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <fcntl.h>
#include <unistd.h>
#include <utility>

#include "drivers/io/descriptor.hpp"

namespace probebox::app {
namespace {

using messages::UpdateState;

constexpr std::size_t kMostReport = 4096;

UpdateState stateNamed(std::string_view name) {
  for (auto state = UpdateState::installing; state <= UpdateState::gone_back;
       state = static_cast<UpdateState>(static_cast<unsigned>(state) + 1)) {
    if (nameOf(state) == name) return state;
  }
  return UpdateState::none;
}

template <class Number>
Number numberIn(std::string_view text) {
  Number number{};
  std::from_chars(text.data(), text.data() + text.size(), number);
  return number;
}

void take(std::string_view name, std::string_view value, UpdaterReport& report) {
  if (name == "state") report.state = stateNamed(value);
  if (name == "installation") report.installation = numberIn<std::uint64_t>(value);
  if (name == "version") report.version = value;
  if (name == "running") report.running_version = value;
  if (name == "percent") report.percent = std::min(numberIn<std::uint8_t>(value), std::uint8_t{100});
  if (name == "text") report.text = value;
}

Error troubleWith(const std::string& path) {
  return Error{"disk-failed: " + path + ": " + std::strerror(errno) + ". Check the disk of the box."};
}

}  // namespace

UpdaterReport parseReport(std::string_view text) {
  UpdaterReport report;
  while (!text.empty()) {
    const auto line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    const auto blank = std::min(line.find(' '), line.size());
    take(line.substr(0, blank), line.substr(std::min(blank + 1, line.size())), report);
  }
  return report;
}

Updater::Updater(std::filesystem::path reports, std::filesystem::path requests)
    : reports_{std::move(reports)}, requests_{std::move(requests)} {}

std::optional<UpdaterReport> Updater::report() const {
  const io::Descriptor file{::open((reports_ / "state").c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC)};
  std::array<char, kMostReport> text{};
  const auto size = file ? ::read(file.get(), text.data(), text.size()) : -1;
  if (size <= 0) return std::nullopt;
  return parseReport({text.data(), static_cast<std::size_t>(size)});
}

std::optional<Error> Updater::askInstall(std::uint64_t installation, bool although_not_newer) {
  return put("request", std::to_string(installation) + (although_not_newer ? " although-not-newer\n" : " newer\n"));
}

bool Updater::takeBack() {
  return ::unlink((requests_ / "request").c_str()) == 0;
}

std::optional<Error> Updater::askRestart() {
  return put("restart", "restart\n");
}

// The file is there as a whole or not at all, also after a power cut.
std::optional<Error> Updater::put(const char* name, const std::string& text) {
  const auto path = (requests_ / name).string();
  const auto unfinished = path + ".new";
  const io::Descriptor file{::open(unfinished.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0600)};
  if (!file || ::write(file.get(), text.data(), text.size()) != static_cast<ssize_t>(text.size()) ||
      ::fsync(file.get()) != 0 || ::rename(unfinished.c_str(), path.c_str()) != 0)
    return troubleWith(path);
  const io::Descriptor folder{::open(requests_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)};
  if (folder && ::fsync(folder.get()) == 0) return std::nullopt;
  const auto trouble = troubleWith(path);
  // Withdraws a refused request. If the updater has taken it already, it is carried out.
  return ::unlink(path.c_str()) == 0 ? std::optional{trouble} : std::nullopt;
}

}  // namespace probebox::app
