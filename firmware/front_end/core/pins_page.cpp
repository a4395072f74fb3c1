// Writes board/front-end/pins.md from protocol/receiver/front_end.hpp. `pins_page` prints it; `pins_page --check FILE`
// fails when the file says something else.
#include <algorithm>
#include <string>
#include <string_view>

#include "protocol/messages/reference_table.hpp"
#include "protocol/receiver/front_end.hpp"

namespace probebox::front_end {
namespace {

std::string pins() {
  auto sorted = kPins;
  std::ranges::sort(sorted, {}, &Pin::gpio);
  std::string rows = "| GPIO | name | direction | meaning |\n|---|---|---|---|\n";
  for (const auto& [gpio, use, name, meaning] : sorted)
    rows += "| " + std::to_string(gpio) + " | `" + std::string{name} + "` | " + (use == PinUse::input ? "in" : "out") +
            " | " + std::string{meaning} + " |\n";
  return rows;
}

std::string requestNumber(Request request) {
  return std::to_string(static_cast<unsigned>(request));
}

std::string page() {
  return R"(# Pins and requests of the front end
Generated from protocol/receiver/front_end.hpp, which the program is compiled from, by `cmake --build build --target front-end-page`; do
not edit. [docs/front-end.md](../../docs/front-end.md) says what stands between these pins and the machine.

All inputs take 3.3 V, are pulled down and have Schmitt triggers. The numbers are those of the RP2040's GPIO, and of a Pico's GP.

)" + pins() +
         R"(
## Requests
Control transfers of type vendor, recipient device, wIndex 0 (bmRequestType 0xc0 IN, 0x40 OUT). Numbers are little endian, without
padding. What is refused is stalled.

**)" + requestNumber(Request::identity) +
         R"( identity** (IN)

)" + messages::packedTable<Identity>() +
         R"(
**)" + requestNumber(Request::pins) +
         R"( pins** (IN): one byte a pin, its GPIO, in the order of `kPins`.

**)" + requestNumber(Request::counters) +
         R"( counters** (IN), since the program started

)" + messages::packedTable<FrontEndCounters>() +
         R"(
**)" + requestNumber(Request::settings) +
         R"( settings** (IN: those in use; OUT: new ones, with which samples and counts begin anew and `run` is another)

)" + messages::packedTable<Settings>() +
         R"(
**)" + requestNumber(Request::boot_loader) +
         R"( boot loader** (OUT, wValue 0xb007, no data): the chip waits for another program, as with its button.
)";
}

}  // namespace
}  // namespace probebox::front_end

int main(int argc, char** argv) {
  return probebox::messages::printOrCheck(argc, argv, probebox::front_end::page(), "front-end-page");
}
