#include "tools/probebox/tables/table_of_recording.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "protocol/frame/bytes.hpp"
#include "protocol/messages/stream.hpp"
#include "protocol/units/angle.hpp"
#include "protocol/units/plain_input.hpp"
#include "tools/probebox/cli/output.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/link/read_through.hpp"
#include "tools/probebox/tables/csv_rows.hpp"
#include "tools/probebox/tables/npy_rows.hpp"
#include "tools/probebox/tables/scale.hpp"
#include "tools/probebox/tables/tip_points.hpp"

namespace probebox::command {
namespace {

// The columns, once for both formats. column(name, NumPy's type, value).
void columns(const messages::Trigger& t, auto&& column) {
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  const auto position = [&](std::size_t axis) {
    return (unsigned{t.has_position} >> axis & 1U) != 0 ? t.position_mm[axis] : kUnknown;
  };
  const auto angle = [&](std::size_t axis) {
    return (unsigned{t.has_angle} >> axis & 1U) != 0 ? degrees(t.angle_rad[axis]) : kUnknown;
  };
  column("number", "<u4", t.number);
  column("line", "|u1", t.line);
  column("line_sequence", "<u4", t.line_sequence);
  column("at_ns", "<i8", toNs(t.at));
  column("tick", "<i8", t.tick.index);
  column("phase_q32", "<u4", t.phase_q32);
  column("sigma_ns", "<u4", t.sigma_ns);
  column("clock_state", "|u1", static_cast<std::uint8_t>(t.clock_state));
  column("x_mm", "<f8", position(0));
  column("y_mm", "<f8", position(1));
  column("z_mm", "<f8", position(2));
  column("correction_x_mm", "<f8", t.correction_mm[0]);
  column("correction_y_mm", "<f8", t.correction_mm[1]);
  column("correction_z_mm", "<f8", t.correction_mm[2]);
  column("correction_valid", "|u1", std::uint8_t{t.correction_valid});
  column("correction_degraded", "|u1", std::uint8_t{t.correction_degraded});
  column("correction_sequence", "<u2", t.sequence);
  column("a_deg", "<f8", angle(0));
  column("b_deg", "<f8", angle(1));
  column("c_deg", "<f8", angle(2));
}

template <class T>
constexpr bool kIsFloat = std::same_as<T, double>;

std::string csv(std::span<const messages::Trigger> triggers) {
  std::string text;
  columns({}, [&](std::string_view name, auto, auto) { text += (text.empty() ? "" : ",") + std::string{name}; });
  text += '\n';
  for (const auto& trigger : triggers) {
    bool first = true;
    columns(trigger, [&](auto, auto, auto value) {
      if (!std::exchange(first, false)) text += ',';
      if constexpr (kIsFloat<decltype(value)>) {
        if (value == value) append(text, value);
      } else {
        append(text, +value);
      }
    });
    text += '\n';
  }
  return text;
}

std::string npy(std::span<const messages::Trigger> triggers) {
  std::string types;
  columns({}, [&](std::string_view name, std::string_view type, auto) {
    types += "('" + std::string{name} + "', '" + std::string{type} + "'), ";
  });
  std::string bytes = npyHeader(types, triggers.size());
  for (const auto& trigger : triggers) {
    columns(trigger, [&](auto, auto, auto value) {
      std::array<std::byte, sizeof value> field{};
      frame::ByteWriter{field}.put(value);
      bytes.append(reinterpret_cast<const char*>(field.data()), field.size());
    });
  }
  return bytes;
}

// Writes triggers as a table, one row each: CSV, or a structured array of NumPy if the name ends with .npy. Unknown
// positions and angles are empty (nan in NumPy). Returns why it could not be written.
std::optional<std::string> writeTriggers(const std::string& path, bool force,
                                         std::span<const messages::Trigger> triggers) {
  auto output = Output::open(path, force, std::cout);
  if (!output) return output.error().what;
  const bool written = output->write(path.ends_with(".npy") ? npy(triggers) : csv(triggers)) && output->finish();
  if (!written) return output->failure();
  return std::nullopt;
}

constexpr std::size_t kGapsNoted = 10;

std::vector<std::string> columnNames(const messages::Descriptor& descriptor) {
  std::vector<std::string> names;
  for (const auto& channel : descriptor.channels) names.push_back(columnName(channel));
  return names;
}

// Blocks into rows, each sample once.
class Rows : public link::StreamListener {
 public:
  Rows(RowWriter& writer, Console& console) : writer_{writer}, console_{console} {}

