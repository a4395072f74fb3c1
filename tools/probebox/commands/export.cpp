#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <vector>

#include "tools/link/recording.hpp"
#include "tools/probebox/box.hpp"
#include "tools/probebox/commands.hpp"
#include "tools/probebox/output.hpp"
#include "tools/probebox/scale.hpp"

namespace probebox::command {
namespace {

constexpr std::size_t kGapsNoted = 10;

// "um/s" cannot stand in a column's name.
std::string columnName(const messages::ChannelDescription& channel) {
  std::string unit = channel.unit;
  for (auto& c : unit) {
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
  }
  return unit.empty() ? channel.name : channel.name + "_" + unit;
}

std::vector<std::string> columnNames(const messages::Descriptor& descriptor) {
  std::vector<std::string> names;
  for (const auto& channel : descriptor.channels) names.push_back(columnName(channel));
  return names;
}

void append(std::string& text, auto number) {
  std::array<char, 40> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr;
  text.append(digits.data(), end);
}

// Blocks into rows. Samples that are missing have no row; where they are missing is remembered. The file is opened by
// the first descriptor: what is no recording overwrites no table.
class Table : public link::StreamListener {
 public:
  Table(const Export& options, Console& console) : options_{options}, console_{console} {}

  void onWelcome(const messages::Welcome& welcome) override {
    if (boot_id_ && *boot_id_ != welcome.boot_id) {
      next_.reset();  // sample indices begin anew
      ++restarts_;
    }
    boot_id_ = welcome.boot_id;
  }
  void onDescriptor(const messages::Descriptor& descriptor) override {
    const auto names = columnNames(descriptor);
    if (!output_ && !failure_) {
      open();
      writeHeader(names);
    } else if (names != names_) {
      channels_changed_ = true;
    }
  }
  void onBlock(const link::DecodedBlock& block) override {
    if (channels_changed_ || failure_ || console_.interrupted()) return;
    scales_.clear();
    for (const auto& channel : block.descriptor.channels) scales_.emplace_back(channel.scale);
    for (std::size_t k = 0; k < block.header.count; ++k) {
      const SampleIndex sample = block.header.first + static_cast<std::int64_t>(k);
      if (next_ && sample > *next_) remember({*next_, static_cast<std::uint64_t>(sample - *next_), {}}, "not_recorded");
      if (next_ && sample < *next_) continue;  // a resumed stream repeats what came before
      writeRow(block, k, sample);
      next_ = sample + 1;
    }
  }
  void onGap(const messages::Gap& gap) override { remember(gap, messages::nameOf(gap.reason)); }
  void onHole(const messages::Gap& hole) override { remember(hole, "lost_on_link"); }

  struct Missing {
    std::int64_t first{};
    std::uint64_t count{};
    std::string reason;
  };
  const std::vector<Missing>& missing() const { return missing_; }
  std::uint64_t missingSamples() const {
    std::uint64_t all = 0;
    for (const auto& gap : missing_) all += gap.count;
    return all;
  }
  std::uint64_t rows() const { return rows_; }
  std::uint64_t restarts() const { return restarts_; }
  bool channelsChanged() const { return channels_changed_; }
  bool hasHeader() const { return output_.has_value(); }
  void flush() {
    if (output_ && !failure_ && !output_->flush()) failure_ = output_->failure();
  }
  const std::optional<std::string>& failure() const { return failure_; }
  const std::string& name() const { return output_->name(); }

 private:
  void open() {
    auto output = Output::open(options_.output, options_.force, console_.out());
    if (output) {
      output_.emplace(std::move(output).value());
    } else {
      failure_ = output.error().what;
    }
  }

  void write(const std::string& text) {
    if (!failure_ && !output_->write(text)) failure_ = output_->failure();
  }

  void writeHeader(const std::vector<std::string>& names) {
    names_ = names;
    std::string header = "sample,time_ns";
    for (const auto& name : names) header += "," + name;
    write(header + "\n");
  }

  void writeRow(const link::DecodedBlock& block, std::size_t k, SampleIndex sample) {
    row_.clear();
    append(row_, sample.index);
    row_ += ',';
    append(row_, toNs(codec::timeOf(block.header, sample)));
    for (std::size_t channel = 0; channel < block.descriptor.channels.size(); ++channel) {
      row_ += ',';
      row_ += scales_[channel].text(block.column(channel)[k]);
    }
    row_ += '\n';
    write(row_);
    ++rows_;
  }

