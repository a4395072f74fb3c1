#include "firmware/tape/text.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string_view>

namespace probebox::tape {
namespace {

template <class... Values>
std::string printed(const char* format, Values... values) {
  std::array<char, 96> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

// As it is written with so many decimals, and no "-0.0000".
double shownZero(double value, int decimals) {
  const double half = 0.5 * std::pow(10.0, -decimals);
  return std::abs(value) <= half ? 0.0 : value;
}

constexpr int kDecimals_mm = 4;
double zeroed(double mm) {
  return shownZero(mm, kDecimals_mm);
}

constexpr const char* kEnd = "\r\n";

// '*' and all characters of the text by exclusive or.
std::string checksumOf(std::string_view text) {
  unsigned sum = 0;
  for (const char c : text) sum ^= static_cast<unsigned char>(c);
  return printed("*%02X", sum);
}

// Numbers of the values, from Form::first on. Never change them.
enum Number : unsigned {
  kStatus = 0,
  kSequence = 1,
  kCorrection = 2,    // X Y Z, mm
  kCentreline = 5,    // X Y, mm; tilts X/Z and Y/Z, mm per mm
  kCentrelineSd = 9,  // X Y, mm
  kDelay = 11,        // X Y Z, ms
  kDelaySd = 14,      // X Y Z, ms
};

class Tape {
 public:
  Tape(const published::Snapshot& snapshot, const Form& form) : of_{snapshot}, form_{form} {}

  std::string write(Ask ask) {
    line("%");
    if (hasCorrection(ask)) corrections();
    if (ask == Ask::centreline || ask == Ask::all) centreline();
    if (ask == Ask::delay || ask == Ask::all) delay();
    line("%");
    return std::move(text_);
  }

 private:
  void line(const std::string& words) { text_ += words + kEnd; }
  void value(unsigned number, double of, int digits) {
    const unsigned at = form_.first + number;
    line(form_.dialect == Dialect::macro ? printed("#%u=%.*f", at, digits, shownZero(of, digits))
                                         : printed("N%u V%.*f", at, digits, shownZero(of, digits)));
  }
  template <std::size_t size>
  void values(unsigned number, const std::array<double, size>& of, double factor, int digits) {
    for (std::size_t i = 0; i < size; ++i) value(number + static_cast<unsigned>(i), of[i] * factor, digits);
  }
  bool numbered() const { return form_.dialect != Dialect::g10; }

  void corrections() {
    if (numbered()) {
      value(kStatus, statusOf(of_), 0);
      value(kSequence, of_.sequence, 0);
    }
    if (!of_.valid) return line("(NO VALID CORRECTION)");
    const auto& [x, y, z] = of_.correction_mm;
    if (numbered()) return values(kCorrection, of_.correction_mm, 1, 4);
    offset(printed("P%u X%.4f Y%.4f Z%.4f", unsigned{form_.offset}, zeroed(x), zeroed(y), zeroed(z)));
  }

  // Under G91 the control would add the values to those that it has, and under G20 take them for inches.
  void offset(const std::string& words) {
    line("G21");
    line("G90 G10 L2 " + words);
  }

  void centreline() {
    const auto& [result, has_z, here] = of_.centreline;
    if (result.result_id == 0) return line("(NO CENTRELINE IN FORCE)");
    if (!has_z) return line("(Z IS NOT KNOWN)");
    if (!numbered()) return offset(printed("P%u X%.4f Y%.4f", form_.offset + 1U, zeroed(here[0]), zeroed(here[1])));
    values(kCentreline, here, 1, 4);
    values(kCentreline + 2, result.slope, 1, 7);
    values(kCentrelineSd, result.sd_centre_mm, 1, 5);
  }

  void delay() {
    constexpr double kMsPerS = 1e3;
    if (of_.delay.result_id == 0) return line("(NO DELAY IN FORCE)");
    if (!of_.delay.calibrated) return line("(NO DELAY OF EVERY AXIS IN FORCE)");
    if (!numbered()) return line("(A WORK OFFSET HOLDS NO DELAY)");
    values(kDelay, of_.delay.tau_s, kMsPerS, 5);
    values(kDelaySd, of_.delay.sd_s, kMsPerS, 5);
  }

  const published::Snapshot& of_;
  const Form& form_;
  std::string text_;
};

}  // namespace

std::string record(const published::Snapshot& snapshot) {
  constexpr std::uint64_t kMostAge = 65535;  // as in register 11
  const auto& [x, y, z] = snapshot.correction_mm;
  const std::string text =
      printed("X%+.4f Y%+.4f Z%+.4f S%u N%u A%u", zeroed(x), zeroed(y), zeroed(z), unsigned{statusOf(snapshot)},
              unsigned{snapshot.sequence}, static_cast<unsigned>(std::min(snapshot.age_ms / 100, kMostAge)));
  return text + checksumOf(text) + kEnd;
}

bool isSentByTheBox(std::string_view line) {
  if (line == "OK" || line.starts_with("ERR ")) return true;
  const auto asterisk = line.rfind('*');
  return line.starts_with('X') && asterisk != std::string_view::npos &&
         line.substr(asterisk) == checksumOf(line.substr(0, asterisk));
}

bool hasCorrection(Ask ask) {
  return ask != Ask::centreline && ask != Ask::delay;
}

std::string tape(const published::Snapshot& snapshot, Ask ask, const Form& form) {
  return ask == Ask::status ? record(snapshot) : Tape{snapshot, form}.write(ask);
}

}  // namespace probebox::tape
