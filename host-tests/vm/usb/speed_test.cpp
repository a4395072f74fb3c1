#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <functional>
#include <gtest/gtest.h>
#include <poll.h>
#include <thread>

#include "bare_pump.hpp"
#include "drivers/usb_gadget/gadget_port.hpp"
#include "drivers/usb_host/usb_link.hpp"
#include "firmware/app/host/host_link.hpp"
#include "protocol/codec/block.hpp"
#include "tools/link/client.hpp"
#include "usb_gadget.hpp"

// How fast the gadget is beside a pump that does nothing but move bytes, in the same guest, one after the other.
namespace probebox::vm {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::uint64_t kBytes = 24U << 20U;
constexpr int kRounds = 3;

// Turns a port in a thread of its own, as the daemon's links thread does.
class PortThread {
 public:
  using Serve = std::function<void(std::optional<io::Connection> begun)>;
  explicit PortThread(Serve serve) {
    auto opened = usb_gadget::GadgetPort::open({});
    if (!opened) throw std::runtime_error{opened.error().what};
    port_ = std::move(*opened);
    thread_ = std::thread{[this, serve = std::move(serve)] {
      while (!stopping_) {
        pollfd waiting{port_->descriptor(), POLLIN, 0};
        poll(&waiting, 1, 10);
        port_->turn();
        serve(port_->accept());
      }
      serve(io::Connection{});
    }};
  }
  ~PortThread() {
    stopping_ = true;
    thread_.join();
  }
  PortThread(const PortThread&) = delete;
  PortThread& operator=(const PortThread&) = delete;

 private:
  std::unique_ptr<usb_gadget::GadgetPort> port_;
  std::atomic<bool> stopping_{};
  std::thread thread_;
};

io::Connection connect() {
  for (int tries = 0; tries < 500; ++tries) {
    if (auto opened = usb_host::openUsbLink("")) return std::move(*opened);
    std::this_thread::sleep_for(std::chrono::milliseconds{20});
  }
  throw std::runtime_error{"the box did not appear"};
}

const std::vector<codec::ChannelFormat>& formats() {
  static const std::vector<codec::ChannelFormat> all(14, {4, true});
  return all;
}

constexpr std::size_t kSamples = 256;

const std::vector<std::byte>& block(SampleIndex first) {
  static const std::vector<std::int64_t> columns(formats().size() * kSamples, 123'456);
  static std::vector<std::byte> bytes(codec::rawBlockSize(formats(), kSamples));
  if (!codec::encodeRaw({.first = first, .count = kSamples}, formats(), columns, bytes)) throw std::logic_error{"raw"};
  return bytes;
}

// Frames that are ready, through the port and the host's pipe.
double readyFrames() {
  const auto& payload = block(SampleIndex{0});
  std::vector<std::byte> frame(frame::bareSize(payload.size()));
  frame::encodeBare({}, payload, frame);
  io::Connection box;
  std::size_t sent = 0;
  const PortThread port{[&](std::optional<io::Connection> begun) {
    if (begun) box = std::move(*begun), sent = 0;
    while (box.data) {
      const auto put = box.data->write(std::span{frame}.subspan(sent)).bytes;
      if (put == 0) break;
      sent = (sent + put) % frame.size();
    }
  }};
  auto host = connect();
  std::uint64_t received = 0;
  const auto start = Clock::now();
  while (received < kBytes) {
    pollfd waiting{host.data->descriptor(), POLLIN, 0};
    poll(&waiting, 1, 1000);
    while (received < kBytes) {
      const auto there = host.data->front();
      if (there.empty()) break;
      received += there.size();
      host.data->consume(there.size());
    }
  }
  return static_cast<double>(received) / std::chrono::duration<double>(Clock::now() - start).count();
}

// The whole way: blocks of samples through session, port, pipe and client, decoded and balanced.
struct EndToEnd {
  double bytes_per_s{};
  bool exact{};
  std::uint64_t lost{};
};

EndToEnd samples() {
  stream::History history{64 * 1024, 16};
  std::unique_ptr<app::HostLink> link;
  SampleIndex next{0};
  messages::Descriptor described;
  for (std::size_t k = 0; k < formats().size(); ++k) described.channels.push_back({"c", "nm", 1.0, 4, true, ""});
  history.setDescriptor(messages::encoded(described));
  const PortThread port{[&](std::optional<io::Connection> begun) {
    const MonoTime now = link::now();
    if (begun) {
      link.reset();
      if (begun->data)
        link = std::make_unique<app::HostLink>(1, std::move(*begun), stream::SessionOptions{}, history);
    }
    if (!link) return;
    link->receive(now);
    // As fast as they go out: what waits is never more than a few blocks.
    for (int k = 0; k < 64 && link->session().feed().queuedSamples() < 8 * kSamples; ++k) {
      const stream::EncodedBlock made{next, kSamples, block(next)};
      link->session().offer(made);
      next = next + static_cast<std::int64_t>(kSamples);
      link->flush();
    }
    link->session().advance(now, {});
    link->flush();
  }};
  struct Counter : link::StreamListener {
    void onBlock(const link::DecodedBlock& received) override { bytes += received.columns.size() * 4; }
    std::uint64_t bytes{};
  } counter;
  link::Client client{connect(), {}, &counter};
  const auto wait = link::patience(std::chrono::seconds{60});
  if (!client.connect(wait)) throw std::runtime_error{"no handshake"};
  client.start({});
  const auto start = Clock::now();
  while (counter.bytes < kBytes && client.round(wait)) {
  }
  const double took = std::chrono::duration<double>(Clock::now() - start).count();
  const auto received = counter.bytes;
  const auto balance = client.finish(wait);
  if (!balance) throw std::runtime_error{"no closing ledger"};
  return {static_cast<double>(received) / took, balance->exact,
          balance->account.declared_lost + balance->account.inferred_lost};
}

double median(std::vector<double> values) {
  std::ranges::sort(values);
  return values[values.size() / 2];
}

// The pump that others have: adbd moves 16 kB at a time.
constexpr std::size_t kUsualTransfer = 16 * 1024;
constexpr std::size_t kOurTransfer = 32 * 1024;

TEST(UsbSpeed, IsThatOfABarePump) {
  const UsbGadget gadget;
  std::vector<double> usual, large, ready, whole;
  for (int round = 0; round < kRounds; ++round) {
    usual.push_back(barePump(kBytes, kUsualTransfer));
    large.push_back(barePump(kBytes, kOurTransfer));
    ready.push_back(readyFrames());
    const auto streamed = samples();
    whole.push_back(streamed.bytes_per_s);
    EXPECT_TRUE(streamed.exact);
  }
  const auto row = [&](const char* what, double speed) {
    std::printf("%-36s %6.1f MB/s  %.2f of the usual pump  %.2f of the large one\n", what, speed / 1e6,
                speed / median(usual), speed / median(large));
  };
  row("bare pump, 16 kB at a time (usual)", median(usual));
  row("bare pump, 32 kB at a time (large)", median(large));
  row("frames that are ready, box to host", median(ready));
  row("samples, encoded, checked, decoded", median(whole));
  EXPECT_GE(median(ready), 0.9 * median(usual));
  EXPECT_GE(median(whole), 0.5 * median(usual));
}

}  // namespace
}  // namespace probebox::vm
