#include "tools/probebox/text/report_loop_back.hpp"

#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

constexpr unsigned kLostOf100 = 1;

}  // namespace

Json describe(const messages::LoopBack::Answer& late) {
  return {{"output", late.output},
          {"input", late.input},
          {"pulses", late.pulses},
          {"lost_pulses", late.lost},
          {"median_lateness_ns", late.median_ns},
          {"p99_lateness_ns", late.p99_ns},
          {"largest_lateness_ns", late.largest_ns},
          {"bracket_ns", late.bracket_ns},
          {"sigma_ns", late.sigma_ns}};
}

std::string line(const messages::LoopBack::Answer& late) {
  const auto duration = [](std::int64_t ns) { return readableNs(static_cast<double>(ns)); };
  return "Edges from " + late.output + " to " + late.input + " are stamped " + duration(late.median_ns) +
         " late (median), spread " + duration(late.sigma_ns) + ", 99 of 100 within " + duration(late.p99_ns) +
         ", the latest " + duration(late.largest_ns) + "; the write takes " + duration(late.bracket_ns) +
         printed(" of it; %u of %u pulses were lost", late.lost, late.pulses);
}

metrology::Finding judge(const messages::LoopBack::Answer& late) {
  const bool good = 100 * std::uint64_t{late.lost} < kLostOf100 * std::uint64_t{late.pulses};
  return {good, good ? "" : "pulses-lost", line(late) + (good ? "." : ": check the wire between the two lines.")};
}

}  // namespace probebox::command
