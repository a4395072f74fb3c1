#include "firmware/app/daemon.hpp"

#include <array>
#include <cstddef>
#include <fstream>
#include <thread>
#include <unistd.h>
#include <utility>
#include <vector>

#include "drivers/io/rendezvous.hpp"
#include "drivers/tcp/linux_tcp.hpp"
#include "firmware/app/board_sources.hpp"
#include "firmware/app/box_config.hpp"
#include "firmware/app/calibrations.hpp"
#include "firmware/app/capture_thread.hpp"
#include "firmware/app/cnc_lines.hpp"
#include "firmware/app/control_desk.hpp"
#include "firmware/app/core_thread.hpp"
#include "firmware/app/journal.hpp"
#include "firmware/app/link_service.hpp"
#include "firmware/app/log.hpp"
#include "firmware/app/worker.hpp"
#include "version.hpp"

namespace probebox::app {
namespace {

constexpr std::size_t kQueueEvents = 1U << 15U;

messages::BootId bootId() {
  messages::BootId id{};
  std::ifstream random{"/dev/urandom", std::ios::binary};
  std::array<char, sizeof id> bytes{};
  random.read(bytes.data(), bytes.size());
  for (std::size_t i = 0; i < id.size(); ++i) id[i] = static_cast<std::byte>(bytes[i]);
  return id;
}

Mounting mountingOf(const board::Descriptions& descriptions) {
  return {.probe_serial_number = descriptions.probe.serial_number,
          .machine = descriptions.machine.name,
          .mounting = descriptions.machine.mounting};
}

LinkService::Options linkOptions(const board::Descriptions& descriptions) {
  LinkService::Options options;
  options.session.boot_id = bootId();
  options.session.firmware_version = firmwareVersion();
  options.session.queue_pieces = descriptions.service.stream.ring_blocks;
  options.session.queue_bytes =
      descriptions.service.stream.ring_blocks * std::size_t{box::BlockBuilder::kMostBytes} / 4;
  options.descriptor = wireDescriptor(descriptions, firmwareVersion());
  return options;
}

}  // namespace

std::string firmwareVersion() {
  return PROBEBOX_VERSION;
}

Outcome<board::Descriptions> loadDescriptions(const Options& options) {
  return options.board == "sim" ? board::simDescriptions(options.config)
                                : board::loadDirectory(options.board, options.config);
}

// Constructed from the top; ~Parts() says in which order the threads end.
struct Daemon::Parts {
  Parts(const Options& options, const board::Descriptions& descriptions, store::Store store,
        std::optional<JournalWriter> journal_writer)
      : time{options.time_scale},
        core{boxConfig(descriptions), events, commands, core_wake_up},
        calibrations{std::move(store), mountingOf(descriptions), [this] { return time.now(); },
                     [this](const Event& command) { return tellCore(command); }},
        journal{std::move(journal_writer)},
        journal_queue{journal ? &core.openJournal(counters) : nullptr},
        worker{std::make_unique<Worker>([this] { workerRound(); })},
        desk{{descriptions.box.board_name, firmwareVersion()},
             descriptions.service.access,
             {core.plan(), time, commands, *worker, calibrations, counters},
             [this](Reply reply) { links.reply(std::move(reply)); }},
        links{linkOptions(descriptions), desk, core.feed(), core.addStateReader(), counters, links_wake_up} {}

  ~Parts() {
    io::rendezvous::withdraw(getpid());
    capture.reset();
    cnc_lines.clear();
    links.stop();
    worker.reset();  // while the core still takes what it has to say
    core.stop();
    writeJournal();
  }

  bool tellCore(const Event& command) {
    const bool taken = commands.push(command);
    core_wake_up.notify();
    return taken;
  }

  void workerRound() {
    writeJournal();
    if (const auto run = core.takeRunToSolve())
      calibrations.solve(*run, core.recording(), core.scales(), std::string{procedure::nameOf(core.plan().method)});
  }

  void writeJournal() {
    if (!journal) return;
    Event event;
    while (journal_queue->pop(event)) {
      if (journal->write(event)) continue;
      logError("The journal cannot be written any more: is the disk full? The box goes on without it.");
      journal.reset();
      return;
    }
    const std::uint64_t lost = counters.journal_lost_events;
    journal->skip(lost - journal_lost_said);
    journal_lost_said = lost;
    journal->flush();
  }

  Outcome<bool> openLinks(const std::vector<std::string>& texts);
  Outcome<bool> openCncLines(const std::vector<std::string>& texts);
  Outcome<bool> openMachine(const board::Descriptions& descriptions);
  void announce();
  void run();

