#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "protocol/events/procedure.hpp"
#include "protocol/messages/nothing.hpp"
#include "protocol/messages/types.hpp"
#include "protocol/state/shown_when.hpp"
#include "protocol/step/step.hpp"

// Starts measuring procedures, follows them, marks their steps and reads their data.
namespace probebox::messages {

// A Marker from the host; the box stamps it on arrival.
struct PostMarker {
  static constexpr Operation kOperation = Operation::post_marker;
  struct Request {
    std::uint32_t procedure{};
    std::uint32_t step{};
    StepPhase phase{};
    std::array<double, 3> rotary_angles_rad{};
    std::uint32_t tool{};
    double nominal_speed_mm_s{};
    bool at_rest{};
    static constexpr void fields(auto& self, auto&& field) {
      field("procedure", self.procedure, "the run that the step belongs to, as the box numbered it");
      field("step", self.step, "step of the procedure, from 0");
      field("phase", self.phase, "0 begin, 1 end, 2 abandon (the step is repeated)");
      field("rotary_angles_rad", self.rotary_angles_rad, "rad, A B C, as procedure_status has asked for them");
      field("tool", self.tool, "tool number, 0 for none");
      field("nominal_speed_mm_s", self.nominal_speed_mm_s, "mm/s, commanded measuring speed of the step");
      field("at_rest", self.at_rest, "1 when all axes are at standstill");
    }
  };
  using Answer = Nothing;
};

struct StartProcedure {
  static constexpr Operation kOperation = Operation::start_procedure;
  struct Request {
    std::string method{};
    ProcedureOptions options{};
    static constexpr void fields(auto& self, auto&& field) {
      field("method", self.method, "such as delay-multi-speed");
      ProcedureOptions::asked(self.options, field);
    }
  };
  struct Answer {
    std::uint32_t run{};
    static constexpr void fields(auto& self, auto&& field) { field("run", self.run, "number of the run, for markers"); }
  };
};

struct ProcedureStatus {
  static constexpr Operation kOperation = Operation::procedure_status;
  using Request = Nothing;
  struct Answer : Step {
    std::uint32_t run{};
    std::string method{};
    RunState state{};
    std::uint32_t step{};
    std::uint32_t steps{};
    std::string prompt{};
    std::string refusal{};
    std::uint64_t result_id{};
    bool referenced{};
    bool has_temperature{};
    double temperature_c{};
    static constexpr void fields(auto& self, auto&& field) {
      field("run", self.run, "number of the run; 0 before the first");
      field("method", self.method, "such as delay-multi-speed");
      field(
          "state", self.state,
          "0 idle, 1 waiting, 2 running, 3 solving, 4 proposed (or done, where there is nothing to accept), 5 refused, "
          "6 aborted");
      field("step", self.step, "present step, from 0");
      field("steps", self.steps, "number of steps");
      field("prompt", self.prompt, "what to do next, for a person");
      field("refusal", self.refusal, "why there is no result, and what to do");
      field("result_id", self.result_id, "the proposed result, 0 for none");
      field("referenced", self.referenced, "1 when the box knows where the axes stand");
      Step::fields(self, field);
      field("has_temperature", self.has_temperature, "1 when the run was started with a temperature");
      field("temperature_c", self.temperature_c, "degrees C, as stated when the run was started",
            published::NullUnless{self.has_temperature});
    }
  };
};

struct AbortProcedure {
  static constexpr Operation kOperation = Operation::abort_procedure;
  struct Request {
    std::uint32_t run{};
    static constexpr void fields(auto& self, auto&& field) {
      field("run", self.run, "the one to be given up, and no other; 0: whichever goes on");
    }
  };
  using Answer = Nothing;
};

// Reads the data of a run piece by piece, so that a host can save the calibration that it has just followed.
struct GetDataset {
  static constexpr Operation kOperation = Operation::get_dataset;
  struct Request {
    std::uint32_t run{};
    std::uint64_t offset{};
    static constexpr void fields(auto& self, auto&& field) {
      field("run", self.run, "number of the run");
      field("offset", self.offset, "bytes that the host already has");
    }
  };
  struct Answer {
    std::uint64_t total_bytes{};
    std::uint64_t offset{};
    std::string bytes{};
    static constexpr void fields(auto& self, auto&& field) {
      field("total_bytes", self.total_bytes, "of the whole document");
      field("offset", self.offset, "where this piece begins");
      field("bytes", self.bytes, "a piece of the run's data as JSON text");
    }
  };
};

}  // namespace probebox::messages
