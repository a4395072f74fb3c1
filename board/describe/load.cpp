#include <algorithm>
#include <array>
#include <functional>
#include <sstream>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "board/describe/encoder_checks.hpp"
#include "board/describe/file_content.hpp"
#include "board/describe/keys.hpp"
#include "board/describe/parse.hpp"
#include "board/describe/section.hpp"
#include "board/describe/sim_files.hpp"
#include "board/describe/spelling.hpp"

namespace probebox::board {
namespace {

struct File {
  std::string name;  // as a person would find it
  std::string text;
};

constexpr std::array kFileNames{"box.toml", "machine.toml", "probe.toml", "service.toml", "world.toml"};

Error unreadable(const std::filesystem::path& path, const std::string& reason) {
  return {path.string() + ": " + reason +
          "; a board is a folder with box.toml, machine.toml, probe.toml and service.toml"};
}

// A pipe or a device could keep the reader waiting, or never end.
Outcome<File> readFile(const std::filesystem::path& path) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) return unreadable(path, error ? error.message() : "No such file or directory");
  if (!std::filesystem::is_regular_file(status)) return unreadable(path, "it is no ordinary file");
  auto text = fileContent(path);
  if (!text) return unreadable(path, text.error().what);
  return File{path.string(), std::move(text).value()};
}

using Reader = std::function<Outcome<File>(const std::string& file_name)>;

// Reads the files of one board, and collects what is wrong with them, alone and together.
class Reading {
 public:
  explicit Reading(Reader reader) : reader_{std::move(reader)} {}

  template <class T>
  void take(const std::string& file_name, Outcome<T> (*parse)(std::string_view, std::string_view), T& into) {
    const auto file = reader_(file_name);
    auto parsed = file ? parse(file->text, file->name) : Outcome<T>{file.error()};
    if (parsed) {
      into = std::move(parsed).value();
    } else {
      add(parsed.error().what);
    }
  }
  void add(const std::string& problem) { error_.what += (good() ? "" : "\n") + problem; }
  bool good() const { return error_.what.empty(); }
  const Error& error() const { return error_; }
  std::string nameOf(const std::string& file_name) const {
    const auto file = reader_(file_name);
    return file ? file->name : file_name;
  }

 private:
  Reader reader_;
  Error error_;
};

// Where the emulated machine has to stand, its axes have to go: two files that must agree.
void checkTravel(const World& world, const Machine& machine, Reading& reading) {
  std::vector<std::pair<std::string, Vector3>> places{{"axes.home_mm", world.axes.home_mm},
                                                      {"datum_sphere.centre_mm", world.sphere.centre_mm}};
  for (std::size_t axis = 0; axis < world.plates.size(); ++axis) {
    if (const auto& plates = world.plates.at(axis))
      places.emplace_back(std::string{"gauge_plates."} + "XYZ"[axis] + ".middle_mm", plates->middle_mm);
  }
  if (world.cylinder) places.emplace_back("gauge_cylinder.middle_mm", world.cylinder->middle_mm);
  if (world.cube) places.emplace_back("gauge_cube.middle_mm", world.cube->middle_mm);
  if (world.tool_setter) places.emplace_back("tool_setter.centre_mm", world.tool_setter->centre_mm);
  for (const auto& [key, place] : places) {
    for (std::size_t i = 0; i < machine.axes.size(); ++i) {
      const auto& axis = machine.axes[i];
      if (i == 1 && !machine.has_y && key != "axes.home_mm") continue;  // beside the plane of its stylus
      if (place[i] >= axis.travel_min_mm && place[i] <= axis.travel_max_mm) continue;
      reading.add(reading.nameOf("world.toml") + ": '" + key + "' has " + "XYZ"[i] + " = " + plain(place[i]) +
                  ", and that axis travels " + inWords({axis.travel_min_mm, axis.travel_max_mm}) + " mm in " +
                  reading.nameOf("machine.toml") + ": move it inside, or correct the travel");
    }
  }
}

std::string namesOf(const std::vector<GpioLine>& lines) {
  std::string names;
  for (const auto& line : lines) names += (names.empty() ? "\"" : ", \"") + line.name + "\"";
  return names;
}

// The device that tools are set on: its line is the vendor's, what it measures the integrator's.
void checkToolSetter(const Box& box, const Machine& machine, Reading& reading) {
  if (!machine.tool_setter || lineOfToolSetter(box, machine)) return;
  const auto names = namesOf(box.triggers);
  reading.add(reading.nameOf("machine.toml") + ": 'tool_setter.trigger' is \"" + machine.tool_setter->trigger +
              "\", and " + reading.nameOf("box.toml") + " has no [[trigger]] of that name" +
              (names.empty() ? ": add one" : "; it has " + names));
}

