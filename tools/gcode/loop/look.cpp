#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "tools/gcode/loop/writer.hpp"

// How a program copies the registers of the step.
namespace probebox::gcode::loop {
namespace {

constexpr int kScan = 6;  // register 852

bool ofScan(std::string_view pin) {
  return pin.starts_with("probebox.step-scan");
}

}  // namespace

const std::vector<std::string>& Writer::headOfStep() {
  static const std::vector<std::string> head{"probebox.step-run", "probebox.step-number", "probebox.step-repeats",
                                             "probebox.step-state"};
  return head;
}

std::string Writer::copyOf(std::string_view pin) {
  std::string name = "_pb_box_" + std::string{pin.substr(pin.find('.') + 1)};
  std::ranges::replace(name, '-', '_');
  return name;
}

// A copy is of one instant where run, number, repeats and state are the same before and behind it. While the box
// records, the step stays the one that is copied: only its state is read, since the recording has room for so much.
void Writer::look() {
  const int again = newLabel(), behind = newLabel();
  const auto& head = headOfStep();
  const auto live = [&](const std::string& pin) { return read(*placeRead(pin)); };
  for (std::size_t i = 0; i + 1 < head.size(); ++i) jumpIf(live(head[i]), "NE", variable(copyOf(head[i])), again);
  const auto state = variable(copyOf(head.back()));
  jumpIf(live(head.back()), "EQ", state, behind);
  assign(state, live(head.back()));
  jumpIf(state, "NE", number(1), behind);
  label(again);
  for (const auto& pin : head) assign(variable(copyOf(pin)), live(pin));
  for (const auto& pin : step_pins_) {
    if (std::ranges::find(head, pin) == head.end() && !ofScan(pin)) assign(variable(copyOf(pin)), live(pin));
  }
  // Each word takes its time, and other steps have no scan.
  const int no_scan = newLabel();
  jumpIf(variable(copyOf("probebox.step-kind")), "NE", number(kScan), no_scan);
  for (const auto& pin : step_pins_) {
    if (ofScan(pin)) assign(variable(copyOf(pin)), live(pin));
  }
  label(no_scan);
  for (const auto& pin : head) jumpIf(live(pin), "NE", variable(copyOf(pin)), again);
  label(behind);
}

}  // namespace probebox::gcode::loop
