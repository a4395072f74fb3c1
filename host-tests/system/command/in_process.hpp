#pragma once
#include <atomic>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "tools/probebox/run.hpp"

namespace probebox::command {

struct Finished {
  int status{};
  std::string out;
  std::string err;

  // The JSON objects of the standard output, one a line.
  std::vector<Json> objects() const {
    std::vector<Json> all;
    std::istringstream lines{out};
    for (std::string line; std::getline(lines, line);) all.push_back(Json::parse(line));
    return all;
  }
  Json object() const { return objects().at(0); }
};

// `probebox ARGUMENTS` in this process, without a terminal.
inline Finished probebox(const std::vector<std::string>& arguments, const std::string& input = {},
                         const std::atomic<bool>* interrupted = nullptr) {
  static const std::atomic<bool> never{false};
  std::istringstream in{input};
  std::ostringstream out, err;
  const Streams streams{in, out, err, false, false, 0, interrupted == nullptr ? never : *interrupted};
  const auto status = run(arguments, streams);
  return {static_cast<int>(status), out.str(), err.str()};
}

}  // namespace probebox::command
