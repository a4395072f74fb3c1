#include "host-tests/mock_usb/mock_file.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <fcntl.h>
#include <linux/usbdevice_fs.h>
#include <stdexcept>
#include <unistd.h>
#include <utility>

namespace probebox::usb {
namespace {

bool isIn(std::uint8_t address) {
  return (address & 0x80U) != 0;
}

std::span<std::byte> bufferOf(const usbdevfs_urb& urb) {
  return {static_cast<std::byte*>(urb.buffer), static_cast<std::size_t>(urb.buffer_length)};
}

void closeEnd(int& descriptor) {
  if (descriptor >= 0) close(std::exchange(descriptor, -1));
}

}  // namespace

MockFile::~MockFile() {
  closeEnd(reading_end_);
  closeEnd(writing_end_);
}

void MockFile::opened(int descriptor) {
  closeEnd(reading_end_);
  closeEnd(writing_end_);
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC | O_NONBLOCK) != 0 || dup2(ends[1], descriptor) < 0) {
    throw std::runtime_error{"no pipe for a mocked node"};
  }
  reading_end_ = ends[0];
  writing_end_ = ends[1];
  fcntl(writing_end_, F_SETPIPE_SZ, 4096);  // one page: one byte fills it
  ready_ = true;
  showReady();
}

void MockFile::unplugged() {
  gone_ = true;
  flush(-ESHUTDOWN);
  closeEnd(reading_end_);
  closeEnd(writing_end_);
}

int MockFile::claim() {
  if (gone_) return ENODEV;
  if (!held_by.empty()) return EBUSY;
  claimed = true;
  return 0;
}

int MockFile::release() {
  if (!std::exchange(claimed, false)) return EINVAL;
  if (!frozen) flush(-ESHUTDOWN);
  return gone_ ? ENODEV : 0;
}

int MockFile::selectAlternate(std::size_t new_session) {
  if (gone_) return ENODEV;
  flush(-ESHUTDOWN);
  for (auto& [address, endpoint] : endpoints_) endpoint.to_host.clear();
  ++resets;
  session = new_session;
  return 0;
}

int MockFile::submit(usbdevfs_urb& urb) {
  if (gone_) return ENODEV;
  urb.actual_length = 0;
  if (urb.type == USBDEVFS_URB_TYPE_CONTROL) {
    answerControl(urb);
    return 0;
  }
  if (!claimed) return ENOENT;
  endpoints_[urb.endpoint].in_flight.push_back(&urb);
  progress(urb.endpoint);
  return 0;
}

int MockFile::reap(usbdevfs_urb*& urb) {
  if (back_.empty()) return gone_ ? ENODEV : EAGAIN;
  urb = back_.front();
  back_.pop_front();
  showReady();
  return 0;
}

int MockFile::discard(const usbdevfs_urb* urb) {
  if (frozen) return 0;
  for (auto& [address, endpoint] : endpoints_) {
    const auto found = std::ranges::find(endpoint.in_flight, urb);
    if (found == endpoint.in_flight.end()) continue;
    auto& cancelled = **found;
    endpoint.in_flight.erase(found);
    comeBack(cancelled, -ENOENT);
    return 0;
  }
  return EINVAL;
}

void MockFile::send(std::uint8_t address, std::span<const std::byte> bytes) {
  endpoints_[address].to_host.emplace_back(bytes.begin(), bytes.end());
  progress(address);
}

std::size_t MockFile::waiting(std::uint8_t address) const {
  const auto found = endpoints_.find(address);
  std::size_t bytes = 0;
  if (found == endpoints_.end()) return bytes;
  for (const auto& message : found->second.to_host) bytes += message.size();
  return bytes;
}

std::vector<std::byte> MockFile::received(std::uint8_t address) {
  return std::exchange(endpoints_[address].from_host, {});
}

void MockFile::setReading(std::uint8_t address, bool reads) {
  endpoints_[address].mute = !reads;
  progress(address);
}

void MockFile::spoil(std::uint8_t address, int status) {
  endpoints_[address].spoilt.push_back(status);
  progress(address);
}

std::size_t MockFile::inFlight(std::uint8_t address) const {
  const auto found = endpoints_.find(address);
  return found == endpoints_.end() ? 0 : found->second.in_flight.size();
}

// Transfers of an endpoint come back in the order in which they were submitted.
void MockFile::progress(std::uint8_t address) {
  auto& endpoint = endpoints_[address];
  while (!endpoint.in_flight.empty() && finish(address, endpoint, *endpoint.in_flight.front())) {
    endpoint.in_flight.pop_front();
  }
}

// A set-up packet, then data one way or the other.
void MockFile::answerControl(usbdevfs_urb& urb) {
  const auto setup = bufferOf(urb).first<8>();
  const auto data = bufferOf(urb).subspan(8);
  const bool in = isIn(std::to_integer<std::uint8_t>(setup[0]));
  const auto answer = control ? control(setup, in ? std::span<std::byte>{} : data) : std::nullopt;
  if (!answer) return comeBack(urb, -EPIPE);
  const auto moved = in ? std::min(answer->size(), data.size()) : data.size();
  if (in) std::copy_n(answer->begin(), moved, data.begin());
  urb.actual_length = static_cast<int>(moved);
  comeBack(urb, 0);
}

// False when the transfer has to wait for the firmware.
bool MockFile::finish(std::uint8_t address, Endpoint& endpoint, usbdevfs_urb& urb) {
  if (!endpoint.spoilt.empty()) {
    comeBack(urb, endpoint.spoilt.front());
    endpoint.spoilt.pop_front();
    return true;
  }
  const auto buffer = bufferOf(urb);
  if (!isIn(address)) {
    if (endpoint.mute) return false;
    endpoint.from_host.insert(endpoint.from_host.end(), buffer.begin(), buffer.end());
    urb.actual_length = urb.buffer_length;
    if (buffer.size() % MockBus::kPacketBytes == 0 && (urb.flags & USBDEVFS_URB_ZERO_PACKET) == 0) ++endless;
    comeBack(urb, 0);
    return true;
  }
  if (endpoint.to_host.empty()) return false;
  auto& message = endpoint.to_host.front();
  const auto moved = std::min(buffer.size(), message.size());
  std::copy_n(message.begin(), moved, buffer.begin());
  message.erase(message.begin(), message.begin() + static_cast<std::ptrdiff_t>(moved));
  if (message.empty()) endpoint.to_host.pop_front();
  urb.actual_length = static_cast<int>(moved);
  comeBack(urb, 0);
  return true;
}

void MockFile::comeBack(usbdevfs_urb& urb, int status) {
  urb.status = status;
  back_.push_back(&urb);
  showReady();
}

void MockFile::flush(int status) {
  for (auto& [address, endpoint] : endpoints_) {
    while (!endpoint.in_flight.empty()) {
      auto& urb = *endpoint.in_flight.front();
      endpoint.in_flight.pop_front();
      comeBack(urb, status);
    }
  }
}

void MockFile::showReady() {
  const bool ready = !back_.empty();
  if (ready == ready_ || writing_end_ < 0) return;
  ready_ = ready;
  char byte{};
  const auto moved = ready ? read(reading_end_, &byte, 1) : write(writing_end_, &byte, 1);
  if (moved != 1) throw std::runtime_error{"the pipe of a mocked node is not as it was left"};
}

}  // namespace probebox::usb
