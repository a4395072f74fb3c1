#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <exception>
#include <optional>
#include <signal.h>
#include <string>
#include <string_view>
#include <time.h>
#include <variant>

#include "drivers/gpio/lines.hpp"
#include "firmware/app/log/log.hpp"
#include "firmware/app/solver/solver_child.hpp"
#include "firmware/app/threads/real_time.hpp"
#include "firmware/app/wiring/command_line.hpp"
#include "firmware/app/wiring/daemon.hpp"
#include "firmware/app/wiring/service_manager.hpp"
#include "firmware/app/wiring/start_folder.hpp"
#include "firmware/app/wiring/unit_in_use.hpp"

namespace {

using probebox::Nanoseconds;

constexpr int kFailed = 1;  // this machine does not give what is needed now
constexpr int kUsage = 2;   // and nothing but a person changes that
constexpr Nanoseconds kLook = std::chrono::seconds{1};
constexpr Nanoseconds kPatience = std::chrono::seconds{5};  // where nobody watches

// One name and one value a line; the descriptions allow plain ASCII only.
void printUsbIdentity(const probebox::board::Box& box) {
  std::printf("vendor_id 0x%04x\nproduct_id 0x%04x\nmanufacturer %s\nproduct %s\nserial_number %s\n",
              unsigned{box.usb.vendor_id}, unsigned{box.usb.product_id}, box.usb.manufacturer.c_str(),
              box.usb.product.c_str(), box.serial_number.c_str());
}

void sayLoopBack(const probebox::board::Box& box) {
  using probebox::gpio::describe;
  if (box.loop_back) {
    std::printf("Loop-back: from %s to %s.\n", describe(box.loop_back->output).c_str(),
                describe(box.loop_back->input).c_str());
  } else {
    std::puts("Loop-back: none; the latency of this board's edge stamps cannot be measured.");
  }
}

std::string scaleText(double scale) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%g", scale);
  return text.data();
}

bool endComesWithin(Nanoseconds duration) {
  sigset_t ends;
  sigemptyset(&ends);
  sigaddset(&ends, SIGINT);
  sigaddset(&ends, SIGTERM);
  const timespec wait{.tv_sec = duration / std::chrono::seconds{1},
                      .tv_nsec = (duration % std::chrono::seconds{1}).count()};
  return sigtimedwait(&ends, nullptr, &wait) >= 0;
}

// The watchdog is fed by the whole chain, and a stage that stands still is named before it bites.
void watch(probebox::app::Daemon& daemon, probebox::app::ServiceManager& manager) {
  const auto watchdog = manager.watchdog();
  const Nanoseconds look = watchdog ? std::min(*watchdog / 5, kLook) : kLook;
  const Nanoseconds patience = watchdog ? *watchdog / 2 : kPatience;
  do {
    const auto condition = daemon.condition(patience);
    manager.status(condition.in_words);
    if (condition.goes_on) manager.feedWatchdog();
  } while (!endComesWithin(look));
}

// Before any thread exists: they inherit it, and the signals wait for endComesWithin().
void blockSignals() {
  sigset_t blocked;
  sigemptyset(&blocked);
  sigaddset(&blocked, SIGINT);
  sigaddset(&blocked, SIGTERM);
  sigaddset(&blocked, SIGPIPE);
  pthread_sigmask(SIG_BLOCK, &blocked, nullptr);
}

// Reads what the options name, and says in the log what is wrong with it. Nothing where this build cannot run with it:
// that stays so until a person edits it, whatever the reason is. Who asks for the USB identity opens no addresses.
std::optional<probebox::board::Descriptions> accepted(const probebox::app::Options& options) try {
  auto descriptions = probebox::app::loadDescriptions(options);
  std::optional<probebox::Error> refused;
  if (!descriptions) {
    refused = descriptions.error();
  } else if (!options.usb_identity) {
    refused = probebox::app::validate(options, *descriptions);
  }
  if (!refused) return std::move(descriptions).value();
  probebox::app::logError(refused->what);
  return std::nullopt;
} catch (const std::exception& error) {
  probebox::app::logError(std::string{"The descriptions cannot be read: "} + error.what());
  return std::nullopt;
}

int begin(const std::filesystem::path& folder) {
  if (const auto error = probebox::app::writeStartingDescriptions(folder)) {
    probebox::app::logError(error->what);
    return kFailed;
  }
  std::printf(
      "%s has box.toml, machine.toml, probe.toml and service.toml now: edit what is marked there, then run\n"
      "  probeboxd --board %s --check\n",
      folder.c_str(), folder.c_str());
  return 0;
}

int run(const probebox::app::Options& options) {
  if (!options.init.empty()) return begin(options.init);
  auto descriptions = accepted(options);
  if (!descriptions) return kUsage;
  if (options.usb_identity) {
    if (const auto unit = probebox::app::unitOf(options)) (void)probebox::board::applyUnit(*unit, *descriptions);
    printUsbIdentity(descriptions->box);
    return 0;
  }
  if (options.check) {
    // The daemon starts without its door, and a person who checks wants to know.
    const auto why = probebox::app::whyNoDoor(options, *descriptions);
    if (why) {
      probebox::app::logError(why->what);
      return kUsage;
    }
    std::puts("The descriptions are good.");
    sayLoopBack(descriptions->box);
    return 0;
  }
  blockSignals();
  probebox::app::keepMemoryResident();
  probebox::app::ServiceManager manager;
  const auto daemon = probebox::app::Daemon::start(options, *descriptions, probebox::app::takePassedSockets());
  if (!daemon) {
    probebox::app::logError(daemon.error().what);
    manager.status(daemon.error().what);
    return kFailed;
  }
  if (options.time_scale != 1.0)
    probebox::app::logInfo("the emulated machine runs " + scaleText(options.time_scale) +
                           " times as fast as real time");
  manager.ready();
  watch(**daemon, manager);
  manager.stopping();
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  // The daemon runs itself to solve a case; nothing else of it is set up there.
  if (argc == 3 && std::string_view{argv[1]} == "--solver") return probebox::app::solveInChild(argv[2]);
  try {
    auto asked = probebox::app::readCommandLine(argc, argv, kUsage);
    if (const int* status = std::get_if<int>(&asked)) return *status;
    auto& options = std::get<probebox::app::Options>(asked);
    options.solver = "/proc/self/exe";
    return run(options);
  } catch (const std::exception& error) {
    probebox::app::logError(error.what());
    return kFailed;
  }
}
