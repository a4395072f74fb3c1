#include "firmware/app/wiring/board_sources.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>
#include <span>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "board/describe/machine.hpp"
#include "board/describe/parse.hpp"
#include "board/describe/world.hpp"
#include "drivers/gpio/lines.hpp"
#include "drivers/gpio/loop_back_emulator.hpp"
#include "drivers/gpio/quadrature.hpp"
#include "drivers/iio/linux_buffer.hpp"
#include "drivers/iio/linux_polled.hpp"
#include "drivers/iio/sensors.hpp"
#include "drivers/io/byte_pipe.hpp"
#include "drivers/io/event_source.hpp"
#include "drivers/tcp/linux_tcp.hpp"
#include "drivers/usb_probe/linux_receiver.hpp"
#include "drivers/world/box_link.hpp"
#include "drivers/world/controller.hpp"
#include "drivers/world/following.hpp"
#include "drivers/world/lateness.hpp"
#include "drivers/world/world.hpp"
#include "firmware/app/log/log.hpp"
#include "firmware/app/threads/counters.hpp"
#include "firmware/app/wiring/controller_link.hpp"
#include "firmware/app/wiring/encoder_sources.hpp"
#include "firmware/app/wiring/gpio_line.hpp"
#include "protocol/units/angle.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::app {
namespace {

// Lets a program on this computer lead the emulated machine, by lines of text over TCP ([outside_control] in
// board/sim/world.toml explains them). One at a time: another one waits until the first has gone.
class OutsideControl {
 public:
  static Outcome<std::unique_ptr<OutsideControl>> open(const board::World& description, world::World& world);

  // Does and answers what has been sent. Never blocks.
  void serve(MonoTime now);
  // As far as the world may advance.
  MonoTime known(MonoTime now) const { return following_.known(now); }

 private:
  OutsideControl(const board::World& description, world::World& world, tcp::Listener listener);
  void receive();
  std::string answer(std::string_view line, MonoTime now);
  std::optional<std::string> take(std::string_view values, MonoTime now);
  void send();

  bool swivels_head_, tilts_table_;  // by B
  world::World& world_;
  world::Following following_;
  tcp::Listener listener_;
  std::unique_ptr<io::BytePipe> control_;
  std::string received_, unsent_;
};

// Replaces all drivers by the emulated machine. Its controller runs in the same thread and reaches the box only through
// `link`; where world.toml names an outside control, that one leads the machine instead.
class SimSource : public io::EventSource {
 public:
  static Outcome<std::unique_ptr<SimSource>> open(const board::World& world, const board::Machine& machine,
                                                  std::unique_ptr<world::BoxLink> link, MonoTime start);
  SimSource(const board::World& world, const board::Machine& machine, std::unique_ptr<world::BoxLink> link,
            MonoTime start);

  std::size_t read(std::span<Event> into, MonoTime now) override;
  int descriptor() const override { return -1; }
  std::string_view name() const override { return "the emulated machine"; }

 private:
  void advanceTo(MonoTime now);

