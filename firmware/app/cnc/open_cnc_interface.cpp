#include "firmware/app/cnc/open_cnc_interface.hpp"

#include <array>
#include <cstdio>
#include <functional>
#include <memory>
#include <optional>
#include <pthread.h>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include "firmware/app/cnc/cnc_interface.hpp"
#include "firmware/app/cnc/controller_requests.hpp"
#include "firmware/app/cnc/register_server.hpp"
#include "firmware/app/cnc/text_server.hpp"
#include "firmware/app/log/log.hpp"
#include "firmware/app/threads/time_source.hpp"
#include "protocol/modbus/refusals.hpp"

namespace probebox::app {
namespace {

// Serves a controller that sends and reads text.
class TextLine final : public CncInterface {
 public:
  TextLine(const TextOptions& options, const board::Access& may, StateBuffer& states,
           const CncDependencies& dependencies);
  ~TextLine() override;

  void start() override;
  messages::CncLineStatus status() const override;
  std::uint64_t rounds() const override { return server_.rounds(); }

 private:
  void compare(const tape::Positions& reached);

  board::Access may_;
  StateBuffer& states_;
  CncDependencies deps_;
  std::string device_;
  std::string connection_;  // name in the ConnectionInhibits
  TimeSource time_;
  LimitedWarning warnings_{std::chrono::seconds{10}};
  LimitedWarning reached_{std::chrono::seconds{1}, logInfo};
  TextServer server_;
  std::thread thread_;
};

TextLine::TextLine(const TextOptions& options, const board::Access& may, StateBuffer& states,
                   const CncDependencies& dependencies)
    : may_{may},
      states_{states},
      deps_{dependencies},
      device_{options.line.path},
      connection_{(options.format == TextOptions::Format::tape ? "tape:" : "records:") + device_},
      server_{
          options,
          // A tape is read once and taken whole; records are followed.
          {.snapshot =
               [this, follows = options.format != TextOptions::Format::tape] {
                 const auto snapshot = states_.newest().snapshot;
                 return follows ? deps_.served.shownTo(connection_, snapshot) : snapshot;
               },
           // Written down before it goes out.
           .serves = [this](const published::Snapshot& snapshot) { deps_.served.note(snapshot, connection_); },
           .take =
               [this](const tape::Said& said) { return deps_.handler.take(said, connection_, states_.newest(), may_); },
           .run = [this] { return states_.newest().snapshot.calibration_run; },
           .report = [this](const std::string& text) { warnings_.warn(time_.now(), text); },
           .reached = [this](const tape::Positions& reached) { compare(reached); },
           .round =
               [this] {
                 warnings_.look(time_.now());
                 reached_.look(time_.now());
               }}} {}

TextLine::~TextLine() {
  server_.stop();
  if (thread_.joinable()) thread_.join();
}

void TextLine::start() {
  thread_ = std::thread{[this] { server_.run(); }};
  pthread_setname_np(thread_.native_handle(), "cnc-text");
}

messages::CncLineStatus TextLine::status() const {
  const auto counters = server_.counters();
  return {.name = device_,
          .answered = counters.answered,
          .refused = counters.refused,
          .bad_frames = 0,
          .skipped_bytes = 0,
          .unsent = counters.unsent,
          .reopened = counters.reopened};
}

// A control's own display beside the box's encoders, in the log: they differ by the correction and by lost counts.
void TextLine::compare(const tape::Positions& reached) {
  const auto& axes = states_.newest().snapshot.axes;
  std::string text = device_ + " reports";
  for (std::size_t i = 0; i < axes.size(); ++i) {
    if (!reached.at_mm[i]) continue;
    std::array<char, 80> words{};
    std::snprintf(words.data(), words.size(), " %c %.4f (the box: %s%.4f)", "XYZ"[i], *reached.at_mm[i],
                  axes[i].referenced ? "" : "not referenced, ", axes[i].position_mm);
    text += words.data();
  }
  reached_.warn(time_.now(), text);
}

// Serves a controller that is a Modbus master.
class CncLine final : public CncInterface {
 public:
  // How its masters come, and what they may.
  struct Way {
    std::string kind;  // "modbus"
    std::string name;  // of the device or address
    board::Access may;
    std::optional<modbus::WordOrder> words{};  // of a port on the network; empty: the master of a serial line chooses
    std::function<std::unique_ptr<RegisterServer>(RegisterServer::Callbacks)> serve;
  };
  CncLine(const Way& way, StateBuffer& states, const CncDependencies& dependencies);
  ~CncLine() override;

  void start() override;
  messages::CncLineStatus status() const override;
  std::uint64_t rounds() const override { return server_->rounds(); }

 private:
  bool take(std::span<const Event> said);
  RegisterServer::Callbacks callbacks(std::optional<modbus::WordOrder> words);
  bool mayRequest(const modbus::ControllerRequest& controller_request);
  bool keep(modbus::WordOrder order);
  published::LineState lineState(const published::Snapshot& snapshot);