  void onWelcome(const messages::Welcome& welcome) override {
    sums_.onWelcome(welcome);
    if (boot_id_ && *boot_id_ != welcome.boot_id) {
      // Sample indices begin anew, and so do numbers of triggers; recordings may be joined in any order.
      ends_[*boot_id_] = {next_, next_trigger_, first_, std::move(without_row_)};
      const auto end = ends_.find(welcome.boot_id);
      restarts_ += end == ends_.end();
      std::tie(next_, next_trigger_, first_, without_row_) = end == ends_.end() ? End{} : std::move(end->second);
    }
    boot_id_ = welcome.boot_id;
  }
  void onDescriptor(const messages::Descriptor& descriptor) override {
    const auto names = columnNames(descriptor);
    if (!begun_ && !writer_.failure()) {
      begun_ = true;
      writer_.begin(descriptor);
      names_ = names;
    } else if (names != names_ || !writer_.canGoOnWith(descriptor)) {
      channels_changed_ = true;
    }
  }
  void onBlock(const link::DecodedBlock& block) override {
    sums_.onBlock(block);
    if (channels_changed_ || writer_.failure() || console_.interrupted()) return;
    if (delays_.empty() || delays_.back().delay.result_id != block.descriptor.delay.result_id)
      delays_.push_back({block.header.first.index, block.descriptor.delay});
    writer_.enter(block.descriptor);
    for (std::size_t k = 0; k < block.header.count; ++k) {
      const SampleIndex sample = block.header.first + static_cast<std::int64_t>(k);
      if (next_ && sample > *next_) remember({*next_, static_cast<std::uint64_t>(sample - *next_), {}}, "not_recorded");
      // A resumed stream repeats what came before, and so does a recording joined with one of the same time. What was
      // joined behind later samples has no row.
      if (next_ && sample < *next_) {
        ++(hasRow(sample) ? repeated_ : out_of_order_);
        continue;
      }
      if (!first_) first_ = sample;
      writer_.row(block, k, sample);
      ++rows_;
      next_ = sample + 1;
    }
  }
  void onGap(const messages::Gap& gap) override {
    sums_.onGap(gap);
    remember(gap, messages::nameOf(gap.reason));
  }
  void onHole(const messages::Gap& hole) override {
    sums_.onHole(hole);
    remember(hole, "lost_on_link");
  }
  void onHeartbeat(const messages::Heartbeat& beat, const std::optional<link::Balance>& balance) override {
    sums_.onHeartbeat(beat, balance);
  }

  void onTrigger(const messages::Trigger& trigger) override {
    if (trigger.number < next_trigger_) return;
    next_trigger_ = trigger.number + 1;
    triggers_.push_back(trigger);
    if (!writer_.failure()) writer_.trigger(trigger);
  }
  void onTriggerGap(const messages::TriggerGap& gap) override { missing_triggers_ += gap.count; }
  void onTriggerHole(const messages::TriggerGap& hole) override { missing_triggers_ += hole.count; }
  const std::vector<messages::Trigger>& triggers() const { return triggers_; }
  std::uint64_t missingTriggers() const { return missing_triggers_; }

  struct Missing {
    std::int64_t first{};
    std::uint64_t count{};
    std::string reason;
  };
  // The delay in force from a sample on.
  struct Delay {
    std::int64_t first{};
    messages::DelayInForce delay;
  };
  const std::vector<Missing>& missing() const { return missing_; }
  const std::vector<Delay>& delays() const { return delays_; }
  std::uint64_t missingSamples() const {
    std::uint64_t all = 0;
    for (const auto& gap : missing_) all += gap.count;
    return all;
  }
  const RecordingSums& sums() const { return sums_; }
  std::uint64_t rows() const { return rows_; }
  std::uint64_t repeated() const { return repeated_; }
  std::uint64_t outOfOrder() const { return out_of_order_; }
  std::uint64_t restarts() const { return restarts_; }
  bool channelsChanged() const { return channels_changed_; }
  bool begun() const { return begun_; }

 private:
  // A link may miss what came before over another one.
  void remember(const messages::Gap& gap, std::string_view reason) {
    const SampleIndex end = gap.first + static_cast<std::int64_t>(gap.count);
    const SampleIndex first = next_ ? std::max(gap.first, *next_) : gap.first;
    if (end <= first) return;
    const auto count = static_cast<std::uint64_t>(end - first);
    missing_.push_back({first.index, count, std::string{reason}});
    without_row_[first] = end;
    if (!writer_.failure()) writer_.missing(first, count, reason);
    next_ = end;
  }
  // Of a sample before next_.
  bool hasRow(SampleIndex sample) const {
    if (!first_ || sample < *first_) return false;
    const auto after = without_row_.upper_bound(sample);
    return after == without_row_.begin() || sample >= std::prev(after)->second;
  }

