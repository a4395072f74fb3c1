#pragma once
#include <atomic>
#include <functional>
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
  std::vector<nlohmann::ordered_json> objects() const {
    std::vector<nlohmann::ordered_json> all;
    std::istringstream lines{out};
    for (std::string line; std::getline(lines, line);) all.push_back(nlohmann::ordered_json::parse(line));
    return all;
  }
  nlohmann::ordered_json object() const { return objects().at(0); }
};

// `probebox ARGUMENTS` in this process, without a terminal.
inline Finished probebox(const std::vector<std::string>& arguments, const std::string& input = {},
                         const std::atomic<bool>* interrupted = nullptr, std::function<bool()> enter_pressed = {}) {
  static const std::atomic<bool> never{false};
  std::istringstream in{input};
  std::ostringstream out, err;
  const Streams streams{
      in, out, err, false, false, 0, interrupted == nullptr ? never : *interrupted, std::move(enter_pressed)};
  const auto status = run(arguments, streams);
  return {static_cast<int>(status), out.str(), err.str()};
}

// An output that takes some bytes and then nothing more: a full disk, or a reader that has gone.
class SpentOutput : public std::streambuf {
 public:
  explicit SpentOutput(std::size_t bytes) : left_{bytes} {}

 protected:
  int_type overflow(int_type c) override {
    if (left_ == 0) return traits_type::eof();
    --left_;
    return c;
  }

 private:
  std::size_t left_;
};

// The same with a standard output that takes only so many bytes; `out` stays empty.
inline Finished probeboxInto(std::size_t bytes, const std::vector<std::string>& arguments) {
  static const std::atomic<bool> never{false};
  SpentOutput spent{bytes};
  std::istringstream in;
  std::ostream out{&spent};
  std::ostringstream err;
  const auto status = run(arguments, {in, out, err, false, false, 0, never});
  return {static_cast<int>(status), {}, err.str()};
}

}  // namespace probebox::command