  board::Access may_;
  StateBuffer& states_;
  CncDependencies deps_;
  std::string name_;
  std::string connection_;  // name in the ConnectionInhibits
  TimeSource time_;
  LimitedWarning refused_{std::chrono::seconds{10}};   // a master may repeat a refused write at every cycle
  LimitedWarning reported_{std::chrono::seconds{10}};  // anybody may connect to a port
  ControllerRequests requests_;
  modbus::RegisterImage::Results features_of_;  // results in force that features_ were found with
  published::KnownFeatures features_;
  std::unique_ptr<RegisterServer> server_;
  std::thread thread_;
};

published::KnownFeatures knownFeatures(const procedure::Facts& facts) {
  published::KnownFeatures known;
  known.stylus_radius_mm = facts.stylus_ball_diameter_mm / 2;
  if (facts.sphere_diameter_mm) known.sphere_reach_mm = *facts.sphere_diameter_mm / 2 + known.stylus_radius_mm;
  // Plates and the wall of a bore stand about the stylus: their normals point inwards.
  const auto within = [&](double size_mm) { return known.stylus_radius_mm - size_mm / 2; };
  const auto around = [&](double size_mm) { return known.stylus_radius_mm + size_mm / 2; };
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    if (const auto& gap = facts.gaps[axis]) known.plates_reach_mm[axis] = within(gap->mm);
    if (const auto& cube = facts.datum_cube) known.cube_reach_mm[axis] = around(cube->edges_mm[axis]);
  }
  if (const auto& cylinder = facts.datum_cylinder)
    known.cylinder_reach_mm = cylinder->inside ? within(cylinder->diameter.mm) : around(cylinder->diameter.mm);
  if (!facts.tool_setter) return known;
  known.has_setter = true;
  known.has_setter_place = facts.tool_setter->accepted_mm.has_value();
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    known.setter_half_width_mm[axis] = facts.tool_setter->half_width_mm[axis];
    if (known.has_setter_place) known.setter_mm[axis] = (*facts.tool_setter->accepted_mm)[axis];
  }
  return known;
}

CncLine::CncLine(const Way& way, StateBuffer& states, const CncDependencies& dependencies)
    : may_{way.may},
      states_{states},
      deps_{dependencies},
      name_{way.name},
      connection_{way.kind + ":" + way.name},
      requests_{"controller at " + name_,
                [this](messages::Operation operation, std::vector<std::byte> body, std::function<void(Reply)> then) {
                  deps_.links.ask({connection_, may_, operation, std::move(body), std::move(then)});
                },
                [this](std::uint64_t result) { return deps_.calibrations.inForce().isWaiting(result); }},
      server_{way.serve(callbacks(way.words))} {}

RegisterServer::Callbacks CncLine::callbacks(std::optional<modbus::WordOrder> words) {
  // A computer that connects anew goes on as the same reader.
  const auto nameOf = [this](std::string_view reader) {
    return connection_ + (reader.empty() ? "" : " ") + std::string{reader};
  };
  RegisterHandler::Callbacks registers{
      .snapshot = [this] { return states_.newest().snapshot; },
      .shown_to = [this, nameOf](
                      std::string_view reader,
                      const published::Snapshot& snapshot) { return deps_.served.shownTo(nameOf(reader), snapshot); },
      .take = [this](std::span<const Event> said) { return take(said); },
      .kept =
          [this, words] {
            return RegisterHandler::Kept{
                words.value_or(static_cast<modbus::WordOrder>(deps_.connections.wordOrder(connection_))),
                deps_.connections.inhibits(connection_)};
          },
      .line = [this](const published::Snapshot& snapshot) { return lineState(snapshot); },
      // Written down before the answer that has it goes out.
      .serves = [this, nameOf](const published::Snapshot& snapshot,
                               std::string_view reader) { deps_.served.note(snapshot, nameOf(reader)); },
      .results = [this] { return deps_.calibrations.inForce().served(); },
      .controller_request =
          [this](const modbus::ControllerRequest& controller_request) { requests_.make(controller_request); },
      .may_request =
          [this](const modbus::ControllerRequest& controller_request) { return mayRequest(controller_request); },
      .only_looks = !board::givesARight(may_)};
  if (!words) registers.keep = [this](modbus::WordOrder order) { return keep(order); };
  return {.registers = std::move(registers),
          .report =
              [this, network = words.has_value()](const std::string& text) {
                if (network) return reported_.warn(time_.now(), text);
                logWarning(text);
              },
          .round =
              [this] {
                for (const auto& why : requests_.newRefusals())
                  refused_.warn(time_.now(), "What " + name_ + " asked for was refused: " + why);
                refused_.look(time_.now());
                reported_.look(time_.now());
              }};
}

CncLine::~CncLine() {
  server_->stop();
  if (thread_.joinable()) thread_.join();
}

void CncLine::start() {
  thread_ = std::thread{[this] { server_->run(); }};
  pthread_setname_np(thread_.native_handle(), "cnc");
}

messages::CncLineStatus CncLine::status() const {
  const auto counters = server_->counters();
  return {.name = name_,
          .answered = counters.answered,
          .refused = counters.refused,
          .bad_frames = counters.bad_frames,
          .skipped_bytes = counters.skipped_bytes,
          .unsent = counters.unsent,
          .reopened = counters.reopened};
}

