#include "firmware/front_end/core/control.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

#include "protocol/messages/fields.hpp"
#include "protocol/usb/interface.hpp"

namespace probebox::front_end {
namespace {

constexpr std::uint8_t kToHost = 0x80, kTypeMask = 0x60, kStandard = 0x00, kVendor = 0x40, kRecipientMask = 0x1f;
constexpr std::uint8_t kDevice = 0, kInterface = 1, kEndpoint = 2;
constexpr std::uint8_t kBulkIn = 0x81;
constexpr std::uint16_t kHalt = 0;

// Numbers of pid.codes that are free for tests; a vendor has its own.
constexpr std::uint16_t kVendorId = 0x1209, kProductId = 0x0001;
constexpr std::uint8_t low(unsigned value) {
  return static_cast<std::uint8_t>(value & 0xFFU);
}
constexpr std::uint8_t high(unsigned value) {
  return static_cast<std::uint8_t>(value >> 8U);
}

constexpr std::array<std::uint8_t, 18> kDeviceDescriptor{18,
                                                         1,
                                                         0x00,
                                                         0x02,
                                                         0,
                                                         0,
                                                         0,
                                                         kControlBytes,
                                                         low(kVendorId),
                                                         high(kVendorId),
                                                         low(kProductId),
                                                         high(kProductId),
                                                         low(kVersion),
                                                         high(kVersion),
                                                         1,
                                                         2,
                                                         3,
                                                         1};

constexpr std::uint8_t kSelfPowered = 0x40;
constexpr std::array<std::uint8_t, 25> kConfigurationDescriptor{9,
                                                                2,
                                                                25,
                                                                0,
                                                                1,
                                                                1,
                                                                0,
                                                                0x80 | kSelfPowered,
                                                                250 / 2,  //
                                                                9,
                                                                4,
                                                                0,
                                                                0,
                                                                1,
                                                                usb::kReceiver.interface_class,
                                                                usb::kReceiver.subclass,
                                                                usb::kReceiver.protocol,
                                                                0,  //
                                                                7,
                                                                5,
                                                                kBulkIn,
                                                                2,
                                                                low(kBulkBytes),
                                                                high(kBulkBytes),
                                                                0};

constexpr std::array<std::string_view, 2> kStrings{"probebox", "probebox front end"};
constexpr std::size_t kSerialString = 3;

}  // namespace

struct Control::Setup {
  std::uint8_t type, request;
  std::uint16_t value, index, length;

  explicit Setup(std::span<const std::byte, 8> bytes)
      : type{std::to_integer<std::uint8_t>(bytes[0])},
        request{std::to_integer<std::uint8_t>(bytes[1])},
        value{frame::loadLittle<std::uint16_t>(&bytes[2])},
        index{frame::loadLittle<std::uint16_t>(&bytes[4])},
        length{frame::loadLittle<std::uint16_t>(&bytes[6])} {}

