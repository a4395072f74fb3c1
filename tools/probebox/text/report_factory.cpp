#include "tools/probebox/text/report_factory.hpp"

#include <algorithm>
#include <array>
#include <string_view>

#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

using Verdict = MeasuredCheck::Verdict;

constexpr std::uint8_t kSync = 0;              // LineStatus::role
constexpr double kLeastMotion_mm = 0.1;        // more than vibration and jitter of a count
constexpr std::uint16_t kTestVendor = 0x1209;  // pid.codes, whose products 0001 to 0010 are for tests
constexpr std::uint16_t kLastTestProduct = 0x0010;

Verdict judged(bool good) {
  return good ? Verdict::passed : Verdict::failed;
}

std::string joined(const std::vector<std::string>& keys) {
  std::string all;
  for (const auto& key : keys) all += (all.empty() ? "" : ", ") + key;
  return all.empty() ? "none" : all;
}

// The entry of the same name before, or an empty one: a line that came in between.
template <typename Entry>
Entry entryBefore(const std::vector<Entry>& before, const std::string& name) {
  const auto found = std::ranges::find(before, name, &Entry::name);
  return found == before.end() ? Entry{} : *found;
}

}  // namespace

std::vector<MeasuredCheck> lineChecks(const messages::Status::Answer& before, const messages::Status::Answer& after) {
  std::vector<MeasuredCheck> checks;
  for (const auto& line : after.lines) {
    if (line.role == kSync) continue;
    const auto earlier = entryBefore(before.lines, line.name);
    const auto edges = line.edges - earlier.edges, lost = line.lost - earlier.lost;
    checks.push_back(
        {"line-" + line.name, "line " + line.name, std::to_string(edges) + " edges, " + std::to_string(lost) + " lost",
         "at least one edge, none lost", judged(edges > 0 && lost == 0),
         "drive the line while samples are received; then check its wire, isolator and 'active' in box.toml"});
  }
  return checks;
}

std::vector<MeasuredCheck> encoderChecks(const std::vector<AxisMotion>& axes, std::uint64_t index_pulses) {
  std::vector<MeasuredCheck> checks;
  for (const auto& axis : axes) {
    const double moved_mm = axis.most_mm - axis.least_mm;
    checks.push_back(
        {"encoder-" + axis.channel, "encoder of " + axis.channel, printed("moved by %.4f mm", moved_mm),
         printed("at least %g mm", kLeastMotion_mm), judged(moved_mm >= kLeastMotion_mm),
         "move the axis, or feed its input, while samples are received; then check A and B and their supply"});
  }
  checks.push_back({"index-pulses", "index pulses", std::to_string(index_pulses) + " samples with one", "at least one",
                    index_pulses > 0 ? Verdict::passed : Verdict::not_told,
                    "move an axis over its mark while samples are received; encoders without one have none"});
  return checks;
}

std::vector<MeasuredCheck> controllerChecks(const messages::Status::Answer& before,
                                            const messages::Status::Answer& after) {
  std::vector<MeasuredCheck> checks;
  for (const auto& line : after.cnc_lines) {
    const auto earlier = entryBefore(before.cnc_lines, line.name);
    const auto answered = line.answered - earlier.answered, bad = line.bad_frames - earlier.bad_frames,
               unsent = line.unsent - earlier.unsent;
    checks.push_back(
        {"controller-" + line.name, "controller on " + line.name,
         std::to_string(answered) + " requests answered, " + std::to_string(bad) + " bad frames, " +
             std::to_string(unsent) + " answers not sent",
         "at least one answered, none bad, all sent", judged(answered > 0 && bad == 0 && unsent == 0),
         "read registers over it while samples are received (mbpoll); then check its wires, speed and parity"});
  }
  if (checks.empty())
    checks.push_back({"controller", "controller", "service.toml names no line (cnc)", "", Verdict::not_told, ""});
  return checks;
}

MeasuredCheck usbNumbersCheck(const messages::DescribeUnit::Answer& unit) {
  const bool is_for_tests = unit.usb_vendor_id == kTestVendor && unit.usb_product_id <= kLastTestProduct;
  return {"usb-numbers",
          "numbers on USB",
          printed("%04x:%04x", unit.usb_vendor_id, unit.usb_product_id),
          "the vendor's own, not those for tests",
          judged(unit.provisioned && !is_for_tests),
          "write your own vendor_id and product_id in [usb] of unit.toml; 1209:0001 to 1209:0010 may not be shipped"};
}

MeasuredCheck updateKeyCheck(const messages::DescribeUnit::Answer& unit) {
  MeasuredCheck check{"update-key",
                      "key of updates",
                      "image: " + joined(unit.image_keys) + "; unit.toml: " + joined(unit.update_keys),
                      "those of unit.toml and no other",
                      Verdict::not_told,
                      "write [trust] update_keys of unit.toml, and make the image with --key and --cert of that key"};
  if (unit.image_keys.empty()) return check;  // no image: its packages are updated
  auto image = unit.image_keys, named = unit.update_keys;
  std::ranges::sort(image);
  std::ranges::sort(named);
  check.verdict = judged(image == named);
  return check;
}

MeasuredCheck timeSourceCheck(const messages::Status::Answer& status) {
  return {"time-source",
          "time source",
          status.utc + "; " + status.date_source,
          "the date is known",
          judged(!status.utc.empty() && !status.utc.starts_with("unknown")),
          "set the clock of the computer that asks (timedatectl), which tells it to the box"};
}

}  // namespace probebox::command
