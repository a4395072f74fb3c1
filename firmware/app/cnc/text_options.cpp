#include <array>
#include <charconv>

#include "firmware/app/cnc/text_server.hpp"

namespace probebox::app {
namespace {

constexpr serial::Settings kRecords{19200, serial::Parity::even, 8, 1};
constexpr serial::Settings kTape{9600, serial::Parity::even, 7, 2};

template <class Value>
struct Choice {
  std::string_view name;
  Value value;
};
constexpr std::array<Choice<bool>, 2> kYesNo{{{"yes", true}, {"no", false}}};
constexpr std::array<Choice<tape::Dialect>, 3> kDialects{
    {{"g10", tape::Dialect::g10}, {"macro", tape::Dialect::macro}, {"nv", tape::Dialect::nv}}};
constexpr std::array<Choice<tape::Ask>, 4> kReaders{{{"corrections", tape::Ask::corrections},
                                                     {"centreline", tape::Ask::centreline},
                                                     {"delay", tape::Ask::delay},
                                                     {"all", tape::Ask::all}}};

template <class Value, std::size_t size>
bool choose(std::string_view text, const std::array<Choice<Value>, size>& all, auto& into) {
  for (const auto& one : all) {
    if (one.name != text) continue;
    into = one.value;
    return true;
  }
  return false;
}

bool number(std::string_view text, unsigned least, unsigned most, auto& into) {
  unsigned value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || value < least || value > most) return false;
  into = static_cast<std::remove_reference_t<decltype(into)>>(value);
  return true;
}

// Whether an option was one of the tape format; all others belong to the serial line. An error explains a bad value.
enum class Taken { yes, no, wrong };

Taken taken(bool good) {
  return good ? Taken::yes : Taken::wrong;
}

Taken apply(std::string_view key, std::string_view value, TextOptions& options) {
  const bool tape = options.format == TextOptions::Format::tape;
  if (key == "flow") return taken(choose(value, kYesNo, options.flow));
  if (!tape && key == "every") {
    unsigned ms = 0;
    const bool good = number(value, 20, 60'000, ms);
    options.every = std::chrono::milliseconds{ms};
    return taken(good);
  }
  if (!tape) return Taken::no;
  if (key == "dialect") return taken(choose(value, kDialects, options.form.dialect));
  if (key == "reader") return taken(choose(value, kReaders, options.usual));
  if (key == "answers") return taken(choose(value, kYesNo, options.answers));
  if (key == "first") return taken(number(value, 1, 60'000, options.form.first));
  if (key == "offset") return taken(number(value, 0, 9, options.form.offset));
  return Taken::no;
}

constexpr const char* kRecordsKeys = "every=20 to 60000 (ms), flow=yes|no";
constexpr const char* kTapeKeys =
    "dialect=g10|macro|nv, first=1 to 60000, offset=0 to 9, reader=corrections|centreline|delay|all, answers=yes|no, "
    "flow=yes|no";

// In which the line can send a record.
std::chrono::milliseconds shortestPeriod(const serial::Settings& settings) {
  constexpr unsigned kLongestRecord = 60;  // characters
  const unsigned bits = kLongestRecord * serial::bitsPerCharacter(settings);
  return std::chrono::milliseconds{(bits * 1000 + settings.baud - 1) / settings.baud};
}

Outcome<TextOptions> parse(std::string_view text, TextOptions options, const serial::Settings& usual) {
  std::string line;
  for (std::size_t at = 0; at <= text.size();) {
    const auto part = text.substr(at, text.find(',', at) - at);
    at += part.size() + 1;
    const auto equals = part.find('=');
    const bool pair = equals != std::string_view::npos;
    const Taken is = pair ? apply(part.substr(0, equals), part.substr(equals + 1), options) : Taken::no;
    const char* keys = options.format == TextOptions::Format::tape ? kTapeKeys : kRecordsKeys;
    if (is == Taken::wrong) return Error{"'" + std::string{part} + "' is not a setting: known are " + keys};
    if (is == Taken::no) line += (line.empty() ? "" : ",") + std::string{part};
  }
  TRY(auto address, serial::parseAddress(line, usual));
  options.line = std::move(address);
  if (const auto least = shortestPeriod(options.line.settings); options.every.count() > 0 && options.every < least)
    return Error{"every=" + std::to_string(options.every.count()) + " is shorter than a record takes at " +
                 serial::describe(options.line.settings) + ": write every=" + std::to_string(least.count()) +
                 " or more, or a higher baud"};
  return options;
}

}  // namespace

std::optional<Outcome<TextOptions>> parseTextOptions(std::string_view text) {
  constexpr std::string_view kRecordsFace = "records:", kTapeFace = "tape:";
  TextOptions options;
  if (text.starts_with(kRecordsFace)) {
    options.answers = true;
    return parse(text.substr(kRecordsFace.size()), options, kRecords);
  }
  if (!text.starts_with(kTapeFace)) return std::nullopt;
  options.format = TextOptions::Format::tape;
  options.flow = true;
  return parse(text.substr(kTapeFace.size()), options, kTape);
}

}  // namespace probebox::app