  bool isIn() const { return (type & kToHost) != 0; }
  std::uint8_t recipient() const { return type & kRecipientMask; }
};

Control::Control(Assembly& assembly, std::span<const char> serial)
    : assembly_{assembly}, serial_size_{std::min(serial.size(), serial_.size())} {
  std::copy_n(serial.begin(), serial_size_, serial_.begin());
}

void Control::reset() {
  address_ = 0;
  configured_ = halted_ = false;
  new_host_ = true;
}

std::optional<Settings> Control::takeSettings() {
  return std::exchange(settings_, std::nullopt);
}
bool Control::takeNewHost() {
  return std::exchange(new_host_, false);
}
bool Control::takeBootLoader() {
  return std::exchange(boot_loader_, false);
}

Answer Control::setup(std::span<const std::byte, 8> packet) {
  const Setup setup{packet};
  switch (setup.type & kTypeMask) {
    case kStandard:
      return standard(setup);
    case kVendor:
      return vendor(setup);
    default:
      return {};
  }
}

Answer Control::give(std::size_t size, const Setup& setup) {
  if (!setup.isIn()) return {};
  return {Answer::Kind::in, std::span{bytes_}.first(std::min<std::size_t>(size, setup.length)), 0};
}

Answer Control::standard(const Setup& setup) {
  constexpr Answer kDone{Answer::Kind::acknowledge, {}, 0};
  const bool is_endpoint = setup.index == kBulkIn || (setup.index & 0x7FU) == 0;
  if (!setup.isIn() && setup.length != 0) return {};
  switch (setup.request) {
    case 0: {  // GET_STATUS
      if (setup.value != 0 || setup.recipient() > kEndpoint) return {};
      const bool knows = setup.recipient() == kDevice      ? setup.index == 0
                         : setup.recipient() == kInterface ? setup.index == 0 && configured_
                                                           : is_endpoint;
      if (!knows) return {};
      const bool is_bulk = setup.recipient() == kEndpoint && setup.index == kBulkIn;
      bytes_[0] = static_cast<std::byte>(setup.recipient() == kDevice ? 1 : is_bulk && halted_ ? 1 : 0);
      bytes_[1] = {};
      return give(2, setup);
    }
    case 1:  // CLEAR_FEATURE
    case 3:  // SET_FEATURE
      return setup.isIn() ? Answer{} : feature(setup, setup.request == 3);
    case 5:  // SET_ADDRESS
      if (setup.isIn() || setup.recipient() != kDevice || setup.value > 127 || setup.index != 0) return {};
      address_ = static_cast<std::uint8_t>(setup.value);
      return kDone;
    case 6:  // GET_DESCRIPTOR
      return setup.recipient() == kDevice ? descriptor(setup) : Answer{};
    case 8:  // GET_CONFIGURATION
      bytes_[0] = static_cast<std::byte>(configured_ ? 1 : 0);
      return setup.recipient() == kDevice && setup.value == 0 ? give(1, setup) : Answer{};
    case 9:  // SET_CONFIGURATION
      if (setup.isIn() || setup.recipient() != kDevice || setup.value > 1) return {};
      configured_ = setup.value == 1;
      halted_ = false;
      new_host_ = true;
      return kDone;
    case 10:  // GET_INTERFACE
      bytes_[0] = {};
      return setup.recipient() == kInterface && setup.index == 0 && configured_ ? give(1, setup) : Answer{};
    case 11:  // SET_INTERFACE
      if (setup.isIn() || setup.recipient() != kInterface || setup.index != 0 || setup.value != 0 || !configured_)
        return {};
      halted_ = false;
      new_host_ = true;
      return kDone;
    default:
      return {};
  }
}

Answer Control::feature(const Setup& setup, bool on) {
  const bool is_bulk = setup.recipient() == kEndpoint && setup.index == kBulkIn && setup.value == kHalt && configured_;
  const bool is_control = setup.recipient() == kEndpoint && (setup.index & 0x7FU) == 0 && setup.value == kHalt;
  if (!is_bulk && !is_control) return {};
  if (is_bulk) {
    halted_ = on;
    new_host_ = true;
  }
  return {Answer::Kind::acknowledge, {}, 0};
}

Answer Control::descriptor(const Setup& setup) {
  const auto copied = [&](const auto& from) {
    std::ranges::transform(from, bytes_.begin(), [](std::uint8_t byte) { return std::byte{byte}; });
    return give(from.size(), setup);
  };
  const unsigned which = setup.value & 0xFFU;
  switch (setup.value >> 8U) {
    case 1:
      return which == 0 ? copied(kDeviceDescriptor) : Answer{};
    case 2:
      return which == 0 ? copied(kConfigurationDescriptor) : Answer{};
    case 3:
      break;
    default:
      return {};
  }
  if (which == 0) return copied(std::array<std::uint8_t, 4>{4, 3, 0x09, 0x04});
  if (which > kSerialString) return {};
  const std::string_view text =
      which == kSerialString ? std::string_view{serial_.data(), serial_size_} : kStrings[which - 1];
  const std::size_t size = 2 + 2 * text.size();
  bytes_[0] = static_cast<std::byte>(size);
  bytes_[1] = std::byte{3};
  for (std::size_t i = 0; i < text.size(); ++i) {
    bytes_[2 + 2 * i] = static_cast<std::byte>(text[i]);
    bytes_[3 + 2 * i] = {};
  }
  return give(size, setup);
}

template <class T>
Answer Control::structure(const T& value, const Setup& setup) {
  frame::ByteWriter writer{bytes_};
  messages::detail::encodeFields(writer, value);
  return give(writer.size(), setup);
}

Answer Control::refuse(RefusalCode code) {
  assembly_.counters().last_refusal = static_cast<std::uint8_t>(code);
  return {};
}

Answer Control::vendor(const Setup& setup) {
  if (setup.recipient() != kDevice || setup.index != 0) return {};
  switch (static_cast<Request>(setup.request)) {
    case Request::identity:
      return structure(Identity{}, setup);
    case Request::pins:
      std::ranges::transform(kPins, bytes_.begin(), [](const Pin& pin) { return std::byte{pin.gpio}; });
      return give(kPins.size(), setup);
    case Request::counters:
      return structure(assembly_.counters(), setup);
    case Request::settings:
      if (setup.isIn()) return structure(assembly_.settings(), setup);
      if (setup.length != kSettingsBytes) return refuse(RefusalCode::bad_size);
      return {Answer::Kind::out, {}, kSettingsBytes};
    case Request::boot_loader:
      if (setup.isIn() || setup.length != 0 || setup.value != kBootLoaderKey) return {};
      boot_loader_ = true;
      return {Answer::Kind::acknowledge, {}, 0};
  }
  return {};
}

Answer Control::data(std::span<const std::byte> bytes) {
  if (bytes.size() != kSettingsBytes) return refuse(RefusalCode::bad_size);
  frame::ByteReader reader{bytes};
  Settings settings;
  messages::detail::decodeFields(reader, settings);
  const auto refused = whyRefused(settings);
  if (refused != RefusalCode::none) return refuse(refused);
  assembly_.counters().last_refusal = 0;
  settings_ = settings;
  return {Answer::Kind::acknowledge, {}, 0};
}

}  // namespace probebox::front_end