// A touch-trigger probe: kind and line stand in two files that must agree, and the emulated machine has to have it.
void checkProbeSwitch(const Descriptions& all, Reading& reading) {
  const auto problem = [&](const std::string& text) { reading.add(text); };
  const std::string box = reading.nameOf("box.toml"), probe = reading.nameOf("probe.toml");
  const auto& device = all.box.devices.probe;
  if (!all.probe.by_switch) {
    if (device == "trigger")
      problem(box + ": 'devices.probe' is \"trigger\", and " + probe +
              " describes a scanning probe: write kind = \"trigger\" there, or name the probe's receiver here");
    if (all.world && all.world->touch_trigger)
      problem(reading.nameOf("world.toml") + ": [touch_trigger] is fitted, and " + probe +
              " describes a scanning probe: write kind = \"trigger\" there, or remove the section");
    return;
  }
  if (device != "trigger" && device != "sim")
    problem(probe + ": 'probe.kind' is \"trigger\", and 'devices.probe' in " + box + " is \"" + device +
            "\": write \"trigger\" there, or kind = \"scanning\" here");
  if (lineOfProbeSwitch(all.box, all.probe)) return;
  const auto names = namesOf(all.box.triggers);
  problem(probe + ": 'probe.trigger' is \"" + all.probe.by_switch->trigger + "\", and " + box +
          " has no [[trigger]] of that name" + (names.empty() ? ": add one" : "; it has " + names));
}

// Between two plates, and in a bore, the stylus ball needs room for its way out.
void checkGaps(const Descriptions& all, Reading& reading) {
  if (all.probe.by_switch) return;
  const double least_mm = all.probe.ball_diameter_mm + kLeastGapRoom_mm;
  const auto check = [&](const std::string& key, double size_mm) {
    if (size_mm > least_mm) return;
    reading.add(reading.nameOf("machine.toml") + ": '" + key + "' is " + plain(size_mm) + ", and the stylus ball of " +
                reading.nameOf("probe.toml") + " has " + plain(all.probe.ball_diameter_mm) +
                " mm: on its way out of a touch it would go into the opposite side. Use one of more than " +
                plain(least_mm) + " mm or a smaller ball, or remove the section");
  };
  for (std::size_t axis = 0; axis < all.machine.datum_plates.size(); ++axis) {
    if (const auto& plates = all.machine.datum_plates.at(axis))
      check(std::string{"datum_plates."} + "XYZ"[axis] + ".gap_mm", plates->gap_mm);
  }
  const auto& cylinder = all.machine.datum_cylinder;
  if (cylinder && cylinder->touched == CylinderDescription::Touched::inside)
    check("datum_cylinder.diameter_mm", cylinder->diameter_mm);
}

// A sensor without a screw would be read for nothing, and a screw without a sensor never corrected.
void checkDrift(const Box& box, const Machine& machine, Reading& reading) {
  const auto isRead = [&](std::size_t axis) {
    return box.devices.drift == "sim" ||
           std::ranges::any_of(box.sensors.drift, [&](const auto& sensor) { return sensor.axis == axis; });
  };
  for (std::size_t axis = 0; axis < machine.screws.size(); ++axis) {
    if (!machine.screws[axis] || isRead(axis)) continue;
    const std::string name{"XYZ"[axis]};
    reading.add(reading.nameOf("machine.toml") + ": [screw." + name + "] has no " + "sensor in " +
                reading.nameOf("box.toml") + ": add a [[drift]] with axis = \"" + name +
                "\" and drift = \"iio\" there (docs/sensors.md), or remove the screw");
  }
  for (const auto& sensor : box.sensors.drift) {
    if (machine.screws.at(sensor.axis)) continue;
    const std::string axis{"XYZ"[sensor.axis]};
    reading.add(reading.nameOf("box.toml") + ": [[drift]] has axis = \"" + axis + "\", and " +
                reading.nameOf("machine.toml") + " has no [screw." + axis +
                "]: describe the screw there, or remove the sensor");
  }
}

// The emulated machine has the probe that is described, with a usual switch where world.toml has none.
WorldTouchTrigger usualTouchTrigger(const ProbeSwitch& described) {
  return {.pre_travel_mm = 0.008,
          .lobe_mm = 0.002,
          .axial_mm = 0.003,
          .hysteresis_mm = 0.0005,
          .repeatability_um = described.repeatability_um,
          .late_s = 0.0006,
          .chatter_probability = 0.05,
          .chatter_s = 0.0008};
}

