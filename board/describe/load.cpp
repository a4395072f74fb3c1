#include <cerrno>
#include <cstring>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "board/describe/parse.hpp"
#include "board/describe/sim_files.hpp"

namespace probebox::board {
namespace {

struct File {
  std::string name;  // as a person would find it
  std::string text;
};

Outcome<File> readFile(const std::filesystem::path& path) {
  errno = 0;
  std::ifstream in{path, std::ios::binary};
  std::ostringstream text;
  if (in) text << in.rdbuf();
  if (!in) {
    const std::string reason = errno != 0 ? std::strerror(errno) : "it cannot be read";
    return Error{path.string() + ": " + reason +
                 "; a board is a folder with box.toml, machine.toml, probe.toml and service.toml"};
  }
  return File{path.string(), text.str()};
}

using Reader = std::function<Outcome<File>(const std::string& file_name)>;

template <class T>
bool take(const Reader& reader, const std::string& file_name, Outcome<T> (*parse)(std::string_view, std::string_view),
          T& into, Error& error) {
  const auto file = reader(file_name);
  auto parsed = file ? parse(file->text, file->name) : Outcome<T>{file.error()};
  if (parsed) {
    into = std::move(parsed).value();
    return true;
  }
  error.what += (error.what.empty() ? "" : "\n") + parsed.error().what;
  return false;
}

std::string nameOf(const Reader& reader, const std::string& file_name) {
  const auto file = reader(file_name);
  return file ? file->name : file_name;
}

// Where the emulated machine has to stand, its axes have to go: two files that must agree.
void checkTravel(const Reader& reader, const World& world, const Machine& machine, Error& error) {
  std::vector<std::pair<std::string, Vector3>> places{{"axes.home_mm", world.axes.home_mm},
                                                      {"datum_sphere.centre_mm", world.sphere.centre_mm}};
  if (world.plates) places.emplace_back("gauge_plates.middle_mm", world.plates->middle_mm);
  if (world.tool_setter) places.emplace_back("tool_setter.centre_mm", world.tool_setter->centre_mm);
  for (const auto& [key, place] : places) {
    for (std::size_t i = 0; i < machine.axes.size(); ++i) {
      const auto& axis = machine.axes[i];
      if (place[i] >= axis.travel_min_mm && place[i] <= axis.travel_max_mm) continue;
      std::ostringstream text;
      text << nameOf(reader, "world.toml") << ": '" << key << "' has "
           << "XYZ"[i] << " = " << place[i] << ", and the travel of that axis is " << axis.travel_min_mm << " to "
           << axis.travel_max_mm << " mm in " << nameOf(reader, "machine.toml")
           << ": move it inside, or mend the travel";
      error.what += (error.what.empty() ? "" : "\n") + text.str();
    }
  }
}

// The device that tools are set on: its line is the vendor's, what it measures the integrator's.
void checkToolSetter(const Reader& reader, const Box& box, const Machine& machine, Error& error) {
  if (!machine.tool_setter || lineOfToolSetter(box, machine)) return;
  std::string names;
  for (const auto& line : box.triggers) names += (names.empty() ? "\"" : ", \"") + line.name + "\"";
  error.what += (error.what.empty() ? "" : "\n") + nameOf(reader, "machine.toml") + ": 'tool_setter.trigger' is \"" +
                machine.tool_setter->trigger + "\", and " + nameOf(reader, "box.toml") +
                " has no [[trigger]] of that name" + (names.empty() ? ": add one" : "; it has " + names);
}

Outcome<Descriptions> load(const Reader& reader, bool emulated) {
  Descriptions all;
  World world;
  Error error;
  bool good = take(reader, "box.toml", parseBox, all.box, error);
  good &= take(reader, "machine.toml", parseMachine, all.machine, error);
  good &= take(reader, "probe.toml", parseProbe, all.probe, error);
  good &= take(reader, "service.toml", parseService, all.service, error);
  if (emulated) {
    good &= take(reader, "world.toml", parseWorld, world, error);
    if (good) checkTravel(reader, world, all.machine, error);
    all.world = std::move(world);
  }
  if (good) checkToolSetter(reader, all.box, all.machine, error);
  if (!error.what.empty()) return error;
  return all;
}

bool overridden(const std::filesystem::path& overrides, const std::string& file_name) {
  return !overrides.empty() && std::filesystem::exists(overrides / file_name);
}

// A folder that was named but is not there is a slip, not an empty set of overrides.
std::optional<Error> missingFolder(const std::filesystem::path& folder) {
  std::error_code ignored;
  if (folder.empty() || std::filesystem::is_directory(folder, ignored)) return std::nullopt;
  return Error{folder.string() + ": there is no such folder; name one that holds TOML descriptions"};
}

}  // namespace

std::optional<std::uint8_t> lineOfToolSetter(const Box& box, const Machine& machine) {
  if (!machine.tool_setter) return std::nullopt;
  for (std::size_t i = 0; i < box.triggers.size(); ++i) {
    if (box.triggers[i].name == machine.tool_setter->trigger) return static_cast<std::uint8_t>(i);
  }
  return std::nullopt;
}

Outcome<Descriptions> loadDirectory(const std::filesystem::path& directory, const std::filesystem::path& overrides) {
  for (const auto& folder : {directory, overrides}) {
    if (const auto error = missingFolder(folder)) return *error;
  }
  const auto place = [&](const std::string& name) {
    return (overridden(overrides, name) ? overrides : directory) / name;
  };
  const Reader reader = [&](const std::string& name) { return readFile(place(name)); };
  return load(reader, std::filesystem::exists(place("world.toml")));
}

Outcome<Descriptions> simDescriptions(const std::filesystem::path& overrides) {
  if (const auto error = missingFolder(overrides)) return *error;
  const Reader reader = [&](const std::string& name) -> Outcome<File> {
    if (overridden(overrides, name)) return readFile(overrides / name);
    return File{"board/sim/" + name, std::string{simFile(name)}};
  };
  return load(reader, true);
}

}  // namespace probebox::board
