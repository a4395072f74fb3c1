#include "firmware/app/host/link_service.hpp"

#include <algorithm>
#include <array>
#include <pthread.h>
#include <utility>

#include "drivers/serial/linux_serial.hpp"
#include "firmware/app/log/log.hpp"
#include "firmware/app/results/result_summary.hpp"
#include "firmware/app/results/wall_clock.hpp"

namespace probebox::app {
namespace {

constexpr std::chrono::milliseconds kAdvance{10};
// In that time, of all hosts together: whoever catches up in profile tight does not keep the others waiting.
constexpr int kTightBlocks = 4;
constexpr Nanoseconds kUsbHeartbeat = std::chrono::milliseconds{10};
constexpr Nanoseconds kRetry = std::chrono::seconds{1};

messages::GapReason reasonOf(const FeedItem& item) {
  return item.kind == FeedItem::Kind::lost_in_queue ? messages::GapReason::queue_full : wireReason(item.reason);
}

void addTo(messages::LinkCounters& sum, const messages::LinkCounters& counters) {
  sum.frames += counters.frames;
  sum.bad_crc += counters.bad_crc;
  sum.bad_cobs += counters.bad_cobs;
  sum.bad_length += counters.bad_length;
  sum.oversize += counters.oversize;
  sum.discarded_bytes += counters.discarded_bytes;
  sum.unexpected += counters.unexpected;
}

}  // namespace

LinkService::LinkService(Options options, ControlRequestHandler& handler, Feed& feed, StateBuffer& states,
                         Counters& counters, WakeUp& wake_up)
    : options_{std::move(options)},
      handler_{handler},
      feed_{feed},
      states_{states},
      counters_{counters},
      wake_up_{wake_up},
      started_{time_.now()},
      history_{options_.history_bytes, options_.history_pieces, {messages::Profile::fast}},
      transcoder_{box::channelFormats(), box::BlockBuilder::kMostSamples},
      connection_acceptor_{
          loop_,
          {.why_full = [this](std::size_t listener) { return whyFull(listener); },
           .enter = [this](ConnectionAcceptor::GreetedConnection greeted) { enter(std::move(greeted)); }}},
      description_{options_.descriptor, options_.probe} {}

LinkService::~LinkService() {
  stop();
}

void LinkService::listen(tcp::Listener listener, std::string name, const board::Access& may) {
  connection_acceptor_.listen(std::move(listener));
  listener_access_.push_back({std::move(name), may});
}
void LinkService::listen(tcp::Listener listener, std::string name, const board::TlsKeys& keys, RightsOf rights_of) {
  if (!tls_door_) tls_door_.emplace(keys);
  connection_acceptor_.listen(std::move(listener), [this](std::unique_ptr<io::BytePipe> carrier) {
    return tls_door_->secure(std::move(carrier));
  });
  listener_access_.push_back({std::move(name), {}, std::move(rights_of)});
}
void LinkService::serve(const serial::Address& line, const board::Access& may) {
  serial_lines_.push_back(std::make_unique<SerialLine>());
  serial_lines_.back()->name = "serial:" + line.path;
  serial_lines_.back()->address = line;
  serial_lines_.back()->may = may;
}
void LinkService::serve(const usb_gadget::PortAddress& port, const board::Access& may) {
  usb_ports_.push_back(std::make_unique<UsbPort>());
  usb_ports_.back()->name = "usb";
  usb_ports_.back()->address = port;
  usb_ports_.back()->may = board::onUsb(may);
}

void LinkService::start() {
  thread_ = std::thread{[this] {
    std::vector<EventLoop::Watch> watches;
    connection_acceptor_.advance(time_.now());
    connection_acceptor_.open();
    watches.push_back(loop_.watch(wake_up_.descriptor(), [this] {
      wake_up_.clear();
      passOn();
      answerInside();
      passOnReplies();
    }));
    watches.push_back(loop_.every(kAdvance, [this] { advance(); }));
    loop_.run();
    connection_acceptor_.close();
    links_.clear();
    usb_ports_.clear();
  }};
  pthread_setname_np(thread_.native_handle(), "links");
}

void LinkService::stop() {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard lock{replies_mutex_};
    stopping_ = true;
  }
  wake_up_.notify();
  thread_.join();
}

void LinkService::reply(Reply reply) {
  {
    const std::lock_guard lock{replies_mutex_};
    replies_.push_back(std::move(reply));
  }
  wake_up_.notify();
}

void LinkService::ask(InsideRequest request) {
  {
    const std::lock_guard lock{replies_mutex_};
    asked_.push_back(std::move(request));
  }
  wake_up_.notify();
}

void LinkService::answerInside() {
  std::deque<InsideRequest> asked;
  {
    const std::lock_guard lock{replies_mutex_};
    asked.swap(asked_);
  }
  for (auto& request : asked) {
    const std::uint64_t link = ++last_link_;
    const stream::PendingRequest pending{.ticket = 0, .operation = request.operation, .body = request.body};
    inside_.emplace(link, std::move(request.then));
    const auto reply =
        handler_.handle({link, request.connection, request.may, {}}, pending, states_.newest(), vitals());
    if (reply) answeredInside(*reply);
  }
}

