#include "firmware/app/wiring/daemon.hpp"

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <sys/resource.h>
#include <thread>
#include <unistd.h>
#include <utility>
#include <vector>

#include "drivers/io/rendezvous.hpp"
#include "drivers/tcp/linux_tcp.hpp"
#include "firmware/app/cnc/open_cnc_interface.hpp"
#include "firmware/app/host/control_request_handler.hpp"
#include "firmware/app/host/key_folder.hpp"
#include "firmware/app/host/link_service.hpp"
#include "firmware/app/log/journal.hpp"
#include "firmware/app/log/log.hpp"
#include "firmware/app/results/applied_correction_file.hpp"
#include "firmware/app/results/boot_counter.hpp"
#include "firmware/app/results/calibrations.hpp"
#include "firmware/app/results/connection_inhibits.hpp"
#include "firmware/app/results/cutting_time.hpp"
#include "firmware/app/results/due_dates.hpp"
#include "firmware/app/results/last_served_file.hpp"
#include "firmware/app/threads/capture_thread.hpp"
#include "firmware/app/threads/chain_watch.hpp"
#include "firmware/app/threads/core_thread.hpp"
#include "firmware/app/threads/worker.hpp"
#include "firmware/app/update/update_request_handler.hpp"
#include "firmware/app/wiring/addresses.hpp"
#include "firmware/app/wiring/board_sources.hpp"
#include "firmware/app/wiring/box_config.hpp"
#include "firmware/app/wiring/encoder_sources.hpp"
#include "firmware/app/wiring/unit_in_use.hpp"
#include "firmware/procedure/described/machine_facts.hpp"
#include "version.hpp"

namespace probebox::app {
namespace {

constexpr std::size_t kQueueBytes = 1024 * 1024;  // 0.08 s of 100 000 samples a second with the counts of six axes

std::string inWords(const box::State& state, std::uint32_t hosts) {
  std::string text = "Master clock " + std::string{messages::nameOf(state.map.state)} + ", " + std::to_string(hosts) +
                     (hosts == 1 ? " host" : " hosts");
  if (const auto& delay = state.snapshot.delay; delay.result_id != 0)
    text += ", delay of result " + std::to_string(delay.result_id) + " in force";
  return text;
}

}  // namespace

std::string firmwareVersion() {
  return PROBEBOX_VERSION;
}

// Constructed from the top; ~Parts() says in which order the threads end.
struct Daemon::Parts {
  Parts(const Options& options, board::Descriptions described, const std::filesystem::path& state, store::Store store,
        std::optional<JournalWriter> journal_writer, UnitRequestHandler unit, const Earlier& earlier)
      : descriptions{std::move(described)},
        time{options.time_scale},
        core{boxConfig(descriptions), events, commands, core_wake_up, counters},
        cutting{(state / "cutting").string(), earlier.start},
        calibrations{std::move(store),
                     mountingOf(descriptions),
                     procedure::factsOf(descriptions),
                     [this] { return time.now(); },
                     [config = boxConfig(descriptions)](std::span<const Event> told) {
                       return box::validateActivation(config, told);
                     },
                     [this](const Event& command) { return tellCore(command); },
                     options.solver,
                     &cutting},
        due{schedulesOf(descriptions.machine), cutting, calibrations.inForce()},
        connections{(state / "connections").string(),
                    [this](bool inhibited) { return tellCore(CutInhibit{.active = inhibited, .at = time.now()}); },
                    earlier.start},
        served{(state / "served-last").string(), boxConfig(descriptions).corrections.limits},
        applied{(state / "served").string(), boxConfig(descriptions).corrections.limits,
                [this](const Event& bounds) { postBlocking(bounds); }, earlier.start},
        boots{countBoot((state / kBootsFile).string(), earlier.files)},
        journal{std::move(journal_writer)},
        journal_queue{journal ? &core.openJournal() : nullptr},
        result_request_handler{calibrations, core_view, connections},
        loop_back_request_handler{descriptions.box.loop_back, loopBackOf(descriptions)},
        key_folder{state},
        unit_request_handler{std::move(unit)},
        update_request_handler{state / "update",
                               options.updater,
                               {[this] { return activity(); }, [this] { worker.notify(); },
                                [file = options.confirmed] { return file.empty() || store::isThere(file.string()); }}},
        worker{[this] { workerRound(); }},
        handler{{descriptions.box.board_name, firmwareVersion(), wireLines(descriptions.box), namesOf(descriptions)},
                {descriptions.probe.deflection_limit_mm, time, commands, worker, calibrations, result_request_handler,
                 loop_back_request_handler, unit_request_handler, update_request_handler, connections, applied,
                 counters, source_table, [this] { return cncLineStatus(); }, travelOf(descriptions.machine),
                 controlAxes(descriptions.box.devices), boots.problem, &due},
                [this](Reply reply) { links.reply(std::move(reply)); }},
        links{linkOptions(descriptions, firmwareVersion()),
              handler,
              core.feed(),
              core.addStateReader(),
              counters,
              links_wake_up} {}

