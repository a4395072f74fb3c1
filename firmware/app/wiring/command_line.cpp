#include "firmware/app/wiring/command_line.hpp"

#include <CLI/CLI.hpp>
#include <charconv>
#include <string>

#include "firmware/app/log/log.hpp"
#include "firmware/app/wiring/daemon.hpp"

namespace probebox::app {
namespace {

// CLI::Range takes nan.
CLI::Validator timeScale() {
  constexpr double kLeast = 0.01, kMost = 100.0;
  const auto check = [](std::string& text) {
    double scale = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), scale);
    const bool good = error == std::errc{} && end == text.data() + text.size() && scale >= kLeast && scale <= kMost;
    return good ? std::string{} : "'" + text + "' is not a number from 0.01 to 100, such as 4";
  };
  return CLI::Validator{check, "0.01 to 100", "time scale"};
}

}  // namespace

void declareOptions(CLI::App& command, Options& options) {
  command.name("probeboxd");
  command.description(
      "probeboxd: the box between a scanning probe and a CNC controller.\nIt only taps signals: no motion stop may "
      "depend on it.");
  command.footer("Example, without any hardware:\n  probeboxd --board sim --link tcp:127.0.0.1:7627");
  command.set_version_flag("--version", "probeboxd " + firmwareVersion());
  command
      .add_option("--board", options.board,
                  "sim (the emulated machine), sim-lathe (a lathe of X and Z), or a folder with box.toml, "
                  "machine.toml, probe.toml, "
                  "service.toml")
      ->capture_default_str();
  command.add_option("--state", options.state, "folder for results and whatever else must survive a restart");
  command.add_option("--config", options.config, "folder with descriptions that replace the board's own, file by file");
  command
      .add_option(
          "--link", options.links,
          "address for hosts: tcp:HOST:PORT, tls:HOST:PORT, serial:DEVICE[,baud=921600] or usb; may be repeated, "
          "replaces the links of service.toml, which has the keys of tls: links")
      ->allow_extra_args(false);
  command
      .add_option(
          "--cnc", options.cnc,
          "line of a CNC: modbus:DEVICE[,baud=19200][,parity=even][,unit=1], modbus-tcp:HOST:PORT[,words=low-first], "
          "records:DEVICE[,every=100] or tape:DEVICE[,dialect=g10|macro|nv]; may be repeated, replaces cnc of "
          "service.toml")
      ->allow_extra_args(false);
  command.add_option("--journal", options.journal, "record every event that reaches the core in this new file");
  command.add_option("--time-scale", options.time_scale, "speed of the emulated machine, as a multiple of real time")
      ->check(timeScale());
  command
      .add_option("--init", options.init,
                  "write commented descriptions to begin with into this folder and exit; none is overwritten")
      ->type_name("FOLDER");
  command
      .add_option("--updater", options.updater,
                  "folder where the program that installs updates says what it does; without it none are taken "
                  "(probebox update)")
      ->type_name("FOLDER");
  command
      .add_option("--confirmed", options.confirmed,
                  "file that is there once the running version was found healthy; no update is taken before")
      ->type_name("FILE");
  command.add_flag("--check", options.check,
                   "check descriptions and addresses, print every problem and exit, with status 2 where there is one");
  command.add_flag("--usb-identity", options.usb_identity, "print the USB identity for probebox-usb-setup and exit");
}

std::variant<Options, int> readCommandLine(int argc, char** argv, int wrong_usage) {
  CLI::App command;
  Options options;
  declareOptions(command, options);
  try {
    command.parse(argc, argv);
    return options;
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return command.exit(error);
    logError(std::string{error.what()} + ": see probeboxd --help.");
    return wrong_usage;
  }
}

}  // namespace probebox::app
