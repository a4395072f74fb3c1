#include "tools/probebox/link/box.hpp"

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "drivers/io/kernel_clock.hpp"
#include "drivers/io/rendezvous.hpp"
#include "protocol/units/calendar.hpp"
#include "tools/link/own_keys.hpp"
#include "tools/probebox/link/on_usb.hpp"

namespace probebox::command {
namespace {

constexpr milliseconds kGlance{500};
constexpr const char* kHowToGetABox =
    "plug one in, start an emulated one with `probeboxd --board sim`, or name another with -u URI or PROBEBOX_URI";

// Of this computer, for boxes that have no clock of their own.
messages::TimeOfDay timeOfDay() {
  const auto clock = io::kernelClock();
  if (!clock.isKept() || !couldBeNow(std::chrono::floor<std::chrono::seconds>(clock.utc))) return {};
  if (!clock.synchronised) return {.utc_us = clock.utc.time_since_epoch().count()};
  return {.utc_us = clock.utc.time_since_epoch().count(),
          .error_ms = static_cast<std::uint32_t>(std::chrono::ceil<milliseconds>(clock.largest_error).count())};
}

// TCP first: a serial line serves one host only.
std::string preferred(const std::vector<std::string>& uris) {
  const auto tcp = std::ranges::find_if(uris, [](const std::string& uri) { return uri.starts_with("tcp:"); });
  return tcp != uris.end() ? *tcp : uris.empty() ? std::string{} : uris.front();
}

// A killed box leaves its announcement behind, and another process may have its number by now.
bool takesNobody(const std::string& text) {
  const auto uri = link::parseUri(text);
  return !uri || !link::open(*uri, kGlance);
}

// A box that runs on this very computer may be on its USB as well, and has said so: it counts once.
std::vector<std::string> urisOnUsb(const std::vector<io::rendezvous::Announcement>& announced) {
  std::vector<std::string> uris;
  for (const auto& device : boxesOnUsb()) uris.push_back("usb:" + device.name());
  for (const auto& announcement : announced) {
    std::erase_if(
        uris, [&](const auto& uri) { return std::ranges::find(announcement.uris, uri) != announcement.uris.end(); });
  }
  return uris;
}

// A box that could not announce itself has the usual address.
Outcome<std::string, Trouble> boxElsewhere() {
  const auto folder = io::rendezvous::chosen();
  if (!folder) return std::string{kUsualUri};
  return Trouble{ExitStatus::no_box, "no-box",
                 "no box is announced in " + folder->string() +
                     ", the only place that PROBEBOX_RENDEZVOUS lets this command look in; unset it, or " +
                     kHowToGetABox};
}

Outcome<std::string, Trouble> theOnlyBox() {
  const auto announced = io::rendezvous::listed();
  const auto on_usb = urisOnUsb(announced);
  std::vector<std::string> boxes;
  for (const auto& announcement : announced) {
    if (auto uri = preferred(announcement.uris); !uri.empty()) boxes.push_back(std::move(uri));
  }
  if (boxes.size() + on_usb.size() > 1) std::erase_if(boxes, takesNobody);
  boxes.insert(boxes.end(), on_usb.begin(), on_usb.end());
  if (boxes.empty()) return boxElsewhere();
  if (boxes.size() == 1) return boxes.front();
  std::string all;
  for (const auto& uri : boxes) all += " " + uri;
  return usage("several boxes were found; name one with -u:" + all);
}

}  // namespace

Trouble usage(std::string what) {
  return {ExitStatus::usage, "usage", std::move(what)};
}

Trouble interruption() {
  return {ExitStatus::interrupted, "interrupted", "interrupted"};
}

Outcome<link::Uri, Trouble> chooseUri(const std::string& given) {
  std::string text = given;
  if (const char* environment = std::getenv("PROBEBOX_URI"); text.empty() && environment != nullptr) text = environment;
  if (text.empty()) {
    TRY(auto found, theOnlyBox());
    text = std::move(found);
  }
  auto uri = link::parseUri(text);
  if (!uri) return usage(uri.error().what);
  auto meant = link::settled(*uri);
  if (!meant) return troubleOf(meant.error());
  return std::move(meant).value();
}

Outcome<std::string, Trouble> chooseRecording(const std::string& path, const std::string& given) {
  if (!path.empty()) return path;
  const char* environment = std::getenv("PROBEBOX_URI");
  const auto uri = link::parseUri(given.empty() && environment != nullptr ? environment : given);
  if (uri && uri->isFile()) return std::get<link::FileAddress>(uri->address).path;
  return usage("no recording is named; give its file, such as scan.pbx, or -u file:scan.pbx");
}

std::string signer(const std::string& by, const std::string& given) {
  if (!by.empty()) return by;
  const auto uri = chooseUri(given);
  if (!uri || !std::holds_alternative<link::TlsAddress>(uri->address)) return {};
  const auto keys = link::ownKeys();
  return keys ? keys->ownName() : std::string{};
}

Trouble troubleOf(const link::OpenFailure& failure) {
  using Kind = link::OpenFailure::Kind;
  switch (failure.kind) {
    case Kind::no_permission:
      return {ExitStatus::no_box, "no-permission", failure.what};
    case Kind::busy:
      return {ExitStatus::no_box, "busy", failure.what};
    case Kind::ambiguous:
      return usage(failure.what);
    default:
      return {ExitStatus::no_box, "no-box", "no box answers: " + failure.what};
  }
}

Trouble troubleOf(const link::Failure& failure, const Console& console) {
  if (console.interrupted()) return interruption();
  switch (failure.kind) {
    case link::Failure::Kind::box_refused:
      return {ExitStatus::box_refused, std::string{messages::nameOf(failure.code)}, "the box refused: " + failure.what};
    case link::Failure::Kind::no_protocol:
      return {ExitStatus::no_box, "no-box", failure.what};
    case link::Failure::Kind::timed_out:
      return {ExitStatus::no_box, "timed-out", failure.what};
    default:
      return {ExitStatus::no_box, "link-lost", failure.what};
  }
}

milliseconds inMilliseconds(double seconds) {
  constexpr double kDay_s = 86'400;
  return milliseconds{static_cast<std::int64_t>(std::clamp(seconds, 1e-3, kDay_s) * 1e3)};
}

link::Wait patienceOf(const Console& console, milliseconds limit) {
  return link::patience(limit, &console.interruption());
}

Outcome<Box, Trouble> openBox(const link::Uri& uri, const Console& console, milliseconds patience,
                              link::StreamListener* listener, const link::ClientOptions& options) {
  auto connection = link::open(uri, patience);
  if (!connection) {
    auto trouble = troubleOf(connection.error());
    if (!std::holds_alternative<link::UsbAddress>(uri.address)) trouble.what += std::string{"; "} + kHowToGetABox;
    return trouble;
  }
  auto told = options;
  if (!told.time_of_day) told.time_of_day = timeOfDay;
  auto box = std::make_unique<link::Client>(std::move(connection).value(), told, listener);
  const auto welcome = box->connect(patienceOf(console, patience));
  if (!welcome) {
    auto trouble = troubleOf(welcome.error(), console);
    if (trouble.status == ExitStatus::no_box) trouble.what = "no box answers at " + uri.text + ": " + trouble.what;
    return trouble;
  }
  return box;
}

Outcome<Box, Trouble> openBox(const std::string& given, const Console& console) {
  TRY(const auto uri, chooseUri(given));
  if (uri.isFile()) {
    return usage(
        uri.text +
        " is a recording, which cannot answer; info, status, watch, record, export and verify read it, or name a box");
  }
  return openBox(uri, console);
}

std::optional<Trouble> ListWatch::part(std::uint64_t first, std::uint64_t last) {
  if (first > last_ && last >= first) return furtherPart(last);
  last_ = last;
  return endless();
}

std::optional<Trouble> ListWatch::furtherPart(std::uint64_t last) {
  last_ = last;
  if (++parts_ <= most_parts_) return std::nullopt;
  return endless();
}

Trouble ListWatch::endless() const {
  return Trouble{ExitStatus::no_box, "endless-list",
                 "the box's list does not end: after number " + std::to_string(last_) +
                     " it says the same again, or ever more; update its firmware"};
}

}  // namespace probebox::command