  TimeSource time;
  Counters counters;
  EventQueue events{kQueueEvents};
  CommandQueue commands;
  WakeUp core_wake_up;
  WakeUp links_wake_up;
  CoreThread core;
  Calibrations calibrations;
  std::optional<JournalWriter> journal;
  EventQueue* journal_queue;
  std::uint64_t journal_lost_said{};
  std::unique_ptr<Worker> worker;
  ControlDesk desk;
  LinkService links;
  std::vector<std::unique_ptr<CncLine>> cnc_lines;
  std::vector<std::unique_ptr<io::EventSource>> sources;
  std::unique_ptr<CaptureThread> capture;
  std::vector<std::string> uris;
  std::optional<tcp::Address> reachable_at;  // for the emulated controller
};

Outcome<bool> Daemon::Parts::openLinks(const std::vector<std::string>& texts) {
  for (const auto& text : texts) {
    const auto address = parseLink(text);
    if (!address) return address.error();
    if (const auto* line = std::get_if<serial::Address>(&*address)) {
      links.serve(*line);
      uris.push_back("serial:" + line->path);
      continue;
    }
    auto listener = tcp::Listener::open(std::get<tcp::Address>(*address));
    if (!listener) return listener.error();
    if (!reachable_at) reachable_at = listener->address();
    uris.push_back("tcp:" + tcp::describe(listener->address()));
    links.listen(std::move(*listener));
  }
  return true;
}

Outcome<bool> Daemon::Parts::openCncLines(const std::vector<std::string>& texts) {
  for (const auto& text : texts) {
    const auto options = CncLine::parse(text);
    if (!options) return options.error();
    auto line = std::make_unique<CncLine>(*options, core.addStateReader(), desk, counters);
    if (auto opened = line->open(); !opened) return opened.error();
    cnc_lines.push_back(std::move(line));
  }
  return true;
}

Outcome<bool> Daemon::Parts::openMachine(const board::Descriptions& descriptions) {
  if (!reachable_at) {
    // The emulated controller is a host like any other and needs a door.
    auto listener = tcp::Listener::open({.host = "127.0.0.1", .port = 0});
    if (!listener) return listener.error();
    reachable_at = listener->address();
    links.listen(std::move(*listener));
  }
  auto opened = openSources(descriptions, *reachable_at, time.now());
  if (!opened) return opened.error();
  sources = std::move(*opened);
  return true;
}

void Daemon::Parts::announce() {
  for (const auto& uri : uris) logInfo("reachable at " + uri);
  if (const auto announced = io::rendezvous::announce(getpid(), uris); !announced)
    logWarning(announced.error().what + " probebox list will not find this box by itself.");
}

void Daemon::Parts::run() {
  if (const auto delay = calibrations.restore()) tellCore(*delay);
  core.start(*worker, links_wake_up);
  links.start();
  for (const auto& line : cnc_lines) line->start();
  capture = std::make_unique<CaptureThread>(std::move(sources), time, events, core_wake_up, counters);
}

Outcome<std::unique_ptr<Daemon>> Daemon::start(const Options& options, const board::Descriptions& descriptions) {
  if (const auto refused = box::whyRefused(boxConfig(descriptions))) return *refused;
  const auto state = stateDirectory(options.state);
  if (!state) return state.error();
  auto store = store::Store::open((*state / "results.db").string());
  if (!store) return Error{store.error().what};
  if (!store->notice().empty()) logWarning(store->notice());
  std::optional<JournalWriter> journal;
  if (!options.journal.empty()) {
    auto created = JournalWriter::create(options.journal);
    if (!created) return created.error();
    journal.emplace(std::move(*created));
  }

  auto parts = std::make_unique<Parts>(options, descriptions, std::move(*store), std::move(journal));
  const auto& service = descriptions.service;
  if (auto opened = parts->openLinks(options.links.empty() ? service.links : options.links); !opened)
    return opened.error();
  if (auto opened = parts->openCncLines(options.cnc.empty() ? service.cnc : options.cnc); !opened)
    return opened.error();
  if (auto opened = parts->openMachine(descriptions); !opened) return opened.error();
  parts->run();
  parts->announce();
  return std::unique_ptr<Daemon>{new Daemon{std::move(parts)}};
}

Daemon::Daemon(std::unique_ptr<Parts> parts) : parts_{std::move(parts)} {}
Daemon::~Daemon() = default;

const std::vector<std::string>& Daemon::uris() const {
  return parts_->uris;
}

}  // namespace probebox::app
