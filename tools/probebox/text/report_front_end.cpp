#include "tools/probebox/text/report_front_end.hpp"

#include <algorithm>
#include <cmath>

#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

using Verdict = MeasuredCheck::Verdict;

constexpr auto kWindow = messages::ReceiverInputs::kWindow;

// The box refuses more. Half of it is room for a rate_hz that is no whole number of a front end's steps.
constexpr double kMostOff_ppm = 200;
constexpr double kNoiseMargin = 1.1;  // 4.5 sd of a standard deviation that one window measures
// A stamp is late by up to two steps where another line changed beside it, and each end of a period is right to one.
constexpr double kMostOff_steps = 3;

Verdict verdictOf(bool good) {
  return good ? Verdict::passed : Verdict::failed;
}

MeasuredCheck program(const messages::FrontEndStatus& front_end) {
  const bool tells = !front_end.version.empty();
  return {"front-end",
          "front end",
          identityOf(front_end),
          "it lacks nothing that this firmware knows",
          front_end.lacks.empty() ? Verdict::passed
          : tells                 ? Verdict::failed
                                  : Verdict::not_told,
          front_end.lacks};
}

MeasuredCheck tooFewSamples(const messages::FrontEndStatus& front_end) {
  const auto when = front_end.rate_hz > 0 ? printed("in %.0f s", std::ceil(kWindow / front_end.rate_hz)) : "after them";
  return {"converter", "converter", printed("not yet %u samples", kWindow), "", Verdict::not_told, "repeat " + when};
}

MeasuredCheck oscillator(const messages::ReceiverStatus& receiver) {
  const double off_ppm = 1e-3 * receiver.frequency_ppb;
  return {"receiver-clock",
          "clock of the receiver",
          std::string{messages::nameOf(receiver.state)} + ", samples within " + readableNs(receiver.sigma_ns) +
              printed(" (k = 1), %+.2f ppm", off_ppm),
          printed("locked, within %g ppm", kMostOff_ppm),
          verdictOf(receiver.state == ClockState::locked && std::abs(off_ppm) <= kMostOff_ppm),
          "check rate_hz of probe.toml, the receiver's crystal, and its USB cable and hub"};
}

MeasuredCheck noise(const messages::FrontEndStatus& front_end) {
  const auto& nm = front_end.inputs.noise_nm;
  const double most_nm = kNoiseMargin * 1e3 * front_end.stated_noise_um;
  return {"converter-noise",
          "noise of the converter",
          printed("%.1f %.1f %.1f nm (k = 1) of one sample, channels a b c", nm[0], nm[1], nm[2]),
          printed("at most %g times noise_um of probe.toml: %g nm", kNoiseMargin, most_nm),
          verdictOf(*std::ranges::max_element(nm) <= most_nm),
          "look for a vibrating stylus, the screen of the probe's cable, and its supply; or state in probe.toml what "
          "the noise is"};
}

MeasuredCheck range(const messages::ReceiverInputs& inputs) {
  std::string measured, constant;
  for (std::size_t c = 0; c < 3; ++c) {
    const char channel = "abc"[c];
    measured += printed("%s%c %+.3f to %+.3f", c == 0 ? "" : ", ", channel, 1e-3 * inputs.lowest_nm.at(c),
                        1e-3 * inputs.highest_nm.at(c));
    if (inputs.lowest_nm.at(c) == inputs.highest_nm.at(c)) constant += channel;
  }
  return {"converter-range",
          "range of the converter",
          measured + " um, " + std::to_string(inputs.clipped) + " samples at its end" +
              (constant.empty() ? "" : ", constant: " + constant),
          "no sample at the end of the range, no channel constant",
          verdictOf(inputs.clipped == 0 && constant.empty()),
          "leave the stylus free; then check the wires of the channel, the converter's range strap, and full_scale_um "
          "in box.toml"};
}

