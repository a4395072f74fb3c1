#include <cerrno>
#include <cstring>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>

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
    all.world = std::move(world);
  }
  if (!good) return error;
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
