#include "firmware/app/cnc/modbus_tcp_server.hpp"

#include <algorithm>
#include <array>
#include <tuple>
#include <utility>

namespace probebox::app {
namespace {

constexpr std::chrono::milliseconds kRound{500};
constexpr std::uint8_t kUnit = 1;  // of requests at the handler; answers have the unit that the master wrote
constexpr int kMostPending = 16;   // in one turn: connections that come without end do not keep the masters waiting

// "tcp:10.0.0.7" of "tcp:10.0.0.7:51234".
std::string_view computerOf(const io::BytePipe& pipe) {
  return pipe.name().substr(0, pipe.name().rfind(':'));
}

}  // namespace

Outcome<ModbusTcpOptions> parseModbusTcpOptions(std::string_view text) {
  ModbusTcpOptions options;
  const auto comma = text.find(',');
  if (comma != std::string_view::npos) {
    const auto words = text.substr(comma + 1);
    if (words != "words=high-first" && words != "words=low-first")
      return Error{"'" + std::string{words} + "' is unknown: write words=high-first or words=low-first"};
    options.words = words == "words=low-first" ? modbus::WordOrder::low_first : modbus::WordOrder::high_first;
  }
  TRY(options.address, tcp::parseAddress(text.substr(0, comma)));
  return options;
}

ModbusTcpServer::ModbusTcpServer(tcp::Listener listener, std::string revision, Callbacks callbacks)
    : listener_{std::move(listener)},
      name_{tcp::describe(listener_.address())},
      report_{std::move(callbacks.report)},
      round_{std::move(callbacks.round)},
      handler_{kUnit, std::move(revision), std::move(callbacks.registers)} {}

void ModbusTcpServer::run() {
  std::vector<EventLoop::Watch> watches;
  watches.push_back(loop_.watch(listener_.descriptor(), [this] { accept(); }));
  watches.push_back(loop_.watch(stop_.descriptor(), [this] { loop_.quit(); }));
  watches.push_back(loop_.every(kRound, [this] {
    ++rounds_;
    std::erase_if(masters_, [](const auto& master) { return master->gone; });
    if (round_) round_();
  }));
  loop_.run();
  masters_.clear();
}

void ModbusTcpServer::accept() {
  for (int k = 0; k < kMostPending; ++k) {
    auto pipe = listener_.accept();
    if (!pipe) return;
    makeRoomFor(computerOf(*pipe));
    masters_.push_back(std::make_unique<Master>());
    auto& master = *masters_.back();
    master.pipe = std::move(pipe);
    master.heard = ++turn_;
    master.watch = loop_.watch(master.pipe->descriptor(), [this, &master] { receive(master); });
  }
}

void ModbusTcpServer::makeRoomFor(std::string_view computer) {
  std::erase_if(masters_, [](const auto& master) { return master->gone; });
  if (masters_.size() < kMostMasters) return;
  const auto computer_of = [](const auto& master) { return computerOf(*master->pipe); };
  const auto ofComputer = [&](std::string_view name) { return std::ranges::count(masters_, name, computer_of); };
  const bool among_own = ofComputer(computer) >= static_cast<std::ptrdiff_t>(kMostMasters / 2);
  const auto quietest = std::ranges::min_element(masters_, {}, [&](const auto& master) {
    const bool may_stay = among_own && computer_of(master) != computer;
    return std::tuple{may_stay, master->has_asked, -ofComputer(computer_of(master)), master->heard};
  });
  dismiss(**quietest, "gave way to a newer one: " + std::to_string(kMostMasters) + " masters are served at once");
  masters_.erase(quietest);
}

void ModbusTcpServer::receive(Master& master) {
  if (master.gone) return;
  std::array<std::byte, modbus::kMaxTcpFrameBytes> buffer{};
  const auto got = master.pipe->read(buffer);
  auto rest = std::span<const std::byte>{buffer}.first(got.bytes);
  while (!rest.empty() && !master.gone) {
    rest = rest.subspan(master.requests.push(rest));
    while (auto asked = master.requests.next()) {
      answer(master, *asked);
      if (master.gone) return;
    }
    if (!master.requests.broken()) continue;
    ++bad_frames_;
    skipped_bytes_ += master.requests.unfinished() + rest.size();
    return dismiss(master, "sent something else than Modbus over TCP");
  }
  if (got.state != io::PipeState::closed || master.gone) return;
  if (const auto lost = master.requests.unfinished(); lost > 0) {
    ++bad_frames_;
    skipped_bytes_ += lost;
  }
  master.watch.pause();
  master.gone = true;
}

void ModbusTcpServer::answer(Master& master, modbus::TcpRequest& asked) {
  ++rounds_;
  master.has_asked = true;
  master.heard = ++turn_;
  // The unit is the master's own word, and no broadcast.
  asked.request.bytes[0] = kUnit;
  const auto [kind, serial] = handler_.answer(asked.request, computerOf(*master.pipe));
  std::array<std::uint8_t, modbus::kMaxTcpFrameBytes> frame{};
  const auto size = modbus::tcpAnswer(asked, serial, frame);
  using Kind = RegisterHandler::Answer::Kind;
  if (kind == Kind::failed || size == 0 ||
      master.pipe->write(std::as_bytes(std::span{frame}.first(size))).bytes != size) {
    // Half an answer would be the end of all that follow; the buffer of a connection holds hundreds of them.
    ++unsent_;
    return dismiss(master, "does not read its answers");
  }
  ++(kind == Kind::refused ? refused_ : answered_);
}

void ModbusTcpServer::dismiss(Master& master, const std::string& why) {
  report_("The Modbus master " + std::string{master.pipe->name()} + " at " + name_ + " " + why + ". It was closed.");
  master.watch.pause();
  master.pipe.reset();
  master.gone = true;
}

ModbusCounters ModbusTcpServer::counters() const {
  return {answered_, refused_, bad_frames_, skipped_bytes_, unsent_, 0};
}

}  // namespace probebox::app
