#include "host-tests/emulation/boot.hpp"

#include <algorithm>
#include <utility>

namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;

constexpr board::Access kAll{
    .allow_marker = true, .allow_homing = true, .allow_inhibit = true, .allow_calibrate = true, .allow_accept = true};

// As the boxes of these scenarios have them.
constexpr app::AppliedCorrectionFile::Limits kLimits{{{0.5, 0.05}, {0.5, 0.05}, {0.5, 0.05}}};

}  // namespace

Boot::Boot(Office& office, const std::filesystem::path& file, const procedure::Facts& facts)
    : office_{office},
      core_{states_, commands_},
      calibrations_{store::Store::openAnyhow(file.string()),
                    {.probe_serial_number = "1",
                     .machine = "mill",
                     .mounting = "spindle",
                     .travel = travelOf(facts),
                     .has_y = facts.has_y},
                    facts,
                    [this] { return office_.scenario().now(); },
                    [](std::span<const Event>) { return std::optional<Error>{}; },
                    [this](const Event& event) {
                      tell(event);
                      return true;
                    }},
      connections_{(file.parent_path() / "connections").string(),
                   [this](bool inhibited) {
                     tell(CutInhibit{.active = inhibited, .at = {}});
                     return true;
                   }},
      applied_{(file.parent_path() / "served").string(), kLimits, [this](const Event& bounds) { tell(bounds); }},
      results_{calibrations_, core_, connections_},
      loop_back_{std::nullopt, nullptr},
      unit_{app::UnitRecord{(file.parent_path() / "unit").string()}, "office", {}},
      worker_{[] {}},
      handler_{{"office", "0", {}},
               {1.0, time_, commands_, worker_, calibrations_, results_, loop_back_, unit_, updates_, connections_,
                applied_, counters_, sources_, [] { return std::vector<messages::CncLineStatus>{}; }, travelOf(facts)},
               [](const app::Reply&) {}} {}

std::vector<Event> Boot::restored(const app::LastServedAtStart& served) {
  auto events = applied_.restore(office_.scenario().now(), served);
  for (const auto& event : calibrations_.restore()) events.push_back(event);
  // After what was in force before: that is no change, and a cut does not keep it out.
  if (connections_.anyInhibits()) events.emplace_back(CutInhibit{.active = true, .at = office_.scenario().now()});
  return events;
}

// The handler stamps what it takes with the kernel's time.
void Boot::tell(Event event) {
  std::visit([this](auto& e) { e.at = office_.scenario().now(); }, event);
  office_.scenario().push(event);
}

void Boot::run(Nanoseconds duration) {
  constexpr Nanoseconds kRound = 100ms;
  for (Nanoseconds done{}; done < duration; done += kRound) {
    office_.run(kRound);
    look();
  }
}

void Boot::look(const std::optional<app::LastRead>& read) {
  calibrations_.look(office_.scenario().state());
  applied_.look(office_.scenario().state().snapshot, read);
}

app::Reply Boot::ask(messages::Operation operation, std::span<const std::byte> body) {
  auto reply = handler_.handle({.link = 1, .connection = "tcp:127.0.0.1:7627", .may = kAll},
                               {.ticket = 1, .operation = operation, .body = body}, office_.scenario().state(), {});
  for (Event event; commands_.pop(event);) tell(event);
  return reply.value_or(app::Reply{});
}

std::optional<Error> Boot::take(std::span<const Event> said) {
  auto refusal = handler_.take(said, "modbus:line 1", office_.scenario().state(), kAll);
  for (Event event; commands_.pop(event);) tell(event);
  return refusal;
}

messages::ProcedureStatus::Answer Boot::procedure() {
  const auto reply = ask(messages::Operation::procedure_status);
  return messages::decode<messages::ProcedureStatus::Answer>(reply.body).value();
}

std::uint32_t Boot::start(std::string_view method) {
  const auto reply = ask<messages::StartProcedure>({.method = std::string{method}});
  if (reply.code != messages::ErrorCode::ok) return 0;
  return messages::decode<messages::StartProcedure::Answer>(reply.body)->run;
}

std::optional<store::Id> Boot::finish() {
  auto& scenario = office_.scenario();
  auto& to_solve = scenario.recorder().run_to_solve;
  for (int k = 0; k < 300 && !to_solve; ++k) run(1s);
  if (!solve()) return std::nullopt;
  run(100ms);
  const auto& progress = scenario.state().procedure;
  return progress.state == procedure::State::proposed ? std::optional{progress.result_id} : std::nullopt;
}

std::optional<store::Record> Boot::newestProposed() {
  constexpr std::size_t kNewest = 5;
  const auto results = calibrations_.results(0, kNewest, kNewest);
  if (!results) return std::nullopt;
  const auto found =
      std::ranges::find(results->rbegin(), results->rend(), store::State::proposed, &store::Record::state);
  return found == results->rend() ? std::nullopt : std::optional{*found};
}

bool Boot::solve() {
  auto& scenario = office_.scenario();
  const auto run = std::exchange(scenario.recorder().run_to_solve, std::nullopt);
  if (!run) return false;
  const auto& box = scenario.box();
  calibrations_.solve(*run, box.plan(), box.recording(), box.scales());
  return true;
}

}  // namespace probebox::scenario