  world::World world_;
  std::unique_ptr<world::BoxLink> link_;
  world::Controller controller_;
  std::unique_ptr<OutsideControl> outside_control_;
  MonoTime reached_;
};

constexpr std::size_t kLongestLine = 512;
constexpr std::size_t kMostUnsent = 1U << 20U;  // a control that never reads its answers

// A controller's servo cycle.
constexpr Nanoseconds kCycle = std::chrono::milliseconds{1};

Outcome<std::unique_ptr<OutsideControl>> OutsideControl::open(const board::World& description, world::World& world) {
  TRY(auto listener, tcp::Listener::open({.host = "127.0.0.1", .port = description.outside_control->port}));
  return std::unique_ptr<OutsideControl>{new OutsideControl{description, world, std::move(listener)}};
}

OutsideControl::OutsideControl(const board::World& description, world::World& world, tcp::Listener listener)
    : swivels_head_{description.outside_control->b_swivels_head && description.swivel_head},
      tilts_table_{!description.outside_control->b_swivels_head && description.tilting_table},
      world_{world},
      following_{{.cycle = Nanoseconds{description.outside_control->cycle_ns}}, world},
      listener_{std::move(listener)} {}

void OutsideControl::serve(MonoTime now) {
  if (!control_) {
    control_ = listener_.accept();
    received_.clear();
    unsent_.clear();
  }
  if (!control_) return;
  receive();
  std::size_t begin = 0;
  for (auto end = received_.find('\n'); end != std::string::npos; end = received_.find('\n', begin)) {
    unsent_ += answer(std::string_view{received_}.substr(begin, end - begin), now) + '\n';
    begin = end + 1;
  }
  received_.erase(0, begin);
  send();
  if (received_.size() > kLongestLine || unsent_.size() > kMostUnsent) control_.reset();
}

void OutsideControl::receive() {
  std::array<std::byte, 4096> bytes{};
  while (control_) {
    const auto [count, state] = control_->read(bytes);
    received_.append(reinterpret_cast<const char*>(bytes.data()), count);
    if (state == io::PipeState::closed) control_.reset();
    if (count < bytes.size()) return;
  }
}

std::string OutsideControl::answer(std::string_view line, MonoTime now) {
  const auto space = line.find(' ');
  const auto number = line.substr(0, space);
  if (const auto wrong = take(space == std::string_view::npos ? "" : line.substr(space), now)) return "? " + *wrong;
  return std::string{number} + (world_.machine().touching() ? " 1 " : " 0 ") +
         std::to_string(world_.machine().crashes());
}

std::optional<std::string> OutsideControl::take(std::string_view values, MonoTime now) {
  std::istringstream words{std::string{values}};
  world::Lead lead;
  world::Vector3 angles_deg{};
  for (double& motor : lead.motor_mm) words >> motor;
  for (double& angle : angles_deg) words >> angle;
  words >> lead.tool;
  const bool complete = !words.fail();
  std::string mount, more;
  const bool has_mount = static_cast<bool>(words >> mount);
  const auto* const end = mount.data() + mount.size();
  const bool readable = !has_mount || std::from_chars(mount.data(), end, lead.mount).ptr == end;
  if (!complete || !readable || words >> more)
    return "a line is a number, X Y Z in mm, A B C in degrees, the tool's number, and the mount of the balls where it "
           "is "
           "not the first";
  const double b_rad = angles_deg[1] * kDegree;
  lead.pose = {.a_rad = angles_deg[0] * kDegree,
               .head_rad = swivels_head_ ? b_rad : 0,
               .table_rad = tilts_table_ ? b_rad : 0,
               .c_rad = angles_deg[2] * kDegree};
  return following_.take(lead, now);
}

void OutsideControl::send() {
  if (!control_ || unsent_.empty()) return;
  const auto [count, state] = control_->write(std::as_bytes(std::span{unsent_}));
  unsent_.erase(0, count);
  if (state == io::PipeState::closed) control_.reset();
}

Outcome<std::unique_ptr<SimSource>> SimSource::open(const board::World& world, const board::Machine& machine,
                                                    std::unique_ptr<world::BoxLink> link, MonoTime start) {
  auto source = std::make_unique<SimSource>(world, machine, std::move(link), start);
  if (world.outside_control) {
    TRY(auto control, OutsideControl::open(world, source->world_));
    source->outside_control_ = std::move(control);
  }
  return source;
}

world::ControllerConfig controllerOf(const board::World& world, const board::Machine& machine) {
  auto config = world::controllerFor(world);
  config.has_y = machine.has_y;
  return config;
}

SimSource::SimSource(const board::World& world, const board::Machine& machine, std::unique_ptr<world::BoxLink> link,
                     MonoTime start)
    : world_{{world, machine, start}, world.seed},
      link_{std::move(link)},
      controller_{controllerOf(world, machine), world_.machine(), *link_},
      reached_{start} {
  for (const auto& fault : world.faults) world_.inject(world::faultFrom(start, fault));
}

std::size_t SimSource::read(std::span<Event> into, MonoTime now) {
  advanceTo(now);
  return world_.poll(into);
}

void SimSource::advanceTo(MonoTime now) {
  if (outside_control_) {
    outside_control_->serve(now);
    return world_.advanceTo(outside_control_->known(now));
  }
  while (reached_ < now) {
    reached_ = std::min(reached_ + kCycle, now);
    controller_.advance(reached_);
    world_.advanceTo(reached_);
  }
}

// Opens the drivers of the sensors on IIO devices that box.toml names, one per device.
std::vector<std::unique_ptr<io::EventSource>> sensorSources(const board::Descriptions& descriptions) {
  std::vector<std::unique_ptr<io::EventSource>> sources;
  for (auto& device : iio::devicesOf(descriptions.box.sensors, descriptions.probe.rate_hz)) {
    if (device.buffered) {
      sources.push_back(std::make_unique<iio::LinuxBuffer>(std::move(device)));
    } else {
      sources.push_back(std::make_unique<iio::LinuxPolled>(std::move(device)));
    }
  }
  return sources;
}

// A probe receiver that status shows, with its damaged packets.
class ProbeReceiver final : public io::EventSource {
 public:
  // serial_number: empty for the only receiver. number: 0 the first, 1 the second. The descriptions are supported.
  // `counters` must outlive this.
  ProbeReceiver(std::string serial_number, const board::Descriptions& descriptions, std::uint8_t number,
                ReceiverCounters& counters)
      : receiver_{std::move(serial_number),
                  {counterAxes(descriptions, number), wiredLines(descriptions.box, number), number},
                  frontEndSettings(descriptions, number).value()},
        counters_{counters},
        noise_um_{descriptions.probe.noise_um} {}

  std::size_t read(std::span<Event> into, MonoTime now) override {
    const std::size_t count = receiver_.read(into, now);
    counters_.bad_packets = receiver_.packets().bad();
    if (std::exchange(shown_, receiver_.changes()) != receiver_.changes()) show();
    const auto& inputs = receiver_.inputs();
    if (std::exchange(shown_windows_, inputs.windows()) != inputs.windows()) counters_.inputs.publish(inputs.last());
    return count;
  }
  int descriptor() const override { return receiver_.descriptor(); }
  std::string_view name() const override { return receiver_.name(); }
  std::string_view problem() const override { return receiver_.problem(); }
  std::uint32_t faults() const override { return receiver_.faults(); }
  std::span<const io::SourceFault> faultNames() const override { return receiver_.faultNames(); }

