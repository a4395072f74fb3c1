#pragma once
#include <memory>
#include <mutex>
#include <optional>
#include <string_view>
#include <vector>

#include "firmware/front_end/core/assembly.hpp"
#include "firmware/front_end/core/control.hpp"
#include "host-tests/mock_usb/mock_bus.hpp"

namespace probebox::usb {

// The program of the front end, as far as its control endpoint, behind a device of a mocked bus. The bus asks it on a
// thread of its own.
class FrontEndOnBus {
 public:
  static constexpr std::string_view kSerial = "E0C9125B0D9B5A25";

  FrontEndOnBus() { assembly_->start({}, 0); }

  MockBus::Device device() {
    return {.path = "1-3",
            .address = 7,
            .serial_number = std::string{kSerial},
            .product = "front end",
            .interface_class = kReceiver,
            .endpoints = {MockBus::kSamplesIn},
            .control = [this](auto setup, auto data) { return answer(setup, data); }};
  }

  front_end::Settings settings() {
    const std::lock_guard lock{mutex_};
    return assembly_->settings();
  }
  // Changes with each of its settings.
  std::uint8_t run() {
    const std::lock_guard lock{mutex_};
    return run_;
  }
  bool takeBootLoader() {
    const std::lock_guard lock{mutex_};
    return control_.takeBootLoader();
  }
  // It says that its program has this version.
  void pretendVersion(std::uint16_t version) {
    const std::lock_guard lock{mutex_};
    version_ = version;
  }

 private:
  std::optional<std::vector<std::byte>> answer(std::span<const std::byte, 8> setup, std::span<const std::byte> data) {
    const std::lock_guard lock{mutex_};
    auto answer = control_.setup(setup);
    using Kind = front_end::Answer::Kind;
    if (answer.kind == Kind::out) answer = control_.data(data);
    if (const auto settings = control_.takeSettings()) assembly_->start(*settings, ++run_);
    if (answer.kind == Kind::stall) return std::nullopt;
    std::vector<std::byte> bytes{answer.bytes.begin(), answer.bytes.end()};
    if (version_ && setup[1] == std::byte{1}) {
      bytes[0] = static_cast<std::byte>(*version_ & 0xFFU);
      bytes[1] = static_cast<std::byte>(*version_ >> 8U);
    }
    return bytes;
  }

  std::unique_ptr<front_end::Assembly> assembly_ = std::make_unique<front_end::Assembly>();
  front_end::Control control_{*assembly_, kSerial};
  std::mutex mutex_;
  std::uint8_t run_{};
  std::optional<std::uint16_t> version_;
};

}  // namespace probebox::usb