  ~Parts() {
    io::rendezvous::withdraw(getpid());
    capture.reset();
    links.stop();
    cnc_lines.clear();
    worker.stop();  // while the core still takes what it has to say
    cutting.finish();
    calibrations.finishSolving(std::chrono::seconds{4});
    core.stop();
    applied.finish(core_view.newest().snapshot, served.last());
    writeJournal();
    writeLogHere();
  }

  bool tellCore(const Event& command) {
    const bool taken = commands.push(command);
    core_wake_up.notify();
    return taken;
  }

  // The core empties its queue within milliseconds, and the worker may wait.
  void postBlocking(const Event& command) {
    while (!tellCore(command)) std::this_thread::sleep_for(std::chrono::milliseconds{1});
  }

  void workerRound() {
    ++counters.progress.worker;
    writeJournal();
    source_table.logFaults();
    drainLog();
    calibrations.look(core_view.newest());
    cutting.look(core_view.newest());
    // Not the state of before: results that come into force ask for a newer one.
    applied.look(core_view.newest().snapshot, served.last());
    result_request_handler.look();
    update_request_handler.look();
    if (const auto run = core.takeRunToSolve()) calibrations.solve(*run, core.plan(), core.recording(), core.scales());
    worker.alsoWaitFor(calibrations.solverDescriptor());
  }

  // Activity of the machine that an update has to wait for. For the worker's thread.
  Activity activity() {
    const auto& now = core_view.newest();
    return {.cut_is_on = connections.anyInhibits() || now.snapshot.inhibited,
            .run_is_on = inProgress(now.procedure.state)};
  }

  void writeJournal() {
    if (!journal) return;
    Event event;
    while (journal_queue->pop(event)) {
      if (journal->write(event)) continue;
      logError("The journal can no longer be written: check whether the disk is full. The box continues without it.");
      journal.reset();
      return;
    }
    const std::uint64_t lost = counters.journal_lost_events;
    journal->skip(lost - journal_lost_said);
    journal_lost_said = lost;
    journal->flush();
  }

  // Asked by the links' thread, which runs only while the lines are there.
  std::vector<messages::CncLineStatus> cncLineStatus() const {
    std::vector<messages::CncLineStatus> all;
    for (const auto& line : cnc_lines) all.push_back(line->status());
    return all;
  }

  Outcome<void> adopt(std::vector<PassedSocket> passed, const Options& options, const board::Service& service);
  Outcome<void> openLinks(const std::vector<std::string>& texts, const board::Service& service);
  Outcome<tcp::Listener> listenForCnc(const tcp::Address& address);
  Outcome<void> openCncLines(const std::vector<std::string>& texts, const board::Service& service);
  Outcome<void> openMachine();
  Outcome<void> serve(tcp::Listener listener, const tcp::Address& named, const board::Connection* connection);
  void serveByTls(tcp::Listener listener, const tcp::Address& named, const board::Service& service);
  bool isPassed(const tcp::Address& address) const;
  void announce();
  std::vector<Event> fromBefore();
  void run();
  Condition condition(Nanoseconds patience);

