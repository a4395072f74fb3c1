#include "host-tests/emulation/boot.hpp"

#include <utility>

namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;

constexpr board::Access kAll{
    .allow_marker = true, .allow_homing = true, .allow_inhibit = true, .allow_calibrate = true, .allow_accept = true};

// As the boxes of these scenarios have them.
constexpr app::StandingKeeper::Limits kLimits{{{0.5, 0.05}, {0.5, 0.05}, {0.5, 0.05}}};

store::Store opened(const std::filesystem::path& file) {
  return std::move(store::Store::open(file.string())).value();
}

}  // namespace

Boot::Boot(Office& office, const std::filesystem::path& file)
    : office_{office},
      core_{states_},
      calibrations_{opened(file),
                    {.probe_serial_number = "1", .machine = "mill", .mounting = "spindle"},
                    usualFacts(),
                    [this] { return office_.scenario().now(); },
                    [](std::span<const Event>) { return std::optional<Error>{}; },
                    [this](const Event& event) {
                      tell(event);
                      return true;
                    }},
      doors_{(file.parent_path() / "doors").string(),
             [this](bool inhibited) {
               tell(CutInhibit{.active = inhibited, .at = {}});
               return true;
             }},
      standing_{(file.parent_path() / "served").string(), kLimits, [this](const Event& bounds) { tell(bounds); }},
      results_{calibrations_, core_, doors_},
      loop_back_{std::nullopt, nullptr},
      worker_{[] {}},
      desk_{{"office", "0", {}},
            {1.0, time_, commands_, worker_, calibrations_, results_, loop_back_, doors_, standing_, counters_,
             sources_, [] { return std::vector<messages::CncLineStatus>{}; }},
            [](const app::Reply&) {}} {}

std::vector<Event> Boot::restored() {
  auto events = standing_.restore(office_.scenario().now(), std::nullopt, std::nullopt);
  for (const auto& event : calibrations_.restore()) events.push_back(event);
  return events;
}

// The desk stamps what it takes with the kernel's time.
void Boot::tell(Event event) {
  std::visit([this](auto& e) { e.at = office_.scenario().now(); }, event);
  office_.scenario().push(event);
}

void Boot::run(Nanoseconds duration) {
  constexpr Nanoseconds kRound = 100ms;
  for (Nanoseconds done{}; done < duration; done += kRound) {
    office_.run(kRound);
    calibrations_.look(office_.scenario().state());
    standing_.look(office_.scenario().state().snapshot);
  }
}

app::Reply Boot::ask(messages::Operation operation, std::span<const std::byte> body) {
  auto reply = desk_.handle({.link = 1, .door = "network", .may = kAll},
                            {.ticket = 1, .operation = operation, .body = body}, office_.scenario().state(), {});
  for (Event event; commands_.pop(event);) tell(event);
  return reply.value_or(app::Reply{});
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
  if (!to_solve) return std::nullopt;
  const auto& box = scenario.box();
  calibrations_.solve(*std::exchange(to_solve, std::nullopt), box.plan().method, box.recording(), box.scales());
  run(100ms);
  const auto& progress = scenario.state().procedure;
  return progress.state == procedure::State::proposed ? std::optional{progress.result_id} : std::nullopt;
}

}  // namespace probebox::scenario
