#include <algorithm>
#include <utility>

#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/link/read_through.hpp"
#include "tools/probebox/text/report.hpp"
#include "tools/probebox/text/report_unit.hpp"

namespace probebox::command {
namespace {

using Unit = messages::DescribeUnit::Answer;

// now, unit: null for a recording, and of a box that does not know them.
ExitStatus show(const messages::Descriptor& descriptor, const messages::Corrections::Answer* now, const Unit* unit,
                Console& console) {
  if (console.json()) {
    Json all = describe(descriptor);
    all["cut_in_progress"] = now == nullptr ? Json(nullptr) : Json(now->inhibited);
    all["unit"] = unit == nullptr ? Json(nullptr) : describe(*unit, today());
    console.object(all);
    return ExitStatus::ok;
  }
  if (unit != nullptr) {
    auto rows = page(*unit, today());
    rows.pop_back();
    console.line(rows);
  }
  console.line(page(descriptor));
  if (now != nullptr && now->inhibited) console.line("a cut is on: no result comes into force (probebox inhibit)");
  return ExitStatus::ok;
}

struct FirstDescriptor : link::StreamListener {
  void onDescriptor(const messages::Descriptor& descriptor) override {
    if (!found) found = descriptor;
  }
  std::optional<messages::Descriptor> found;
};

ExitStatus ofRecording(const std::string& path, Console& console) {
  FirstDescriptor listener;
  const auto end = readThrough(path, listener, console, {.enough = [&] { return listener.found.has_value(); }});
  if (!end) return conclude(end.error(), console);
  if (listener.found) return show(*listener.found, nullptr, nullptr, console);
  return console.fail({ExitStatus::usage, "no-descriptor",
                       path + " does not identify its box: its beginning is missing, or it ends too early"});
}

// The descriptor names the delay in the samples, which follows a change of the delay in force with the next block.
bool isUpToDate(const messages::Descriptor& descriptor, const messages::Corrections::Answer& now) {
  using Delays = decltype(now.delay.tau_s);
  return descriptor.delay.tau_s == (now.delay_applied ? now.delay.tau_s : Delays{});
}

}  // namespace

ExitStatus run(const Info&, const std::string& given, Console& console) {
  constexpr int kLooks = 10;
  constexpr milliseconds kPause{100};
  const auto uri = chooseUri(given);
  if (!uri) return console.fail(uri.error());
  if (const auto* file = std::get_if<link::FileAddress>(&uri->address)) return ofRecording(file->path, console);
  for (int look = 1;; ++look) {
    const auto box = openBox(*uri, console);
    if (!box) return console.fail(box.error());
    const auto now = ask<messages::Corrections>(**box, console);
    const auto& descriptor = (*box)->described();
    // A recording that is served as a box answers nothing.
    if (!now && now.error().status == ExitStatus::box_refused) return show(descriptor, nullptr, nullptr, console);
    if (!now) return console.fail(now.error());
    const auto unit = ask<messages::DescribeUnit>(**box, console);
    if (!unit && unit.error().status != ExitStatus::box_refused) return console.fail(unit.error());
    const auto* known = unit ? &*unit : nullptr;
    if (isUpToDate(descriptor, *now)) return show(descriptor, &*now, known, console);
    if (look == kLooks) {
      console.note(
          "the delay below is that of the latest samples; another one is in force, and no sample has come since");
      return show(descriptor, &*now, known, console);
    }
    for (const auto pause = patienceOf(console, kPause); (*box)->round(pause);) {
    }
    if (console.interrupted()) return console.fail(interruption());
  }
}

}  // namespace probebox::command
