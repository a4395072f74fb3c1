#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "firmware/latch/record.hpp"
#include "protocol/frame/frame.hpp"
#include "tools/probebox/cli/output.hpp"
#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/link/settled_status.hpp"
#include "tools/probebox/text/report.hpp"
#include "tools/probebox/text/report_factory.hpp"
#include "tools/probebox/text/report_front_end.hpp"
#include "tools/probebox/text/report_loop_back.hpp"
#include "tools/probebox/text/report_unit.hpp"
#include "tools/probebox/text/sample_tally.hpp"
#include "tools/report/sheet.hpp"

// Test of a box by its vendor before it is shipped. Every line is measured over the link that was named.
namespace probebox::command {
namespace {

// Duration, size and losses of a stream of samples received for trial.
struct StreamTrial {
  double seconds{};
  std::uint64_t samples{};
  std::uint64_t bytes{};  // of their frames
  std::uint64_t lost_at_source{}, lost_in_queue{}, lost_on_link{};
  bool balances{};  // the box counts the same
  messages::Status::Answer before, after;
  SampleIndex first{};  // of the samples
  std::vector<AxisMotion> axes;
  std::uint64_t index_pulses{};
  messages::BootId boot_id{};
};

// How fast the link brings what the box has kept.
struct BacklogTrial {
  double seconds{};
  std::uint64_t bytes{};
  double bytesPerSecond() const { return seconds > 0 ? static_cast<double>(bytes) / seconds : 0; }
};

struct Received : link::StreamListener {
  void onFrame(const frame::Frame& frame) override {
    if (frame.header.type != static_cast<std::uint8_t>(messages::MessageType::samples)) return;
    bytes += frame.payload.size() + frame::kOverhead;
    last_at = link::now();
  }
  void onBlock(const link::DecodedBlock& block) override {
    if (!first) first = block.header.first;
    tally.block(block.header.first, block.header.count);
    const auto& channels = block.descriptor.channels;
    for (std::size_t c = 0; c < channels.size(); ++c) {
      if (channels[c].name.starts_with("position_")) moved(channels[c], block.column(c));
      if (channels[c].name == "flags")
        index_pulses += static_cast<std::uint64_t>(std::ranges::count_if(
            block.column(c), [](std::int64_t flags) { return (flags & latch::flag::kIndexPulse) != 0; }));
    }
  }
  void onGap(const messages::Gap& gap) override { tally.gap(gap); }
  void onHole(const messages::Gap& hole) override { tally.hole(hole); }
  void onHeartbeat(const messages::Heartbeat& beat, const std::optional<link::Balance>& balance) override {
    tally.heartbeat(beat, balance);
  }

  void moved(const messages::ChannelDescription& channel, std::span<const std::int64_t> values) {
    if (values.empty()) return;
    const auto [least, most] = std::ranges::minmax(values);
    const double least_mm = channel.scale * static_cast<double>(least),
                 most_mm = channel.scale * static_cast<double>(most);
    const auto known = std::ranges::find(axes, channel.name, &AxisMotion::channel);
    if (known == axes.end()) {
      axes.push_back({channel.name, least_mm, most_mm});
    } else {
      known->least_mm = std::min(known->least_mm, least_mm);
      known->most_mm = std::max(known->most_mm, most_mm);
    }
  }

