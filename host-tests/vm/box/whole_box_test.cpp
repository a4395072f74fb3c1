#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <map>
#include <memory>
#include <numeric>
#include <regex>
#include <signal.h>
#include <sstream>
#include <sys/stat.h>
#include <thread>
#include <unistd.h>

#include "box_process.hpp"
#include "box_user.hpp"
#include "gpio_sim.hpp"
#include "host-tests/host/test_host.hpp"
#include "pulse_train.hpp"
#include "receiver_gadget.hpp"
#include "recording.hpp"
#include "usb_gadget.hpp"

// All of the box on real kernel interfaces at once, for five minutes of the guest, with trouble: sync and touches from
// gpio-sim, the probe from a receiver on USB, samples out over USB, the CNC's registers by mbpoll over CDC-ACM.
namespace probebox::vm {
namespace {

using namespace std::chrono_literals;
using std::this_thread::sleep_for;
using std::this_thread::sleep_until;

// Lines of board/vm.
constexpr unsigned kSync = 0, kTouch = 1, kOvertravel = 2, kSkip = 4;
constexpr int kTicksToATouch = 7;

void edit(const std::filesystem::path& file, const std::string& from, const std::string& to) {
  std::ostringstream text;
  text << std::ifstream{file}.rdbuf();
  std::string content = text.str();
  const auto at = content.find(from);
  if (at == std::string::npos) throw std::runtime_error{file.string() + " has no " + from};
  std::ofstream{file} << content.replace(at, from.size(), to);
}

// Sync pulses and touches, with a chip that can be pulled out in between.
class Machine {
 public:
  Machine() { rest(); }
  void start() {
    train_ = std::make_unique<PulseTrain>(chip_, kSync, 1ms, [this](std::uint64_t tick) {
      if (tick % kTicksToATouch != 0) return;
      chip_.pulse(kTouch);
      touch_edges_ += 2;
    });
  }
  void unplugFor(std::chrono::milliseconds duration) {
    train_.reset();
    sleep_for(300ms);  // what the kernel holds goes with the chip: the box has read it by now
    chip_.unplug();
    sleep_for(duration);
    chip_.plugIn();
    rest();
    sleep_for(1500ms);  // the box asks for its lines every second
    start();
  }
  void stop() { train_.reset(); }
  std::uint64_t touchEdges() const { return touch_edges_; }

 private:
  void rest() {
    chip_.drive(kOvertravel, true);
    chip_.drive(kSkip, true);
  }

  GpioSim chip_{"probebox-vm", {"", "TOUCH", "OVERTRAVEL", "INDEX_X", ""}};
  std::atomic<std::uint64_t> touch_edges_{};
  std::unique_ptr<PulseTrain> train_;
};

// mbpoll on the PC's end of the serial line, again and again.
class Controller {
 public:
  struct Seen {
    int answers{};
    int wrong{};      // an answer that is no first block of the map
    int backwards{};  // the heartbeat went back
    int heartbeat{-1};
    int unlocked{};
  };
  Controller() : thread_{[this] { run(); }} {}
  Seen stop() {
    stopping_ = true;
    thread_.join();
    return seen_;
  }

 private:
  void run() {
    while (!stopping_) {
      ask();
      sleep_for(200ms);
    }
  }
  void ask() {
    FILE* const answer =
        popen("timeout 5 mbpoll -m rtu -a 1 -b 19200 -P even -t 4 -0 -r 0 -c 13 -1 -q /dev/ttyACM0 2>/dev/null", "r");
    if (answer == nullptr) return;
    std::string text;
    for (int c = 0; (c = std::fgetc(answer)) != EOF;) text += static_cast<char>(c);
    if (pclose(answer) != 0) return;  // the line is away, or the box is
    const std::regex row{R"(\[(\d+)\]:\s+(-?\d+))"};
    std::map<int, int> registers;
    for (auto at = std::sregex_iterator{text.begin(), text.end(), row}; at != std::sregex_iterator{}; ++at)
      registers[std::stoi((*at)[1])] = std::stoi((*at)[2]) & 0xFFFF;
    ++seen_.answers;
    if (registers.size() != 13 || registers[0] != 0x5042) {
      ++seen_.wrong;
      return;
    }
    if ((registers[2] & 2) == 0) ++seen_.unlocked;
    const int ahead = (registers[4] - seen_.heartbeat) & 0xFFFF;
    if (seen_.heartbeat >= 0 && ahead > 0x8000) ++seen_.backwards;
    seen_.heartbeat = registers[4];
  }