  const board::Descriptions descriptions;
  io::Descriptor state_lock;
  TimeSource time;
  Counters counters;
  SourceTable source_table;
  EventQueue events{kQueueBytes};
  CommandQueue commands;
  WakeUp core_wake_up;
  WakeUp links_wake_up;
  CoreThread core;
  StateBuffer& state_for_watch{core.addStateReader()};
  CoreView core_view{core.addStateReader(), commands};
  CuttingTime cutting;
  Calibrations calibrations;
  DueDates due;
  ConnectionInhibits connections;
  LastServedFile served;
  AppliedCorrectionFile applied;
  Boots boots;  // the last of these files: where it is, a start has made all of them
  std::optional<JournalWriter> journal;
  EventQueue* journal_queue;
  std::uint64_t journal_lost_said{};
  ResultRequestHandler result_request_handler;
  LoopBackRequestHandler loop_back_request_handler;
  KeyFolder key_folder;
  UnitRequestHandler unit_request_handler;
  UpdateRequestHandler update_request_handler;
  Worker worker;
  ControlRequestHandler handler;
  LinkService links;
  std::vector<std::unique_ptr<CncInterface>> cnc_lines;
  std::vector<std::unique_ptr<io::EventSource>> sources;
  std::unique_ptr<CaptureThread> capture;
  std::vector<std::string> uris;
  std::vector<tcp::Address> passed_addresses;  // of links
  std::vector<tcp::Listener> passed_for_cnc;   // not yet served
  std::optional<tcp::Address> reachable_at;    // for the emulated controller
  TimeSource real_time;                        // a watchdog's, whatever the emulated machine's scale
  std::optional<ChainWatch> chain;
};

Outcome<void> Daemon::Parts::adopt(std::vector<PassedSocket> passed, const Options& options,
                                   const board::Service& service) {
  for (auto& socket : passed) {
    TRY(auto listener, tcp::Listener::adopt(std::move(socket.descriptor), socket.name));
    if (isForCnc(listener.address(), cncLinesOf(options, service))) {
      passed_for_cnc.push_back(std::move(listener));
      continue;
    }
    const auto address = listener.address();
    if (const auto door = tlsLinkAt(address, linksOf(options, service)); door && service.tls) {
      serveByTls(std::move(listener), *door, service);
      passed_addresses.push_back(address);
      continue;
    }
    const auto named = linkAt(address, linksOf(options, service));
    if (auto opened = serve(std::move(listener), named, connectionOf(address, service)); !opened) return opened;
    passed_addresses.push_back(address);
  }
  return {};
}

// named: its address as service.toml has it. connection: null where service.toml has none for it.
Outcome<void> Daemon::Parts::serve(tcp::Listener listener, const tcp::Address& named,
                                   const board::Connection* connection) {
  if (auto why = whyOpenToAll(listener.address(), connection)) return *why;
  if (!reachable_at && tcp::isLoopback(listener.address())) reachable_at = listener.address();
  uris.push_back("tcp:" + tcp::describe(listener.address()));
  const auto name = connectionNameOf("tcp", named, listener.address());
  links.listen(std::move(listener), name, connection == nullptr ? descriptions.service.access : connection->access);
  return {};
}

void Daemon::Parts::serveByTls(tcp::Listener listener, const tcp::Address& named, const board::Service& service) {
  uris.push_back("tls:" + tcp::describe(listener.address()));
  auto name = connectionNameOf("tls", named, listener.address());
  links.listen(std::move(listener), std::move(name), key_folder.in(*service.tls),
               [&service](std::string_view person) { return service.accessOf(person); });
}

bool Daemon::Parts::isPassed(const tcp::Address& address) const {
  return std::ranges::any_of(passed_addresses, [&](const auto& passed) { return tcp::covers(passed, address); });
}

Outcome<void> Daemon::Parts::openLinks(const std::vector<std::string>& texts, const board::Service& service) {
  for (const auto& text : texts) {
    TRY(const auto address, parseLink(text));
    if (const auto* line = std::get_if<serial::Address>(&address)) {
      links.serve(*line, service.accessAt(text));
      uris.push_back("serial:" + line->path + ",baud=" + std::to_string(line->settings.baud));
      continue;
    }
    if (const auto* port = std::get_if<usb_gadget::PortAddress>(&address)) {
      links.serve(*port, service.accessAt(text));
      continue;
    }
    if (const auto* door = std::get_if<TlsAddress>(&address)) {
      if (isPassed(door->at)) continue;
      TRY(auto listener, tcp::Listener::open(door->at));
      serveByTls(std::move(listener), door->at, service);
      continue;
    }
    const auto& connection = std::get<tcp::Address>(address);
    if (isPassed(connection)) continue;
    TRY(auto listener, tcp::Listener::open(connection));
    if (auto opened = serve(std::move(listener), connection, service.connectionAt(text)); !opened) return opened;
  }
  return {};
}

Outcome<tcp::Listener> Daemon::Parts::listenForCnc(const tcp::Address& address) {
  const auto of_it = [&](const auto& passed) { return tcp::covers(passed.address(), address); };
  const auto found = std::ranges::find_if(passed_for_cnc, of_it);
  if (found == passed_for_cnc.end()) return tcp::Listener::open(address);
  auto listener = std::move(*found);
  passed_for_cnc.erase(found);
  return listener;
}

Outcome<void> Daemon::Parts::openCncLines(const std::vector<std::string>& texts, const board::Service& service) {
  for (const auto& text : texts) {
    TRY(const auto options, parseCncLine(text));
    const auto listen = [&](const tcp::Address& address) -> Outcome<tcp::Listener> {
      TRY(auto listener, listenForCnc(address));
      if (const auto why = whyOpenToMasters(text, listener.address(), service.connectionAt(text))) return *why;
      return listener;
    };
    const CncDependencies dependencies{handler,      links,       connections,       served,
                                       calibrations, boots.count, firmwareVersion(), &due};
    TRY(auto interface, openCncInterface(options, service.accessAt(text), core.addStateReader(), dependencies, listen));
    cnc_lines.push_back(std::move(interface));
  }
  for (const auto& unused : passed_for_cnc)
    logWarning("No line of 'cnc' needs the socket " + tcp::describe(unused.address()) + ": remove it from its unit");
  passed_for_cnc.clear();
  return {};
}

Outcome<void> Daemon::Parts::openMachine() {
  if (!reachable_at && isEmulated(descriptions)) {
    // The emulated controller is a host like any other and needs a listener.
    TRY(auto listener, tcp::Listener::open({.host = "127.0.0.1", .port = 0}));
    reachable_at = listener.address();
    links.listen(std::move(listener), "tcp:emulated-machine", descriptions.service.access);
  }
  TRY(auto opened, openSources(descriptions, reachable_at.value_or(tcp::Address{}), time.now(), counters));
  sources = std::move(opened);
  return {};
}

void Daemon::Parts::announce() {
  for (const auto& uri : uris) logInfo("serving " + uri);
  // Commands of this computer have other ways in, and no certificate.
  auto here = uris;
  std::erase_if(here, [](const std::string& uri) { return uri.starts_with("tls:"); });
  if (const auto announced = io::rendezvous::announce(getpid(), here); !announced)
    logWarning(announced.error().what + " probebox list will not find this box by itself.");
}

// The last end may have been any: what was served, what is in force, and whether a cut is on.
std::vector<Event> Daemon::Parts::fromBefore() {
  auto restored = applied.restore(time.now(), served.before());
  served.setOnDisk(applied.startOnDisk(), applied.countOnDisk(), applied.appliedBefore());
  for (const auto& event : calibrations.restore()) restored.push_back(event);
  // After what was in force before: that is no change, and a cut does not keep it out.
  if (connections.anyInhibits()) restored.emplace_back(CutInhibit{.active = true, .at = time.now()});
  return restored;
}

void Daemon::Parts::run() {
  leaveLogToWorker();
  core.tellBeforeStart(fromBefore(), time.now());
  core.start(worker, links_wake_up);
  links.start();
  for (const auto& line : cnc_lines) line->start();
  capture = std::make_unique<CaptureThread>(std::move(sources), time, events, core_wake_up, counters, source_table);
  std::vector<std::string> stages{"capture", "core", "published state", "links", "worker"};
  for (const auto& line : cnc_lines) stages.push_back("CNC line " + line->status().name);
  chain.emplace(std::move(stages), real_time.now());
}

Daemon::Condition Daemon::Parts::condition(Nanoseconds patience) {
  const Progress& progress = counters.progress;
  std::vector<std::uint64_t> counts{progress.capture, progress.core, progress.state, progress.links, progress.worker};
  for (const auto& line : cnc_lines) counts.push_back(line->rounds());
  const auto finding = chain->look(counts, real_time.now(), patience);
  std::string standing_still;
  for (const auto stage : finding.standing_still)
    standing_still.append(standing_still.empty() ? "" : ", ").append(stage);
  if (standing_still.empty()) {
    if (finding.changed) logErrorAtOnce("All stages of the chain are running again.");
    return {.goes_on = finding.all_went_on, .in_words = inWords(state_for_watch.newest(), counters.links)};
  }
  const std::string text = "Stages not progressing, the first is the cause: " + standing_still + ".";
  if (finding.changed) logErrorAtOnce(text + " The watchdog is not triggered until all are running.");
  return {.goes_on = finding.all_went_on, .in_words = text};
}

namespace {

// Opens as many files as this process may, or says that these are too few: without files left it would serve nobody.
Outcome<void> allowOpenFiles() {
  constexpr rlim_t kFewest = 128;
  rlimit files{};
  if (getrlimit(RLIMIT_NOFILE, &files) != 0) return {};
  const auto allowed = files.rlim_max;
  if (allowed < kFewest)
    return Error{"Only " + std::to_string(allowed) + " files may be open, and a box with its hosts and lines needs " +
                 std::to_string(kFewest) + ": raise the limit (ulimit -n, or LimitNOFILE of the service)."};
  constexpr rlim_t kUsual = 1024;
  if (files.rlim_cur >= kUsual) return {};
  files.rlim_cur = std::min(allowed, kUsual);
  setrlimit(RLIMIT_NOFILE, &files);
  return {};
}

}  // namespace

Outcome<std::unique_ptr<Daemon>> Daemon::start(const Options& options, const board::Descriptions& descriptions,
                                               std::vector<PassedSocket> passed) {
  TRY(allowOpenFiles());
  // Before anything is written that has a date; the number of the start is not counted yet.
  // An emulated machine runs on a developer's computer, whose clock is believed; but an image with it shows the day on
  // which it was made.
  const bool is_kept_right = isEmulated(descriptions) && options.updater.empty();
  setWallClock({.is_kept_right = is_kept_right, .start = 0});
  if (const auto refused = validate(options, descriptions)) return *refused;
  TRY(auto state, takeStateDirectory(options.state));
  if (!state.notice.empty()) logWarning(state.notice);
  // Samples and the CNC need no store: what is wrong with it stands in the log and in status.
  const auto earlier = earlierIn(state.path);
  auto store = store::Store::openAnyhow((state.path / "results.db").string(), earlier.start);
  if (!store.notice().empty()) logError(store.notice());  // also where this start fails later
  std::optional<JournalWriter> journal;
  if (!options.journal.empty()) {
    TRY(auto created, JournalWriter::create(options.journal));
    journal.emplace(std::move(created));
  }

  auto described = descriptions;
  auto unit_request_handler = takeUnit(state.path, described);
  auto parts = std::make_unique<Parts>(options, std::move(described), state.path, std::move(store), std::move(journal),
                                       std::move(unit_request_handler), earlier);
  setWallClock({.is_kept_right = is_kept_right, .start = parts->boots.count});
  parts->state_lock = std::move(state.lock);
  for (const auto& problem :
       {parts->connections.problem(), parts->unit_request_handler.problem(), parts->boots.problem})
    if (!problem.empty()) logWarning(problem);
  const auto& service = parts->descriptions.service;
  TRY(parts->adopt(std::move(passed), options, service));
  TRY(parts->openLinks(linksOf(options, service), service));
  TRY(parts->openCncLines(cncLinesOf(options, service), service));
  TRY(parts->openMachine());
  parts->announce();
  parts->run();
  return std::unique_ptr<Daemon>{new Daemon{std::move(parts)}};
}

Daemon::Daemon(std::unique_ptr<Parts> parts) : parts_{std::move(parts)} {}
Daemon::~Daemon() = default;

Daemon::Condition Daemon::condition(Nanoseconds patience) {
  return parts_->condition(patience);
}

const std::vector<std::string>& Daemon::uris() const {
  return parts_->uris;
}

}  // namespace probebox::app
