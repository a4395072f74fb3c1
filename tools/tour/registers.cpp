#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <sstream>
#include <vector>

#include "protocol/modbus/map.hpp"
#include "tools/tour/process.hpp"
#include "tools/tour/tour.hpp"

namespace probebox::tour {
namespace {

using namespace std::chrono_literals;

// mbpoll prints one line a value: "[64]: \t5.2" (and "(-125)" behind a 16-bit value that has a sign).
std::vector<double> valuesOf(const std::string& output) {
  std::vector<double> values;
  std::istringstream lines{output};
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("[")) continue;
    const auto sign = line.find('(');
    const auto colon = line.find(':');
    const auto from = sign == std::string::npos ? colon + 1 : sign + 1;
    values.push_back(std::strtod(line.c_str() + from, nullptr));
  }
  return values;
}

class Mbpoll {
 public:
  explicit Mbpoll(std::filesystem::path port) : port_{std::move(port)} {}

  // Prints the command and what it says, and returns the values.
  Outcome<std::vector<double>> read(const std::string& format, unsigned first, unsigned count,
                                    const std::string& about) {
    const auto values = ask(format, first, count, about);
    if (!values) return values;
    std::printf("   mbpoll -t %-8s -r %-3u %-34s", format.c_str(), first, about.c_str());
    for (const double value : *values) std::printf(" %.8g", value);
    std::puts("");
    return values;
  }

  // The same without a word.
  Outcome<std::vector<double>> ask(const std::string& format, unsigned first, unsigned count,
                                   const std::string& about) {
    std::vector<std::string> command{"mbpoll", "-m", "rtu", "-a", "1", "-b", "19200", "-P", "none", "-0", "-1", "-q"};
    command.insert(command.end(), {"-t", format, "-r", std::to_string(first), "-c", std::to_string(count)});
    if (format != "4") command.emplace_back("-B");
    command.push_back(port_.string());
    TRY(const auto output, outputOf(command));
    const auto values = valuesOf(output);
    if (values.size() != count) return Error{"mbpoll did not read " + about + ":\n" + output};
    return values;
  }

 private:
  std::filesystem::path port_;
};

// The corrections move all the time, so whether their formats agree shows in one read alone: it is of one instant.
bool formatsAgree(const std::vector<double>& from_correction_i16) {
  namespace address = modbus::address;
  std::array<std::uint16_t, modbus::kRegisterCount> words{};
  for (std::size_t i = 0; i < from_correction_i16.size(); ++i)
    words[address::correction_i16 + i] = static_cast<std::uint16_t>(static_cast<int>(from_correction_i16[i]));
  const auto valueAt = [&](std::size_t place) {
    return modbus::decode(*modbus::find(static_cast<std::uint16_t>(place)), modbus::WordOrder::high_first, words);
  };
  bool same = true;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double mm = valueAt(address::correction_i32 + 2 * axis) * 1e-6;
    same = same && std::abs(valueAt(address::correction_f32 + 2 * axis) - mm) < 1e-6 &&
           std::abs(valueAt(address::correction_i16 + axis) * 1e-3 - mm) < 1e-4 &&
           std::abs(valueAt(address::correction_offset + axis) * 1e-3 - mm) < 1e-4;
  }
  return same;
}

}  // namespace

Stopped showRegisters(Stage& stage, const std::filesystem::path& port) {
  namespace address = modbus::address;
  std::puts(
      "\n5. What a CNC reads: the registers over a serial line at 19200 8N1, by mbpoll, a Modbus master of somebody "
      "else.");
  TRY(auto client, meet(stage.box, nullptr));
  Mbpoll mbpoll{port};
  TRY(const auto first, mbpoll.read("4", address::magic, 13, "first block, 16 bit"));
  std::puts("   (status bit 0, valid: the screws warm up, and their corrections are summed; they move while you read)");
  TRY(mbpoll.read("4", address::correction_i16, 3, "corrections X Y Z, 0.1 um"));
  TRY(mbpoll.read("4:float", address::correction_f32, 3, "corrections X Y Z, mm"));
  TRY(const auto i32, mbpoll.read("4:int", address::correction_i32, 3, "corrections X Y Z, nm"));
  TRY(const auto block, mbpoll.ask("4", address::correction_i16, address::correction_i32 + 6 - address::correction_i16,
                                   "all formats in one read"));
  TRY(const auto delay_ms, mbpoll.read("4:float", address::delay_f32, 3, "system delay X Y Z, ms"));
  TRY(const auto delay_ns, mbpoll.read("4:int", address::delay_i32, 3, "system delay X Y Z, ns"));

  const auto in_force = client->request<messages::Corrections>({}, link::patience(5s));
  if (!in_force) return Error{in_force.error().what};
  // Corrections valid, clock locked, delay calibrated, screw sensors good, axes referenced.
  constexpr unsigned kWanted = published::kValid | published::kClockLocked | published::kDelayCalibrated |
                               published::kScrewSensorsGood | published::kReferenced;
  const auto status = static_cast<unsigned>(first[2]);
  bool same = first[0] == modbus::kMagic && (status & kWanted) == kWanted && formatsAgree(block);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double tau_s = in_force->delay.tau_s[axis];
    same = same && std::abs(delay_ms[axis] - tau_s * 1e3) < 1e-5 && std::abs(delay_ns[axis] - tau_s * 1e9) < 1;
    // Some seconds later: a screw moves by less than this meanwhile.
    same = same && std::abs(i32[axis] * 1e-6 - in_force->correction_mm[axis]) < 2e-3;
  }
  stage.table.exact("registers", "delay in force, formats agree", same);
  return {};
}

}  // namespace probebox::tour
