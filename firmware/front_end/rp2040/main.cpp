#include <algorithm>
#include <array>
#include <cstring>
#include <optional>

#include "firmware/front_end/core/assembly.hpp"
#include "firmware/front_end/core/control.hpp"
#include "firmware/front_end/rp2040/chip.hpp"
#include "firmware/front_end/rp2040/converter.hpp"
#include "firmware/front_end/rp2040/latching.hpp"
#include "firmware/front_end/rp2040/registers.hpp"
#include "firmware/front_end/rp2040/usb.hpp"

// The program: one loop that never waits. The hardware latches; a pass reads what it has latched.
namespace probebox::front_end {
namespace {

constexpr std::uint32_t kGoodbyeUs = 20'000;  // for the status stage of the request that ends the program

class Program {
 public:
  Program(const std::array<char, 16>& identity, const StartCause& cause)
      : control_{assembly_, identity}, usb_{control_, assembly_}, run_{cause.run} {
    if (cause.watchdog) assembly_.raise(usb_probe::ReceiverFault::watchdog);
    if (cause.brown_out) assembly_.raise(usb_probe::ReceiverFault::brown_out);
  }

  void start() {
    converter_.prepare();
    assembly_.start(Settings{}, run_);
    latching_.start(assembly_.settings());
    usb_.start();
  }

  void pass() {
    const auto now = nowUs();
    usb_.poll();
    latching_.tellChanges(assembly_);  // at each pass: none has many to tell
    takeSample(now);
    assembly_.work();
    if (const auto settings = control_.takeSettings()) restart(*settings);
    if (control_.takeBootLoader()) goodbye_us_ = now;
    if (goodbye_us_ && now - *goodbye_us_ > kGoodbyeUs) {
      latching_.stop();
      usb_.disconnect();
      restartIntoBootLoader();
    }
    setLed(control_.configured());
    assembly_.counters().most_pass_us = std::max(assembly_.counters().most_pass_us, nowUs() - now);
  }

 private:
  void takeSample(std::uint32_t now) {
    if (!sample_) {
      if (!latching_.hasNext()) return;
      latching_.next(sample_.emplace());
      converter_.begin(now);
    }
    const auto state = converter_.poll(now);
    sample_->is_late = latching_.hasNext();
    if (state != Ad7606::State::done && state != Ad7606::State::silent && !sample_->is_late) return;
    sample_->has_deflection = state == Ad7606::State::done && !sample_->is_late;
    sample_->deflection = converter_.values();
    latching_.tellChanges(assembly_);
    assembly_.sample(*sample_);
    sample_.reset();
  }

  // The counter begins anew with another rate.
  void restart(const Settings& settings) {
    latching_.stop();
    sample_.reset();
    assembly_.start(settings, ++run_);
    latching_.start(settings);
  }

  Assembly assembly_;
  Control control_;
  Usb usb_;
  Latching latching_;
  Ad7606 converter_;
  std::uint8_t run_;
  std::optional<Latched> sample_;
  std::optional<std::uint32_t> goodbye_us_;
};

alignas(Program) std::byte place[sizeof(Program)];

[[noreturn]] void run() {
  startChip();
  const auto cause = startCause();
  const auto identity = flashIdentity();
  auto& program = *new (place) Program{identity, cause};
  program.start();
  startWatchdog();
  while (true) {
    program.pass();
    feedWatchdog();
  }
}

}  // namespace
}  // namespace probebox::front_end

extern "C" {

extern std::uint32_t bss_begin, bss_end, stack_top;

// An exception ends in the watchdog.
[[noreturn]] void fault() {
  while (true) {
  }
}

[[noreturn]] void reset() {
  std::fill(&bss_begin, &bss_end, 0U);
  probebox::front_end::run();
}

using Handler = void (*)();
struct VectorTable {
  std::uint32_t* stack;
  Handler reset;
  std::array<Handler, 46> others;
};
constexpr auto allFault() {
  std::array<Handler, 46> all{};
  all.fill(fault);
  return all;
}
[[gnu::section(".vectors"), gnu::used]] const VectorTable vectors{&stack_top, reset, allFault()};
static_assert(sizeof(VectorTable) == probebox::front_end::kImageMarkAt - probebox::front_end::kBoot2Bytes);
[[gnu::section(".image_mark"), gnu::used]] const probebox::front_end::ImageMark image_mark{};

}  // extern "C"
