#include <fstream>
#include <limits>
#include <optional>
#include <vector>

#include "firmware/clock/estimator.hpp"
#include "firmware/clock/tick_map.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/plain_input.hpp"
#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/tables/csv_rows.hpp"
#include "tools/probebox/tables/integer_table.hpp"
#include "tools/probebox/text/progress_bar.hpp"

namespace probebox::command {
namespace {

constexpr auto kFlags =
    std::to_array<std::string_view>({"accepted", "clipped", "doubled", "spurious", "unfitting", "unlocked"});

// The columns of EDGES.csv.
struct Edges {
  std::vector<std::int64_t> at_ns;
  std::vector<std::int64_t> sequence;  // empty where there is none
};

std::optional<Error> whyNoEdges(const Edges& edges) {
  if (edges.at_ns.empty()) return Error{"has no row after its first line"};
  const auto at = [](std::size_t row) { return "line " + std::to_string(row + 2) + ": "; };
  for (std::size_t k = 1; k < edges.at_ns.size(); ++k) {
    if (edges.at_ns[k] >= edges.at_ns[k - 1]) continue;
    return Error{at(k) + "edge_ns " + std::to_string(edges.at_ns[k]) + " is before " +
                 std::to_string(edges.at_ns[k - 1]) + " of the line before; sort the table by time"};
  }
  constexpr std::int64_t kMost = std::numeric_limits<std::uint32_t>::max();
  for (std::size_t k = 0; k < edges.sequence.size(); ++k) {
    if (edges.sequence[k] >= 0 && edges.sequence[k] <= kMost) continue;
    return Error{at(k) + "line_seqno " + std::to_string(edges.sequence[k]) + " is not a number from 0 to " +
                 std::to_string(kMost) + ", as the kernel counts edges"};
  }
  return std::nullopt;
}

Outcome<Edges> edgesOf(IntegerTable table, const std::string& input) {
  Edges edges;
  bool found = false;
  for (std::size_t c = 0; c < table.names.size(); ++c) {
    if (table.names[c] == "edge_ns") {
      edges.at_ns = std::move(table.columns[c]);
      found = true;
    } else if (table.names[c] == "line_seqno") {
      edges.sequence = std::move(table.columns[c]);
    } else {
      return Error{input + ": line 1: column " + table.names[c] + " is unknown; there are edge_ns and line_seqno"};
    }
  }
  if (!found) return Error{input + ": line 1: there is no column edge_ns"};
  if (const auto why = whyNoEdges(edges)) return Error{input + ": " + why->what};
  return edges;
}

Outcome<Edges> readEdges(const std::string& input, Console& console) {
  const auto named = [&](Outcome<IntegerTable> table) -> Outcome<Edges> {
    if (!table) return Error{input + ": " + table.error().what};
    return edgesOf(std::move(table).value(), input);
  };
  if (input == "-") return named(readIntegerTable(console.in()));
  TRY(auto file, openPlainInput(input));
  return named(readIntegerTable(file));
}

// One row for each tick, written as soon as the tick is decided and never corrected later.
class TickRows {
 public:
  explicit TickRows(Output& output) : output_{output} { output_.write("tick,time_ns,sigma_ns,state\n"); }

  void look(const clock::ClockEstimator& estimator) {
    const auto state = estimator.state();
    if (state != ClockState::locked && state != ClockState::holdover) return;
    const TickMap map = estimator.map();
    if (epoch_ != estimator.epoch()) next_ = map.tick;
    epoch_ = estimator.epoch();
    for (; next_ <= map.tick; next_ = next_ + 1) {
      line_.clear();
      append(line_, next_.index);
      line_ += ',';
      append(line_, toNs(clock::timeOf(map, next_)));
      line_ += ',';
      append(line_, map.sigma_ns);
      line_ += ',';
      line_ += messages::nameOf(map.state);
      line_ += '\n';
      output_.write(line_);
    }
  }