bool LinkService::answeredInside(const Reply& reply) {
  const auto found = inside_.find(reply.link);
  if (found == inside_.end()) return false;
  const auto then = std::move(found->second);
  inside_.erase(found);
  then(reply);
  return true;
}

bool LinkService::Port::mayTry(MonoTime now) {
  if (now < next_try) return false;
  next_try = now + kRetry;
  return true;
}

void LinkService::Port::complain(const std::string& what) {
  if (problem != what) logWarning(what + " Trying again every second.");
  problem = what;
}

LinkService::Link& LinkService::adopt(io::Connection connection, const board::Access& may, Port* port) {
  stream::SessionOptions session = options_.session;
  session.tight_blocks = &tight_blocks_;
  session.first_session_id = static_cast<std::uint32_t>(last_link_ * 1000 + 1);
  if (connection.control) session.heartbeat_period = kUsbHeartbeat;
  links_.push_back(std::make_unique<Link>(Link{.host = {++last_link_, std::move(connection), session, history_},
                                               .port = port,
                                               .listener = 0,
                                               .may = may,
                                               .person = {},
                                               .watch = {}}));
  counters_.links = static_cast<std::uint32_t>(links_.size());
  return *links_.back();
}

std::optional<std::string> LinkService::whyFull(std::size_t listener) const {
  const auto open = std::ranges::count_if(
      links_, [&](const auto& link) { return link->port == nullptr && link->listener == listener && !link->closed; });
  if (static_cast<std::size_t>(open) < options_.most_links) return std::nullopt;
  return "all " + std::to_string(options_.most_links) +
         " links of this address are taken; end a command that holds one, or come over USB or a serial line";
}

void LinkService::enter(ConnectionAcceptor::GreetedConnection greeted) {
  const auto& access = listener_access_.at(greeted.listener);
  const auto person = greeted.pipe->person();
  if (person) logInfo(*person + " came in from " + std::string{greeted.pipe->name()});
  Link& link =
      adopt(std::move(greeted.pipe), access.rights_of ? access.rights_of(person.value_or("")) : access.may, nullptr);
  link.person = person;
  link.listener = greeted.listener;
  link.host.session().receive(greeted.gate.bytes(), time_.now());
  watch(link);
  answerRequests(link);
  flush(link);
}

void LinkService::watch(Link& link) {
  link.watch = loop_.watch(link.host.descriptor(), [this, &link] { serve(link); });
}

void LinkService::openSerialLines(MonoTime now) {
  for (const auto& line : serial_lines_) {
    if (line->link != nullptr || !line->mayTry(now)) continue;
    auto pipe = serial::openSerial(line->address.path, line->address.settings);
    if (!pipe) {
      line->complain(pipe.error().what);
      continue;
    }
    line->problem.clear();
    line->link = &adopt(std::move(*pipe), line->may, line.get());
    watch(*line->link);
  }
}

void LinkService::openUsbPorts(MonoTime now) {
  for (const auto& usb : usb_ports_) {
    if (usb->port || !usb->mayTry(now)) continue;
    auto port = usb_gadget::GadgetPort::open(usb->address);
    if (!port) {
      usb->complain(port.error().what + ".");
      continue;
    }
    usb->problem.clear();
    usb->port = std::move(*port);
    usb->watch = loop_.watch(usb->port->descriptor(), [this, raw = usb.get()] { turn(*raw); });
    logInfo("on the USB bus as a device");
  }
}

// A new connection takes the place of the one before: the host has begun anew.
void LinkService::turn(UsbPort& usb) {
  usb.port->turn();
  if (auto connection = usb.port->accept()) {
    if (usb.link != nullptr) close(*usb.link);
    usb.link = &adopt(std::move(*connection), usb.may, &usb);
  }
  if (usb.link != nullptr) serve(*usb.link);
}

void LinkService::serve(Link& link) {
  link.host.receive(time_.now());
  answerRequests(link);
  flush(link);
}

void LinkService::answerRequests(Link& link) {
  const auto& name = link.port == nullptr ? listener_access_.at(link.listener).name : link.port->name;
  // Dates stand on certificates: only who may bring results into force tells them.
  if (const auto time = link.host.session().nextTimeOfDay(); time && link.may.allow_accept) noteTold(*time, name);
  while (const auto request = link.host.session().nextRequest()) {
    const Caller caller{.link = link.host.id(), .connection = name, .may = link.may, .person = link.person};
    const auto reply = handler_.handle(caller, *request, states_.newest(), vitals());
    if (reply) link.host.session().answer(reply->ticket, reply->code, reply->text, reply->body);
  }
}

void LinkService::flush(Link& link) {
  link.host.flush();
  if (link.host.closed()) return close(link);
  link.watch.wantWrite(link.host.waitsForWriting());
}