 private:
  void show() {
    const auto* const front_end = receiver_.frontEnd();
    messages::FrontEndStatus status;
    status.serial_number = receiver_.serialNumber();
    status.packet_version = receiver_.packetVersion();
    status.stated_noise_um = noise_um_;
    status.lacks = usb_probe::whatIsLacking(front_end, status.packet_version);
    if (front_end != nullptr) {
      const auto& [identity, pins, settings] = *front_end;
      status.version = usb_probe::versionText(identity.version);
      status.counters = identity.counters;
      status.lines = identity.lines;
      status.step_ps = identity.step_ps;
      const double steps_hz = 1e12 / identity.step_ps;
      status.rate_hz = steps_hz / settings.steps_a_sample;
      status.samples_a_packet = settings.samples_a_packet;
      status.sync_out_hz = settings.sync_out_steps == 0 ? 0 : steps_hz / settings.sync_out_steps;
      std::ranges::transform(settings.full_scale_nm, status.full_scale_um.begin(), [](auto nm) { return 1e-3 * nm; });
      for (std::size_t i = 0; i < std::min(pins.size(), front_end::kPins.size()); ++i)
        status.pins.push_back({.name = std::string{front_end::kPins.at(i).name}, .gpio = pins[i]});
    }
    if (!status.lacks.empty() && std::exchange(logged_, status.lacks) != status.lacks)
      logWarning(std::string{name()} + " lacks something: " + status.lacks + ".");
    counters_.front_end.publish(status);
  }

  usb_probe::LinuxReceiver receiver_;
  ReceiverCounters& counters_;
  unsigned shown_{}, shown_windows_{};
  double noise_um_;
  std::string logged_;
};

using Sources = std::vector<std::unique_ptr<io::EventSource>>;

Outcome<Sources> openSim(const board::Descriptions& descriptions, const tcp::Address& box, MonoTime now) {
  TRY(auto machine, SimSource::open(*descriptions.world, descriptions.machine,
                                    std::make_unique<ControllerLink>(box, descriptions.machine.has_y), now));
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
    sources.push_back(std::make_unique<ProbeReceiver>(std::move(*receiver), descriptions, 0, counters.receivers[0]));
  if (const auto& second = box.second_receiver)
    sources.push_back(std::make_unique<ProbeReceiver>(second->serial_number, descriptions, 1, counters.receivers[1]));
  for (auto& sensors : sensorSources(descriptions)) sources.push_back(std::move(sensors));
  return sources;
}

// Stamps as late as those of the emulated machine's sync line are, of a stream of their own. A jumper loses nothing.
gpio::EmulatedLoopBack::NextLateness emulatedLateness(const board::World& world) {
  constexpr std::uint64_t kStream = 17;
  return [clock = world.clock, random = world::Random{world.seed, kStream}]() mutable -> std::optional<Nanoseconds> {
    bool outlier = false;
    return Nanoseconds{std::llround(world::latenessNs(clock, random, outlier))};
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
  if (const auto settings = frontEndSettings(descriptions); !settings) return settings.error();
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

Outcome<std::optional<front_end::Settings>> frontEndSettings(const board::Descriptions& descriptions,
                                                             std::uint8_t number) {
  constexpr double kSteps_hz = double{front_end::kSystemHz} / front_end::kCyclesAStep;
  constexpr double kMostOff = 1e-4;  // the box takes a receiver that is 2e-4 off, its crystal's error included
  if (!descriptions.box.front_end) return std::optional<front_end::Settings>{};
  const auto& [full_scale_um, sync_out_hz, samples_a_packet] = *descriptions.box.front_end;
  const double rate_hz = descriptions.probe.rate_hz;
  const double least_hz = kSteps_hz / front_end::kMostSteps, most_hz = kSteps_hz / front_end::kLeastSteps;
  const double steps = std::round(kSteps_hz / std::clamp(rate_hz, least_hz, most_hz));
  if (std::abs(kSteps_hz / steps / rate_hz - 1) > kMostOff)
    return Error{"probe.toml: rate_hz = " + board::plain(rate_hz) + " is no rate of the front end ([front_end] of " +
                 "box.toml): write " + board::plain(std::round(100 * kSteps_hz / steps) / 100) +
                 ", or another from 100 to 10000 that is a whole number of steps of 48 ns"};
  front_end::Settings settings{.steps_a_sample = static_cast<std::uint32_t>(steps),
                               .samples_a_packet = samples_a_packet,
                               .sync_out_steps = 0,
                               .full_scale_nm = {}};
  if (sync_out_hz && number == 0)
    settings.sync_out_steps = static_cast<std::uint32_t>(std::lround(kSteps_hz / *sync_out_hz));
  std::ranges::transform(full_scale_um, settings.full_scale_nm.begin(),
                         [](double um) { return static_cast<std::int32_t>(std::lround(1000 * um)); });
  return std::optional{settings};
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
