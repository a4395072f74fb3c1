#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "protocol/units/plain_input.hpp"
#include "protocol/units/wording.hpp"
#include "tools/link/recording_maker.hpp"
#include "tools/probebox/cli/output.hpp"
#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/tables/integer_table.hpp"
#include "tools/probebox/text/progress_bar.hpp"

namespace probebox::command {
namespace {

constexpr std::size_t kMostChannels = codec::kMaxChannels;

// Units that a column's name may end with, as in x_nm.
constexpr auto kUnits =
    std::to_array<std::string_view>({"nm",   "um",  "mm", "m",  "ns", "us", "ms", "s",  "counts", "deg",
                                     "urad", "rad", "K",  "mK", "V",  "mV", "uV", "Hz", "ppm",    "ppb"});

// The narrowest integer that holds the column.
messages::ChannelDescription channelOf(const std::string& name, std::span<const std::int64_t> column) {
  messages::ChannelDescription channel;
  channel.name = name;
  const auto end = name.rfind('_');
  if (end != std::string::npos && end > 0 &&
      std::ranges::find(kUnits, std::string_view{name}.substr(end + 1)) != kUnits.end()) {
    channel.name = name.substr(0, end);
    channel.unit = name.substr(end + 1);
  }
  const auto [low, high] = std::ranges::minmax(column);
  channel.is_signed = low < 0;
  for (channel.bytes = 1; channel.bytes < 8; channel.bytes = static_cast<std::uint8_t>(2 * channel.bytes)) {
    const int bits = 8 * channel.bytes;
    if (channel.is_signed ? low >= -(std::int64_t{1} << (bits - 1)) && high < std::int64_t{1} << (bits - 1)
                          : high < std::int64_t{1} << bits)
      break;
  }
  return channel;
}

std::optional<Error> whyNoSamples(const IntegerTable& table) {
  if (table.names.front() != "sample")
    return Error{"line 1: the first column is called " + table.names.front() + ", not sample"};
  if (table.names.size() < 2) return Error{"line 1: there is no column beside sample"};
  if (table.names.size() - 1 > kMostChannels)
    return Error{"line 1: a recording holds at most " + std::to_string(kMostChannels) + " columns beside sample"};
  for (std::size_t column = 0; column < table.names.size(); ++column) {
    const auto& name = table.names[column];
    const auto place = "line 1: the name of column " + std::to_string(column + 1);
    if (const auto why = whyUnprintable(name)) return Error{place + " has " + *why};
    if (lengthOf(name) > kLongestName)
      return Error{place + " has " + std::to_string(lengthOf(name)) + " characters: " + std::to_string(kLongestName) +
                   " are the most"};
  }
  const auto& samples = table.columns.front();
  if (samples.empty()) return Error{"has no row after its first line"};
  for (std::size_t k = 1; k < samples.size(); ++k) {
    if (samples[k] > samples[k - 1]) continue;
    return Error{"line " + std::to_string(k + 2) + ": sample " + std::to_string(samples[k]) + " does not come after " +
                 std::to_string(samples[k - 1]) + " of the line before"};
  }
  if (samples.back() == std::numeric_limits<std::int64_t>::max())
    return Error{"line " + std::to_string(samples.size() + 1) +
                 ": sample: this is the largest possible index; start at a lower one"};
  return std::nullopt;
}

Outcome<IntegerTable> readInput(const Pack& options, Console& console) {
  const auto named = [&](Error error) {
    return Error{(options.input == "-" ? "the standard input" : options.input) + ": " + error.what};
  };
  const auto checked = [&](Outcome<IntegerTable> table) -> Outcome<IntegerTable> {
    if (!table) return named(table.error());
    if (const auto problem = whyNoSamples(*table)) return named(*problem);
    return table;
  };
  if (options.input == "-") return checked(readIntegerTable(console.in()));
  TRY(auto file, openPlainInput(options.input));
  std::error_code unknown;
  const auto size = std::filesystem::file_size(options.input, unknown);
  return checked(readIntegerTable(
      file, [&](std::uint64_t done) { console.progress("reading  " + progressBar(done, unknown ? 0 : size)); }));
}

messages::Descriptor descriptorOf(const IntegerTable& table) {
  messages::Descriptor descriptor;
  descriptor.board = "table";
  descriptor.firmware_version = "probebox " PROBEBOX_VERSION;
  for (std::size_t c = 1; c < table.columns.size(); ++c)
    descriptor.channels.push_back(channelOf(table.names[c], table.columns[c]));
  return descriptor;
}

// Stretch by stretch of samples that follow each other.
bool make(const IntegerTable& table, link::RecordingMaker& maker, Console& console) {
  const auto& samples = table.columns.front();
  if (!maker.begin(descriptorOf(table))) return false;
  std::vector<std::span<const std::int64_t>> stretch(table.columns.size() - 1);
  constexpr std::size_t kMostAtOnce = 1U << 16U;  // progress is seen, and frames are whole
  for (std::size_t begin = 0; begin < samples.size() && !console.interrupted();) {
    std::size_t end = begin + 1;
    while (end < samples.size() && samples[end] == samples[end - 1] + 1 && end - begin < kMostAtOnce) ++end;
    for (std::size_t c = 1; c < table.columns.size(); ++c)
      stretch[c - 1] = std::span{table.columns[c]}.subspan(begin, end - begin);
    if (!maker.add({samples[begin]}, stretch)) return false;
    begin = end;
    console.progress("packing  " + progressBar(begin, samples.size()));
  }
  return maker.end();
}

Json summary(const Pack& options, const link::RecordingMaker& maker) {
  return {{"table", options.input},
          {"recording", options.output},
          {"profile", std::string{messages::nameOf(options.profile)}},
          {"frame_samples", options.frame},
          {"rows", maker.samples()},
          {"gaps", maker.gaps()},
          {"missing_samples", maker.missing()},
          {"size_bytes", maker.bytes()},
          {"size_bytes_per_sample", static_cast<double>(maker.bytes()) / static_cast<double>(maker.samples())}};
}

}  // namespace

ExitStatus run(const Pack& options, const std::string&, Console& console) {
  if (options.output == "-") {
    if (console.outIsTerminal())
      return console.fail(
          usage("a recording is not for a terminal; name a file, or send the standard output into a pipe"));
    console.keepOutputForData();
  }
  if (const auto objection = Output::objectionTo(options.output, options.force)) return console.fail(usage(*objection));
  if (Output::isSameFile(options.output, options.input))
    return console.fail(usage(options.output + " is the table itself; name another file for the recording"));
  const auto table = readInput(options, console);
  if (!table) return console.fail({ExitStatus::usage, "unreadable-table", table.error().what});
  if (const auto size = messages::encodedSize(descriptorOf(*table)); size > frame::kMaxPayload) {
    return console.fail(usage("the names of the columns take " + std::to_string(size) + " bytes of a recording: " +
                              std::to_string(frame::kMaxPayload) + " are the most; shorten them"));
  }
  auto output = Output::open(options.output, options.force, console.out());
  if (!output) return console.fail({ExitStatus::usage, "not-written", output.error().what});
  link::RecordingMaker maker{output->stream(), options.profile, options.frame};
  const bool written = make(*table, maker, console);
  if (console.interrupted()) return ExitStatus::interrupted;  // a part would look like a whole recording
  if (!written || !output->finish()) return console.fail({ExitStatus::usage, "not-written", output->failure()});
  if (console.json()) {
    console.object(summary(options, maker));
  } else {
    console.note(std::to_string(maker.samples()) + (maker.samples() == 1 ? " sample in " : " samples in ") +
                 std::to_string(maker.bytes()) + " bytes, " + std::to_string(maker.gaps()) +
                 (maker.gaps() == 1 ? " gap" : " gaps"));
  }
  return ExitStatus::ok;
}

}  // namespace probebox::command
