#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "protocol/messages/handshake.hpp"
#include "protocol/messages/nothing.hpp"
#include "protocol/messages/types.hpp"
#include "protocol/units/machine_accuracy.hpp"

// What a run on this box starts from: machine and probe as described, and the results in force in the place of what
// they replace. Standard deviations are k = 1, and 0 where none is stated.
namespace probebox::messages {

struct ProbeInUse {
  std::string name{};
  bool switches{};
  double repeatability_um{};
  double noise_um{};
  double ball_diameter_mm{};
  double sd_ball_diameter_mm{};
  double deflection_limit_mm{};
  double stand_off_mm{};
  double range_mm{};
  static constexpr void fields(auto& self, auto&& field) {
    field("name", self.name, "name and serial number, with the stylus where styli are exchanged");
    field("switches", self.switches, "1 for a touch-trigger probe, which delivers no samples");
    field("repeatability_um", self.repeatability_um, "um, sd of the depth at which its switch opens or closes");
    field("noise_um", self.noise_um, "um, sd of one sample of one channel, as probe.toml states");
    field("ball_diameter_mm", self.ball_diameter_mm, "mm, of the stylus ball");
    field("sd_ball_diameter_mm", self.sd_ball_diameter_mm, "mm, sd of that diameter");
    field("deflection_limit_mm", self.deflection_limit_mm, "mm, the most overtravel of a touch; 0: not stated");
    field("stand_off_mm", self.stand_off_mm,
          "mm, of a probe that does not touch: distance in the middle of its range; 0: it touches");
    field("range_mm", self.range_mm, "mm, of such a probe, to either side of that");
  }
};

struct SphereInUse {
  double diameter_mm{};
  double sd_diameter_mm{};
  std::string certificate{};
  bool has_temperature{};
  double temperature_c{};
  double sd_temperature_k{};
  double expansion_per_k{};
  static constexpr void fields(auto& self, auto&& field) {
    field("diameter_mm", self.diameter_mm, "mm, at 20 degrees C");
    field("sd_diameter_mm", self.sd_diameter_mm,
          "mm, sd of its certificate, else as machine.toml states it; 0: not stated");
    field("certificate", self.certificate, "for a person; empty for none");
    field("has_temperature", self.has_temperature, "1 when temperature_c is stated");
    field("temperature_c", self.temperature_c, "degrees C, at which it is touched unless a run states another");
    field("sd_temperature_k", self.sd_temperature_k, "K, sd of that temperature");
    field("expansion_per_k", self.expansion_per_k, "1/K; 0 where it is not stated");
  }
};

// Axis B: of a tilting table, or of a head that swivels the probe.
struct TiltInUse {
  std::array<double, 3> axis{};
  std::vector<double> angles_rad{};
  double sigma_rad{};
  std::array<double, 3> pivot_mm{};
  bool has_ball{};
  double sd_ball_mm{};
  bool has_point{};
  std::array<double, 3> point_mm{};
  static constexpr void fields(auto& self, auto&& field) {
    field("axis", self.axis, "unit vector, machine axes X Y Z, right-handed");
    field("angles_rad", self.angles_rad, "rad, at which it is measured");
    field("sigma_rad", self.sigma_rad, "rad, sd of an angle");
    field("pivot_mm", self.pivot_mm, "mm, of a head: from the gauge line of the spindle to its axis");
    field("has_ball", self.has_ball, "1 when the place of the datum sphere is stated, of a head");
    field("sd_ball_mm", self.sd_ball_mm, "mm, of a head: sd of a coordinate of the datum sphere");
    field("has_point", self.has_point, "1 when point_mm is stated, of a table");
    field("point_mm", self.point_mm, "mm, of a table: a point of its axis, as machine position of the stylus ball");
  }
};

struct PlateInUse {
  std::array<double, 3> axis_point_mm{};
  double sd_mm{};
  bool station_correction{};
  std::vector<std::array<double, 3>> balls_mm{};
  static constexpr void fields(auto& self, auto&& field) {
    field("axis_point_mm", self.axis_point_mm, "mm, a point of the nominal C axis, as position of the stylus ball");
    field("sd_mm", self.sd_mm, "mm, sd of a certified coordinate");
    field("station_correction", self.station_correction, "1: errors of the linear axes are taken out by stations");
    field("balls_mm", self.balls_mm, "mm, X Y Z of each ball in the frame of the plate");
  }
};

// A tool that carries the probe.
struct CarrierInUse {
  std::uint32_t number{};
  double length_mm{};
  std::uint64_t result_id{};
  static constexpr void fields(auto& self, auto&& field) {
    field("number", self.number, "of the tool");
    field("length_mm", self.length_mm, "mm, from the gauge line to the stylus ball");
    field("result_id", self.result_id, "the result in force that says so; 0: machine.toml does");
  }
};

struct ShankInUse {
  std::uint32_t tool{};
  double tip_length_mm{};
  double radius_mm{};
  double height_mm{};
  double from_mm{};
  static constexpr void fields(auto& self, auto&& field) {
    field("tool", self.tool, "number of the tool that carries the probe");
    field("tip_length_mm", self.tip_length_mm, "mm, from the gauge line to the stylus ball");
    field("radius_mm", self.radius_mm, "mm");
    field("height_mm", self.height_mm, "mm above the middle of the stylus ball, where it touches");
    field("from_mm", self.from_mm, "mm above the same, where it begins");
  }
};

struct ToolInUse {
  std::uint32_t number{};
  double length_mm{};
  double sd_mm{};
  std::uint8_t faces{};
  std::uint32_t holder{};
  double holder_length_mm{};
  double sd_holder_mm{};
  static constexpr void fields(auto& self, auto&& field) {
    field("number", self.number, "of the tool");
    field("length_mm", self.length_mm, "mm, from the gauge line");
    field("sd_mm", self.sd_mm, "mm, sd of that length");
    field("faces", self.faces, "of the setting device that it reaches: bit 0 +X, 1 -X, 2 +Y, 3 -Y, 4 +Z; 0: all");
    field("holder", self.holder, "number of its holder; 0 for none");
    field("holder_length_mm", self.holder_length_mm, "mm, from the gauge line to its end face");
    field("sd_holder_mm", self.sd_holder_mm, "mm, sd of that length");
  }
};

struct SetterInUse {
  std::array<double, 3> half_width_mm{};
  double sd_half_width_mm{};
  double sd_probe_offset_mm{};
  bool accepted{};
  double sd_accepted_mm{};
  double limit_mm{};
  std::vector<double> swivels_rad{};
  static constexpr void fields(auto& self, auto&& field) {
    field("half_width_mm", self.half_width_mm, "mm, X Y Z, from its middle to its faces");
    field("sd_half_width_mm", self.sd_half_width_mm, "mm, sd of each");
    field("sd_probe_offset_mm", self.sd_probe_offset_mm, "mm, sd of a coordinate of the probe's offset");
    field("accepted", self.accepted, "1 when a place of the device is accepted");
    field("sd_accepted_mm", self.sd_accepted_mm, "mm, sd of a coordinate of that place");
    field("limit_mm", self.limit_mm, "mm, how far it may be from that place");
    field("swivels_rad", self.swivels_rad, "rad, angles of the head at which it is measured; none: 0 alone");
  }
};

struct SensorHeadInUse {
  std::uint32_t tool{};
  double range_mm{};
  double sd_centre_offset_mm{};
  std::uint64_t result_id{};
  std::array<std::array<double, 3>, 3> matrix{};
  std::array<std::array<double, 3>, 3> sd_matrix{};
  static constexpr void fields(auto& self, auto&& field) {
    field("tool", self.tool, "its number");
    field("range_mm", self.range_mm, "mm, of a sensor to either side");
    field("sd_centre_offset_mm", self.sd_centre_offset_mm, "mm, sd of a coordinate of its centre");
    field("result_id", self.result_id, "its calibration in force; 0: none, and what follows is 0");
    field("matrix", self.matrix, "a row for each sensor, per mm along X Y Z");
    field("sd_matrix", self.sd_matrix, "sd of each entry");
  }
};

struct ScrewInUse {
  std::uint8_t axis{};
  double pitch_mm{};
  std::uint64_t face_result_id{};
  double sd_face_um{};
  static constexpr void fields(auto& self, auto&& field) {
    field("axis", self.axis, "0 X, 1 Y, 2 Z");
    field("pitch_mm", self.pitch_mm, "mm, of the thread");
    field("face_result_id", self.face_result_id, "the result in force that has its face table; 0: none");
    field("sd_face_um", self.sd_face_um, "um, largest sd of a value of that table");
  }
};

// The ball that periodic-check reads, with its accepted values.
struct CheckInUse {
  double ball_diameter_mm{};
  double limit_mm{};
  bool accepted{};
  std::array<double, 2> sd_accepted_mm{};
  double sd_centre_z_mm{};
  std::vector<double> swivels_rad{};
  static constexpr void fields(auto& self, auto&& field) {
    field("ball_diameter_mm", self.ball_diameter_mm, "mm");
    field("limit_mm", self.limit_mm, "mm, largest deviation that passes; 0 for none");
    field("accepted", self.accepted, "1 when a position of the C axis is accepted");
    field("sd_accepted_mm", self.sd_accepted_mm, "mm, X Y, sd of that position");
    field("sd_centre_z_mm", self.sd_centre_z_mm, "mm, sd of the accepted height of the ball");
    field("swivels_rad", self.swivels_rad, "rad, angles of the head at which it is read too");
  }
};

struct PreTravelInUse {
  std::uint32_t tool{};
  std::uint64_t result_id{};
  std::array<std::array<double, 4>, 4> covariance_mm2{};
  static constexpr void fields(auto& self, auto&& field) {
    field("tool", self.tool, "number of the tool that carried the probe; 0: for methods that name none");
    field("result_id", self.result_id, "the result that is in force");
    field("covariance_mm2", self.covariance_mm2,
          "mm^2: mean across the stylus, cosine and sine of its lobes, along it");
  }
};

// Errors of the machine, each sd k = 1.
struct AccuracyInUse : MachineAccuracy {
  static constexpr void fields(auto& self, auto&& field) {
    for (const auto& error : kMachineErrors) field(error.key, self.*error.member, error.meaning);
  }
};

// What the newest result about a subject has to keep. 0: not stated.
struct Requirement {
  std::string subject{};
  double limit_um{};
  double limit_us{};
  double limit_urad{};
  static constexpr void fields(auto& self, auto&& field) {
    field("subject", self.subject, "of the results, such as rotary-c");
    field("limit_um", self.limit_um, "um, of its lengths: largest error plus U, of values that are no errors U alone");
    field("limit_us", self.limit_us, "us, the same of its times");
    field("limit_urad", self.limit_urad, "urad, the same of its angles");
  }
};

struct DescribeMachine {
  static constexpr Operation kOperation = Operation::describe_machine;
  using Request = Nothing;
  struct Answer {
    std::string machine{};
    std::string mounting{};
    ProbeInUse probe{};
    std::array<double, 3> positions_hz{};
    double deflections_hz{};
    DelayInForce delay{};
    SphereInUse sphere{};
    std::array<double, 3> gaps_mm{};
    double cylinder_diameter_mm{};
    bool cylinder_inside{};
    std::array<double, 3> cube_edges_mm{};
    double sigma_c_rad{};
    std::vector<TiltInUse> table{};
    std::vector<TiltInUse> head{};
    std::vector<PlateInUse> plate{};
    std::vector<CarrierInUse> carriers{};
    std::vector<ShankInUse> shank{};
    std::vector<ToolInUse> tools{};
    std::vector<SetterInUse> setter{};
    std::vector<SensorHeadInUse> sensor_head{};
    std::vector<ScrewInUse> screws{};
    std::vector<PreTravelInUse> pre_travels{};
    bool has_rim_ball{};
    std::vector<CheckInUse> checked_ball{};
    std::vector<AccuracyInUse> accuracy{};
    std::vector<Requirement> requirements{};
    bool has_y{true};
    static constexpr void fields(auto& self, auto&& field) {
      field("machine", self.machine, "name of the machine description");
      field("mounting", self.mounting, "where the probe sits");
      field("probe", self.probe, "the probe and its stylus");
      field("positions_hz", self.positions_hz,
            "1/s, X Y Z: positions that arrived in the last second; 0: not known yet");
      field("deflections_hz", self.deflections_hz, "1/s, deflections that arrived in it");
      field("delay", self.delay, "the system delay in force");
      field("sphere", self.sphere, "the datum sphere; diameter 0 for none");
      field("gaps_mm", self.gaps_mm, "mm, between the datum plates across X, Y, Z; 0 for none");
      field("cylinder_diameter_mm", self.cylinder_diameter_mm, "mm, of the datum cylinder; 0 for none");
      field("cylinder_inside", self.cylinder_inside, "1 for a bore, touched from within");
      field("cube_edges_mm", self.cube_edges_mm, "mm, along X Y Z, of the datum cube; 0 for none");
      field("sigma_c_rad", self.sigma_c_rad, "rad, sd of an angle of the rotary axis C");
      field("table", self.table, "the tilting table; none or one");
      field("head", self.head, "the swivelling head; none or one");
      field("plate", self.plate, "the ball plate; none or one");
      field("carriers", self.carriers, "the tools that carry the probe");
      field("shank", self.shank, "the shank of the stylus; none or one");
      field("tools", self.tools, "the tools that can be measured");
      field("setter", self.setter, "the tool-setting device; none or one");
      field("sensor_head", self.sensor_head, "the sensor head; none or one");
      field("screws", self.screws, "ball screws with a sensor");
      field("pre_travels", self.pre_travels, "those in force of a touch-trigger probe");
      field("has_rim_ball", self.has_rim_ball, "1 when machine.toml has [rim_ball]");
      field("checked_ball", self.checked_ball, "the ball of periodic-check; none or one");
      field("accuracy", self.accuracy, "errors of the machine, where they are stated; none or one");
      field("requirements", self.requirements, "what results have to keep, as machine.toml states it");
      field("has_y", self.has_y, "0 on a lathe of X and Z");
    }
  };
};

}  // namespace probebox::messages