  Seen seen_;
  std::atomic<bool> stopping_{};
  std::thread thread_;
};

// How much of the guest's processor was used since this was last asked: a box that starves is not what is tested.
class Processor {
 public:
  double busyShare() {
    std::ifstream stat{"/proc/stat"};
    std::string name;
    stat >> name;
    std::array<double, 8> ticks{};  // user nice system idle iowait irq softirq steal
    for (double& value : ticks) stat >> value;
    const double all = std::accumulate(ticks.begin(), ticks.end(), 0.0), idle = ticks[3] + ticks[4];
    const double share = 1 - (idle - idle_) / (all - all_);
    all_ = all, idle_ = idle;
    return share;
  }

 private:
  double all_{}, idle_{};
};

void give(const char* device) {
  if (chown(device, 0, kBoxGroup) != 0 || chmod(device, 0660) != 0) throw std::runtime_error{device};
}

messages::LineStatus lineOf(const messages::Status::Answer& status, const std::string& name) {
  for (const auto& line : status.lines) {
    if (line.name == name) return line;
  }
  return {};
}

TEST(WholeBox, AccountsForEverythingThroughFiveMinutesOfTrouble) {
  UsbGadget gadget{BOARD_VM};
  give("/dev/ttyGS0");
  ReceiverGadget receiver;
  auto player = std::make_unique<ReceiverPlayer>(std::vector<std::string>{"--rate", "1973", "--samples", "7"});
  ReceiverGadget::grant();
  Machine machine;
  BoxProcess box{BOARD_VM};
  edit(box.board() / "box.toml", "probe = \"none\"", "probe = \"usb:RX-VM\"");
  edit(box.board() / "probe.toml", "rate_hz = 2000", "rate_hz = 1973");
  box.start({"--link", "usb", "--link", "tcp:127.0.0.1:7627", "--cnc", "modbus:/dev/ttyGS0"});
  // On a link of its own each time: nobody would speak for one that stays while something else is waited for.
  const auto status = [] {
    const auto host = support::TestHost::connect("tcp:127.0.0.1:7627");
    return host ? host->ask<messages::Status>() : messages::Status::Answer{};
  };
  const auto eventually = [](const auto& is_so) {
    for (int tries = 0; tries < 100; ++tries, sleep_for(300ms)) {
      if (is_so()) return true;
    }
    return false;
  };
  ASSERT_TRUE(eventually([&] {
    const auto sources = status().sources;
    return std::ranges::all_of(sources, [](const auto& source) { return source.problem.empty(); });
  })) << box.log();
  machine.start();
  ASSERT_TRUE(eventually([&] {
    const auto now = status();
    return now.clock.state == ClockState::locked && now.receiver.state == ClockState::locked;
  })) << box.log();

  const auto begin = std::chrono::steady_clock::now();
  Recording recording{300};
  ASSERT_TRUE(recording.running()) << box.log();
  Controller controller;
  Processor processor;
  const auto at = [&](std::chrono::seconds second, const char* trouble) {
    sleep_until(begin + second);
    const auto now = status();
    std::printf(
        "%3lld s: %s (%llu samples, %llu lost so far; receiver +- %.1f us, locked %s, %llu times anew; "
        "the processor was %.0f %% busy)\n",
        static_cast<long long>(second.count()), trouble, static_cast<unsigned long long>(now.ledger.produced),
        static_cast<unsigned long long>(now.ledger.lost_at_source), 1e-3 * now.receiver.sigma_ns,
        now.receiver.state == ClockState::locked ? "yes" : "no", static_cast<unsigned long long>(now.receiver.relocks),
        100 * processor.busyShare());
    std::fflush(stdout);
  };
  at(20s, "the chip is unplugged");
  machine.unplugFor(2s);
  at(50s, "the receiver is unplugged");
  receiver.unbind(), sleep_for(2s), receiver.bind();
  ReceiverGadget::grant();
  at(80s, "the receiver is replaced");
  player.reset();
  while (!ReceiverGadget::node().empty()) sleep_for(20ms);  // the host takes its time to notice
  player = std::make_unique<ReceiverPlayer>(std::vector<std::string>{"--rate", "1973", "--samples", "7"});
  ReceiverGadget::grant();
  at(110s, "the box leaves the bus");
  gadget.unbind(), sleep_for(2s), gadget.bind();
  at(140s, "the host's cable is pulled");
  gadget.unplug(), sleep_for(1s), gadget.plugIn();
  at(170s, "the host stops reading");
  recording.signal(SIGSTOP), sleep_for(4s), recording.signal(SIGCONT);
  at(200s, "the box stands still");
  box.freeze(), sleep_for(300ms), box.thaw();
  at(230s, "box and receiver leave the bus");
  gadget.unbind(), receiver.unbind(), sleep_for(2s), receiver.bind(), gadget.bind();
  ReceiverGadget::grant();
  at(260s, "the chip is unplugged again");
  machine.unplugFor(1s);
  at(298s, "the end");
  const auto sums = recording.summary();
  const auto seen = controller.stop();
  machine.stop();

  EXPECT_TRUE(box.running());
  EXPECT_EQ(sums.value("exit_status", -1), 0) << sums.dump() << box.log();
  EXPECT_TRUE(sums.value("balanced", false)) << sums.dump();
  EXPECT_EQ(sums.value("lost_on_link_samples", -1), 0) << sums.dump();
  EXPECT_EQ(sums.value("lost_in_queue_samples", -1), 0) << sums.dump();
  EXPECT_EQ(sums.value("box_restarts", -1), 0) << sums.dump();
  EXPECT_GE(sums.value("reconnections", 0), 4) << sums.dump();
  const double produced = sums.value("produced_samples", 0.0);
  EXPECT_GT(produced, 0.95 * 300 * 2000) << sums.dump();
  // What was lost was lost with its source: the troubles take about 30 s, and each new beginning of the receiver's
  // clock up to half a minute, until 1 ms frames tell when a sample was within 20 us.
  EXPECT_GT(sums.value("received_samples", 0.0), 0.5 * produced) << sums.dump();

  EXPECT_GT(seen.answers, 100);
  EXPECT_EQ(seen.wrong, 0);
  EXPECT_EQ(seen.backwards, 0);

  EXPECT_TRUE(eventually([&] {
    const auto line = lineOf(status(), "touch");
    return line.edges + line.lost >= machine.touchEdges();
  }));
  const auto after = status();
  EXPECT_EQ(lineOf(after, "touch").edges, machine.touchEdges());
  EXPECT_EQ(lineOf(after, "touch").lost, 0U);
  EXPECT_EQ(after.receiver.state, ClockState::locked);
  EXPECT_EQ(after.events.lost_in_queue, 0U);
  EXPECT_EQ(after.ledger.lost_in_queue, 0U);
  EXPECT_GE(after.usb_ports.at(0).connections, 4U);
  for (const auto& source : after.sources) EXPECT_EQ(source.problem, "") << source.name;
  std::printf("samples: %s\n", sums.dump().c_str());
  std::printf("controller: %d answers, %d while the clock was not locked\n", seen.answers, seen.unlocked);
  std::printf("edges: %llu of the touch line, %llu lost, %llu made\n",
              static_cast<unsigned long long>(lineOf(after, "touch").edges),
              static_cast<unsigned long long>(lineOf(after, "touch").lost),
              static_cast<unsigned long long>(machine.touchEdges()));
}

}  // namespace
}  // namespace probebox::vm