void LinkService::passOn(const stream::EncodedBlock& block) {
  history_.push(block);
  for (const auto& link : links_) link->host.session().offer(block);
}

void LinkService::passOn() {
  while (feed_.pop(item_)) {
    if (item_.kind == FeedItem::Kind::block) {
      describe(item_.delay, item_.tool);
      a_block_has_come_ = true;
      history_.reachTrigger(item_.next_trigger);
      const stream::EncodedBlock block{.first = item_.first,
                                       .count = static_cast<std::uint32_t>(item_.count),
                                       .bytes = std::span{item_.bytes}.first(item_.size)};
      passOn(block);
      passOn(transcoder_.fast(block));
    } else if (item_.kind == FeedItem::Kind::trigger) {
      history_.push(wireTrigger(item_.trigger));
    } else {
      const stream::GapNotice gap{.first = item_.first, .count = item_.count, .reason = reasonOf(item_)};
      history_.push(gap);
      for (const auto& link : links_) link->host.session().offer(gap);
    }
  }
  for (const auto& link : links_) flush(*link);
}

void LinkService::passOnReplies() {
  std::deque<Reply> replies;
  bool stopping = false;
  {
    const std::lock_guard lock{replies_mutex_};
    replies.swap(replies_);
    stopping = stopping_;
  }
  if (stopping) loop_.quit();
  for (const auto& reply : replies) {
    if (answeredInside(reply)) continue;
    for (const auto& link : links_) {
      if (link->host.id() != reply.link) continue;
      link->host.session().answer(reply.ticket, reply.code, reply.text, reply.body);
      flush(*link);
    }
  }
}

void LinkService::advance() {
  const MonoTime now = time_.now();
  const box::State& state = states_.newest();
  if (!a_block_has_come_) describe(state.delay_applied ? state.snapshot.delay : published::DelayInForce{}, {});
  if (std::exchange(state_seen_, state.at) != state.at) ++counters_.progress.links;
  const stream::Vitals of_box{.uptime_ms = uptimeMs(),
                              .clock_state = state.map.state,
                              .clock_sigma_ns = state.map.sigma_ns,
                              .deadline_misses = counters_.deadline_misses,
                              .edges = state.snapshot.clock.edges};
  tight_blocks_ = kTightBlocks;
  ++turn_;  // who comes first takes of them first
  for (std::size_t k = 0; k < links_.size(); ++k) {
    const auto& link = links_[(turn_ + k) % links_.size()];
    link->host.session().advance(now, of_box);
    flush(*link);
    // A serial line stays, and so does USB: the next host says HELLO on it.
    if (link->port == nullptr && link->host.session().state() == stream::SessionState::down) close(*link);
  }
  if (tls_door_ && tls_door_->advance(now)) closePersons();
  connection_acceptor_.advance(now);
  dropClosed();
  openSerialLines(now);
  openUsbPorts(now);
}

void LinkService::closePersons() {
  for (const auto& link : links_) {
    if (!link->person || link->closed) continue;
    logInfo(*link->person + " is let go: the CA of people is another one");
    close(*link);
  }
}

// Samples are described by the descriptor: the blocks that follow refer to the new one.
void LinkService::describe(const published::DelayInForce& delay, const published::ToolInSamples& tool) {
  if (description_.update(delay, tool, time_.now()))
    history_.setDescriptor(messages::encoded(description_.descriptor()));
}

// Only marks the link: its own callback may be running.
void LinkService::close(Link& link) {
  if (link.closed) return;
  link.closed = true;
  addTo(from_gone_hosts_, link.host.session().linkCounters());
  link.watch.pause();
  link.host.hangUp();
  if (link.port != nullptr) link.port->link = nullptr;
}

void LinkService::dropClosed() {
  std::erase_if(links_, [](const auto& link) { return link->closed; });
  counters_.links = static_cast<std::uint32_t>(links_.size());
}

LinkVitals LinkService::vitals() const {
  LinkVitals all{.uptime_ms = uptimeMs(),
                 .from_hosts = from_gone_hosts_,
                 .usb_ports = {},
                 .not_let_in = connection_acceptor_.counters(),
                 .tls_problem = tls_door_ ? tls_door_->problem() : ""};
  for (const auto& link : links_) {
    if (!link->closed) addTo(all.from_hosts, link->host.session().linkCounters());
  }
  for (const auto& usb : usb_ports_) {
    const auto counters = usb->port ? usb->port->counters() : usb_gadget::PortCounters{};
    all.usb_ports.push_back({usb->problem, counters.connections, counters.suspensions, counters.discarded_bytes,
                             counters.failed_transfers, counters.stalled_requests});
  }
  return all;
}

std::uint64_t LinkService::uptimeMs() const {
  return static_cast<std::uint64_t>(
      std::chrono::duration_cast<std::chrono::milliseconds>(time_.now() - started_).count());
}

}  // namespace probebox::app