 private:
  Output& output_;
  std::uint32_t epoch_{};
  Tick next_{};
  std::string line_;
};

// The box's own estimator over the edges, as they would have come.
std::vector<std::optional<clock::Verdict>> judge(const Edges& edges, clock::ClockEstimator& estimator, TickRows* ticks,
                                                 Console& console) {
  std::vector<std::optional<clock::Verdict>> verdicts(edges.at_ns.size());
  const auto take = [&](std::span<const clock::Verdict> decided) {
    for (const auto& verdict : decided) verdicts[verdict.edge] = verdict;
    if (ticks != nullptr) ticks->look(estimator);
  };
  for (std::size_t k = 0; k < edges.at_ns.size() && !console.interrupted(); ++k) {
    Edge edge;
    edge.at = monoTime(edges.at_ns[k]);
    edge.level = Level::active;
    edge.line_sequence =
        static_cast<std::uint32_t>(edges.sequence.empty() ? static_cast<std::int64_t>(k) : edges.sequence[k]);
    take(estimator.push(edge));
    if (k % 65'536 == 0) console.progress(progressBar(k, edges.at_ns.size()));
  }
  if (!edges.at_ns.empty()) {
    const auto& config = estimator.config();
    take(estimator.advance(monoTime(edges.at_ns.back()) + config.delivery_latency + config.nominal_period));
  }
  return verdicts;
}

void writeVerdicts(const std::vector<std::optional<clock::Verdict>>& verdicts, Output& output) {
  output.write("edge,tick,flag\n");
  std::string line;
  for (std::size_t k = 0; k < verdicts.size(); ++k) {
    line.clear();
    append(line, k);
    line += ',';
    if (verdicts[k] && verdicts[k]->tick) append(line, verdicts[k]->tick->index);
    line += ',';
    line += verdicts[k] ? kFlags.at(static_cast<std::size_t>(verdicts[k]->flag)) : "undecided";
    line += '\n';
    output.write(line);
  }
}

Json summary(const Clock& options, const clock::ClockEstimator& estimator) {
  const auto& counters = estimator.counters();
  return {{"edges", options.input},
          {"verdicts", options.output},
          {"count_edges", counters.edges},
          {"accepted", counters.accepted + counters.clipped},
          {"doubled", counters.doubled},
          {"spurious", counters.spurious},
          {"unfitting", counters.unfitting},
          {"unlocked", counters.unlocked},
          {"missing_ticks", counters.missing},
          {"lost_by_kernel", counters.lost_by_kernel},
          {"locks", estimator.epoch()},
          {"offset_ppm", estimator.offsetPpm()},
          {"state", std::string{messages::nameOf(estimator.state())}}};
}

}  // namespace

ExitStatus run(const Clock& options, const std::string&, Console& console) {
  clock::ClockConfig config;
  config.nominal_period = Nanoseconds{options.period_ns};
  if (const auto refused = clock::validate(config)) return console.fail(usage(refused->what));
  for (const auto& path : {options.output, options.ticks}) {
    if (path.empty()) continue;
    if (const auto objection = Output::objectionTo(path, options.force)) return console.fail(usage(*objection));
    if (Output::isSameFile(path, options.input))
      return console.fail(usage(path + " has the edges themselves; name another file for what is written"));
  }
  if (options.ticks == "-" || Output::isSameFile(options.ticks, options.output))
    return console.fail(usage("--ticks " + options.ticks + ": ticks need a file of their own"));
  if (options.output == "-") console.keepOutputForData();
  const auto edges = readEdges(options.input, console);
  if (!edges) return console.fail({ExitStatus::usage, "unreadable-table", edges.error().what});
  auto output = Output::open(options.output, options.force, console.out());
  if (!output) return console.fail({ExitStatus::usage, "not-written", output.error().what});
  std::optional<Output> ticks;
  if (!options.ticks.empty()) {
    auto opened = Output::open(options.ticks, options.force, console.out());
    if (!opened) return console.fail({ExitStatus::usage, "not-written", opened.error().what});
    ticks.emplace(std::move(opened).value());
  }
  std::optional<TickRows> tick_rows;
  if (ticks) tick_rows.emplace(*ticks);
  clock::ClockEstimator estimator{config};
  writeVerdicts(judge(*edges, estimator, tick_rows ? &*tick_rows : nullptr, console), *output);
  if (console.interrupted()) return ExitStatus::interrupted;
  if (!output->finish()) return console.fail({ExitStatus::usage, "not-written", output->failure()});
  if (ticks && !ticks->finish()) return console.fail({ExitStatus::usage, "not-written", ticks->failure()});
  if (console.json()) {
    console.object(summary(options, estimator));
  } else {
    console.note(std::to_string(estimator.counters().accepted + estimator.counters().clipped) + " of " +
                 std::to_string(edges->at_ns.size()) + " edges are ticks");
  }
  return ExitStatus::ok;
}

}  // namespace probebox::command