MeasuredCheck loopBack(const messages::FrontEndStatus& front_end) {
  const auto& inputs = front_end.inputs;
  MeasuredCheck check{"receiver-stamps", "stamps of the receiver", "", "", Verdict::not_told, ""};
  if (inputs.loop_back_periods == 0 || front_end.sync_out_hz <= 0 || front_end.step_ps == 0) {
    const bool is_slow = front_end.sync_out_hz > 0 && front_end.sync_out_hz * kWindow < front_end.rate_hz;
    check.measured =
        is_slow ? printed("SYNC_OUT has less than one period in %u samples", kWindow) : "nothing on LOOPBACK";
    check.remedy = is_slow ? "write a higher sync_out_hz in [front_end] of box.toml to have them judged"
                           : "wire SYNC_OUT to it, with sync_out_hz in [front_end] of box.toml";
    return check;
  }
  const double period = std::round(1e12 / front_end.step_ps / front_end.sync_out_hz);
  const double off =
      std::max(std::abs(inputs.shortest_period_steps - period), std::abs(inputs.longest_period_steps - period));
  check.measured = printed("%u periods from SYNC_OUT to LOOPBACK, %u to %u steps of %g ns", inputs.loop_back_periods,
                           inputs.shortest_period_steps, inputs.longest_period_steps, 1e-3 * front_end.step_ps);
  check.limit = printed("%.0f steps, within %g", period, kMostOff_steps);
  check.verdict = verdictOf(off <= kMostOff_steps);
  check.remedy = "check the wire from SYNC_OUT to LOOPBACK, and its isolator";
  return check;
}

// The edges that both receivers have stamped show how well their clocks go together.
MeasuredCheck map(const messages::SecondReceiverStatus& second) {
  constexpr double kMostOdd = 0.01;
  const auto odd = second.unmatched + second.unseen + second.misfits;
  const auto matched = static_cast<double>(second.matched);
  return {"second-receiver-clock",
          "clock of the second receiver",
          std::string{messages::nameOf(second.state)} + ", samples within " + readableNs(second.sigma_ns) +
              printed(" (k = 1) of the first's, %+.2f ppm, %.0f sync edges on both, %.0f on one alone or apart",
                      1e-3 * second.frequency_ppb, matched, static_cast<double>(odd)),
          printed("locked, at most %g of 100 edges on one alone or apart", 100 * kMostOdd),
          verdictOf(second.state == ClockState::locked && static_cast<double>(odd) <= kMostOdd * matched),
          "check that the sync line is wired to both receivers, that the serial numbers in box.toml are not exchanged, "
          "and the second one's USB cable and hub"};
}

std::vector<MeasuredCheck> firstReceiverChecks(const messages::Status::Answer& status) {
  const auto& front_end = status.front_end;
  if (!front_end.isThere()) return {};
  std::vector<MeasuredCheck> checks{program(front_end)};
  if (front_end.inputs.samples == 0) {
    checks.push_back(tooFewSamples(front_end));
    return checks;
  }
  checks.push_back(oscillator(status.receiver));
  checks.push_back(noise(front_end));
  checks.push_back(range(front_end.inputs));
  if (!front_end.version.empty()) checks.push_back(loopBack(front_end));
  return checks;
}

}  // namespace

std::string identityOf(const messages::FrontEndStatus& front_end) {
  return (front_end.serial_number.empty() ? "no serial number" : front_end.serial_number) + ", packets of version " +
         std::to_string(front_end.packet_version) +
         (front_end.version.empty() ? ", another receiver" : ", program " + front_end.version);
}

// Of the second its converter is not read.
std::vector<MeasuredCheck> receiverChecks(const messages::Status::Answer& status) {
  auto checks = firstReceiverChecks(status);
  if (!status.second_front_end.isThere()) return checks;
  auto second = program(status.second_front_end);
  second.name = "second-front-end";
  second.title = "second front end";
  checks.push_back(std::move(second));
  checks.push_back(map(status.second_receiver));
  return checks;
}

}  // namespace probebox::command