  void remember(const messages::Gap& gap, std::string_view reason) {
    missing_.push_back({gap.first.index, gap.count, std::string{reason}});
    next_ = gap.first + static_cast<std::int64_t>(gap.count);
  }

  const Export& options_;
  Console& console_;
  std::optional<Output> output_;
  std::optional<std::string> failure_;
  std::optional<messages::BootId> boot_id_;
  std::vector<std::string> names_;
  std::vector<Missing> missing_;
  std::vector<Scale> scales_;
  std::string row_;
  std::optional<SampleIndex> next_;
  std::uint64_t rows_{};
  std::uint64_t restarts_{};
  bool channels_changed_{};
};

std::string sentence(const Table::Missing& gap) {
  return "  " + std::to_string(gap.count) + " from sample " + std::to_string(gap.first) + " on: " + gap.reason;
}

void note(const Table& table, const link::RecordingEnd& end, Console& console) {
  const auto& missing = table.missing();
  if (!missing.empty()) {
    console.note(std::to_string(table.missingSamples()) + " samples are missing, in " + std::to_string(missing.size()) +
                 " places; they have no row:");
  }
  for (std::size_t i = 0; i < missing.size() && i < kGapsNoted; ++i) console.note(sentence(missing[i]));
  if (missing.size() > kGapsNoted) console.note("  and so on; --json names them all");
  if (end.frames.bad() > 0) console.note(std::to_string(end.frames.bad()) + " frames of the recording are damaged");
  if (end.cut_bytes > 0) console.note("the recording is cut off in the middle of a frame");
  if (!end.closed) {
    console.note("the recording ends before its stream did: what came from sample " + std::to_string(end.next.index) +
                 " on is unknown");
  }
  if (table.restarts() > 0) console.note("the box was restarted: sample numbers begin anew there");
}

Json summary(const Export& options, const Table& table, const link::RecordingEnd& end) {
  Json gaps = Json::array();
  for (const auto& gap : table.missing()) {
    gaps.push_back({{"first_sample", gap.first}, {"count_samples", gap.count}, {"reason", gap.reason}});
  }
  return {{"recording", options.input},
          {"table", options.output},
          {"rows", table.rows()},
          {"missing_samples", table.missingSamples()},
          {"gaps", gaps},
          {"damaged_frames", end.frames.bad()},
          {"cut_bytes", end.cut_bytes},
          {"end_known", end.closed},
          {"box_restarts", table.restarts()}};
}

ExitStatus finish(const Export& options, Table& table, const link::RecordingEnd& end, Console& console) {
  table.flush();
  if (table.failure()) return console.fail({ExitStatus::usage, "not-written", *table.failure()});
  if (!table.hasHeader()) {
    return console.fail({ExitStatus::usage, "no-descriptor",
                         options.input + " does not say what its channels are: its beginning is cut off"});
  }
  if (console.interrupted()) return ExitStatus::interrupted;
  note(table, end, console);
  if (console.json()) {
    console.object(summary(options, table, end));
  } else {
    console.note(std::to_string(table.rows()) + " rows in " + table.name());
  }
  if (table.channelsChanged()) {
    return console.fail(
        {ExitStatus::failed, "channels-changed",
         "the box changed its channels after row " + std::to_string(table.rows()) + "; the rest is not in the table"});
  }
  return ExitStatus::ok;
}

// Said before the table is begun, so that a wrong name overwrites nothing.
std::optional<std::string> objectionTo(const Export& options) {
  if (options.input == "-") return std::nullopt;
  if (!std::ifstream{options.input}) return options.input + " cannot be read: " + std::strerror(errno);
  std::error_code different;
  if (std::filesystem::equivalent(options.input, options.output, different)) {
    return options.output + " is the recording itself; name another file for the table";
  }
  return std::nullopt;
}

}  // namespace

ExitStatus run(const Export& options, const std::string&, Console& console) {
  if (options.output == "-") console.keepOutputForData();
  if (const auto objection = objectionTo(options)) {
    return console.fail({ExitStatus::usage, "unreadable-recording", *objection});
  }
  if (const auto objection = Output::objectionTo(options.output, options.force)) {
    return console.fail(usage(*objection));
  }
  Table table{options, console};
  const auto end =
      options.input == "-" ? link::readRecording(console.in(), table) : link::readRecording(options.input, table);
  if (!end) return console.fail({ExitStatus::usage, "unreadable-recording", end.error().what});
  return finish(options, table, *end, console);
}

}  // namespace probebox::command
