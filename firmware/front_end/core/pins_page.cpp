// Writes board/front-end/pins.md from protocol/receiver/front_end.hpp. `pins_page` prints it; `pins_page --check FILE`
// fails when the file says something else.
#include <algorithm>
#include <fstream>
#include <iostream>
#include <sstream>
#include <string>
#include <string_view>
#include <type_traits>

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

template <class T>
std::string typeName() {
  if constexpr (std::is_integral_v<T>)
    return (std::is_signed_v<T> ? "i" : "u") + std::to_string(8 * sizeof(T));
  else
    return std::to_string(std::tuple_size_v<T>) + " x " + typeName<typename T::value_type>();
}

template <class T>
std::string fields() {
  std::string rows = "| offset | field | type | meaning |\n|---|---|---|---|\n";
  std::size_t offset = 0;
  const T value{};
  T::fields(value, [&](std::string_view name, const auto& member, std::string_view meaning) {
    rows += "| " + std::to_string(offset) + " | `" + std::string{name} + "` | " +
            typeName<std::decay_t<decltype(member)>>() + " | " + std::string{meaning} + " |\n";
    offset += sizeof(member);
  });
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

)" + fields<Identity>() +
         R"(
**)" + requestNumber(Request::pins) +
         R"( pins** (IN): one byte a pin, its GPIO, in the order of `kPins`.

**)" + requestNumber(Request::counters) +
         R"( counters** (IN), since the program started

)" + fields<FrontEndCounters>() +
         R"(
**)" + requestNumber(Request::settings) +
         R"( settings** (IN: those in use; OUT: new ones, with which samples and counts begin anew and `run` is another)

)" + fields<Settings>() +
         R"(
**)" + requestNumber(Request::boot_loader) +
         R"( boot loader** (OUT, wValue 0xb007, no data): the chip waits for another program, as with its button.
)";
}

}  // namespace
}  // namespace probebox::front_end

int main(int argc, char** argv) {
  const auto page = probebox::front_end::page();
  if (argc == 3 && std::string_view{argv[1]} == "--check") {
    std::ostringstream text;
    text << std::ifstream{argv[2]}.rdbuf();
    if (text.str() == page) return 0;
    std::cerr << argv[2] << " is stale; run: cmake --build build --target front-end-page\n";
    return 1;
  }
  std::cout << page;
  return std::cout.flush() ? 0 : 1;
}