  SampleTally tally;
  std::vector<AxisMotion> axes;
  std::uint64_t index_pulses{};
  std::optional<SampleIndex> first;
  std::uint64_t bytes{};
  MonoTime last_at{};
};

// Receives all samples at the configured rate.
Outcome<StreamTrial, Trouble> tryStream(const link::Uri& uri, double seconds, Console& console) {
  Received received;
  TRY(const auto box, openBox(uri, console, kConnectPatience, &received));
  StreamTrial trial;
  TRY(auto before, ask<messages::Status>(*box, console));
  trial.before = std::move(before);
  trial.boot_id = box->reader().welcome()->boot_id;
  const auto begin = link::now();
  box->start({.profile = messages::Profile::fast, .policy = messages::Policy::record});
  for (const auto all = patienceOf(console, inMilliseconds(seconds)); box->round(all);)
    console.progress(printed("receiving samples, %.0f of %g s: drive all lines and move all axes",
                             toSeconds(link::now() - begin), seconds));
  if (console.interrupted()) return interruption();
  trial.seconds = toSeconds(link::now() - begin);
  const auto closing = box->finish(patienceOf(console, kAnswerPatience));
  if (!closing) return troubleOf(closing.error(), console);
  TRY(auto after, ask<messages::Status>(*box, console));
  trial.after = std::move(after);
  const auto& sums = received.tally.now();
  trial.samples = sums.received;
  trial.bytes = received.bytes;
  trial.lost_at_source = sums.lost_at_source;
  trial.lost_in_queue = sums.lost_in_queue;
  trial.lost_on_link = sums.lost_on_link;
  trial.balances = received.tally.exact();
  trial.first = received.first.value_or(SampleIndex{});
  trial.axes = received.axes;
  trial.index_pulses = received.index_pulses;
  return trial;
}

// Asks for the samples of `stream` once more, uncompressed: they come as fast as the link takes them, for 5 s at most.
Outcome<BacklogTrial, Trouble> tryBacklog(const link::Uri& uri, const StreamTrial& stream, Console& console) {
  constexpr milliseconds kLongest{5000};
  Received received;
  TRY(const auto box, openBox(uri, console, kConnectPatience, &received, {.last_boot_id = stream.boot_id}));
  const auto end = stream.first + static_cast<std::int64_t>(stream.samples);
  const auto begin = link::now();
  box->start({.profile = messages::Profile::raw,
              .policy = messages::Policy::record,
              .has_resume = true,
              .resume_from = stream.first});
  for (const auto all = patienceOf(console, kLongest); received.tally.next() < end && box->round(all);)
    console.progress("measuring the link");
  if (console.interrupted()) return interruption();
  return BacklogTrial{.seconds = toSeconds(received.last_at - begin), .bytes = received.bytes};
}

using report::Sheet;
using report::SheetRow;
using Verdict = SheetRow::Verdict;
using Unit = messages::DescribeUnit::Answer;

// Limits, with where they come from.
constexpr double kMostSigma_ns = 20'000;        // docs/decisions/0006: later samples are lost rather than guessed
constexpr std::uint64_t kOneOf = 100;           // edges, as of the pulses of a loop-back
constexpr double kLinkMargin = 2;               // half of the link stays free for results and for catching up
constexpr std::uint64_t kMostResident_MB = 48;  // docs/service.md

Verdict verdict(bool good) {
  return good ? Verdict::passed : Verdict::failed;
}

std::string number(std::uint64_t value) {
  return std::to_string(value);
}

void addIdentity(const Unit& unit, const messages::Status::Answer& status, Sheet& sheet) {
  const auto who = unit.vendor + " " + unit.model + ", " + unit.serial_number;
  sheet.rows.push_back({"identity", "identity",
                        !unit.provisioned ? "not provisioned"
                        : unit.in_use     ? who + ", board " + unit.board
                                          : who + ", not in use before the next start",
                        "provisioned and in use", verdict(unit.provisioned && unit.in_use)});
  if (unit.sphere.empty()) {
    sheet.rows.push_back({"sphere", "calibrated sphere", "none", "", Verdict::no_limit});
  } else {
    const auto& sphere = unit.sphere.front();
    sheet.rows.push_back(
        {"sphere", "calibrated sphere",
         sphere.serial_number + ", certificate " + sphere.certificate + ", next due " + sphere.next_due,
         "certificate not overdue", verdict(!overdue(unit, today()))});
  }
  sheet.rows.push_back({"firmware", "firmware", status.firmware_version, "as this command: " PROBEBOX_VERSION,
                        verdict(status.firmware_version == PROBEBOX_VERSION)});
}

void addState(const messages::Status::Answer& status, Sheet& sheet) {
  std::string missing;
  for (const auto& source : status.sources)
    if (!source.problem.empty()) missing += (missing.empty() ? "" : "; ") + source.name + ": " + source.problem;
  sheet.rows.push_back({"inputs", "inputs", missing.empty() ? number(status.sources.size()) + " deliver" : missing,
                        "all deliver", verdict(missing.empty())});
  std::string storage;
  for (const auto& problem : status.storage_problems) storage += (storage.empty() ? "" : "; ") + problem;
  sheet.rows.push_back(
      {"storage", "storage", storage.empty() ? "no problem" : storage, "no problem", verdict(storage.empty())});
  const auto& clock = status.clock;
  sheet.rows.push_back({"clock", "master clock",
                        std::string{messages::nameOf(clock.state)} + ", ticks within " + readableNs(clock.sigma_ns) +
                            printed(" (k = 1), %+.2f ppm", 1e-3 * clock.frequency_ppb),
                        "locked, within " + readableNs(kMostSigma_ns),
                        verdict(clock.state == ClockState::locked && clock.sigma_ns <= kMostSigma_ns)});
}

void addChecks(std::vector<MeasuredCheck> checks, Sheet& sheet) {
  for (auto& check : checks) {
    using Of = MeasuredCheck::Verdict;
    if (check.verdict != Of::passed && !check.remedy.empty()) check.measured += "; " + check.remedy;
    sheet.rows.push_back({check.name, check.title, std::move(check.measured), std::move(check.limit),
                          check.verdict == Of::not_told ? Verdict::not_told : verdict(check.verdict == Of::passed)});
  }
}

// What was moved and driven while samples were received.
void addDriven(const StreamTrial& trial, Sheet& sheet) {
  addChecks(lineChecks(trial.before, trial.after), sheet);
  addChecks(encoderChecks(trial.axes, trial.index_pulses), sheet);
  addChecks(controllerChecks(trial.before, trial.after), sheet);
}

// From the status after the samples: what they show of a receiver's inputs.
void addReceiver(const messages::Status::Answer& status, Sheet& sheet) {
  auto checks = receiverChecks(status);
  if (checks.empty()) return;
  addChecks(std::move(checks), sheet);
  std::string faults;
  for (const auto& source : status.sources)
    if (!source.faults.empty()) faults += (faults.empty() ? "" : "; ") + source.faults;
  sheet.rows.push_back({"receiver-faults", "faults that the receiver tells", faults.empty() ? "none" : faults,
                        "none in the last minute", verdict(faults.empty())});
}

// Trouble: something else than that the box has no loop-back.
std::optional<Trouble> addLateness(link::Client& box, Console& console, Sheet& sheet) {
  console.progress("measuring the loop-back");
  const auto late = ask<messages::LoopBack>(box, console);
  SheetRow row{"stamp-lateness", "lateness of edge stamps", "", "fewer than 1 of 100 pulses lost", Verdict::not_told};
  if (late) {
    row.measured = line(*late);
    row.verdict = verdict(command::judge(*late).good);
  } else if (late.error().name != messages::nameOf(messages::ErrorCode::not_found)) {
    return late.error();
  } else {
    row.measured = "no loop-back ([loop_back] of box.toml)";
  }
  sheet.rows.push_back(row);
  return std::nullopt;
}

std::uint64_t lostByKernel(const messages::Status::Answer& status) {
  auto lost = status.clock.edges.lost + status.events.lost + status.events.lost_in_queue;
  for (const auto& each : status.lines) lost += each.lost;
  return lost;
}

std::uint64_t doubtfulEdges(const messages::EdgeCounters& edges) {
  return edges.missing + edges.doubled + edges.spurious;
}

void addRates(const StreamTrial& trial, const messages::Descriptor& descriptor, Sheet& sheet) {
  const auto& before = trial.before.clock.edges;
  const auto& after = trial.after.clock.edges;
  const auto edges = after.accepted - before.accepted;
  const auto doubtful = doubtfulEdges(after) - doubtfulEdges(before);
  const auto lost = lostByKernel(trial.after) - lostByKernel(trial.before);
  const double tick_hz = 1e9 / static_cast<double>(descriptor.nominal_tick_period_ns);
  sheet.rows.push_back({"edges", "edges at rate",
                        printed("%.1f s at %g per second: ", trial.seconds, tick_hz) + number(edges) + " taken, " +
                            number(lost) + " lost in the box, " + number(doubtful) + " missing, doubled or spurious",
                        "none lost in the box, at most 1 of 100 missing, doubled or spurious",
                        verdict(edges > 0 && lost == 0 && kOneOf * doubtful <= edges)});
  const auto lost_samples = trial.lost_at_source + trial.lost_in_queue + trial.lost_on_link;
  sheet.rows.push_back(
      {"samples", "samples at rate",
       printed("%.1f s at %g per second: ", trial.seconds, descriptor.samplesPerSecond()) + number(trial.samples) +
           " received, lost " + number(trial.lost_at_source) + " at the source, " + number(trial.lost_in_queue) +
           " in the box, " + number(trial.lost_on_link) + " on the link",
       "none lost, and both sides count the same", verdict(trial.samples > 0 && lost_samples == 0 && trial.balances)});
  sheet.rows.push_back({"late-ticks", "late ticks", number(trial.after.deadline_misses - trial.before.deadline_misses),
                        "none", verdict(trial.after.deadline_misses == trial.before.deadline_misses)});
}

void addLink(const StreamTrial& stream, const BacklogTrial& link, Sheet& sheet) {
  const double needed = static_cast<double>(stream.bytes) / stream.seconds;
  sheet.rows.push_back({"link", "throughput of the link",
                        printed("%.3g MB/s (%.3g MB in %.3g s); samples take %.3g MB/s", 1e-6 * link.bytesPerSecond(),
                                1e-6 * static_cast<double>(link.bytes), link.seconds, 1e-6 * needed),
                        printed("%g times what samples take", kLinkMargin),
                        verdict(link.bytes > 0 && link.bytesPerSecond() >= kLinkMargin * needed)});
}

void addProcess(const messages::ProcessStatus& process, Sheet& sheet) {
  const bool told = process.resident_bytes > 0;
  sheet.rows.push_back({"memory", "resident memory of probeboxd",
                        told ? printed("%.1f MB", 1e-6 * static_cast<double>(process.resident_bytes)) : "",
                        "at most " + number(kMostResident_MB) + " MB",
                        !told ? Verdict::not_told : verdict(process.resident_bytes <= 1'000'000 * kMostResident_MB)});
  const bool confined =
      !process.is_root && process.capabilities == 0 && process.no_new_privileges && process.calls_filtered;
  sheet.rows.push_back(
      {"sandbox", "sandbox of probeboxd",
       !told ? ""
             : std::string{process.is_root ? "root, " : "no root, "} +
                   printed("capabilities %llx, ", static_cast<unsigned long long>(process.capabilities)) +
                   (process.no_new_privileges ? "no new privileges, " : "may gain privileges, ") +
                   (process.calls_filtered ? "system calls filtered" : "all system calls"),
       "no root, no capability, no new privileges, system calls filtered",
       told ? verdict(confined) : Verdict::not_told});
  sheet.rows.push_back({"exposure", "systemd exposure",
                        "systemd-analyze security probeboxd.service on the box tells it", "", Verdict::not_told});
}

bool isDriven(std::string_view name) {
  return name.starts_with("line-") || name.starts_with("encoder-") || name.starts_with("controller");
}

std::string whyNotUndriven(const std::string& name, const Sheet& sheet) {
  std::string all;
  for (const auto& row : sheet.rows)
    if (isDriven(row.name)) all += (all.empty() ? "" : ", ") + row.name;
  return "--undriven " + name + ": no line that a fixture drives has this name; this box has " + all;
}

Outcome<Sheet, Trouble> measuredSheet(const FactoryTest& options, const link::Uri& uri, Console& console) {
  Sheet sheet{.title = "Factory sheet", .box = {}, .when = nowUtc(), .by = options.by, .where = uri.text, .rows = {}};
  messages::Descriptor descriptor;
  {
    TRY(const auto box, openBox(uri, console));
    if (auto trouble = whyNotAtRest(*box, console)) return *trouble;
    TRY(const auto status, settledStatus(*box, console));
    TRY(const auto unit, ask<messages::DescribeUnit>(*box, console));
    descriptor = box->described();
    sheet.box = descriptor.board + " " + descriptor.serial_number;
    addIdentity(unit, status, sheet);
    addChecks({usbNumbersCheck(unit), updateKeyCheck(unit), timeSourceCheck(status)}, sheet);
    addState(status, sheet);
    if (auto trouble = addLateness(*box, console, sheet)) return *trouble;
  }
  TRY(const auto stream, tryStream(uri, options.seconds, console));
  addReceiver(stream.after, sheet);
  addDriven(stream, sheet);
  addRates(stream, descriptor, sheet);
  TRY(const auto backlog, tryBacklog(uri, stream, console));
  addLink(stream, backlog, sheet);
  addProcess(stream.after.process, sheet);
  for (const auto& name : options.undriven) {
    const auto row = std::ranges::find(sheet.rows, name, &SheetRow::name);
    if (row == sheet.rows.end() || !isDriven(name)) return usage(whyNotUndriven(name, sheet));
    row->verdict = Verdict::not_told;
    row->measured = "not driven by this fixture";
  }
  return sheet;
}

void tell(const Sheet& sheet, const FactoryTest& options, Console& console) {
  if (!console.json()) {
    for (const auto& row : sheet.rows)
      console.line(printed("%-20s %-30s ", report::verdictText(row.verdict).c_str(), row.title.c_str()) + row.measured +
                   (row.verdict == Verdict::failed ? " (limit: " + row.limit + ")" : ""));
    console.line(options.output + ": " + number(sheet.rows.size()) + " lines, " + number(sheet.failed()) + " failed");
    return;
  }
  Json rows = Json::array();
  for (const auto& row : sheet.rows)
    rows.push_back({{"name", row.name},
                    {"measured", row.measured},
                    {"limit", row.limit},
                    {"verdict", row.verdict == Verdict::failed ? "failed" : report::verdictText(row.verdict)}});
  console.object({{"output", options.output}, {"box", sheet.box}, {"failed", sheet.failed()}, {"rows", rows}});
}

}  // namespace

ExitStatus run(const FactoryTest& options, const std::string& given, Console& console) {
  if (options.output == "-") console.keepOutputForData();
  if (const auto objection = Output::objectionTo(options.output, options.force))
    return console.fail({ExitStatus::usage, "output-exists", *objection});
  const auto uri = chooseUri(given);
  if (!uri) return console.fail(uri.error());
  if (uri->isFile()) return console.fail(usage("a recording cannot be tested; name a box"));
  const auto sheet = measuredSheet(options, *uri, console);
  if (!sheet) return console.fail(sheet.error());
  auto output = Output::open(options.output, options.force, console.out());
  if (!output) return console.fail({ExitStatus::usage, "not-written", output.error().what});
  if (!output->write(report::sheetPage(*sheet, PROBEBOX_VERSION)) || !output->finish())
    return console.fail({ExitStatus::usage, "not-written", output->failure()});
  tell(*sheet, options, console);
  return sheet->failed() == 0 ? ExitStatus::ok : ExitStatus::failed;
}

}  // namespace probebox::command
