#include "tools/probebox/report_loop_back.hpp"

#include "tools/probebox/report.hpp"

namespace probebox::command {

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

std::string page(const messages::LoopBack::Answer& late) {
  const auto duration = [](std::int64_t ns) { return readableNs(static_cast<double>(ns)); };
  return "loop-back      from " + late.output + " to " + late.input +
         printed(": %u pulses, %u lost\n", late.pulses, late.lost) +  //
         "edges stamped  " + duration(late.median_ns) + " late (median), spread " + duration(late.sigma_ns) +
         ", 99 of 100 within " + duration(late.p99_ns) + ", the latest " + duration(late.largest_ns) +
         "; the write itself takes " + duration(late.bracket_ns) + " of it";
}

ExitStatus loopBack(link::Client& box, Console& console, std::uint32_t pulses) {
  const auto late = ask<messages::LoopBack>(box, console, {pulses});
  if (!late) return console.fail(late.error());
  if (console.json()) {
    console.object({{"loop_back", describe(*late)}});
  } else {
    console.line(page(*late));
  }
  return ExitStatus::ok;
}

}  // namespace probebox::command
