#pragma once
#include <array>
#include <cstdint>

#include "firmware/procedure/plan/procedure.hpp"
#include "locked_clock.hpp"

namespace probebox::procedure {

// A machine that does what it is asked for, one step at a time.
class ObedientMachine {
 public:
  explicit ObedientMachine(Procedure& procedure) : procedure_{procedure} {}

  void mark(MarkerPhase phase) {
    const auto& progress = procedure_.progress();
    procedure_.mark(Marker{.procedure = progress.run,
                           .step = progress.step,
                           .phase = phase,
                           .rotary_angles_rad = angles_rad,
                           .tool = tool,
                           .at_rest = true,
                           .at = monoTime(now_ns_)},
                    kLocked, zeros);
  }
  Zeros zeros{};
  std::int64_t row_ns{1'000'000};  // from one row to the next
  std::array<double, 3> angles_rad{};
  std::uint32_t tool{};
  void touch(bool clipped = false) {
    mark(MarkerPhase::begin);
    for (int i = 0; i < 10; ++i) {
      now_ns_ += row_ns;
      for (const Axis axis : {Axis::x, Axis::y, Axis::z}) {
        procedure_.push(Count{.axis = axis, .sequence = 0, .counts = i, .at = monoTime(now_ns_)});
        procedure_.push(Drift{axis, i, monoTime(now_ns_)});
      }
      procedure_.push(Deflection{.sequence = 0, .channels_nm = {}, .clipped = clipped, .at = monoTime(now_ns_)});
    }
    mark(MarkerPhase::end);
  }
  void touchWithALoss() {
    mark(MarkerPhase::begin);
    procedure_.push(SourceLost{.source = Source::probe, .at = monoTime(now_ns_)});
    mark(MarkerPhase::end);
  }
  void wait(Nanoseconds duration) {
    now_ns_ += duration.count();
    procedure_.advance(monoTime(now_ns_));
  }

 private:
  Procedure& procedure_;
  std::int64_t now_ns_{};
};

}  // namespace probebox::procedure
