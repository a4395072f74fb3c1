#include <charconv>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <thread>
#include <unistd.h>

#include "drivers/serial/emulator.hpp"
#include "drivers/tcp/linux_tcp.hpp"
#include "tools/tour/process.hpp"
#include "tools/tour/tour.hpp"

namespace probebox::tour {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

// A folder that goes with the tour.
class Workshop {
 public:
  Workshop() {
    std::string pattern = (fs::temp_directory_path() / "probebox-demo-XXXXXX").string();
    if (mkdtemp(pattern.data()) != nullptr) path_ = pattern;
  }
  ~Workshop() {
    std::error_code ignored;
    if (!path_.empty()) fs::remove_all(path_, ignored);
  }
  Workshop(const Workshop&) = delete;
  Workshop& operator=(const Workshop&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

// The serial line between the box and the CNC, on a thread of its own.
class Cable {
 public:
  explicit Cable(serial::EmulatedCable cable)
      : cable_{std::move(cable)}, thread_{[this] {
          while (!stopping_) cable_.pump(20ms);
        }} {}
  ~Cable() {
    stopping_ = true;
    thread_.join();
  }
  Cable(const Cable&) = delete;
  Cable& operator=(const Cable&) = delete;

 private:
  serial::EmulatedCable cable_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

// A port that is free now; the box takes it a moment later.
Outcome<tcp::Address> freePort() {
  TRY(const auto listener, tcp::Listener::open({.host = "127.0.0.1", .port = 0}));
  return listener.address();
}

Stopped waitForBox(Process& box, const tcp::Address& address, const fs::path& log) {
  for (int attempt = 0; attempt < 200 && box.running(); ++attempt) {
    if (tcp::connectTcp(address, 200ms)) return {};
    std::this_thread::sleep_for(50ms);
  }
  std::string why = "The box did not start. Its last words:\n";
  if (auto said = outputOf({"tail", "-n", "10", log.string()})) why += *said;
  return Error{why};
}

Stopped guide(Stage& stage, const fs::path& programs, const fs::path& folder, std::uint64_t seed) {
  const fs::path box_port = folder / "box-serial";
  const fs::path cnc_port = folder / "cnc-serial";
  TRY(auto cable, serial::EmulatedCable::open(box_port, cnc_port));
  const Cable running_cable{std::move(cable)};
  TRY(const auto world, writeWorld(folder, seed));
  stage.truth = world;
  TRY(const auto port, freePort());
  stage.box = port;

  const std::string link = "tcp:" + tcp::describe(stage.box);
  const std::string cnc = "modbus:" + box_port.string() + ",parity=none";
  const fs::path log = folder / "probeboxd.log";
  std::printf("$ probeboxd --board sim --link %s --cnc %s\n", link.c_str(), cnc.c_str());
  TRY(auto box, Process::start({(programs / "probeboxd").string(), "--board", "sim", "--config", folder.string(),
                                "--state", (folder / "state").string(), "--link", link, "--cnc", cnc},
                               log.string()));
  if (auto stopped = waitForBox(box, stage.box, log)) return stopped;
  if (auto stopped = showClock(stage)) return stopped;
  if (auto stopped = showCalibration(stage)) return stopped;
  if (auto stopped = showCentreline(stage)) return stopped;
  if (auto stopped = showStream(stage, seed)) return stopped;
  return showRegisters(stage, cnc_port);
}

constexpr const char* kUsage =
    "usage: probebox-tour [SEED]\n"
    "Shows probebox at work without any hardware. SEED is a whole number; the same one draws the same hidden delays.\n";

// Nothing when the word is no whole number.
std::optional<std::uint64_t> seedOf(std::string_view word) {
  std::uint64_t seed{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), seed);
  if (error != std::errc{} || end != word.data() + word.size()) return std::nullopt;
  return seed;
}

int run(int argc, char** argv) {
  if (argc == 2 && (argv[1] == std::string_view{"--help"} || argv[1] == std::string_view{"-h"})) {
    std::fputs(kUsage, stdout);
    return 0;
  }
  const auto given = argc > 1 ? seedOf(argv[1]) : std::optional<std::uint64_t>{std::random_device{}()};
  if (!given || argc > 2) {
    std::fputs(kUsage, stderr);
    return 2;
  }
  const std::uint64_t seed = *given;
  std::printf(
      "probebox without hardware: an emulated machine, in real time, with delays that nobody told the box (seed "
      "%llu).\n",
      static_cast<unsigned long long>(seed));
  const Workshop workshop;
  // The box announces itself in this folder, not among those that work.
  setenv("PROBEBOX_RENDEZVOUS", workshop.path().c_str(), 1);
  Stage stage;
  const auto stopped = guide(stage, fs::path{argv[0]}.parent_path(), workshop.path(), seed);
  std::puts("\nSummary");
  stage.table.print();
  if (stopped) {
    std::fprintf(stderr, "The demo could not go on: %s\n", stopped->what.c_str());
    return 1;
  }
  std::puts(
      "\nNow try it yourself:\n"
      "  build/bin/probeboxd --board sim &\n"
      "  build/bin/probebox watch                            # the box, live\n"
      "  build/bin/probebox calibrate delay-multi-speed      # the touches, step by step\n"
      "  build/bin/probebox record -o scan.pbx --for 5       # then: build/bin/probebox export scan.pbx -o scan.csv");
  return stage.table.allRight() ? 0 : 1;
}

}  // namespace
}  // namespace probebox::tour

int main(int argc, char** argv) {
  return probebox::tour::run(argc, argv);
}