  RowWriter& writer_;
  Console& console_;
  RecordingSums sums_;
  std::optional<messages::BootId> boot_id_;
  std::vector<std::string> names_;
  std::vector<Missing> missing_;
  std::vector<Delay> delays_;
  std::vector<messages::Trigger> triggers_;
  std::uint32_t next_trigger_{};
  std::uint64_t missing_triggers_{};
  std::optional<SampleIndex> next_;
  std::optional<SampleIndex> first_;                // with a row
  std::map<SampleIndex, SampleIndex> without_row_;  // first to end
  using End = std::tuple<std::optional<SampleIndex>, std::uint32_t, std::optional<SampleIndex>,
                         std::map<SampleIndex, SampleIndex>>;
  std::map<messages::BootId, End> ends_;  // of starts of the box whose samples another one followed
  std::uint64_t rows_{};
  std::uint64_t repeated_{};
  std::uint64_t out_of_order_{};
  std::uint64_t restarts_{};
  bool begun_{};
  bool channels_changed_{};
};

std::string sentence(const Rows::Missing& gap) {
  return "  " + std::to_string(gap.count) + " from sample " + std::to_string(gap.first) + " on: " + gap.reason;
}

void note(const Rows& table, Console& console) {
  const auto& missing = table.missing();
  if (!missing.empty()) {
    console.note(std::to_string(table.missingSamples()) +
                 (table.missingSamples() == 1
                      ? " sample is missing; it has no row:"
                      : " samples are missing, at " + std::to_string(missing.size()) +
                            (missing.size() == 1 ? " place" : " places") + "; they have no row:"));
  }
  for (std::size_t i = 0; i < missing.size() && i < kGapsNoted; ++i) console.note(sentence(missing[i]));
  if (missing.size() > kGapsNoted) console.note("  and so on; --json names them all");
  if (table.repeated() > 0)
    console.note(std::to_string(table.repeated()) + (table.repeated() == 1 ? " sample came" : " samples came") +
                 " more than once; the first has the row");
  if (table.outOfOrder() > 0)
    console.note(std::to_string(table.outOfOrder()) + (table.outOfOrder() == 1 ? " sample came" : " samples came") +
                 " behind later ones and have no row: join recordings in the order of their times");
  if (table.restarts() > 0) console.note("the box was restarted: sample numbers begin anew there");
}

void noteTriggers(const TableJob& job, const Rows& table, bool in_table, Console& console) {
  const auto count = table.triggers().size(), missing = table.missingTriggers();
  const std::string triggers = std::to_string(count) + (count == 1 ? " trigger" : " triggers");
  if (missing > 0)
    console.note(std::to_string(missing) + (missing == 1 ? " trigger is" : " triggers are") + " missing");
  if (!job.triggers.empty()) {
    console.note(triggers + " in " + job.triggers);
  } else if (in_table) {
    console.note(triggers + " in " + job.output);
  } else if (!table.triggers().empty()) {
    console.note(triggers + (count == 1 ? " is" : " are") + " in the recording; --triggers FILE writes them");
  }
}

void notePoints(const TipPoints& points, Console& console) {
  console.note(std::to_string(points.tips()) + " samples have a tip, " + std::to_string(points.surfaces()) +
               " a point of the surface");
  for (const auto& [why, missing] : points.missing()) {
    console.note("  no " + std::string{missing.what} + " of " + std::to_string(missing.samples) + " samples, from " +
                 std::to_string(missing.first) + " on: " + why);
  }
}

Json describe(const TipPoints& points) {
  Json missing = Json::array();
  for (const auto& [why, lacks] : points.missing()) {
    missing.push_back(
        {{"what", lacks.what}, {"first_sample", lacks.first}, {"count_samples", lacks.samples}, {"reason", why}});
  }
  return {{"tips", points.tips()}, {"surface_points", points.surfaces()}, {"missing", missing}};
}

Json describe(const Rows& table) {
  Json delays = Json::array();
  for (const auto& [first, delay] : table.delays()) {
    delays.push_back({{"first_sample", first},
                      {"calibrated", delay.calibrated},
                      {"result_id", delay.result_id},
                      {"tau_s", delay.tau_s},
                      {"tau_sd_s", delay.sd_s}});
  }
  return delays;
}

Json summary(const TableJob& job, const Rows& table, const link::RecordingEnd& end) {
  Json gaps = Json::array();
  for (const auto& gap : table.missing()) {
    gaps.push_back({{"first_sample", gap.first}, {"count_samples", gap.count}, {"reason", gap.reason}});
  }
  Json all{{"recording", job.input},
           {"table", job.output},
           {"rows", table.rows()},
           {"repeated_samples", table.repeated()},
           {"out_of_order_samples", table.outOfOrder()},
           {"missing_samples", table.missingSamples()},
           {"gaps", gaps},
           {"delays", describe(table)},
           {"trigger_table", job.triggers},
           {"triggers", table.triggers().size()},
           {"missing_triggers", table.missingTriggers()},
           {"damaged_frames", end.frames.bad()},
           {"cut_bytes", end.cut_bytes},
           {"end_known", end.closed},
           {"box_restarts", table.restarts()}};
  if (job.points != nullptr) all["points"] = describe(*job.points);
  return all;
}

ExitStatus finish(const TableJob& job, RowWriter& writer, const Rows& table, const link::RecordingEnd& end,
                  Console& console) {
  if (table.begun()) writer.end();
  if (writer.failure()) return console.fail({ExitStatus::usage, "not-written", *writer.failure()});
  if (!table.begun() && !console.interrupted()) {
    return console.fail(
        {ExitStatus::usage, "no-descriptor",
         job.input + " does not describe its channels: its beginning is missing, or it ends too early"});
  }
  if (console.interrupted()) return ExitStatus::interrupted;
  if (!job.triggers.empty()) {
    if (const auto failure = writeTriggers(job.triggers, job.force, table.triggers()))
      return console.fail({ExitStatus::usage, "not-written", *failure});
  }
  note(table, console);
  noteTriggers(job, table, writer.holdsTriggers(), console);
  if (job.points != nullptr) notePoints(*job.points, console);
  if (console.json()) {
    console.object(summary(job, table, end));
  } else {
    console.note(std::to_string(table.rows()) + " rows in " + (job.output == "-" ? "the standard output" : job.output));
  }
  if (job.points != nullptr && job.points->tips() == 0 && table.rows() > 0) {
    const auto& missing = job.points->missing();
    return console.fail({ExitStatus::failed, "no-points",
                         "no sample has a position of the tip: " + (missing.empty() ? "" : missing.begin()->first)});
  }
  if (table.channelsChanged()) {
    return console.fail(
        {ExitStatus::failed, "channels-changed",
         "the box changed its channels after row " + std::to_string(table.rows()) + "; the rest is not in the table"});
  }
  return tellFaults(job.input, "the table holds what could be read of it", table.sums(), end, console);
}

// Said before the table is begun, so that a wrong name overwrites nothing.
std::optional<std::string> objectionTo(const TableJob& job) {
  if (job.input == "-") return std::nullopt;
  if (const auto why = whyNoPlainInput(job.input)) return job.input + " cannot be read: " + *why;
  if (!std::ifstream{job.input}) return job.input + " cannot be read: " + std::strerror(errno);
  if (Output::isSameFile(job.output, job.input)) {
    return job.output + " is the recording itself; name another file for the table";
  }
  return std::nullopt;
}

std::optional<std::string> objectionToTriggers(const TableJob& job) {
  if (job.triggers.empty()) return std::nullopt;
  if (job.triggers == "-" || Output::isSameFile(job.triggers, job.output) ||
      Output::isSameFile(job.triggers, job.input))
    return "--triggers " + job.triggers + ": triggers need a file of their own";
  if (auto objection = objectionToFormat(job.triggers, Format::table)) return objection;
  return Output::objectionTo(job.triggers, job.force);
}

}  // namespace

std::optional<std::string> objectionToFormat(const std::string& path, Format format) {
  const auto suffix = std::filesystem::path{path}.extension().string();
  if (suffix.empty() || suffix == ".csv" || suffix == ".npy") return std::nullopt;
  const bool log_allowed = format == Format::table_or_log;
  if (log_allowed && suffix == ".mcap") return std::nullopt;
  return path + ": tables are written as .csv (text)" +
         (log_allowed ? ", .npy (NumPy) or .mcap (MCAP)" : " or .npy (NumPy)") + ", not as " + suffix +
         "; give a name that ends with one of them";
}

ExitStatus writeTable(const TableJob& job, RowWriter& writer, Console& console) {
  if (job.output == "-") console.keepOutputForData();
  if (const auto objection = objectionTo(job)) {
    return console.fail({ExitStatus::usage, "unreadable-recording", *objection});
  }
  if (const auto objection = Output::objectionTo(job.output, job.force)) return console.fail(usage(*objection));
  if (const auto objection = objectionToTriggers(job)) return console.fail(usage(*objection));
  Rows table{writer, console};
  const auto end = readThrough(job.input, table, console, {.shows_progress = job.input != "-"});
  // The rows up to Ctrl-C are a complete table.
  if (!end && console.interrupted()) return finish(job, writer, table, {}, console);
  if (!end) return console.fail(end.error());
  return finish(job, writer, table, *end, console);
}

}  // namespace probebox::command
