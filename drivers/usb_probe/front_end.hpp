#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/usb_host/vendor_request.hpp"
#include "protocol/receiver/front_end.hpp"
#include "protocol/units/outcome.hpp"

// The requests of protocol/receiver/front_end.hpp, as a host makes them.
namespace probebox::usb_probe {

// What the front end says of itself.
struct FrontEnd {
  front_end::Identity identity;
  std::vector<std::uint8_t> pins;  // as front_end::kPins has them; fewer where it has fewer
  front_end::Settings settings;
};

// nullopt for a receiver that does not know these requests.
std::optional<FrontEnd> askFrontEnd(const usb_host::VendorRequests& requests);

// Sends settings: samples and counts begin anew with them. The error names the one that the front end refuses, or says
// that they did not get there.
std::optional<Error> setFrontEnd(const usb_host::VendorRequests& requests, const front_end::Settings& wanted);

// "1.0" of 0x0100.
std::string versionText(std::uint16_t version);

// What a receiver lacks of what this firmware knows, with the remedy; empty for nothing. front_end: nullptr where it
// says nothing of itself. packet_version: of its packets; 0 before the first.
std::string whatIsLacking(const FrontEnd* front_end, std::uint8_t packet_version);

}  // namespace probebox::usb_probe
