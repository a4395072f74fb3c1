// Plays a probe receiver on a device controller until its input ends. Commands, one a line, each answered by the
// counts:
//   drop N      the next N packets are taken and never sent
//   corrupt N   the next N packets get a wrong bit
//   mute, speak samples are taken and none is sent; are sent again
//   restart C   the counter goes on at C, as after a failure of power
//   counts      nothing but the counts: taken delivered withheld refused returned
#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <iostream>
#include <poll.h>
#include <sstream>
#include <string>
#include <sys/timerfd.h>
#include <unistd.h>

#include "drivers/io/descriptor.hpp"
#include "played_receiver.hpp"

namespace {

using namespace probebox;

struct Options {
  std::string mount{"/run/receiver"};
  std::string gadget{"/sys/kernel/config/usb_gadget/receiver"};
  std::string controller{"dummy_udc.1"};
  usb_probe::EmulatedReceiver::Config receiver{.samples_a_packet = 10};
  double amplitude_um{500};
  double sine_hz{1};
};

void describe(CLI::App& command, Options& options) {
  command.add_option("--mount", options.mount, "where FunctionFS is mounted")->capture_default_str();
  command.add_option("--gadget", options.gadget, "the gadget's folder in configfs")->capture_default_str();
  command.add_option("--controller", options.controller, "a device controller of /sys/class/udc")
      ->capture_default_str();
  command.add_option("--rate", options.receiver.rate_hz, "Hz, nominal")->capture_default_str();
  command.add_option("--ppm", options.receiver.offset_ppm, "how much longer its sample period is")
      ->capture_default_str();
  command.add_option("--samples", options.receiver.samples_a_packet, "in a packet")->capture_default_str();
  command.add_option("--first", options.receiver.first_counter, "counter of the first sample")->capture_default_str();
  command.add_option("--amplitude-um", options.amplitude_um, "of channel a, a sine of the monotonic clock")
      ->capture_default_str();
  command.add_option("--sine-hz", options.sine_hz, "its frequency; channel b is its cosine, channel c stands still")
      ->capture_default_str();
}

MonoTime monotonicNow() {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return monoTime(std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec);
}

// Channels by the time of the kernel's clock, so that whoever gets a sample can tell when it was taken.
usb_probe::EmulatedReceiver::Waveform waveform(const Options& options, MonoTime start) {
  return [=](Nanoseconds since_start) {
    const double phase = 2 * M_PI * options.sine_hz * toSeconds(start.time_since_epoch() + since_start);
    return std::array{Micrometres{options.amplitude_um * std::sin(phase)},
                      Micrometres{options.amplitude_um * std::cos(phase)}, Micrometres{10}};
  };
}

// False when the word is unknown.
bool obey(vm::PlayedReceiver& played, const std::string& line) {
  std::istringstream words{line};
  std::string word;
  std::uint32_t number = 0;
  words >> word >> number;
  if (word == "drop") {
    played.dropPackets(number);
  } else if (word == "corrupt") {
    played.corruptPackets(number);
  } else if (word == "mute" || word == "speak") {
    played.setMute(word == "mute");
  } else if (word == "restart") {
    played.restart(number);
  } else {
    return word == "counts";
  }
  return true;
}

void sayCounts(const vm::PlayedCounts& counts) {
  const auto& [taken, delivered, withheld, refused, returned] = counts;
  std::cout << taken << ' ' << delivered << ' ' << withheld << ' ' << refused << ' ' << returned << std::endl;
}

void setAlarm(int timer, MonoTime at) {
  const itimerspec once{{0, 0}, {toNs(at) / 1'000'000'000, toNs(at) % 1'000'000'000}};
  timerfd_settime(timer, TFD_TIMER_ABSTIME, &once, nullptr);
}

// Whole lines of the standard input; empty and false at its end.
class Commands {
 public:
  bool read(vm::PlayedReceiver& played) {
    std::array<char, 256> text{};
    const auto got = ::read(STDIN_FILENO, text.data(), text.size());
    if (got <= 0) return false;
    pending_.append(text.data(), static_cast<std::size_t>(got));
    for (auto end = pending_.find('\n'); end != std::string::npos; end = pending_.find('\n')) {
      const std::string line = pending_.substr(0, end);
      pending_.erase(0, end + 1);
      if (!obey(played, line)) std::cerr << "receiver-player: what is '" << line << "'?" << std::endl;
      sayCounts(played.counts());
    }
    return true;
  }

 private:
  std::string pending_;
};

int play(vm::PlayedReceiver& played) {
  const io::Descriptor timer{timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK)};
  Commands commands;
  while (true) {
    setAlarm(timer.get(), played.nextPacketAt());
    std::array<pollfd, 3> waiting{pollfd{timer.get(), POLLIN, 0}, pollfd{played.descriptor(), POLLIN, 0},
                                  pollfd{STDIN_FILENO, POLLIN, 0}};
    if (poll(waiting.data(), waiting.size(), -1) < 0) continue;
    played.turn(monotonicNow());
    if (waiting[2].revents != 0 && !commands.read(played)) return 0;
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App command{"Plays a probe receiver on a USB device controller."};
  Options options;
  describe(command, options);
  CLI11_PARSE(command, argc, argv);
  const MonoTime start = monotonicNow();
  const auto played = vm::PlayedReceiver::open(options.receiver, waveform(options, start), start, options.mount,
                                               options.gadget, options.controller);
  if (!played) {
    std::cerr << "receiver-player: " << played.error().what << std::endl;
    return 1;
  }
  sayCounts((*played)->counts());
  return play(**played);
}