Outcome<Descriptions> load(const Reader& reader, bool emulated) {
  Descriptions all;
  Reading reading{reader};
  reading.take("box.toml", parseBox, all.box);
  reading.take("machine.toml", parseMachine, all.machine);
  reading.take("probe.toml", parseProbe, all.probe);
  reading.take("service.toml", parseService, all.service);
  if (emulated) reading.take("world.toml", parseWorld, all.world.emplace());
  if (!reading.good()) return reading.error();
  if (all.world) {
    checkTravel(*all.world, all.machine, reading);
    if (all.probe.by_switch && !all.world->touch_trigger)
      all.world->touch_trigger = usualTouchTrigger(*all.probe.by_switch);
    all.world->distance_probe = all.probe.by_distance;
    if (all.probe.by_distance) all.world->sphere.stylus_ball_radius_mm = 0;
  }
  if (!emulated && all.machine.like_sim)
    reading.add(
        reading.nameOf("machine.toml") +
        ": 'like_sim' completes the description of an emulated machine: describe this one whole, and remove it");
  checkProbeSwitch(all, reading);
  checkToolSetter(all.box, all.machine, reading);
  checkGaps(all, reading);
  checkDrift(all.box, all.machine, reading);
  for (const auto& problem :
       encoderProblems(all.box, reading.nameOf("box.toml"), all.machine, reading.nameOf("machine.toml")))
    reading.add(problem);
  if (!reading.good()) return reading.error();
  return all;
}

// A link that leads nowhere is there too: it was meant to be read.
bool isThere(const std::filesystem::path& path) {
  std::error_code error;
  return std::filesystem::symlink_status(path, error).type() != std::filesystem::file_type::not_found;
}

bool overridden(const std::filesystem::path& overrides, const std::string& file_name) {
  return !overrides.empty() && isThere(overrides / file_name);
}

// Says what is wrong with a folder that was named: it is not there, or it holds a description whose name is misspelt,
// which would be passed over without a word.
std::optional<Error> whyNoFolder(const std::filesystem::path& folder) {
  if (folder.empty()) return std::nullopt;
  std::error_code error;
  auto entries = std::filesystem::directory_iterator{folder, error};
  if (error == std::errc::permission_denied)
    return Error{folder.string() + ": this folder cannot be read; give its group the right to (chmod g+rx)"};
  if (error == std::errc::no_such_file_or_directory || error == std::errc::not_a_directory)
    return Error{folder.string() + ": there is no such folder; name one that holds TOML descriptions"};
  if (error) return Error{folder.string() + ": this folder cannot be read: " + error.message()};
  const std::vector<std::string> names{kFileNames.begin(), kFileNames.end()};
  for (; !error && entries != std::filesystem::directory_iterator{}; entries.increment(error)) {
    const auto name = entries->path().filename().string();
    const auto meant = name.ends_with(".toml") ? nearest(name, names) : std::nullopt;
    if (meant && !isThere(folder / *meant))
      return Error{entries->path().string() + ": nothing reads a file of this name; did you mean " + *meant + "?"};
  }
  return std::nullopt;
}

std::optional<std::uint8_t> triggerNamed(const Box& box, const std::string& name) {
  for (std::size_t i = 0; i < box.triggers.size(); ++i) {
    if (box.triggers[i].name == name) return static_cast<std::uint8_t>(i);
  }
  return std::nullopt;
}

Outcome<Descriptions> compiledIn(const std::string& folder, std::string_view (*file)(std::string_view),
                                 const std::filesystem::path& overrides) {
  if (const auto error = whyNoFolder(overrides)) return *error;
  const Reader reader = [&](const std::string& name) -> Outcome<File> {
    if (overridden(overrides, name)) return readFile(overrides / name);
    return File{folder + name, std::string{file(name)}};
  };
  return load(reader, true);
}

}  // namespace

std::optional<std::uint8_t> lineOfToolSetter(const Box& box, const Machine& machine) {
  return machine.tool_setter ? triggerNamed(box, machine.tool_setter->trigger) : std::nullopt;
}

std::optional<std::uint8_t> lineOfProbeSwitch(const Box& box, const Probe& probe) {
  return probe.by_switch ? triggerNamed(box, probe.by_switch->trigger) : std::nullopt;
}

Outcome<Descriptions> loadDirectory(const std::filesystem::path& directory, const std::filesystem::path& overrides) {
  for (const auto& folder : {directory, overrides}) {
    if (const auto error = whyNoFolder(folder)) return *error;
  }
  const auto place = [&](const std::string& name) {
    return (overridden(overrides, name) ? overrides : directory) / name;
  };
  const Reader reader = [&](const std::string& name) { return readFile(place(name)); };
  return load(reader, isThere(place("world.toml")));
}

Outcome<Descriptions> simDescriptions(const std::filesystem::path& overrides) {
  return compiledIn("board/sim/", simFile, overrides);
}

Outcome<Descriptions> simLatheDescriptions(const std::filesystem::path& overrides) {
  return compiledIn("board/sim-lathe/", simLatheFile, overrides);
}

}  // namespace probebox::board
