#include "drivers/usb_probe/front_end.hpp"

#include <algorithm>
#include <array>
#include <span>

#include "protocol/messages/fields.hpp"

namespace probebox::usb_probe {
namespace {

using front_end::RefusalCode;
using front_end::Request;
using usb_host::VendorRequests;

template <class T>
std::optional<T> read(const VendorRequests& requests, Request request) {
  std::array<std::byte, 128> bytes{};
  const auto size = requests.read(static_cast<std::uint8_t>(request), bytes);
  if (!size || *size == 0) return std::nullopt;
  const auto decoded = messages::decode<T>(std::span{bytes}.first(std::min(*size, bytes.size())));
  return decoded ? std::optional{*decoded} : std::nullopt;
}

std::string nameOf(RefusalCode code) {
  switch (code) {
    case RefusalCode::bad_steps_a_sample:
      return "rate_hz of probe.toml";
    case RefusalCode::bad_samples_a_packet:
      return "samples_a_packet of [front_end]";
    case RefusalCode::bad_sync_out_steps:
      return "sync_out_hz of [front_end]";
    case RefusalCode::bad_full_scale:
      return "full_scale_um of [front_end]";
    default:
      return "the settings as a whole";
  }
}

}  // namespace

std::optional<FrontEnd> askFrontEnd(const VendorRequests& requests) {
  const auto identity = read<front_end::Identity>(requests, Request::identity);
  if (!identity || identity->version == 0 || identity->step_ps == 0) return std::nullopt;
  const auto settings = read<front_end::Settings>(requests, Request::settings);
  if (!settings) return std::nullopt;
  FrontEnd answer{*identity, {}, *settings};
  std::array<std::byte, 64> pins{};
  const auto count = requests.read(static_cast<std::uint8_t>(Request::pins), pins).value_or(0);
  for (const auto pin : std::span{pins}.first(std::min(count, pins.size())))
    answer.pins.push_back(std::to_integer<std::uint8_t>(pin));
  return answer;
}

std::optional<Error> setFrontEnd(const VendorRequests& requests, const front_end::Settings& wanted) {
  std::array<std::byte, front_end::kSettingsBytes> bytes{};
  const auto size = messages::encode(wanted, bytes);
  const bool taken = size && requests.write(static_cast<std::uint8_t>(Request::settings), 0, bytes);
  if (!taken) {
    const auto counters = read<front_end::FrontEndCounters>(requests, Request::counters);
    const auto refusal = static_cast<RefusalCode>(counters ? counters->last_refusal : 0);
    if (refusal == RefusalCode::none)
      return Error{"its settings cannot be sent: plug it in again, or try another cable"};
    return Error{"it refuses " + nameOf(refusal) +
                 ": correct it in the description of the board, or update the front end"};
  }
  const auto now = read<front_end::Settings>(requests, Request::settings);
  if (now != wanted) return Error{"it does not keep its settings: plug it in again, or update the front end"};
  return std::nullopt;
}

std::string versionText(std::uint16_t version) {
  return std::to_string(version >> 8U) + "." + std::to_string(version & 0xFFU);
}

std::string whatIsLacking(const FrontEnd* front_end, std::uint8_t packet_version) {
  std::string lacks;
  const auto add = [&lacks](const std::string& what) { lacks += (lacks.empty() ? "" : "; ") + what; };
  if (front_end != nullptr && front_end->identity.version < front_end::kVersion)
    add("its program is version " + versionText(front_end->identity.version) + ", and this firmware knows " +
        versionText(front_end::kVersion) + ": probebox update --front-end");
  if (packet_version == PacketHeader::kVersion)
    add("packets of version 1 have no axis counters and no index pulses (version 2)");
  if (packet_version != 0 && packet_version < PacketHeader::kWithEdges)
    add("packets of version " + std::to_string(packet_version) +
        " have no edges of lines and no faults (version 3): let it send version 3, or wire lines to a gpio chip");
  return lacks;
}

}  // namespace probebox::usb_probe
