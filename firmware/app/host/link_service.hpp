#pragma once
#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <variant>
#include <vector>

#include "drivers/io/byte_pipe.hpp"
#include "drivers/serial/settings.hpp"
#include "drivers/tcp/linux_tcp.hpp"
#include "drivers/usb_gadget/gadget_port.hpp"
#include "firmware/app/host/connection_acceptor.hpp"
#include "firmware/app/host/control_request_handler.hpp"
#include "firmware/app/host/host_link.hpp"
#include "firmware/app/host/inside_request.hpp"
#include "firmware/app/host/sample_description.hpp"
#include "firmware/app/host/tls_door.hpp"
#include "firmware/app/threads/core_thread.hpp"
#include "firmware/app/threads/event_loop.hpp"
#include "firmware/app/threads/feed.hpp"
#include "firmware/app/threads/wake_up.hpp"
#include "firmware/stream/history.hpp"
#include "firmware/stream/session.hpp"
#include "firmware/stream/transcoder.hpp"
#include "protocol/messages/handshake.hpp"

namespace probebox::app {

// Serves all links to hosts in one thread: TCP listeners, serial lines, USB ports, with a session for each host. A slow
// or faulty host affects only its own session.
class LinkService {
 public:
  struct Options {
    stream::SessionOptions session;
    messages::Descriptor descriptor;  // without what is in force
    ProbeOnMachine probe;
    std::size_t history_bytes = 2U << 20U;
    std::size_t history_pieces = 2048;
    std::size_t most_links = 8;  // per listener
  };

  LinkService(Options options, ControlRequestHandler& handler, Feed& feed, StateBuffer& states, Counters& counters,
              WakeUp& wake_up);
  ~LinkService();
  LinkService(const LinkService&) = delete;
  LinkService& operator=(const LinkService&) = delete;

  // Call before start(). may: rights of the hosts that connect there. name: of their common connection, as
  // ConnectionInhibits has it.
  void listen(tcp::Listener listener, std::string name, const board::Access& may);
  // The same by TLS, where the rights are those of each person; the keys of the first one are those of all.
  using RightsOf = std::function<board::Access(std::string_view person)>;
  void listen(tcp::Listener listener, std::string name, const board::TlsKeys& keys, RightsOf rights_of);
  void serve(const serial::Address& line, const board::Access& may);
  void serve(const usb_gadget::PortAddress& port, const board::Access& may);

  void start();
  void stop();

  // Any thread: delivers a late answer.
  void reply(Reply reply);

  // Any thread: takes a request from a controller's line.
  void ask(InsideRequest request);

 private:
  struct Port;
  struct Link {
    HostLink host;
    Port* port{};            // null: from the network
    std::size_t listener{};  // index of the listener, if from the network
    board::Access may;
    std::optional<std::string> person;  // whom the certificate names, of TLS
    EventLoop::Watch watch;             // not for USB, whose port reports events
    bool closed{};
  };
  struct ListenerAccess {
    std::string name;
    board::Access may;
    RightsOf rights_of{};  // of TLS, in place of `may`
  };
  // A listener or port that is retried every second until it works.
  struct Port {
    std::string name;     // as ConnectionInhibits has it
    std::string problem;  // last reported problem; empty when there is none
    MonoTime next_try{};
    Link* link{};  // link of the host that connected here
    board::Access may;
    bool mayTry(MonoTime now);
    void complain(const std::string& what);
  };
  struct SerialLine : Port {
    serial::Address address;
  };
  struct UsbPort : Port {
    usb_gadget::PortAddress address;
    std::unique_ptr<usb_gadget::GadgetPort> port;
    EventLoop::Watch watch;  // of the port, which also serves its link
  };

  Link& adopt(io::Connection connection, const board::Access& may, Port* port);
  void enter(ConnectionAcceptor::GreetedConnection greeted);
  std::optional<std::string> whyFull(std::size_t listener) const;
  void watch(Link& link);
  void openSerialLines(MonoTime now);
  void openUsbPorts(MonoTime now);
  void turn(UsbPort& port);
  void serve(Link& link);
  void answerRequests(Link& link);
  void flush(Link& link);
  void passOn();
  void passOn(const stream::EncodedBlock& block);
  void passOnReplies();
  void answerInside();
  bool answeredInside(const Reply& reply);
  void advance();
  void describe(const published::DelayInForce& delay, const published::ToolInSamples& tool);
  void closePersons();
  void dropClosed();
  void close(Link& link);
  LinkVitals vitals() const;
  std::uint64_t uptimeMs() const;

  Options options_;
  ControlRequestHandler& handler_;
  Feed& feed_;
  StateBuffer& states_;
  Counters& counters_;
  WakeUp& wake_up_;
  TimeSource time_;  // real time for hosts, regardless of the emulated machine's scale
  MonoTime started_;
  stream::History history_;
  stream::Transcoder transcoder_;
  FeedItem item_;
  EventLoop loop_;
  std::optional<TlsDoor> tls_door_;  // where a tls: link needs it
  ConnectionAcceptor connection_acceptor_;
  std::vector<ListenerAccess> listener_access_;  // by listener
  std::vector<std::unique_ptr<SerialLine>> serial_lines_;
  std::vector<std::unique_ptr<UsbPort>> usb_ports_;
  std::vector<std::unique_ptr<Link>> links_;
  int tight_blocks_{};  // that may still be encoded before the next advance()
  std::size_t turn_{};
  std::uint64_t last_link_{};
  messages::LinkCounters from_gone_hosts_;
  MonoTime state_seen_{};
  SampleDescription description_;
  bool a_block_has_come_{};  // until then the number of the next sample comes from the state
  std::mutex replies_mutex_;
  std::deque<Reply> replies_;
  std::deque<InsideRequest> asked_;                             // under replies_mutex_
  std::map<std::uint64_t, std::function<void(Reply)>> inside_;  // by link number; no host has these numbers
  bool stopping_{};
  std::thread thread_;
};

}  // namespace probebox::app