published::LineState CncLine::lineState(const published::Snapshot& snapshot) {
  if (const auto in_force = deps_.calibrations.inForce().served(); in_force != features_of_) {
    features_ = knownFeatures(deps_.calibrations.factsNow());
    features_of_ = in_force;
  }
  std::uint16_t refusal = 0;
  if (snapshot.calibration == published::CalibrationState::refused) {
    const auto& step = snapshot.step;
    const bool in_a_step = snapshot.calibration_step < snapshot.calibration_steps;
    const auto text = deps_.calibrations.lastRefusal();
    if (!in_a_step) {
      refusal = modbus::codeOfRefusal(text.substr(0, text.find(':')));
    } else {
      refusal = static_cast<std::uint16_t>(step.timed_out ? unsigned{modbus::refusal::step_never_ended}
                                                          : modbus::refusal::of_step + unsigned{step.fault});
    }
  }
  return {.boots = deps_.boots,
          .calibration_refusal = refusal,
          .controller_request = requests_.state(snapshot),
          .features = features_,
          .due = deps_.due == nullptr ? std::uint16_t{0} : deps_.due->count()};
}

bool CncLine::take(std::span<const Event> said) {
  const auto error = deps_.handler.take(said, connection_, states_.newest(), may_);
  if (error) refused_.warn(time_.now(), "What " + name_ + " wrote was refused: " + error->what);
  return !error;
}

bool CncLine::mayRequest(const modbus::ControllerRequest& controller_request) {
  using modbus::ControllerRequest;
  const bool runs = controller_request.what == ControllerRequest::What::start ||
                    controller_request.what == ControllerRequest::What::abort;
  if (runs ? may_.allow_calibrate : may_.allow_accept) return true;
  refused_.warn(time_.now(), "What " + name_ + " asked for was refused: service.toml does not allow it: set " +
                                 (runs ? "allow_calibrate" : "allow_accept") + " = true for this line.");
  return false;
}

bool CncLine::keep(modbus::WordOrder order) {
  const auto error = deps_.connections.keepWordOrder(connection_, static_cast<std::uint16_t>(order));
  if (error) logWarning("The word order of " + name_ + " was refused: " + error->what);
  return !error;
}

}  // namespace

Outcome<CncOptions> parseCncLine(const std::string& text) {
  if (auto face = parseTextOptions(text)) {
    if (!face->ok()) return face->error();
    return CncOptions{std::move(*face).value()};
  }
  constexpr std::string_view kModbus = "modbus:", kModbusTcp = "modbus-tcp:";
  if (text.starts_with(kModbusTcp)) {
    TRY(auto options, parseModbusTcpOptions(std::string_view{text}.substr(kModbusTcp.size())));
    return CncOptions{std::move(options)};
  }
  if (!text.starts_with(kModbus))
    return Error{"The CNC line '" + text +
                 "' is not modbus:DEVICE[,baud=19200][,parity=even][,unit=1], modbus-tcp:HOST:PORT[,words=low-first], "
                 "records:DEVICE[,every=100] or tape:DEVICE[,dialect=g10]."};
  TRY(auto options, parseModbusOptions(std::string_view{text}.substr(kModbus.size())));
  return CncOptions{std::move(options)};
}

const serial::Address* serialLineOf(const CncOptions& options) {
  if (const auto* modbus = std::get_if<ModbusOptions>(&options)) return &modbus->line;
  if (const auto* text = std::get_if<TextOptions>(&options)) return &text->line;
  return nullptr;
}

Outcome<std::unique_ptr<CncInterface>> openCncInterface(const CncOptions& options, const board::Access& may,
                                                        StateBuffer& states, const CncDependencies& dependencies,
                                                        const Listen& listen) {
  if (const auto* text = std::get_if<TextOptions>(&options))
    return std::unique_ptr<CncInterface>{std::make_unique<TextLine>(*text, may, states, dependencies)};
  if (const auto* line = std::get_if<ModbusOptions>(&options)) {
    auto modbus = *line;
    modbus.revision = dependencies.revision;
    const CncLine::Way way{.kind = "modbus",
                           .name = modbus.line.path,
                           .may = may,
                           .serve = [&modbus](RegisterServer::Callbacks callbacks) {
                             return std::make_unique<ModbusServer>(modbus, std::move(callbacks));
                           }};
    return std::unique_ptr<CncInterface>{std::make_unique<CncLine>(way, states, dependencies)};
  }
  const auto& [address, words] = std::get<ModbusTcpOptions>(options);
  TRY(auto listener, listen(address));
  const CncLine::Way way{.kind = "modbus-tcp",
                         .name = tcp::describe(listener.address()),
                         .may = may,
                         .words = words,
                         .serve = [&](RegisterServer::Callbacks callbacks) {
                           return std::make_unique<ModbusTcpServer>(std::move(listener), dependencies.revision,
                                                                    std::move(callbacks));
                         }};
  return std::unique_ptr<CncInterface>{std::make_unique<CncLine>(way, states, dependencies)};
}

}  // namespace probebox::app
