#include <array>
#include <cctype>
#include <cstdlib>
#include <string>

#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

constexpr std::string_view kAxes = "XYZ";
constexpr milliseconds kAxesPublished{100};  // the box publishes the state of its axes every 10 ms
constexpr int kLooks = 10;

Outcome<messages::HomeAxes::Request, Trouble> requestOf(const Home& options) {
  messages::HomeAxes::Request request;
  request.by = options.by;
  for (const auto& text : options.axes) {
    const auto axis = kAxes.find(static_cast<char>(std::toupper(static_cast<unsigned char>(text.front()))));
    const auto bit = static_cast<std::uint8_t>(1U << axis);
    if ((request.axes & bit) != 0) return usage(text + ": each axis has one position; name it once");
    request.axes = static_cast<std::uint8_t>(request.axes | bit);
    request.position_mm.at(axis) = std::strtod(text.c_str() + 2, nullptr);
  }
  return request;
}

bool allReferenced(const messages::Corrections::Answer& now, std::uint8_t axes) {
  for (std::size_t i = 0; i < now.axes.size(); ++i) {
    if ((unsigned{axes} >> i & 1U) != 0 && !now.axes[i].referenced) return false;
  }
  return true;
}

// Waits until the box's core has processed the request, and returns its outcome.
Outcome<messages::Corrections::Answer, Trouble> outcome(link::Client& box, std::uint8_t axes, std::uint32_t refused,
                                                        const Console& console) {
  for (int look = 0;; ++look) {
    for (const auto pause = patienceOf(console, kAxesPublished); box.round(pause);) {
    }
    if (console.interrupted()) return interruption();
    auto now = ask<messages::Corrections>(box, console);
    if (!now || now->refused_homings != refused || allReferenced(*now, axes) || look == kLooks) return now;
  }
}

void show(const messages::Corrections::Answer& now, std::uint8_t axes, Console& console) {
  Json object = Json::object();
  for (std::size_t i = 0; i < now.axes.size() && i < kAxes.size(); ++i) {
    if ((unsigned{axes} >> i & 1U) == 0) continue;
    const std::string name(1, kAxes[i]);
    if (console.json()) {
      object[name] = Json{{"referenced", now.axes[i].referenced}, {"position_mm", now.axes[i].position_mm}};
    } else {
      console.line("axis " + name + printed(" is referenced; it is at %.4f mm now", now.axes[i].position_mm));
    }
  }
  if (console.json()) console.object({{"homed", object}});
}

}  // namespace

ExitStatus run(const Home& options, const std::string& uri, Console& console) {
  const auto request = requestOf(options);
  if (!request) return console.fail(request.error());
  const auto box = openBox(uri, console);
  if (!box) return console.fail(box.error());
  const auto before = ask<messages::Corrections>(**box, console);
  if (!before) return console.fail(before.error());
  const auto homed = ask<messages::HomeAxes>(**box, console, *request);
  if (!homed) return console.fail(homed.error());
  const auto now = outcome(**box, request->axes, before->refused_homings, console);
  if (!now) return console.fail(now.error());
  if (now->refused_homings != before->refused_homings || !allReferenced(*now, request->axes)) {
    return console.fail({ExitStatus::failed, "not-homed",
                         "an axis was not homed: it has to stand still for 0.1 s, and one with an absolute encoder "
                         "needs no homing; probebox corrections shows which axes are referenced"});
  }
  show(*now, request->axes, console);
  return ExitStatus::ok;
}

}  // namespace probebox::command
