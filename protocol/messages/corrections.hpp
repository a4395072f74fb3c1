#pragma once
#include <array>
#include <cstdint>

#include "protocol/messages/nothing.hpp"
#include "protocol/messages/types.hpp"

// What the CNC is being told.
namespace probebox::messages {

struct Corrections {
  static constexpr Operation kOperation = Operation::corrections;
  using Request = Nothing;
  struct Answer {
    bool valid{};
    bool degraded{};
    std::array<double, 3> correction_mm{};
    std::uint16_t mask{};
    std::uint16_t sequence{};
    std::uint16_t heartbeat{};
    std::uint32_t age_ms{};
    bool delay_calibrated{};
    std::array<double, 3> tau_s{};
    std::array<double, 3> tau_sd_s{};
    static constexpr void fields(auto& self, auto&& field) {
      field("valid", self.valid, "1 when the values may be used");
      field("degraded", self.degraded, "1 when a value is held or saturated");
      field("correction_mm", self.correction_mm,
            "mm, machine axes X Y Z, radius: to be ADDED to the commanded position");
      field("mask", self.mask, "sources that are summed: bit 0 screw, 1 swivel, 2 rotary, 3 centreline");
      field("sequence", self.sequence, "+1 whenever any correction changes");
      field("heartbeat", self.heartbeat, "+1 every 0.1 s");
      field("age_ms", self.age_ms, "ms since the corrections were computed");
      field("delay_calibrated", self.delay_calibrated, "1 when a result about the system delay is active");
      field("tau_s", self.tau_s, "s, X Y Z, machine minus probe");
      field("tau_sd_s", self.tau_sd_s, "s, X Y Z, standard deviation (k = 1)");
    }
  };
};

}  // namespace probebox::messages
