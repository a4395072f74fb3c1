#include "firmware/app/wiring/board_sources.hpp"

#include <cmath>
#include <string>
#include <string_view>
#include <utility>
#include <variant>

#include "drivers/gpio/lines.hpp"
#include "drivers/gpio/loop_back_emulator.hpp"
#include "drivers/gpio/quadrature.hpp"
#include "drivers/world/from_description.hpp"
#include "drivers/world/lateness.hpp"
#include "firmware/app/wiring/controller_link.hpp"
#include "firmware/app/wiring/encoder_sources.hpp"
#include "firmware/app/wiring/gpio_line.hpp"
#include "firmware/app/wiring/probe_receiver.hpp"
#include "firmware/app/wiring/sensor_sources.hpp"
#include "firmware/app/wiring/sim_source.hpp"

namespace probebox::app {
namespace {

using Sources = std::vector<std::unique_ptr<io::EventSource>>;

Outcome<Sources> openSim(const board::Descriptions& descriptions, const tcp::Address& box, MonoTime now) {
  TRY(auto machine,
      SimSource::open(*descriptions.world, descriptions.machine, std::make_unique<ControllerLink>(box), now));
  Sources sources;
  sources.push_back(std::move(machine));
  return sources;
}

// Devices that cannot be opened yet are retried while the box runs.
Sources openReal(const board::Descriptions& descriptions, Counters& counters) {
  const auto& box = descriptions.box;
  Sources sources;
  for (auto& line : gpio::linesApart(box)) sources.push_back(std::make_unique<GpioLine>(std::move(line)));
  for (auto& encoder : openEncoders(descriptions)) sources.push_back(std::move(encoder));
  if (auto receiver = receiverOf(box.devices))
    sources.push_back(std::make_unique<ProbeReceiver>(std::move(*receiver), counterAxes(descriptions), counters));
  for (auto& sensors : sensorSources(descriptions)) sources.push_back(std::move(sensors));
  return sources;
}

// Stamps as late as those of the emulated machine's sync line are, of a stream of their own. A jumper loses nothing.
gpio::EmulatedLoopBack::NextLateness emulatedLateness(const board::World& world) {
  constexpr std::uint64_t kStream = 17;
  return [sync = world::fromDescription(world).sync,
          random = world::Random{world.seed, kStream}]() mutable -> std::optional<Nanoseconds> {
    bool outlier = false;
    return Nanoseconds{std::llround(world::latenessNs(sync, random, outlier))};
  };
}

}  // namespace

bool isEmulated(const board::Descriptions& descriptions) {
  return descriptions.box.devices.encoders == "sim" && descriptions.box.devices.probe == "sim";
}

std::optional<Error> whyUnsupported(const board::Descriptions& descriptions) {
  const auto& devices = descriptions.box.devices;
  if (isEmulated(descriptions)) {
    if (descriptions.world) return std::nullopt;
    return Error{
        "box.toml asks for the emulated machine (sim), but its folder has no world.toml: add one, such as the one in "
        "board/sim."};
  }
  const bool knows_probe = devices.probe == "none" || devices.probe == "trigger" || countsSamples(devices);
  const bool knows_encoders = devices.encoders == "none" || devices.encoders == "axes";
  if (knows_encoders && knows_probe) return whyUnsupportedEncoders(devices);
  return Error{"box.toml, [devices]: encoders = \"" + devices.encoders + "\" with probe = \"" + devices.probe +
               "\" is not in this build. It has: both \"sim\" (the emulated machine); or encoders \"none\" or "
               "\"axes\" (each as [encoder.AXIS] says) with probe \"none\", \"usb\" (a receiver on USB), "
               "\"usb:SERIAL\" (the one with that serial number), \"iio\" (a converter, [probe_adc]) or \"trigger\" (a "
               "touch-trigger probe)."};
}

std::optional<std::string> receiverOf(const board::Devices& devices) {
  constexpr std::string_view kNamed = "usb:";
  if (devices.probe == "usb") return std::string{};
  if (!devices.probe.starts_with(kNamed) || devices.probe.size() == kNamed.size()) return std::nullopt;
  return devices.probe.substr(kNamed.size());
}

bool countsSamples(const board::Devices& devices) {
  return devices.probe == "iio" || receiverOf(devices);
}

Outcome<Sources> openSources(const board::Descriptions& descriptions, const tcp::Address& box, MonoTime now,
                             Counters& counters) {
  if (auto refused = whyUnsupported(descriptions)) return *refused;
  if (isEmulated(descriptions)) return openSim(descriptions, box, now);
  return openReal(descriptions, counters);
}

std::vector<gpio::ChipLines> watchedLines(const board::Box& box) {
  auto lines = gpio::linesApart(box);
  for (std::size_t axis = 0; axis < board::kAllEncoderAxes.size(); ++axis) {
    const auto& encoder = board::encoderOf(box.devices, axis);
    const auto* const counted = encoder ? std::get_if<board::QuadratureEncoder>(&encoder->by) : nullptr;
    if (counted != nullptr) lines.push_back(gpio::quadratureLines(counted->a, counted->b));
  }
  return lines;
}

std::unique_ptr<gpio::LoopBack> loopBackOf(const board::Descriptions& descriptions) {
  const auto& lines = descriptions.box.loop_back;
  if (!lines) return nullptr;
  if (isEmulated(descriptions)) return std::make_unique<gpio::EmulatedLoopBack>(emulatedLateness(*descriptions.world));
  return std::make_unique<gpio::LinuxLoopBack>(*lines, watchedLines(descriptions.box));
}

}  // namespace probebox::app
