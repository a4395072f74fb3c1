#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "firmware/modbus/register_image.hpp"
#include "protocol/state/snapshot.hpp"
#include "protocol/units/time.hpp"

namespace probebox::campaign {

// A controller that polls the registers, moves its joints to the correction while `valid` is set, and holds them
// otherwise. It knows only MODBUS.md and the limits of rate.
class Follower {
 public:
  Follower(const std::array<double, 3>& rate_mm_s, Nanoseconds poll_interval)
      : rate_mm_s_{rate_mm_s}, poll_interval_{poll_interval} {}

  // Reads the registers at this instant. Returns the rule that they break.
  std::optional<std::string> read(const published::Snapshot& snapshot, MonoTime now);

  // The box starts anew: heartbeat and counters may begin anew. It sets out from the value that the joints follow, to
  // within what an axis covers in this time at its limit of rate.
  void expectRestart(MonoTime now, double doubt_s);
  std::uint64_t validReads() const { return valid_reads_; }
  std::uint64_t reads() const { return reads_; }

 private:
  std::optional<std::string> whyTorn() const;
  std::optional<std::string> whyTooFast(const std::array<double, 3>& served_mm, MonoTime now) const;
  std::optional<std::string> whyBeatsWrong(bool valid, MonoTime now);
  std::int32_t i32(std::size_t address) const;

  // Since the last valid value.
  struct Outage {
    MonoTime since{};
    double doubt_s{};
  };
  struct Beat {
    MonoTime since{};
    MonoTime moved{};
    std::uint16_t last{};
    std::uint64_t beats{};
  };
  std::array<double, 3> rate_mm_s_;
  Nanoseconds poll_interval_;
  modbus::RegisterImage image_;
  std::array<double, 3> joints_mm_{};
  std::optional<MonoTime> followed_at_;  // the last time that `valid` was read
  std::optional<Outage> outage_;
  std::optional<Beat> beat_;
  std::uint64_t valid_reads_{};
  std::uint64_t reads_{};
};

}  // namespace probebox::campaign
